#!/usr/bin/env python3
"""Tables of many digits that tests/it/statistics.rs compares with: data/oracle/*.csv.

    pip install mpmath gmpy2 python-flint numpy scipy && python scripts/oracle_statistics.py

Wherever it can be, the way is another than the crate's: plain sums of positive terms at 400 digits, the other tail as
their complement, exact matrix powers in ball arithmetic, and for Anderson-Darling at finite n a simulation. Arguments
are read as the f64 that the decimal number stands for. A tail below the smallest f64 is given by its logarithm.
"""
import random
from pathlib import Path

import flint
import mpmath as mp
import numpy as np
from mpmath import mpf

OUT = Path(__file__).resolve().parent.parent / "data" / "oracle"
mp.mp.dps = 400
random.seed(20261123)


def write(name, header, rows):
    OUT.mkdir(parents=True, exist_ok=True)
    text = [",".join(v if isinstance(v, str) else repr(v) for v in row) for row in rows]
    (OUT / f"{name}.csv").write_text(header + "\n" + "\n".join(text) + "\n")
    print(name, len(rows), flush=True)


def digits(x):
    return mp.nstr(x, 20, min_fixed=0, max_fixed=0)


def gamma_lower(a, x):
    """P(a, x) by its power series."""
    a, x = mpf(a), mpf(x)
    term = total = mp.exp(a * mp.log(x) - x - mp.loggamma(a + 1))
    n = a
    while True:
        n += 1
        term *= x / n
        total += term
        if n > x and term < total * mpf(10) ** -395:
            return total


def log_uniform(low, high):
    return float(f"{10 ** random.uniform(np.log10(low), np.log10(high)):.4g}")


def chi_square():
    rows = []
    for df in [0.1, 0.5, 1, 2, 3, 7.5, 10, 31, 100, 1000, 12345, 1e5, 250001, 1e6]:
        for z in [-30, -8, -4, -2, -1, -0.3, 0, 0.01, 0.3, 1, 2, 4, 8, 16, 36]:
            h = 2 / (9 * df)
            root = 1 - h + z * h**0.5
            x = float(f"{df * root**3:.15g}") if root > 0.02 else df * 10.0 ** (z / 2)
            x = float(f"{x:.15g}")
            p = gamma_lower(mpf(df) / 2, mpf(x) / 2)
            rows.append((float(df), x, digits(1 - p), digits(p)))
    write("chi_square", "df,x,sf,cdf", rows)


def poisson():
    rows = []
    for mean in [1e-9, 0.3, 1, 4.5, 30, 1000, 123456.7, 1e6, 1e8]:
        for z in [-30, -6, -2, -0.5, 0, 0.5, 2, 6, 30]:
            k = int(max(1, round(mean + z * mean**0.5 + (z > 0) * z * z / 6)))
            if mean >= 1e8 and abs(z) > 6:
                continue
            with mp.workdps(340 if abs(z) > 6 else 60):
                below = gamma_lower_fast(k, mpf(mean))
                rows.append((k, mean, digits(below), digits(1 - below)))
    write("poisson", "k,mean,upper,below", rows)


def gamma_lower_fast(a, x):
    """As gamma_lower, to the working precision."""
    a, x = mpf(a), mpf(x)
    with mp.workdps(mp.mp.dps + 15):
        term = total = mp.exp(a * mp.log(x) - x - mp.loggamma(a + 1))
    n, eps = a, mpf(10) ** -(mp.mp.dps + 2)
    while True:
        n += 1
        term *= x / n
        total += term
        if n > x and term < total * eps:
            return total


