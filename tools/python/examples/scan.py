"""Converts a scan to a GLB with a known error: python scan.py FOLDER [SCAN].

Without SCAN, one is made here: a rock with colours, open below, with noise and pinholes.
"""

import sys
from pathlib import Path

import numpy as np

import kiln


def make_scan():
    """(vertices, faces, colours) of a dome."""
    n, random = 300, np.random.default_rng(1)
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n)))
    height = 0.6 * np.cos(1.4 * u) * np.cos(1.4 * v) + 0.02 * np.sin(23 * u + 3 * v) * np.sin(19 * v)
    vertices = np.stack([u, v, height], axis=1) + random.normal(0, 2e-4, (n * n, 3))
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
    faces = np.concatenate([corner + [0, 1, n + 1], corner + [0, n + 1, n]])
    faces = faces[random.random(len(faces)) > 0.001]  # pinholes
    colors = np.stack([0.5 + 0.3 * np.sin(9 * u), 0.4 + 0.2 * np.cos(7 * v), 0.3 + height / 3], axis=1)
    return vertices, faces, np.clip(colors, 0, 1)


folder = Path(sys.argv[1])
scan = kiln.load(sys.argv[2]) if sys.argv[2:] else kiln.Mesh(*make_scan()[:2], colors=make_scan()[2])
# Chooses the fewest faces whose rendered normals deviate by at most 4 degrees.
glb = kiln.to_glb(scan, max_error="normal=4deg", texture_size=1024, path=folder / "scan.glb")
error = kiln.measure(scan, glb.mesh, glb.bake)
print(glb, f"{error.degrees:.2f} degrees off")
