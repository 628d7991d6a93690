"""Converts a generated mesh to a GLB: python generated_mesh.py FOLDER [MESH].

Without MESH, what a generator leaves is made here: a figure of blended balls by marching cubes, with colours, specks that
float around it, and a shell within.
"""

import sys
from pathlib import Path

import numpy as np

import kiln


def generate_mesh():
    """(vertices, faces, colours)."""
    n = 96
    x, y, z = np.moveaxis(np.mgrid[-1 : 1 : n * 1j, -1 : 1 : n * 1j, -1 : 1 : n * 1j], 0, 0)
    balls = [(0, 0, 0.5, 0.28), (0, 0, 0, 0.36), (0, 0, -0.5, 0.42), (0.35, 0, 0.15, 0.16), (-0.35, 0, 0.15, 0.16)]
    specks = [(0.9 * np.cos(a), 0.9 * np.sin(a), 0.8, 0.03) for a in range(6)]
    field = sum(
        np.exp(-12 * (np.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / r - 1)) for a, b, c, r in balls + specks
    )
    field += 0.15 * np.sin(40 * x) * np.sin(40 * y) * np.sin(40 * z)
    field -= 1e3 * (np.sqrt(x**2 + y**2 + (z + 0.5) ** 2) < 0.25)  # hollows the figure
    mesh = kiln.contour(field, 1, spacing=2 / (n - 1), origin=(-1, -1, -1))
    colors = np.clip(0.5 + 0.5 * mesh.vertices, 0, 1)
    return mesh.vertices, mesh.faces, colors


folder = Path(sys.argv[1])
vertices, faces, colors = (sys.argv[2], None, None) if sys.argv[2:] else generate_mesh()
# The inner shell and bodies below 7% of the diagonal are removed, with a warning each.
glb = kiln.to_glb(
    vertices, faces, colors=colors, faces_target=4000, drop_floaters=0.07, texture_size=512, path=folder / "generated.glb"
)
print(glb, f"{glb.bake.report.missed} samples missed")
