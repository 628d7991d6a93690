#!/usr/bin/env python3
"""Generates meshes with the defects of generators and scanners, for `kiln simplify` and `kiln bake`.

broken_meshes.py DIR          writes one PLY a class
broken_meshes.py DIR --table KILN [--faces N]
                              also simplifies each, without and with --clean, and prints the results
"""
import argparse
import array
import json
import math
import os
import random
import resource
import struct
import subprocess
import sys


def bumpy_radius(x, y, z):
    """Returns a radius near 1 with waves of several lengths."""
    return (1 + 0.03 * math.sin(9 * x + 4 * y) + 0.015 * math.sin(23 * y + 11 * z)
            + 0.006 * math.sin(51 * z + 37 * x))


class Mesh:
    def __init__(self):
        self.points, self.faces = [], []

    def add(self, points, faces):
        first = len(self.points)
        self.points += points
        self.faces += [(a + first, b + first, c + first) for a, b, c in faces]
        return self

    def join(self, other):
        return self.add(other.points, other.faces)

    def with_offset(self, by, scale=1.0):
        mesh = Mesh()
        mesh.points = [tuple(scale * p + o for p, o in zip(point, by)) for point in self.points]
        mesh.faces = list(self.faces)
        return mesh

    def with_flipped_faces(self):
        mesh = Mesh()
        mesh.points, mesh.faces = list(self.points), [(a, c, b) for a, b, c in self.faces]
        return mesh

    def with_separate_corners(self, noise, random_generator):
        """Gives each face separate corners, displaced by up to `noise`."""
        mesh = Mesh()
        for face in self.faces:
            first = len(mesh.points)
            for v in face:
                mesh.points.append(tuple(x + random_generator.uniform(-noise, noise) for x in self.points[v]))
            mesh.faces.append((first, first + 1, first + 2))
        return mesh

    def save(self, path):
        with open(path, "wb") as file:
            file.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\n"
                        "property float y\nproperty float z\nelement face %d\n"
                        "property list uchar int vertex_indices\nend_header\n"
                        % (len(self.points), len(self.faces))).encode())
            file.write(array.array("f", [x for p in self.points for x in p]).tobytes())
            pack = struct.Struct("<Biii").pack
            file.write(b"".join(pack(3, *f) for f in self.faces))


