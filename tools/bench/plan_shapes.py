#!/usr/bin/env python3
"""Writes six high polys by formula, for comparing plans of low polys with a grid (tools/bench/README.md).

    plan_shapes.py FOLDER

They were made before the planner was, and no setting of it was chosen by them.
"""
import math
import pathlib
import struct
import sys

FULL_TURN = 2 * math.pi


def smoothstep(x, low, high):
    t = min(max((x - low) / (high - low), 0), 1)
    return t * t * (3 - 2 * t)


def make_grid(rows, columns, point, wrap_rows, wrap_columns):
    """Makes a sheet of rows x columns quads; if rows or columns wrap, their last points are their first ones."""
    high, wide = rows + (not wrap_rows), columns + (not wrap_columns)
    points = [point(i / rows, j / columns) for i in range(high) for j in range(wide)]
    faces = []
    for i in range(rows):
        for j in range(columns):
            a, b = i * wide + j, i * wide + (j + 1) % wide
            c, d = (i + 1) % high * wide + (j + 1) % wide, (i + 1) % high * wide + j
            faces += [(a, b, c), (a, c, d)]
    return points, faces


def make_ball(rows, columns, radius):
    """Makes a sphere about Z whose radius is a function of latitude 0..1 and longitude 0..1; each pole is one vertex."""
    def surface_point(u, v):
        r, t = radius(u, v), math.pi * u
        return (r * math.sin(t) * math.cos(FULL_TURN * v), r * math.sin(t) * math.sin(FULL_TURN * v), r * math.cos(t))
    points = [surface_point(0, 0), surface_point(1, 0)]
    points += [surface_point(i / rows, j / columns) for i in range(1, rows) for j in range(columns)]
    faces = []
    index = lambda i, j: 2 + (i - 1) * columns + j % columns
    for j in range(columns):
        faces.append((0, index(1, j), index(1, j + 1)))
        faces.append((1, index(rows - 1, j + 1), index(rows - 1, j)))
        for i in range(1, rows - 1):
            a, b, c, d = index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)
            faces += [(a, b, c), (a, c, d)]
    return points, faces


def make_pumpkin():
    def radius(u, v):
        rib = abs(math.cos(5 * math.pi * v)) ** 0.6
        pits = math.sin(61 * u) * math.sin(FULL_TURN * 19 * v) * math.sin(math.pi * u) ** 2
        return 1 + 0.1 * rib * math.sin(math.pi * u) - 0.25 * math.exp(-60 * u * u) + 0.004 * pits
    return make_ball(180, 300, radius)


def make_conch():
    def surface_point(u, v):  # u runs along the spiral, v around its tube
        growth = math.exp(0.16 * FULL_TURN * (3 * u - 3))
        ridge = 1 + 0.05 * abs(math.sin(90 * u)) + 0.012 * math.sin(24 * FULL_TURN * v) * smoothstep(u, 0.3, 0.9)
        tube = 0.42 * growth * ridge
        a, b = FULL_TURN * 3 * u, FULL_TURN * v
        reach = growth + tube * math.cos(b)
        return (reach * math.cos(a), reach * math.sin(a), 1.6 * (1 - growth) + tube * math.sin(b))
    return make_grid(460, 90, surface_point, False, True)