def noncentral():
    rows = []
    mp.mp.dps = 50
    for df in [0.5, 1, 3, 20, 99, 1000, 30000, 1e6]:
        for lam in [0.01, 1, 12.5, 300, 2e4, 1e6]:
            for z in [-4, -1, 0, 1, 4]:
                x = float(f"{max(df + lam + z * (2 * (df + 2 * lam)) ** 0.5, 0.1 * df):.10g}")
                half, y, a = mpf(lam) / 2, mpf(x) / 2, mpf(df) / 2
                j = int(max(0, half - 14 * mp.sqrt(half) - 30))
                end = int(half + 14 * mp.sqrt(half) + 60)
                weight = mp.exp(j * mp.log(half) - half - mp.loggamma(j + 1))
                cdf = mpf(0)
                # From the top down, so that only positive terms are added.
                j, a_top = end, a + end
                weight = mp.exp(j * mp.log(half) - half - mp.loggamma(j + 1))
                p = gamma_lower_fast(a_top, y)
                kernel = mp.exp(a_top * mp.log(y) - y - mp.loggamma(a_top + 1))
                low = int(max(0, half - 14 * mp.sqrt(half) - 30))
                while True:
                    cdf += weight * p
                    if j == low:
                        break
                    kernel *= (a + j) / y
                    p += kernel
                    weight *= j / half
                    j -= 1
                rows.append((float(df), float(lam), x, digits(1 - cdf), digits(cdf)))
    write("noncentral_chi_square", "df,lambda,x,sf,cdf", rows)
    # lambda for a given power at df = 1 has a closed form to check the search with: two normal tails.
    mp.mp.dps = 400


def binomial():
    rows = []
    cases = [(n, p) for n in [1, 10, 64, 1000, 10**5, 10**6, 10**7] for p in [1e-9, 1e-3, 0.1, 0.5, 0.7, 0.999]]
    cases += [(10**8, 1e-8), (10**8, 0.5), (10**9, 1e-5), (10**9, 0.25), (10**10, 1e-10), (10**10, 1e-4), (10**10, 0.5)]
    mp.mp.dps = 40
    for n, p in cases:
        sd = (n * p * (1 - p)) ** 0.5
        chosen = set()
        for z in [-35, -10, -3, -0.5, 0, 0.5, 3, 10, 35] if sd < 2000 else [-10, -0.3, 0, 0.3, 3, 30]:
            k = int(min(n, max(0, round(n * p + z * sd + (0 if z < 0 else z * 0.3)))))
            if k in chosen:
                continue
            chosen.add(k)
            P = mpf(p)
            Q = 1 - P
            first = mp.exp(mp.loggamma(n + 1) - mp.loggamma(k + 1) - mp.loggamma(n - k + 1) + (k * mp.log(P) + (n - k) * mp.log(Q)))

            def run(j, term, up):
                total, ratio = mpf(0), P / Q if up else Q / P
                while term > total * mpf(10) ** -24 and 0 <= j <= n:
                    total += term
                    if up:
                        term = term * (n - j) / (j + 1) * ratio
                        j += 1
                    else:
                        term = term * j / (n - j + 1) * ratio
                        j -= 1
                return total

            with mp.workdps(60):
                first = mp.exp(mp.loggamma(n + 1) - mp.loggamma(k + 1) - mp.loggamma(n - k + 1) + (k * mp.log(P) + (n - k) * mp.log(1 - P)))
            if k >= n * p:
                upper = run(k, first, True)
                lower = 1 - upper + first
            else:
                lower = run(k, first, False)
                upper = 1 - lower + first
            rows.append((k, n, p, digits(upper), digits(lower)))
    write("binomial", "k,n,p,upper,lower", rows)
    mp.mp.dps = 400


def student_t():
    rows = []
    for df in [0.5, 1, 2, 3, 10, 30.5, 100, 1e4, 123456.5, 1e6, 1e8, 1e10, 1e13]:
        for t in [0.001, 0.3, 0.9, 1.2, 1.7, 2.5, 5, 10, 30]:
            a, T = mpf(df) / 2, mpf(t)
            y = T * T / (mpf(df) + T * T)
            # I_y(1/2, a) = y^(1/2) (1-y)^a / (B/2) * sum (a + 1/2)_n / (3/2)_n y^n
            term = total = 2 * mp.sqrt(y) * (1 - y) ** a * mp.exp(mp.loggamma(a + 0.5) - mp.loggamma(a) - mp.loggamma(mpf(0.5)))
            n = 0
            with mp.workdps(60 if df < 3 else 400):
                if df < 3:
                    sf = mp.betainc(a, 0.5, 0, 1 - y, regularized=True) / 2
                else:
                    while term > mpf(10) ** -390:
                        term *= (a + 0.5 + n) / (mpf(1.5) + n) * y
                        total += term
                        n += 1
                    sf = (1 - total) / 2
            rows.append((float(t), float(df), digits(sf)))
    write("student_t", "t,df,sf", rows)


