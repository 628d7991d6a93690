#!/usr/bin/env python3
"""Measures processor seconds of `kiln bake` as its input grows, and the exponent of each family's growth: at most 1.1.

growth.py KILN [--only WORD]    KILN is the program `kiln`

Of the two largest sizes of a family, less what a small input takes. Counts in tests (Growth, Parts) hold the same
without a clock.
"""
import argparse
import math
import os
import random
import subprocess
import sys
import tempfile


def cubes(folder, n, name=lambda i: f"part{i}", high=lambda i: f"part{i}", textures=False):
    """n cubes with names, of LOW with UVs and of HIGH a little larger."""
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    side, columns = math.ceil(n ** (1 / 3)), math.ceil(math.sqrt(n))
    for kind, scale, named in (("high", 1.02, high), ("low", 1, name)):
        with open(f"{folder}/{kind}.obj", "w") as file:
            if textures and kind == "high":
                file.write("mtllib a.mtl\nusemtl m0\n")
            for i in range(n):
                file.write(f"o {named(i)}_{kind}\n")
                at = (i % side, i // side % side, i // side // side)
                for c in range(8):
                    file.write("v %.5f %.5f %.5f\n" % tuple(2 * a + scale * ((c >> k & 1) - 0.5) for k, a in enumerate(at)))
                for f in range(6):
                    for u, v in ((.05, .05), (.95, .05), (.95, .95), (.05, .95)):
                        file.write("vt %.6f %.6f\n" % ((i % columns + (f % 3 + u) / 3) / columns,
                                                     (i // columns + (f // 3 + v) / 2) / columns))
                for f, corners in enumerate(faces):
                    file.write("f " + " ".join(f"{8 * i + c + 1}/{24 * i + 4 * f + k + 1}" for k, c in enumerate(corners)) + "\n")


def parts(folder, n):
    """Each chart covers texel centres, since small charts cost extra, independent of the number of parts."""
    cubes(folder, n)
    return ["--size", "1024", "--match-by", "name"]


def names(folder, n):
    cubes(folder, n, lambda i: f"one{7 * i}" if i else "x", lambda i: f"other{3 * i}" if i else "x")
    return ["--size", "64", "--match-by", "name"]


def patterns(folder, n):
    cubes(folder, 10)
    with open(f"{folder}/list.txt", "w") as file:
        for i in range(n):
            file.write(f"a{i}*_low = b*{i}_high\n")
        file.write("*_low = *_high\n")
    return ["--size", "64", "--match-by", "list", "--match-list", f"{folder}/list.txt"]


def needles(folder, n):
    cubes(folder, 10)
    draw = random.Random(1)
    with open(f"{folder}/high.obj", "w") as file:
        for i in range(n):
            a = [6 * draw.random() - 1 for _ in range(3)]
            way = [draw.random() - 0.5 for _ in range(3)]
            for side in ((0, 0), (1, 0), (1, 1)):
                file.write("v %.6f %.6f %.6f\n" % tuple(p + side[0] * w + side[1] * 0.002 for p, w in zip(a, way)))
            file.write(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}\n")
    return ["--size", "64", "--maps", "normal,curvature", "--clean", "none", "--max-distance", "50%"]


def repeats(folder, n):
    """One picture, named by n materials."""
    cubes(folder, 10, textures=True)
    with open(f"{folder}/a.mtl", "w") as file:
        for i in range(n):
            file.write(f"newmtl m{i}\nmap_Kd a.png\n")
    text = open(f"{folder}/high.obj").read().split("o part")
    for i in range(1, len(text)):
        text[i] = f"{text[i][:text[i].index(chr(10))]}\nusemtl m{i * (n // 10) - 1}{text[i][text[i].index(chr(10)):]}"
    open(f"{folder}/high.obj", "w").write("o part".join(text))
    return ["--size", "64", "--maps", "color"]


def vertices(folder, n):
    """A wavy sheet of HIGH on a map of 16 texels a side."""
    side = math.isqrt(n)
    with open(f"{folder}/high.obj", "w") as file:
        for y in range(side):
            for x in range(side):
                file.write("v %.6f %.6f %.6f\n" % (x / side, y / side, 0.01 * math.sin(40 * x / side) * math.cos(37 * y / side)))
        for y in range(side - 1):
            for x in range(side - 1):
                v = y * side + x + 1
                file.write(f"f {v} {v + 1} {v + side + 1} {v + side}\n")
    with open(f"{folder}/low.obj", "w") as file:
        file.write("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
    return ["--size", "16", "--maps", "normal,curvature"]


FAMILIES = ((parts, (10, 5000, 20000)), (names, (10, 5000, 20000)), (patterns, (10, 5000, 20000)),
            (needles, (100, 30000, 120000)), (repeats, (10, 5000, 20000)), (vertices, (1000, 250000, 1000000)))


def seconds(words):
    before = os.times()
    result = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    after = os.times()
    if result.returncode != 0:
        sys.exit(f"{' '.join(words)}: {result.stderr}")
    return after.children_user + after.children_system - before.children_user - before.children_system


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kiln", type=os.path.abspath)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    over = 0
    print("| family | sizes | processor seconds | power |\n| --- | --- | --- | --: |")
    for make, sizes in FAMILIES:
        if asked.only not in make.__name__:
            continue
        took = []
        for n in sizes:
            with tempfile.TemporaryDirectory() as folder:
                if make is repeats:
                    cubes(folder, 1)
                    words = make(folder, n)
                    subprocess.run([asked.kiln, "bake", f"{folder}/low.obj", f"{folder}/low.obj", "--size", "16", "--quiet",
                                    "--out", folder], check=True, stderr=subprocess.DEVNULL)
                    os.rename(f"{folder}/low_normal.png", f"{folder}/a.png")
                else:
                    words = make(folder, n)
                words = [asked.kiln, "bake", f"{folder}/high.obj", f"{folder}/low.obj", "--quiet", "--out", f"{folder}/out", *words]
                took.append(min(seconds(words) for _ in range(2)))
        power = math.log(max(took[2] - took[0], 0.05) / max(took[1] - took[0], 0.05)) / math.log(sizes[2] / sizes[1])
        over += power > 1.1
        print(f"| {make.__name__} | {', '.join(map(str, sizes))} | {', '.join(f'{t:.2f}' for t in took)} | {power:.2f} |", flush=True)
    return over != 0


if __name__ == "__main__":
    sys.exit(main())