def make_pulley():
    """Makes a solid of revolution with sharp steps and slots."""
    profile = [(0.0, 0.35), (0.0, 0.9), (0.12, 1.0), (0.3, 1.0), (0.42, 0.72), (0.58, 0.72), (0.7, 1.0), (0.88, 1.0),
               (1.0, 0.9), (1.0, 0.35), (0.8, 0.35), (0.8, 0.28), (0.2, 0.28), (0.2, 0.35)]
    lengths = [math.dist(profile[i - 1], profile[i]) for i in range(1, len(profile))] + [math.dist(profile[-1], profile[0])]
    total = sum(lengths)
    steps = [(i, k / max(1, round(120 * lengths[i] / total)))
             for i in range(len(profile)) for k in range(max(1, round(120 * lengths[i] / total)))]
    def surface_point(u, v):
        i, share = steps[round(u * len(steps)) % len(steps)]
        (x, r), (y, s) = profile[i], profile[(i + 1) % len(profile)]
        z, r = x + (y - x) * share, r + (s - r) * share
        slot = 1 if (8 * v) % 1 < 0.3 else 0
        if r > 0.8:
            r -= 0.08 * slot * smoothstep(r, 0.8, 0.9)
        return (r * math.cos(FULL_TURN * v), r * math.sin(FULL_TURN * v), z)
    return make_grid(len(steps), 320, surface_point, True, True)


def make_dunes():
    def surface_point(u, v):
        x, y, height = 5 * u, 7 * v, 0.0
        for k in range(6):
            a = 0.7 + 1.9 * k
            f = 1.7 ** k
            height += (1 - abs(math.sin(f * (x * math.cos(a) + y * math.sin(a)) + 2.1 * k))) / f ** 1.35
        r, t = 3 + 0.22 * height, 2.2 * (u - 0.5)
        return (r * math.sin(t), 6 * v, r * math.cos(t))
    return make_grid(230, 230, surface_point, False, False)


def make_pineapple():
    def radius(u, v):
        a, b = (13 * v + 9 * u) % 1, (13 * v - 9 * u) % 1
        scale = 1 - 2 * max(abs(a - 0.5), abs(b - 0.5))
        body = 1 + 0.45 * abs(math.cos(math.pi * u)) ** 2
        return body * (1 + 0.07 * scale * math.sin(math.pi * u))
    return make_ball(240, 280, radius)


def make_band():
    """Makes a ring of square section that twists by one full turn, with a wavy groove."""
    def surface_point(u, v):
        turn = FULL_TURN * u
        side, share = divmod(4 * (v % 1), 1)
        corner = lambda k: (0.35 * math.sqrt(2) * math.cos(FULL_TURN * (k + 0.5) / 4),
                            0.35 * math.sqrt(2) * math.sin(FULL_TURN * (k + 0.5) / 4))
        p, q = corner(side), corner(side + 1)
        x, y = p[0] + (q[0] - p[0]) * share, p[1] + (q[1] - p[1]) * share
        groove = math.exp(-((share - 0.5 - 0.15 * math.sin(12 * FULL_TURN * u)) / 0.06) ** 2) if side % 2 == 0 else 0
        x, y = x * (1 - 0.12 * groove), y * (1 - 0.12 * groove)
        x, y = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        a = FULL_TURN * u
        return ((1.4 + x) * math.cos(a), (1.4 + x) * math.sin(a), y)
    return make_grid(360, 128, surface_point, True, True)


def orient_outward(points, faces):
    """Orients faces counter-clockwise as seen from outside, by the sign of the enclosed volume."""
    volume = 0
    for a, b, c in faces:
        (x, y, z), (p, q, r), (s, t, u) = points[a], points[b], points[c]
        volume += x * (q * u - r * t) - y * (p * u - r * s) + z * (p * t - q * s)
    return faces if volume > 0 else [(a, c, b) for a, b, c in faces]


def save(path, points, faces):
    with open(path, "wb") as file:
        file.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\n"
                    f"property float y\nproperty float z\nelement face {len(faces)}\n"
                    "property list uchar int vertex_indices\nend_header\n").encode())
        for p in points:
            file.write(struct.pack("<3f", *p))
        for f in faces:
            file.write(struct.pack("<B3i", 3, *f))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for shape in (make_pumpkin, make_conch, make_pulley, make_dunes, make_pineapple, make_band):
        name = shape.__name__.removeprefix("make_")
        points, faces = shape()
        save(folder / f"{name}.ply", points, orient_outward(points, faces))
        print(f"{name}: {len(faces)} faces")


if __name__ == "__main__":
    main()
