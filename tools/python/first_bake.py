"""Waves baked onto a square, from arrays: python first_bake.py FOLDER."""

import sys

import numpy as np

import kiln

x, y = np.meshgrid(np.linspace(0, 1, 257), np.linspace(0, 1, 257))
vertices = np.stack([x, y, 0.005 * np.sin(50 * x) * np.sin(50 * y)], axis=2).reshape(-1, 3)
corner = (np.arange(256)[:, None] * 257 + np.arange(256)).reshape(-1, 1)
faces = np.concatenate([corner + [0, 1, 258], corner + [0, 258, 257]])
square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
low = kiln.Mesh(*square, uvs=np.array(square[0])[:, :2], name="waves")

bake = kiln.bake((vertices, faces), low, size=512)
print(bake, bake.save(sys.argv[1])[0])
