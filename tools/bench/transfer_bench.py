"""Carries a texture over from a dense mesh to a light one with Kiln and with MeshLab, beside each other.

    python tools/bench/transfer_bench.py KILN FOLDER [--size 4096] [--texture 4096]

Both bake a checkerboard of sRGB black and white onto a square of two triangles from a square of 32,768, whose
UVs are the same: what each texel ought to hold is an integral in closed form. Prints one JSON line a program:
seconds by the clock and by the processors of the whole process, the root of the mean square error of the texels
in linear light and in sRGB (1/255), and how many texels stayed empty. Needs pymeshlab and numpy.
"""
import argparse
import json
import math
import os
import resource
import struct
import subprocess
import sys
import time
import zlib

import numpy as np

CELL = 24  # texels of the texture; no whole number of them fits into most texels of the map


def write_png(path, pixels):
    """8 bits, grey or RGB."""
    height, width = pixels.shape[:2]
    kind = 0 if pixels.ndim == 2 else 2
    rows = b"".join(b"\0" + pixels[y].tobytes() for y in range(height))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)))
        file.write(chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def read_png(path):
    """8 or 16 bits, any filter, as numbers from 0 to 1."""
    data = open(path, "rb").read()
    at, packed = 8, b""
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        if name == b"IHDR":
            width, height, depth, kind = struct.unpack(">IIBB", body[:10])
        elif name == b"IDAT":
            packed += body
        at += size + 12
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[kind]
    step = channels * depth // 8
    raw = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, -1)
    lines, last = [], np.zeros(width * step, np.uint8)
    for row in raw:
        kind_of_row, line = row[0], row[1:].copy()
        if kind_of_row == 1:
            line = np.cumsum(line.reshape(-1, step).astype(np.uint8), axis=0, dtype=np.uint8).reshape(-1)
        elif kind_of_row == 2:
            line = line + last
        elif kind_of_row >= 3:
            line = unfilter(kind_of_row, line, last, step)
        lines.append(line)
        last = line
    values = np.stack(lines)
    if depth == 16:
        values = values.reshape(height, -1, 2).astype(np.uint32)
        values = values[..., 0] * 256 + values[..., 1]
    return values.reshape(height, width, channels) / (255.0 if depth == 8 else 65535.0)


def unfilter(kind, line, last, step):
    out = bytearray(line)
    for i in range(len(out)):
        left = out[i - step] if i >= step else 0
        up, corner = int(last[i]), int(last[i - step]) if i >= step else 0
        if kind == 3:
            out[i] = (out[i] + (left + up) // 2) & 255
        else:
            p = left + up - corner
            a, b, c = abs(p - left), abs(p - up), abs(p - corner)
            out[i] = (out[i] + (left if a <= b and a <= c else up if b <= c else corner)) & 255
    return np.frombuffer(bytes(out), np.uint8)


def square(path, cells, texture=None):
    """A unit square as OBJ, with UVs over all of the texture."""
    with open(path, "w") as file:
        if texture:
            material = os.path.splitext(path)[0] + ".mtl"
            file.write(f"mtllib {os.path.basename(material)}\n")
            with open(material, "w") as mtl:
                mtl.write(f"newmtl board\nKd 1 1 1\nmap_Kd {os.path.basename(texture)}\n")
        n = cells + 1
        for y in range(n):
            for x in range(n):
                file.write(f"v {x / cells} {y / cells} 0\nvt {x / cells} {y / cells}\n")
        file.write("vn 0 0 1\n" + ("usemtl board\n" if texture else ""))
        for y in range(cells):
            for x in range(cells):
                a, b, c, d = y * n + x + 1, y * n + x + 2, (y + 1) * n + x + 2, (y + 1) * n + x + 1
                file.write(f"f {a}/{a}/1 {b}/{b}/1 {c}/{c}/1\nf {a}/{a}/1 {c}/{c}/1 {d}/{d}/1\n")


def exact(size, texture):
    """Of each texel the share of white: 1/2 - 1/2 of the product of two square waves' means."""

    def wave(side):
        def integral(x):
            turn = x - 2 * np.floor(x / 2)
            return np.where(turn < 1, -turn, turn - 2)

        edges = np.arange(side + 1) * (texture / CELL / side)
        return np.diff(integral(edges)) / np.diff(edges)

    return 0.5 - 0.5 * np.outer(wave(size), wave(size))


def linear(values):
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def encoded(values):
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055)


def report(program, path, seconds, processors, wanted):
    image = read_png(path)[..., 0]
    alpha = read_png(path)
    empty = int((alpha[..., 3] == 0).sum()) if alpha.shape[2] == 4 else 0
    light = linear(image)
    print(
        json.dumps(
            {
                "program": program,
                "seconds": round(seconds, 2),
                "cpu_seconds": round(processors, 2),
                "rms_linear": round(float(np.sqrt(np.mean((light - wanted) ** 2))), 5),
                "rms_srgb_255": round(float(255 * np.sqrt(np.mean((image - encoded(wanted)) ** 2))), 3),
                "empty_texels": empty,
            }
        ),
        flush=True,
    )


def timed(command):
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"{command[0]} failed:\n{done.stdout}{done.stderr}")
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


MESHLAB = """
import sys, pymeshlab
high, low, size, name = sys.argv[1:]
set = pymeshlab.MeshSet()
set.load_new_mesh(high)
set.load_new_mesh(low)
set.transfer_attributes_to_texture_per_vertex(
    sourcemesh=0, targetmesh=1, attributeenum='Texture Color', textname=name, textw=int(size), texth=int(size))
set.save_current_mesh(low.replace('low.obj', 'low_meshlab.obj'))
"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("kiln")
    parser.add_argument("folder")
    parser.add_argument("--size", type=int, default=4096)
    parser.add_argument("--texture", type=int, default=4096)
    arguments = parser.parse_args()
    folder, size, texture = arguments.folder, arguments.size, arguments.texture
    os.makedirs(folder, exist_ok=True)
    high, low, board = (os.path.join(folder, name) for name in ("high.obj", "low.obj", "board.png"))
    places = np.arange(texture) // CELL
    grey = ((places[:, None] + places[None, :]) % 2 * 255).astype(np.uint8)
    write_png(board, np.repeat(grey[..., None], 3, axis=2))
    square(high, 128, board)
    square(low, 1)
    wanted = exact(size, texture)
    common = [arguments.kiln, "bake", high, low, "--size", str(size), "--gutter", "0", "--format", "png8"]
    seconds, processors = timed(common + ["--maps", "color", "--out", os.path.join(folder, "out"), "--quiet"])
    report("Kiln", os.path.join(folder, "out", "low_color.png"), seconds, processors, wanted)
    seconds, processors = timed([sys.executable, "-c", MESHLAB, high, low, str(size), "meshlab.png"])
    report("MeshLab", os.path.join(folder, "meshlab.png"), seconds, processors, wanted)


if __name__ == "__main__":
    main()