def make_sphere(n, radius=1.0, shape=bumpy_radius):
    """Makes a sphere from a cube with n x n quads per side."""
    index, points, faces = {}, [], []

    def add_vertex(p):
        if p not in index:
            x, y, z = (math.tan((2 * c / n - 1) * math.pi / 4) for c in p)
            size = math.sqrt(x * x + y * y + z * z)
            x, y, z = x / size, y / size, z / size
            r = radius * (shape(x, y, z) if shape else 1)
            index[p] = len(points)
            points.append((r * x, r * y, r * z))
        return index[p]

    for axis in range(3):
        for end in (0, n):
            for i in range(n):
                for k in range(n):
                    quad = []
                    for a, b in ((i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1)):
                        p = [0, 0, 0]
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = end, a, b
                        quad.append(add_vertex(tuple(p)))
                    if end == 0:
                        quad.reverse()
                    faces += [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
    mesh = Mesh()
    mesh.points, mesh.faces = points, faces
    return mesh


def make_tube(a, b, radius, sides, rings, closed=True):
    """Makes a cylinder from a to b."""
    axis = [q - p for p, q in zip(a, b)]
    size = math.sqrt(sum(x * x for x in axis))
    axis = [x / size for x in axis]
    other = (1, 0, 0) if abs(axis[0]) < 0.8 else (0, 1, 0)
    u = [axis[1] * other[2] - axis[2] * other[1], axis[2] * other[0] - axis[0] * other[2],
         axis[0] * other[1] - axis[1] * other[0]]
    length = math.sqrt(sum(x * x for x in u))
    u = [x / length for x in u]
    v = [axis[1] * u[2] - axis[2] * u[1], axis[2] * u[0] - axis[0] * u[2],
         axis[0] * u[1] - axis[1] * u[0]]
    points, faces = [], []
    for r in range(rings + 1):
        for s in range(sides):
            c, n = math.cos(2 * math.pi * s / sides), math.sin(2 * math.pi * s / sides)
            points.append(tuple(a[k] + axis[k] * size * r / rings + radius * (c * u[k] + n * v[k])
                                for k in range(3)))
    for r in range(rings):
        for s in range(sides):
            p, q = r * sides + s, r * sides + (s + 1) % sides
            faces += [(p, q, q + sides), (p, q + sides, p + sides)]
    if closed:
        points += [tuple(a), tuple(b)]
        low, high = len(points) - 2, len(points) - 1
        for s in range(sides):
            t = (s + 1) % sides
            faces += [(low, t, s), (high, rings * sides + s, rings * sides + t)]
    mesh = Mesh()
    mesh.points, mesh.faces = points, faces
    return mesh


def find_cells(mesh, face, size):
    """Returns for each face the block of the grid over space that contains it."""
    return tuple(math.floor(sum(mesh.points[v][k] for v in face) / 3 / size) for k in range(3))


def make_plain(r):
    return make_sphere(182)


def make_soup(r):
    return make_sphere(149).with_separate_corners(3e-7, r)


def make_flipped(r):
    mesh = make_sphere(182)
    wrong = {}
    for i, face in enumerate(mesh.faces):
        if wrong.setdefault(find_cells(mesh, face, 0.3), r.random() < 0.4):
            mesh.faces[i] = (face[0], face[2], face[1])
    return mesh


def make_doubled(r):
    mesh = make_sphere(182)
    again = {}
    mesh.faces += [face for face in list(mesh.faces)
                   if again.setdefault(find_cells(mesh, face, 0.3), r.random() < 0.3)]
    return mesh


def make_torn(r):
    """Blocks that share no vertices, some flipped and some doubled, off by noise; every tenth face of rims is gone, and
    fins stand on edges."""
    mesh = make_sphere(182)
    blocks = {}
    for face in mesh.faces:
        blocks.setdefault(find_cells(mesh, face, 0.25), []).append(face)
    result = Mesh()
    for faces in blocks.values():
        index, points, own = {}, [], []
        for face in faces:
            corners = []
            for v in face:
                if v not in index:
                    index[v] = len(points)
                    points.append(tuple(x + r.uniform(-2e-6, 2e-6) for x in mesh.points[v]))
                corners.append(index[v])
            own.append(tuple(corners))
        if r.random() < 0.25:
            own = [(a, c, b) for a, b, c in own]
        if r.random() < 0.15:
            own += own[:len(own) // 2]
        result.add(points, own)
    for _ in range(700):
        a, b, c = r.choice(result.faces)
        p, q = result.points[a], result.points[b]
        result.points.append(tuple(1.01 * (x + y) / 2 for x, y in zip(p, q)))
        result.faces.append((a, b, len(result.points) - 1))
    return result


def make_shells(r):
    return make_sphere(129).join(make_sphere(129, 0.8).with_flipped_faces()).join(make_sphere(60, 0.5)).join(make_sphere(60, 0.4).with_flipped_faces())


def make_robot(r):
    """Makes parts that intersect each other."""
    mesh = make_sphere(80).with_offset((0, 0, 0), 0.6)
    mesh.join(make_sphere(60).with_offset((0, 0.9, 0), 0.35))
    for x in (-1, 1):
        mesh.join(make_tube((0.3 * x, 0.3, 0), (1.1 * x, -0.2, 0.2), 0.14, 64, 200))
        mesh.join(make_tube((1.05 * x, -0.2, 0.2), (1.2 * x, -0.9, 0.5), 0.11, 64, 200))
        mesh.join(make_sphere(40).with_offset((1.1 * x, -0.2, 0.2), 0.18))
        mesh.join(make_tube((0.25 * x, -0.4, 0), (0.35 * x, -1.6, 0), 0.17, 64, 200))
        mesh.join(make_sphere(40).with_offset((0.35 * x, -1.65, 0.1), 0.22))
        mesh.join(make_sphere(24).with_offset((0.12 * x, 0.95, 0.3), 0.06))
        for i in range(40):
            mesh.join(make_sphere(6, 1, None).with_offset((0.02 * x * i, 0.5 * math.sin(i), 0.5 * math.cos(i)), 0.02))
    return mesh


def make_floaters(r):
    mesh = make_sphere(160)
    for _ in range(400):
        d = [r.gauss(0, 1) for _ in range(3)]
        size = math.sqrt(sum(x * x for x in d))
        away = r.uniform(1.2, 2.2)
        mesh.join(make_sphere(4, 1, None).with_offset(tuple(away * x / size for x in d), r.uniform(0.002, 0.012)))
    mesh.join(make_sphere(40).with_offset((0.3, 0.3, 0.93), 0.1)).join(make_sphere(40).with_offset((-0.3, 0.3, 0.93), 0.1))
    mesh.join(make_tube((0, 6, 0), (0.5, 9, 0), 0.01, 6, 40))
    return mesh


def make_pinholes(r):
    mesh = make_sphere(182)
    removed = set(r.sample(range(len(mesh.faces)), 6000))
    mesh.faces = [face for i, face in enumerate(mesh.faces) if i not in removed]
    return mesh


def make_pieces(r):
    """Makes 266,000 separate faces that no weld can join."""
    mesh = make_sphere(211).with_separate_corners(0, r)
    for i, (a, b, c) in enumerate(mesh.faces):
        d = [r.uniform(-0.01, 0.01) for _ in range(3)]
        for v in (a, b, c):
            mesh.points[v] = tuple(x + y for x, y in zip(mesh.points[v], d))
    mesh.faces = mesh.faces[:266048]
    return mesh


def make_plant(r):
    """Makes stems with single-sided leaves, each a bent sheet of 4 x 4 quads."""
    mesh = Mesh()
    for s in range(12):
        turn = 2 * math.pi * s / 12
        a = (0.05 * math.cos(turn), 0.0, 0.05 * math.sin(turn))
        b = (0.6 * math.cos(turn), 1.6, 0.6 * math.sin(turn))
        mesh.join(make_tube(a, b, 0.02, 16, 200))
        for _ in range(800):
            f = r.uniform(0.1, 1)
            root = [p + f * (q - p) for p, q in zip(a, b)]
            d = [r.gauss(0, 1) for _ in range(3)]
            e = [r.gauss(0, 1) for _ in range(3)]
            points = [tuple(root[k] + 0.04 * (u / 4 * d[k] + (v / 4 - 0.5) * e[k])
                            + 0.01 * math.sin(u) for k in range(3)) for u in range(5) for v in range(5)]
            faces = [f for u in range(4) for v in range(4) for f in
                     ((5 * u + v, 5 * u + v + 5, 5 * u + v + 6), (5 * u + v, 5 * u + v + 6, 5 * u + v + 1))]
            mesh.add(points, faces)
    return mesh


def make_hair(r):
    """Makes a head with 3,000 open tubes as hair."""
    mesh = make_sphere(50)
    for _ in range(3000):
        d = [r.gauss(0, 1) for _ in range(3)]
        size = math.sqrt(sum(x * x for x in d))
        a = tuple(0.98 * x / size for x in d)
        b = tuple(1.5 * x / size + r.uniform(-0.2, 0.2) for x in d)
        mesh.join(make_tube(a, b, 0.004, 5, 10, closed=False))
    return mesh


def make_room(r):
    """Makes a room of walls that face inwards, with furniture and holes."""
    mesh = make_sphere(120, 2.0, lambda x, y, z: 1 / max(abs(x), abs(y), abs(z))).with_flipped_faces()
    mesh.faces = [f for i, f in enumerate(mesh.faces) if (i // 700) % 9 != 0]
    for i in range(60):
        mesh.join(make_sphere(16).with_offset(tuple(r.uniform(-1.6, 1.6) for _ in range(3)), r.uniform(0.05, 0.3)))
    return mesh


def make_figure(r):
    """Makes a figure of blended balls: a body with limbs and folds."""
    def folded_radius(x, y, z):
        return 1 + 0.02 * math.sin(31 * y + 5 * x) + 0.004 * math.sin(90 * x) * math.sin(80 * z)

    mesh = make_sphere(150, 1, lambda x, y, z: folded_radius(x, y, z) * (0.6 + 0.5 * y * y + 0.25 * abs(x) ** 3 * (1 - abs(y))))
    mesh.join(make_sphere(70, 0.35, folded_radius).with_offset((0, 1.35, 0)))
    for x in (-1, 1):
        mesh.join(make_sphere(60, 1, lambda a, b, c: folded_radius(a, b, c) * (0.12 + 0.35 * abs(b) ** 3)).with_offset((0.7 * x, 0.2, 0.1)))
        mesh.join(make_sphere(60, 1, lambda a, b, c: folded_radius(a, b, c) * (0.16 + 0.5 * abs(b) ** 3)).with_offset((0.3 * x, -1.3, 0)))
    return mesh


def make_chair(r):
    """Makes a chair: a seat on legs, with slats close to each other."""
    def make_block(center, size, n=40):
        def box(x, y, z):
            return (1 + 0.01 * math.sin(40 * x) * math.sin(40 * z)) / max(abs(x), abs(y), abs(z))

        mesh = make_sphere(n, 1, box)
        mesh.points = [tuple(c + s * p for c, s, p in zip(center, size, point)) for point in mesh.points]
        return mesh

    mesh = make_block((0, 0, 0), (0.6, 0.05, 0.6), 90)
    for x in (-0.5, 0.5):
        for z in (-0.5, 0.5):
            mesh.join(make_tube((x, -0.05, z), (1.1 * x, -1.0, 1.1 * z), 0.05, 48, 120))
        mesh.join(make_block((x, 0.7, -0.55), (0.05, 0.7, 0.05), 50))
    for i in range(12):
        mesh.join(make_block((0, 0.15 + 0.1 * i, -0.55), (0.48, 0.035, 0.02)))
    return mesh


# The random seed of a class of meshes is its index in this list, so append new classes at the end.
MESH_MAKERS = [make_plain, make_soup, make_flipped, make_doubled, make_torn, make_shells, make_robot, make_floaters, make_pinholes, make_pieces, make_plant, make_hair, make_room, make_figure, make_chair]


def count_defective_edges(path):
    """Counts the open and the non-manifold edges of an OBJ, after welding vertices of equal position."""
    points, index, edges = [], {}, {}
    with open(path) as file:
        for line in file:
            words = line.split()
            if words and words[0] == "v":
                points.append(index.setdefault(tuple(words[1:4]), len(index)))
            elif words and words[0] == "f":
                v = [points[int(w.split("/")[0]) - 1] for w in words[1:4]]
                for k in range(3):
                    edge = (min(v[k], v[k - 1]), max(v[k], v[k - 1]))
                    edges[edge] = edges.get(edge, 0) + 1
    return (sum(1 for n in edges.values() if n == 1), sum(1 for n in edges.values() if n > 2))


def measure_class(kiln, path, faces, flags, folder):
    out, report = os.path.join(folder, "low.obj"), os.path.join(folder, "low.json")
    for file in (out, report):
        if os.path.exists(file):
            os.remove(file)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([kiln, "simplify", path, "--faces", str(faces), "--out", out, "--json", report,
                           "--quiet", "--force"] + flags, stderr=subprocess.PIPE, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if not os.path.exists(report):
        return "exit %d: %s" % (done.returncode, done.stderr.strip()[:100])
    with open(report) as file:
        low = json.load(file)
    opened, face_count = count_defective_edges(out)
    return "%d | %d | %d | %d | %d | %.2f | %.1f | %.1f | %.1f" % (
        done.returncode, low["faces"], opened, face_count, low["charts"], 100 * low["error"], seconds,
        low["seconds"]["unwrap"], low.get("clean", {}).get("seconds", 0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--table", metavar="KILN", help="the command")
    parser.add_argument("--faces", type=int, default=10000)
    parser.add_argument("--only", help="classes, separated by commas")
    arguments = parser.parse_args()
    os.makedirs(arguments.folder, exist_ok=True)
    if arguments.table:
        print("| class | faces | clean | exit | low faces | open edges | non-manifold edges | charts | deviation % | "
              "processor s | unwrap s | clean s |\n" + "| --- " * 12 + "|")
    for number, make in enumerate(MESH_MAKERS):
        name = make.__name__.removeprefix("make_")
        if arguments.only and name not in arguments.only.split(","):
            continue
        path = os.path.join(arguments.folder, name + ".ply")
        if not os.path.exists(path):
            make(random.Random(number)).save(path)
        if not arguments.table:
            continue
        with open(path, "rb") as file:
            count = [line.split()[-1].decode() for line in file.read(400).split(b"\n") if b"element face" in line][0]
        for clean in ("none", "auto"):
            print("| %s | %s | %s | %s |" % (name, count, clean, measure_class(
                arguments.table, path, arguments.faces, ["--clean", clean], arguments.folder)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
