"""Evaluates your own colour field at the texels: python field.py FOLDER.

The field stands for a network or a voxel grid: it is called once with all positions, and may run on a GPU.
"""

import sys
from pathlib import Path

import numpy as np

import kiln


def dense():
    x, y, z = np.mgrid[-1:1:90j, -1:1:90j, -1:1:90j]
    bumps = 0.05 * np.sin(15 * x) * np.sin(15 * y) * np.sin(15 * z)
    return kiln.contour(0.8 - np.sqrt(x**2 + y**2 + z**2) + bumps, 0, spacing=2 / 89, origin=(-1, -1, -1))


def field(points):
    """Wood: rings around an axis. Channels of a PBR material, all in [0, 1]."""
    ring = 0.5 + 0.5 * np.sin(60 * np.hypot(points[:, 0] + 0.1 * np.sin(3 * points[:, 2]), points[:, 1]))
    color = np.outer(ring, [0.35, 0.22, 0.1]) + [0.4, 0.25, 0.12]
    return {"color": color, "roughness": 0.4 + 0.4 * ring, "metallic": 0 * ring}


folder = Path(sys.argv[1])
mesh = dense()
glb = kiln.to_glb(mesh, faces_target=3000, texture_size=512, sample=field, path=folder / "field.glb")
print(glb, f"{len(mesh.faces)} faces before")
# This computes the same maps in separate steps, for an existing low poly.
maps = kiln.sampled(kiln.match(mesh, glb.mesh, size=512), field)
assert {name: array.shape for name, array in maps.items()}["color"] == (512, 512, 3)
