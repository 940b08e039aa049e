#!/usr/bin/env python3
"""Writes the meshes of three_spheres, furnace and lamps_and_sky, and the furnace's sky, into data/scene. Nothing but Python is needed."""

from math import cos, pi, sin
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "data" / "scene"


class Mesh:
    def __init__(self, name):
        self.name, self.lines, self.count = name, [f"# written by scripts/scenes.py", f"mtllib {name}.mtl"], 0

    def part(self, name, material):
        self.lines += [f"o {name}", f"usemtl {material}"]

    def vertices(self, points):
        self.lines += ["v " + " ".join(f"{x:.6g}" for x in p) for p in points]
        first, self.count = self.count + 1, self.count + len(points)
        return first

    def quad(self, name, material, corners):
        """Counter-clockwise seen from the front."""
        self.part(name, material)
        first = self.vertices(corners)
        self.lines.append(f"f {first} {first + 1} {first + 2} {first + 3}")

    def sphere(self, name, material, centre, radius, rings=12):
        """Poles up and down, 2 * rings meridians."""
        self.part(name, material)
        around = 2 * rings
        at = lambda i, j: (
            centre[0] + radius * sin(pi * i / rings) * cos(2 * pi * j / around),
            centre[1] + radius * cos(pi * i / rings),
            centre[2] + radius * sin(pi * i / rings) * sin(2 * pi * j / around),
        )
        top = self.vertices([at(0, 0)])
        rows = [self.vertices([at(i, j) for j in range(around)]) for i in range(1, rings)]
        bottom = self.vertices([at(rings, 0)])
        for j in range(around):
            k = (j + 1) % around
            self.lines.append(f"f {top} {rows[0] + k} {rows[0] + j}")
            for a, b in zip(rows, rows[1:]):
                self.lines.append(f"f {a + j} {a + k} {b + k} {b + j}")
            self.lines.append(f"f {rows[-1] + j} {rows[-1] + k} {bottom}")

    def write(self, materials):
        (FOLDER / f"{self.name}.obj").write_text("\n".join(self.lines) + "\n")
        body = [f"newmtl {name}\n" + "\n".join(values) + "\n" for name, values in materials.items()]
        (FOLDER / f"{self.name}.mtl").write_text("# written by scripts/scenes.py\n" + "\n".join(body))


def level(y, half, x=0.0, z=0.0, up=True):
    corners = [(x - half, y, z + half), (x + half, y, z + half), (x + half, y, z - half), (x - half, y, z - half)]
    return corners if up else corners[::-1]


def three_spheres():
    mesh = Mesh("three_spheres")
    mesh.quad("floor", "floor", level(0, 6))
    for x, name in [(-2.2, "phong1"), (0, "phong50"), (2.2, "phong1e21")]:
        mesh.sphere(name, name, (x, 1, 0), 1, rings=16)
    mesh.quad("lamp", "lamp", level(5, 1, z=1, up=False))
    phong = lambda n: ["Kd 0.1 0.1 0.1", "Ks 0.7 0.7 0.7", f"Ns {n}"]
    mesh.write(
        {
            "floor": ["Kd 0.5 0.5 0.5"],
            "phong1": phong("1"),
            "phong50": phong("50"),
            "phong1e21": phong("1e21"),
            "lamp": ["Kd 0 0 0", "Ke 12 11 10"],
        }
    )


def furnace():
    mesh = Mesh("furnace")
    mesh.sphere("ball", "ball", (0, 0, 0), 1)
    mesh.write({"ball": ["Kd 0.8 0.5 0.2"]})
    # Radiance HDR, uncompressed: 2^(129 - 136) * 128 = 1.
    header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n"
    (FOLDER / "white.hdr").write_bytes(header + bytes([128, 128, 128, 129]) * 8)


def lamps_and_sky():
    mesh = Mesh("lamps_and_sky")
    mesh.quad("floor", "floor", level(0, 4))
    mesh.quad("table", "table", level(0.6, 0.7, x=0.6))
    mesh.quad("warm", "warm", level(2.2, 0.5, x=-1.6, up=False))
    mesh.sphere("small", "small", (1.6, 1.2, 1.0), 0.1, rings=6)
    mesh.write(
        {
            "floor": ["Kd 0.4 0.35 0.3", "Ks 0.3 0.3 0.3", "Ns 40"],
            "table": ["Kd 0.1 0.2 0.7"],
            "warm": ["Kd 0.2 0.2 0.2", "Ke 6 4 2"],
            "small": ["Kd 0 0 0", "Ke 20 30 60"],
        }
    )
    # Apart, since one mesh is two-sided or not.
    sheet = Mesh("lamps_and_sky_sheet")
    sheet.quad("sheet", "sheet", [(0.4, 0.8, -1.6), (1.6, 0.8, -1.2), (1.6, 1.6, -1.2), (0.4, 1.6, -1.6)])
    sheet.write({"sheet": ["Kd 0.1 0.1 0.1", "Ke 1 4 1"]})


three_spheres()
furnace()
lamps_and_sky()