def normal():
    rows = []
    for z in [-37, -10, -3, -1, -0.1, 0, 1e-8, 0.01, 0.5, 1, 1.5, 1.73, 1.7325, 2, 3, 5, 8, 13, 21, 30, 37, 100, 1e4, 1e8]:
        with mp.workdps(400):
            sf = mp.erfc(mpf(z) / mp.sqrt(2)) / 2
            rows.append((float(z), digits(sf) if sf > mpf(10) ** -307 else "0", digits(mp.log(sf))))
    write("normal", "z,sf,ln_sf", rows)


def durbin(n, d, bits):
    """P(D < d) as a ball: the matrix power of Marsaglia, Tsang and Wang at `bits` bits."""
    flint.ctx.prec = bits
    t = flint.arb(d) * n
    k = int(n * mpf(d)) + 1
    m = 2 * k - 1
    h = flint.arb(k) - t
    H = [[flint.arb(1 if i - j + 1 >= 0 else 0) for j in range(m)] for i in range(m)]
    for i in range(m):
        H[i][0] -= h ** (i + 1)
        H[m - 1][i] -= h ** (m - i)
    if 2 * h > 1:
        H[m - 1][0] += (2 * h - 1) ** m
    fac = [flint.arb(1)]
    for i in range(1, m + 1):
        fac.append(fac[-1] * i)
    for i in range(m):
        for j in range(min(m, i + 2)):
            H[i][j] /= fac[i - j + 1]
    power, result, e = flint.arb_mat(H), None, n
    while e:
        if e & 1:
            result = power if result is None else result * power
        e >>= 1
        if e:
            power = power * power
    return result[k - 1, k - 1] * flint.arb(n + 1).gamma() / flint.arb(n) ** n


def kolmogorov():
    rows = []
    for n in [1, 2, 3, 5, 10, 37, 100, 140, 500, 1000, 1001, 2000, 5000]:
        for z in [0.3, 0.5, 0.8, 1.2, 1.6, 1.95, 2.05, 3, 6, 12]:
            d = float(f"{z / n**0.5:.12g}")
            if d >= 1 or n * d <= 0.5 or n * d > 140:
                continue
            bits, sf = 400, None
            while sf is None or sf.rel_accuracy_bits() < 60:
                sf = 1 - durbin(n, d, bits)
                bits *= 2
            rows.append((d, n, sf.str(20, radius=False).replace(" ", "")))
    write("kolmogorov", "d,n,sf", rows)


