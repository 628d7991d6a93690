#!/usr/bin/env python3
"""Writes the polygons, and how Blender triangulates them, that are the fixture of tests/asset/triangulation_test.cpp.

Usage: blender_triangles.py OUT.txt   (needs bpy, of PyPI)

A polygon a line: its number of corners, their coordinates, and the corners of its triangles as Blender's
mesh.loop_triangles has them. Coordinates are multiples of 1/64, so that every program reads the same floats.
"""

import math
import random
import sys

import bpy


def make_star(rng, corners, spread):
    """Makes a star-shaped polygon around the origin; it is convex if spread is 0."""
    turns = sorted(rng.random() for _ in range(corners))
    return [(math.cos(2 * math.pi * t) * r, math.sin(2 * math.pi * t) * r)
            for t, r in ((t, 1 - spread * rng.random()) for t in turns)]


def make_comb(rng, teeth):
    """Makes a polygon with deep notches that is not star-shaped."""
    points = [(0.0, -1.0), (float(teeth), -1.0)]
    for i in reversed(range(teeth)):
        points += [(i + 0.75, 1 + rng.random()), (i + 0.5, rng.random() - 0.5)]
    return points


def place_in_space(rng, flat):
    """Rotates a flat polygon in space, bends it a little, and rounds its coordinates to the grid."""
    a, b = rng.random() * 6.28, math.acos(2 * rng.random() - 1)
    u = (math.cos(a), math.sin(a), 0.0)
    v = (-math.sin(a) * math.cos(b), math.cos(a) * math.cos(b), math.sin(b))
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    bend = 0.05 * rng.random()
    result = []
    for x, y in flat:
        z = bend * rng.random()
        result.append(tuple(round(64 * 4 * (x * u[k] + y * v[k] + z * n[k])) / 64 for k in range(3)))
    return result


def triangulate(corners):
    mesh = bpy.data.meshes.new("polygon")
    mesh.from_pydata(corners, [], [list(range(len(corners)))])
    mesh.calc_loop_triangles()
    result = [tuple(t.loops) for t in mesh.loop_triangles]
    bpy.data.meshes.remove(mesh)
    return result


def main():
    rng = random.Random(7)
    polygons = []
    for i in range(160):
        polygons.append(make_star(rng, 4, 0.9 * (i % 2)))
    for i in range(160):
        polygons.append(make_star(rng, 5 + i % 8, 0.0 if i % 4 == 0 else 0.8))
    for i in range(40):
        polygons.append(make_comb(rng, 2 + i % 6))
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        out.write(f"# Blender {bpy.app.version_string}: tools/bench/blender_triangles.py\n")
        for flat in polygons:
            corners = place_in_space(rng, flat)
            if len(set(corners)) < len(corners):
                continue
            numbers = [str(len(corners))]
            numbers += [f"{x:.9g}" for corner in corners for x in corner]
            numbers += [str(i) for triangle in triangulate(corners) for i in triangle]
            out.write(" ".join(numbers) + "\n")


if __name__ == "__main__":
    main()
