"""Converts a volume to a GLB: python volume.py FOLDER [NRRD ISO].

Without NRRD, voxels are made here: a gyroid in a ball, as a CT or a simulation would give them.
"""

import sys
from pathlib import Path

import numpy as np

import kiln

folder = Path(sys.argv[1])
if sys.argv[2:]:
    voxels, iso = sys.argv[2], float(sys.argv[3])
else:
    x, y, z = np.mgrid[-1:1:80j, -1:1:80j, -1:1:80j]
    gyroid = np.sin(7 * x) * np.cos(7 * y) + np.sin(7 * y) * np.cos(7 * z) + np.sin(7 * z) * np.cos(7 * x)
    voxels, iso = np.minimum(0.6 - np.abs(gyroid), 6 * (0.85 - np.sqrt(x**2 + y**2 + z**2))), 0.0
low, normal = kiln.volume(voxels, iso, faces=8000, size=1024)
glb = kiln.pack_glb(low, {"normal": normal}, path=folder / "volume.glb")
print(glb, f"{low.report['error']:.2g} cells off")
