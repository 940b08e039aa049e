"""A Mitsuba 3 sampler as a program for `warpcheck check --sampler`. Usage: mitsuba_sampler.py KIND [ARGUMENT]

KIND: envmap FILE | ggx ALPHA | ggx-all ALPHA | beckmann ALPHA | square-to-NAME (a warp, such as cosine_hemisphere)
"""
import struct, sys
import numpy as np
import mitsuba as mi

mi.set_variant("scalar_rgb" if "llvm_ad_rgb" not in mi.variants() or "--scalar" in sys.argv else "llvm_ad_rgb")
import drjit as dr

kind, argument = sys.argv[1], (sys.argv + [""])[2]
domain, frame, density = "hemisphere", "z-up", True
incoming = dr.normalize(mi.Vector3f(0.5, 0.2, 0.7))

if kind == "envmap":
    domain, frame = "sphere", "y-up"
    emitter = mi.load_dict({"type": "envmap", "filename": argument})
    scene = mi.load_dict({"type": "scene", "emitter": emitter, "shape": {"type": "sphere"}})
    emitter = scene.environment()

    def sample(xi):
        at = dr.zeros(mi.SurfaceInteraction3f, dr.width(xi))
        direction, _ = emitter.sample_direction(at, xi)
        return direction.d, direction.pdf

    def pdf(w):
        at, direction = dr.zeros(mi.SurfaceInteraction3f, dr.width(w)), dr.zeros(mi.DirectionSample3f, dr.width(w))
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
print(f"warpcheck 1 domain={domain} frame={frame} dimensions=2", flush=True)
below_one = np.nextafter(np.float32(1), np.float32(0))
while line := sys.stdin.buffer.readline():
    word, count = line.split()
    width = 2 if word == b"sample" else numbers
    rows = np.frombuffer(sys.stdin.buffer.read(8 * width * int(count)), "<f8").reshape(-1, width)
    if word == b"sample":
        # Mitsuba takes f32 variates in [0, 1): rounding must not reach 1.
        points, densities = sample(mi.Point2f(np.minimum(rows.astype(np.float32), below_one).T))
        points = np.array(points).T.reshape(-1, numbers)
        answer = np.column_stack([points, np.broadcast_to(np.array(densities), len(points))])
    else:
        answer = np.broadcast_to(np.array(pdf(point_type(rows.astype(np.float32).T))), len(rows))
    sys.stdout.buffer.write(np.ascontiguousarray(answer, dtype="<f8").tobytes())
    sys.stdout.buffer.flush()
