/* A lobe of cos^20 about +Z in C, for `warpcheck check --sampler ./sampler`. Build: cc -O2 sampler.c -lm -o sampler
 * --broken leaves the factor (n + 1) out of the density. The protocol is in docs/protocol.md. */
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double PI = 3.14159265358979323846, N = 20;
static int broken = 0;

static void sample(const double *xi, double *w) {
    double z = pow(1 - xi[0], 1 / (N + 1)), r = sqrt(fmax(0, 1 - z * z)), phi = 2 * PI * xi[1];
    w[0] = r * cos(phi), w[1] = r * sin(phi), w[2] = z;
}

static double pdf(const double *w) { /* per solid angle */
    return (broken ? 1 : N + 1) / (2 * PI) * pow(fmax(0, w[2]), N);
}

int main(int argc, char **argv) {
    static double in[1024 * 3], out[1024 * 4]; /* a question has 1024 rows at most */
    char word[16];
    size_t count;
    broken = argc > 1 && strcmp(argv[1], "--broken") == 0;
    puts("warpcheck 1 domain=hemisphere dimensions=2");
    fflush(stdout);
    while (scanf("%15s %zu", word, &count) == 2 && getchar() == '\n' && count <= 1024) {
        int ask = word[0] == 'd'; /* "density" has points in its rows, "sample" has variates */
        size_t width = ask ? 3 : 2, each = ask ? 1 : 4;
        if (fread(in, 8 * width, count, stdin) != count) return 1;
        for (size_t i = 0; i < count; i++) {
            if (ask) {
                out[i] = pdf(in + 3 * i);
            } else {
                sample(in + 2 * i, out + 4 * i);
                out[4 * i + 3] = pdf(out + 4 * i);
            }
        }
        fwrite(out, 8 * each, count, stdout);
        fflush(stdout);
    }
    return 0;
}
