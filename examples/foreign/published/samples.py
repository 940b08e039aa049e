"""Samples of NumPy's and SciPy's samplers, written for `warpcheck check`. Usage: samples.py FOLDER [COUNT]"""
import pathlib, sys
import numpy as np
import scipy.stats as st

folder = pathlib.Path(sys.argv[1])
count = int(sys.argv[2]) if len(sys.argv) > 2 else 1_000_000
rng = np.random.default_rng(7)
axis = np.array([0.36, 0.48, 0.8])


def save(name, points, pdf):
    np.save(folder / f"{name}.npy", np.column_stack([points, pdf]))


# Directions: normalised normals; SciPy's von Mises-Fisher and uniform directions.
normals = rng.standard_normal((count, 3))
save("numpy-sphere", normals / np.linalg.norm(normals, axis=1, keepdims=True), np.full(count, 0.25 / np.pi))
for kappa in (1, 30):
    lobe = st.vonmises_fisher(axis, kappa)
    points = lobe.rvs(count, random_state=rng)
    save(f"scipy-vmf-{kappa}", points, lobe.pdf(points))
uniform = st.uniform_direction(3)
save("scipy-uniform-direction", uniform.rvs(count, random_state=rng), np.full(count, 0.25 / np.pi))
# Barycentric coordinates.
for name, alpha in (("scipy-dirichlet-flat", (1, 1, 1)), ("scipy-dirichlet", (1.5, 2, 3))):
    law = st.dirichlet(alpha)
    points = law.rvs(count, random_state=rng)
    # SciPy's density is per area of (b0, b1); warpcheck's triangle has the area 1/2, which is that.
    save(name, points, law.pdf(points.T))
# Numbers.
for name, law in (("scipy-beta", st.beta(2.5, 1.5)), ("scipy-truncnorm", st.truncnorm(-1, 2, loc=0.4, scale=0.2))):
    points = law.rvs(count, random_state=rng)
    save(name, points, law.pdf(points))
# Indices.
weights = np.array([5, 0.5, 3, 1e-3, 2, 7])
weights /= weights.sum()
chosen = rng.choice(len(weights), size=count, p=weights)
save("numpy-choice", chosen, weights[chosen])
# The same sphere with the pdf of a hemisphere: how a failure looks.
save("broken-sphere", normals / np.linalg.norm(normals, axis=1, keepdims=True), np.full(count, 0.5 / np.pi))
