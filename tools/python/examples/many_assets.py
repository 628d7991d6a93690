"""Makes several assets from one dense mesh, whose BVH is built once: python many_assets.py FOLDER [MESH]."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import kiln

folder = Path(sys.argv[1])
if sys.argv[2:]:
    dense = kiln.load(sys.argv[2])
else:
    x, y, z = np.mgrid[-1:1:90j, -1:1:90j, -1:1:90j]
    dense = kiln.contour(0.7 - np.cbrt(np.abs(x) ** 3 + np.abs(y) ** 3 + np.abs(z) ** 3) + 0.03 * np.sin(25 * x) * np.sin(25 * z),
                         0, spacing=2 / 89, origin=(-1, -1, -1))  # fmt: skip


def asset(faces):
    size = 128 if faces < 1000 else 512
    low = kiln.unwrap(kiln.simplify(dense, target=faces), size=size)
    bake = source.bake(low, size=size, maps=["normal", "ao"], ao_rays=16)
    return kiln.pack_glb(low, {name: bake.stored(name) for name in bake}, path=folder / f"lod_{faces}.glb")


# Any number of threads may bake from one source.
with kiln.Source(dense) as source, ThreadPoolExecutor(2) as pool:
    for glb in pool.map(asset, [4000, 1000, 250]):
        print(glb)