def anderson_darling():
    """Limiting distribution: Anderson and Darling 1952, eq. 4.35, as in Marsaglia and Marsaglia 2004."""
    rows = []
    for z in [0.03, 0.1, 0.2, 0.5, 0.8, 1, 1.5, 2.5, 4, 6, 10, 20, 50, 100, 300]:
        mp.mp.dps = int(40 + z)
        Z, total, j = mpf(z), mpf(0), 0
        while True:
            c = (4 * j + 1) ** 2 * mp.pi**2 / (8 * Z)
            width = 1 / mp.sqrt(c)
            integral = mp.quad(lambda w: mp.exp(Z / (8 * (w * w + 1)) - c * w * w), mp.linspace(0, width * mp.sqrt(3 * mp.mp.dps), 13))
            term = (-1) ** j * mp.gamma(j + 0.5) * (4 * j + 1) / (mp.factorial(j) * mp.gamma(0.5)) * mp.exp(-c) * integral
            total += term
            j += 1
            if abs(term) < mpf(10) ** -(mp.mp.dps - 5):
                break
        rows.append((float(z), digits(1 - mp.sqrt(2 * mp.pi) / Z * total)))
    mp.mp.dps = 400
    write("anderson_darling_limit", "z,sf", rows)

    rows = []
    rng = np.random.Generator(np.random.PCG64(20261123))
    for n, total in [(2, 4_000_000), (4, 10_000_000), (8, 8_000_000), (16, 4_000_000), (64, 1_000_000)]:
        zs = np.array([0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.5, 6.5])
        hits = np.zeros(len(zs), dtype=np.int64)
        block = 200_000
        for _ in range(total // block):
            u = np.sort(rng.random((block, n)), axis=1)
            i = np.arange(1, n + 1)
            a2 = -n - ((2 * i - 1) / n * (np.log(u) + np.log1p(-u[:, ::-1]))).sum(axis=1)
            hits += (a2[:, None] >= zs).sum(axis=0)
        rows += [(float(z), n, int(h), total) for z, h in zip(zs, hits)]
    write("anderson_darling_simulated", "z,n,hits,trials", rows)


def ln_rising():
    """ln[Gamma(a + n) / (Gamma(a) a^n)], by log-gamma at many digits and, where n is small, by the sum as a check."""
    rows = []
    with mp.workdps(80):
        for a in [1e-300, 1e-12, 1e-3, 0.3, 0.999, 1, 1.7, 15.99, 16, 250.5, 1e4, 1234567.8, 1e9, 1e12]:
            for n in [0, 1, 2, 3, 17, 1000, 10**6, 10**9, 10**12]:
                A = mpf(a)
                R = mp.loggamma(A + n) - mp.loggamma(A) - n * mp.log(A)
                if n <= 1000:
                    assert abs(R - sum(mp.log1p(j / A) for j in range(n))) < mpf(10) ** -50
                rows.append((float(a), n, digits(R) if n > 1 else "0"))
    write("ln_rising", "a,n,value", rows)


def e_process():
    """ln e by the log-gamma functions themselves, and the largest likelihood within the errors by a search in lambda.

    Columns: case, total of the cells, ln e, conservative ln e; the cases are spelled out in tests/it/statistics.rs too.
    """
    rows = []
    with mp.workdps(80):
        for case in range(12):
            m = [2, 3, 5, 40][case % 4]
            weights = [(1 + (7 * i + 3 * case) % 11) for i in range(m)]
            p = [float(w) / float(sum(weights)) for w in weights]
            size = 10 ** (2 + 3 * (case // 4))
            counts = [int(size * q * (1 + 0.01 * ((5 * i + case) % 7 - 3))) for i, q in enumerate(p)]
            error = [1e-6, 1e-3, 3e-2][case % 3]
            errors = [error * q for q in p]
            total = sum(map(mpf, p))
            q = [mpf(x) / total for x in p]
            N = sum(counts)
            terms = []
            for j in range(1, 13):
                k = mpf(10) ** j
                t = mp.loggamma(k) - mp.loggamma(k + N)
                t += sum(mp.loggamma(k * x + n) - mp.loggamma(k * x) for x, n in zip(q, counts))
                terms.append(t)
            top = max(terms)
            numerator = top + mp.log(sum(mp.exp(t - top) for t in terms) / 12)
            ln_e = numerator - sum(n * mp.log(x) for x, n in zip(q, counts))
            low = [max(mpf(0), mpf(a) - mpf(b)) for a, b in zip(p, errors)]
            high = [mpf(a) + mpf(b) for a, b in zip(p, errors)]
            best = lambda lam: [min(max(n / lam, l), h) for n, l, h in zip(counts, low, high)]
            below, above = mpf(1), mpf(10) ** 30
            for _ in range(400):
                middle = mp.sqrt(below * above)
                if sum(best(middle)) > 1:
                    below = middle
                else:
                    above = middle
            inside = best(above)
            assert abs(sum(inside) - 1) < mpf(10) ** -40
            conservative = numerator - sum(n * mp.log(x) for x, n in zip(inside, counts))
            rows.append((case, N, digits(ln_e), digits(conservative)))
    write("e_process", "case,total,ln_e,ln_e_conservative", rows)


def grouped():
    """Kolmogorov's and Anderson and Darling's distance of grouped data: a closed form, and quadrature where an error is off."""
    rows = []
    rng = random.Random(20261124)
    with mp.workdps(60):
        for case in range(24):
            m = [2, 3, 5, 12][case % 4]
            spread = [0, 3, 12][case % 3]
            weights = [10 ** (-spread * rng.random()) for _ in range(m)]
            if m == 12:
                weights[5] = 0.0
            total = sum(weights)
            masses = [w / total for w in weights]
            n = 10 ** (2 + case % 5)
            counts = [int(n * f * (1 + rng.uniform(-0.1, 0.1))) + (rng.random() < 0.3) for f in masses]
            error = [0.0, 1e-9, 1e-4, 1e-2][(case // 4) % 4]
            n, whole, at, seen = sum(counts), sum(map(mpf, masses)), mpf(0), 0
            borders = [(mpf(0), mpf(0))]
            for c, f in zip(counts, masses):
                at += mpf(f) / whole
                seen += c
                borders.append((at, mpf(seen) / n - at))
            borders[-1] = (mpf(1), mpf(0))
            a2, least, e = mpf(0), mpf(0), mpf(error)
            if error > 0:
                e += abs(whole - 1)
            for (f0, h0), (f1, h1) in zip(borders, borders[1:]):
                if f1 == f0:
                    continue
                b = (h1 - h0) / (f1 - f0)
                a = h0 - b * f0
                part = -b * b * (f1 - f0)
                if f0 > 0:
                    part += a * a * mp.log(f1 / f0)
                if f1 < 1:
                    part += (a + b) ** 2 * mp.log((1 - f0) / (1 - f1))
                a2 += part
                if error == 0:
                    least += part
                elif f1 - f0 > 2 * e:
                    cuts = [f0, f1] + ([x for x in ((e - a) / b, (-e - a) / b) if f0 < x < f1] if b else [])
                    cuts += [f0 + (f1 - f0) * mpf(10) ** -j for j in range(1, 13)]
                    cuts += [f1 - (f1 - f0) * mpf(10) ** -j for j in range(1, 13)]
                    g = lambda F: max(abs(a + b * F) - e, 0) ** 2 / ((F + e) * (1 - F + e))
                    with mp.workdps(30):
                        least += mp.quad(g, sorted(cuts)) * (1 - 2 * e / (f1 - f0))
            d = max(abs(h) for _, h in borders)
            rows.append((digits(d), digits(n * a2), digits(n * least), error, *counts, *masses))
    write("grouped", "kolmogorov,anderson_darling,anderson_darling_conservative,error,counts and masses", rows)


def two_sample():
    """Homogeneity of two count vectors: SciPy's Pearson statistic and p; G and Williams' factor at many digits."""
    from scipy.stats import chi2_contingency

    rows = []
    rng = random.Random(20261125)
    for case in range(16):
        m = [2, 3, 7, 20][case % 4]
        sizes = [10 ** (1 + case % 4), 10 ** (1 + case // 4)]
        counts = [[int(size * rng.uniform(0.5, 1.5)) + 1 for _ in range(m)] for size in sizes]
        if m > 2:
            counts[case % 2][1] = 0
        x = chi2_contingency(counts, correction=False)
        g = chi2_contingency(counts, correction=False, lambda_="log-likelihood")
        total = sum(map(sum, counts))
        rows_part = sum(mpf(total) / sum(r) for r in counts) - 1
        columns_part = sum(mpf(total) / (a + b) for a, b in zip(*counts)) - 1
        factor = 1 + rows_part * columns_part / (6 * mpf(total) * (m - 1))
        exact = 2 * sum(o * mp.log(mpf(o) * total / (sum(r) * (a + b))) for r in counts for o, a, b in zip(r, *counts) if o)
        assert abs(exact - g.statistic) < 1e-8 * (1 + exact)
        rows.append((float(x.statistic), float(x.pvalue), digits(exact), digits(factor), *counts[0], *counts[1]))
    write("two_sample_counts", "pearson,p,g,williams,first and second", rows)


if __name__ == "__main__":
    import sys

    for table in [normal, chi_square, student_t, poisson, noncentral, binomial, anderson_darling, kolmogorov, ln_rising, e_process, grouped, two_sample]:
        if len(sys.argv) < 2 or table.__name__ in sys.argv[1:]:
            table()
