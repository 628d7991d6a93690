#!/usr/bin/env python3
"""Measures processor seconds of `kiln bake` as its input grows, and the exponent of each family's growth: at most 1.1.

growth.py KILN [--only WORD] [--sizes N,N,...] [--csv FILE]    KILN is the program `kiln`

  --only WORD      families whose names hold the word
  --sizes N,N,...  sizes in place of a family's own, ascending; the first is what a small input takes
  --csv FILE       the table, a line a size: family,size,processor_seconds,power

The exponent is the slope, by least squares over logarithms, of the seconds beyond those of the first size, where these
are half a second or more: less is noise. At least the two largest sizes count. Counts in tests (Growth, Parts) hold the same without a clock.
"""
import argparse
import csv
import math
import os
import random
import subprocess
import sys
import tempfile


def write_cubes(folder, n, name=lambda i: f"part{i}", high=lambda i: f"part{i}", textures=False, share=True):
    """Writes LOW, n named cubes with UVs, and HIGH, the same cubes a little larger. All charts share the unit square, or each cube has a UDIM tile."""
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    side, columns = math.ceil(n ** (1 / 3)), math.ceil(math.sqrt(n)) if share else 1
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
                        cell = (i % columns, i // columns) if share else (0, 0)
                        file.write("vt %.6f %.6f\n" % ((cell[0] + (f % 3 + u) / 3) / columns,
                                                     (cell[1] + (f // 3 + v) / 2) / columns))
                for f, corners in enumerate(faces):
                    file.write("f " + " ".join(f"{8 * i + c + 1}/{24 * i + 4 * f + k + 1}" for k, c in enumerate(corners)) + "\n")


def parts(folder, n):
    """Each chart covers texel centres: charts that cover none take additional time, which does not depend on the number of parts."""
    write_cubes(folder, n)
    return ["--size", "1024", "--match-by", "name"]


def charts(folder, n):
    """Writes a wavy sheet of n squares, each a separate chart that covers texel centres."""
    side = math.isqrt(n)
    place = lambda x, y, up: (x / side, y / side, up + 0.01 * math.sin(20 * x / side) * math.cos(17 * y / side))
    with open(f"{folder}/high.obj", "w") as high, open(f"{folder}/low.obj", "w") as low:
        for file, up in ((high, 0.001), (low, 0)):
            for y in range(side + 1):
                for x in range(side + 1):
                    file.write("v %.6f %.6f %.6f\n" % place(x, y, up))
        for y in range(side):
            for x in range(side):
                v, t = y * (side + 1) + x + 1, 4 * (y * side + x) + 1
                high.write(f"f {v} {v + 1} {v + side + 2} {v + side + 1}\n")
                for u, w in ((.05, .05), (.95, .05), (.95, .95), (.05, .95)):
                    low.write("vt %.6f %.6f\n" % ((x + u) / side, (y + w) / side))
                low.write(f"f {v}/{t} {v + 1}/{t + 1} {v + side + 2}/{t + 2} {v + side + 1}/{t + 3}\n")
    return ["--size", "2048"]


def sets(folder, n):
    """Writes n cubes, each a texture set."""
    write_cubes(folder, n, share=False)
    return ["--size", "16", "--sets", "object", "--match-by", "name"]


def names(folder, n):
    write_cubes(folder, n, lambda i: f"one{7 * i}" if i else "x", lambda i: f"other{3 * i}" if i else "x")
    return ["--size", "64", "--match-by", "name"]


def patterns(folder, n):
    write_cubes(folder, 10)
    with open(f"{folder}/list.txt", "w") as file:
        for i in range(n):
            file.write(f"a{i}*_low = b*{i}_high\n")
        file.write("*_low = *_high\n")
    return ["--size", "64", "--match-by", "list", "--match-list", f"{folder}/list.txt"]


def needles(folder, n):
    write_cubes(folder, 10)
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
    """Writes n materials that use the same picture."""
    write_cubes(folder, 10, textures=True)
    with open(f"{folder}/a.mtl", "w") as file:
        for i in range(n):
            file.write(f"newmtl m{i}\nmap_Kd a.png\n")
    text = open(f"{folder}/high.obj").read().split("o part")
    for i in range(1, len(text)):
        text[i] = f"{text[i][:text[i].index(chr(10))]}\nusemtl m{i * (n // 10) - 1}{text[i][text[i].index(chr(10)):]}"
    open(f"{folder}/high.obj", "w").write("o part".join(text))
    return ["--size", "64", "--maps", "color"]


def vertices(folder, n):
    """Writes a wavy sheet of n vertices as HIGH; the map has 16 texels a side."""
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


INPUT_FAMILIES = ((parts, (10, 5000, 20000)), (charts, (9, 10000, 90000)), (sets, (10, 500, 2000)), (names, (10, 5000, 20000)), (patterns, (10, 5000, 20000)),
            (needles, (100, 30000, 120000)), (repeats, (10, 5000, 20000)), (vertices, (1000, 250000, 1000000)))


def measure_seconds(words):
    before = os.times()
    result = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    after = os.times()
    if result.returncode != 0:
        sys.exit(f"{' '.join(words)}: {result.stderr}")
    return after.children_user + after.children_system - before.children_user - before.children_system


def fit_power(sizes, took):
    """Subtracts the seconds of the first size from the others, and fits the exponent with which the rest grows."""
    beyond = [(n, t - took[0]) for n, t in zip(sizes, took)]
    clear = [k for k, (_, t) in enumerate(beyond) if t >= 0.5]
    first = min(clear[0] if clear else len(beyond), len(beyond) - 2)
    points = [(math.log(n), math.log(max(t, 0.05))) for n, t in beyond[first:]]
    x, y = (sum(values) / len(points) for values in zip(*points))
    return sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)


def measure_case(kiln, make, n):
    """Returns the processor seconds of a bake, the smaller of two runs."""
    with tempfile.TemporaryDirectory() as folder:
        if make is repeats:
            write_cubes(folder, 1)
            words = make(folder, n)
            subprocess.run([kiln, "bake", f"{folder}/low.obj", f"{folder}/low.obj", "--size", "16", "--quiet", "--out", folder],
                           check=True, stderr=subprocess.DEVNULL)
            os.rename(f"{folder}/low_normal.png", f"{folder}/a.png")
        else:
            words = make(folder, n)
        words = [kiln, "bake", f"{folder}/high.obj", f"{folder}/low.obj", "--quiet", "--out", f"{folder}/out", *words]
        return min(measure_seconds(words) for _ in range(2))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kiln", type=os.path.abspath)
    parser.add_argument("--only", default="")
    parser.add_argument("--sizes", type=lambda text: tuple(int(word) for word in text.split(",")))
    parser.add_argument("--csv")
    arguments = parser.parse_args()
    if arguments.sizes is not None and (len(arguments.sizes) < 3 or list(arguments.sizes) != sorted(set(arguments.sizes))):
        parser.error("--sizes needs three or more, ascending")
    families = [(make, arguments.sizes or sizes) for make, sizes in INPUT_FAMILIES if arguments.only in make.__name__]
    if not families:
        parser.error(f"no family has '{arguments.only}' in its name: " + ", ".join(make.__name__ for make, _ in INPUT_FAMILIES))
    exponents, rows = 0, []
    print("| family | sizes | processor seconds | power |\n| --- | --- | --- | --: |")
    for make, sizes in families:
        took = [measure_case(arguments.kiln, make, n) for n in sizes]
        slope = fit_power(sizes, took)
        exponents += slope > 1.1
        rows += [(make.__name__, n, f"{t:.3f}", f"{slope:.3f}") for n, t in zip(sizes, took)]
        print(f"| {make.__name__} | {', '.join(map(str, sizes))} | {', '.join(f'{t:.2f}' for t in took)} | {slope:.2f} |", flush=True)
        if arguments.csv:
            with open(arguments.csv, "w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([("family", "size", "processor_seconds", "power"), *rows])
    return exponents != 0


if __name__ == "__main__":
    sys.exit(main())
