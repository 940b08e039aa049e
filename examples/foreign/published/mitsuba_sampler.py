"""A Mitsuba 3 sampler as a program for `warpcheck check --sampler`. Usage: mitsuba_sampler.py KIND [ARGUMENT]

KIND: envmap FILE | ggx ALPHA | ggx-all ALPHA | beckmann ALPHA | square-to-NAME (a warp, such as cosine_hemisphere)
With --scalar at the end points go one by one through the scalar variant, which needs no LLVM.
"""
import struct, sys
import numpy as np
import mitsuba as mi

scalar = "llvm_ad_rgb" not in mi.variants() or "--scalar" in sys.argv
mi.set_variant("scalar_rgb" if scalar else "llvm_ad_rgb")
import drjit as dr

kind, argument = (*[a for a in sys.argv[1:] if a != "--scalar"], "", "")[:2]
domain, frame, density = "hemisphere", "z-up", True
incoming = dr.normalize(mi.Vector3f(0.5, 0.2, 0.7))

if kind == "envmap":
    domain, frame = "sphere", "y-up"
    emitter = mi.load_dict({"type": "envmap", "filename": argument})
    scene = mi.load_dict({"type": "scene", "emitter": emitter, "shape": {"type": "sphere"}})
    emitter = scene.environment()

    def zeros(kind, like):
        return kind() if scalar else dr.zeros(kind, dr.width(like))

    def sample(xi):
        direction, _ = emitter.sample_direction(zeros(mi.SurfaceInteraction3f, xi), xi)
        return direction.d, direction.pdf

    def pdf(w):
        at, direction = zeros(mi.SurfaceInteraction3f, w), zeros(mi.DirectionSample3f, w)
        direction.d = w
        return emitter.pdf_direction(at, direction)
elif kind in ("ggx", "ggx-all", "beckmann"):
    lobe = mi.MicrofacetDistribution(
        mi.MicrofacetType.Beckmann if kind == "beckmann" else mi.MicrofacetType.GGX, float(argument), kind != "ggx-all"
    )

    def sample(xi):
        return lobe.sample(incoming, xi)

    def pdf(m):
        return lobe.pdf(incoming, m)
else:
    name = kind.removeprefix("square-to-")
    to, of = getattr(mi.warp, f"square_to_{name}"), getattr(mi.warp, f"square_to_{name}_pdf")
    extra = [float(argument)] if argument else []
    domain = "sphere" if "sphere" in name.split("_") or "von" in name else "disk" if "disk" in name else "hemisphere"

    def sample(xi):
        p = to(xi, *extra)
        return p, of(p, *extra)

    def pdf(p):
        return of(p, *extra)


numbers = 2 if domain == "disk" else 3
point_type = mi.Point2f if domain == "disk" else mi.Vector3f


def sample_all(xi):
    if scalar:
        answers = [sample(mi.Point2f(float(a), float(b))) for a, b in xi]
        return np.array([[*map(float, point), float(density)] for point, density in answers])
    points, densities = sample(mi.Point2f(xi.T))
    points = np.array(points).T.reshape(-1, numbers)
    return np.column_stack([points, np.broadcast_to(np.array(densities), len(points))])


def pdf_all(points):
    if scalar:
        return np.array([float(pdf(point_type(*map(float, p)))) for p in points])
    return np.broadcast_to(np.array(pdf(point_type(points.T))), len(points))


print(f"warpcheck 1 domain={domain} frame={frame} dimensions=2", flush=True)
below_one = np.nextafter(np.float32(1), np.float32(0))
while line := sys.stdin.buffer.readline():
    word, count = line.split()
    width = 2 if word == b"sample" else numbers
    rows = np.frombuffer(sys.stdin.buffer.read(8 * width * int(count)), "<f8").reshape(-1, width)
    if word == b"sample":
        # Mitsuba takes f32 variates in [0, 1): rounding must not reach 1.
        answer = sample_all(np.minimum(rows.astype(np.float32), below_one))
    else:
        answer = pdf_all(rows.astype(np.float32))
    sys.stdout.buffer.write(np.ascontiguousarray(answer, dtype="<f8").tobytes())
    sys.stdout.buffer.flush()
