"""Compares the transfer of a texture by kiln with MeshLab's, by seconds and by error against the exact integral.

    python3 tools/bench/transfer_bench.py KILN OUT_DIR [--size 4096] [--grid 187] [--repeat 3]

Needs PyPI's numpy, pymeshlab and Pillow. HIGH is a flat square (tilted, since MeshLab
finds nothing on one whose box is flat) of 2 GRID x GRID triangles whose UVs fill the
texture. LOW is the same square of two triangles, its chart turned by 30 degrees: a texel is a turned square of
1.37 pixels of the texture. The texture is a sum of waves, each pixel their exact mean over the pixel, in 8 bits,
read as numbers (kiln: linear). So the exact mean over a texel's own area is known: that of each wave is the wave at
the texel's middle times two sincs.

Prints one JSON line each:

    seconds   of the whole transfer with its file, by the clock, and cpu_seconds of all cores: the median run
    rms, max  difference to the exact mean, of 255, over texels whose area lies within the chart
    unfilled  such texels that are further off than half of the pattern's range: background, or another place
"""
import argparse
import json
import os
import resource
import subprocess
import time

import numpy
from PIL import Image

CHART_ANGLE = numpy.radians(30)
CHART_SIDE = 0.98 / (numpy.cos(CHART_ANGLE) + numpy.sin(CHART_ANGLE))  # side of the chart in UVs
CHART_AXES = numpy.array([[numpy.cos(CHART_ANGLE), numpy.sin(CHART_ANGLE)], [-numpy.sin(CHART_ANGLE), numpy.cos(CHART_ANGLE)]]) * CHART_SIDE
# Waves over the texture: cycles per pixel in u and in v, amplitude, phase. At most 0.45 cycles per pixel.
TEXTURE_WAVES = [(0.001, 0.0007, 40, 0.1), (0.013, -0.021, 25, 1.0), (0.11, 0.07, 20, 2.0), (-0.19, 0.23, 15, 0.7),
         (0.31, 0.29, 10, 0.3), (0.45, -0.05, 8, 2.9)]


def average_pattern(points, size, area):
    """Returns the means of the texture over parallelograms at points (u, v). \\param area  two edges, in UVs"""
    total = numpy.full(points.shape[:-1], 128.0)
    for u, v, strength, phase in TEXTURE_WAVES:
        wave = numpy.array([u, v]) * size
        weight = strength * numpy.prod(numpy.sinc(numpy.asarray(area) @ wave))
        total += weight * numpy.cos(2 * numpy.pi * (points @ wave) + phase)
    return total


def texel_centres(size, rows):
    """Returns the UVs of texel centres, the first row at the top (v = 1)."""
    u = (numpy.arange(size) + 0.5) / size
    v = 1 - (rows + 0.5) / size
    return numpy.stack(numpy.meshgrid(u, v), axis=-1)


def write_scene(folder, size, grid):
    texture = numpy.empty((size, size), numpy.uint8)
    for first in range(0, size, 256):
        rows = numpy.arange(first, min(first + 256, size))
        texture[rows] = numpy.rint(average_pattern(texel_centres(size, rows), size, numpy.eye(2) / size))
    Image.fromarray(numpy.repeat(texture[..., None], 3, axis=-1)).save(folder + "/pattern.png")
    with open(folder + "/high.mtl", "w") as file:
        file.write("newmtl pattern\nmap_Kd pattern.png\n")
    steps = numpy.linspace(0, 1, grid + 1)
    with open(folder + "/high.obj", "w") as file:
        file.write("mtllib high.mtl\n")
        file.writelines("v %.9g %.9g %.9g\n" % (x, 0.8 * y, 0.6 * y) for y in steps for x in steps)
        file.writelines("vt %.9g %.9g\n" % (x, y) for y in steps for x in steps)
        file.write("usemtl pattern\n")
        for y in range(grid):
            for x in range(grid):
                a = y * (grid + 1) + x + 1
                b, c, d = a + 1, a + grid + 2, a + grid + 1
                file.write("f %d/%d %d/%d %d/%d\nf %d/%d %d/%d %d/%d\n" % (a, a, b, b, c, c, a, a, c, c, d, d))
    with open(folder + "/low.obj", "w") as file:
        corners = numpy.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        file.writelines("v %.9g %.9g %.9g\n" % (x, 0.8 * y, 0.6 * y) for x, y in corners)
        file.writelines("vt %.9g %.9g\n" % tuple(uv) for uv in (corners - 0.5) @ CHART_AXES + 0.5)
        file.write("f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")


def measure_error(path, size):
    """Returns the root mean square error, the maximum error, and the number of unfilled texels."""
    back = numpy.linalg.inv(CHART_AXES)
    area = back / size  # the two edges of a texel in UVs
    image = Image.open(path)
    squares, count, max_error, unfilled = 0.0, 0, 0.0, 0
    half = numpy.abs(back).sum(axis=0) / size / 2
    pixels = numpy.asarray(image)
    pixels = pixels[..., 0] if pixels.ndim == 3 else pixels
    scale = 255 / (65535 if pixels.dtype != numpy.uint8 else 255)
    for first in range(0, size, 256):
        rows = numpy.arange(first, min(first + 256, size))
        points = (texel_centres(size, rows) - 0.5) @ back + 0.5
        inside = numpy.all((points > half) & (points < 1 - half), axis=-1)
        if not inside.any():
            continue
        off = numpy.abs(pixels[rows][inside] * scale - average_pattern(points[inside], size, area))
        squares, count = squares + float((off ** 2).sum()), count + off.size
        max_error, unfilled = max(max_error, float(off.max())), unfilled + int((off > 118).sum())
    return {"rms": round((squares / count) ** 0.5, 3), "max": round(max_error, 2), "unfilled": unfilled, "texels": count}


def bake_with_kiln(kiln, folder, size):
    out = folder + "/kiln"
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([kiln, "bake", folder + "/high.obj", folder + "/low.obj", "--size", str(size), "--maps", "mask",
                    "--transfer", folder + "/pattern.png:pattern:linear", "--format", "png8", "--out", out,
                    "--quiet"], check=True, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (time.perf_counter() - start, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            out + "/low_pattern.png")


def bake_with_meshlab(folder, size):
    import pymeshlab

    start, processors = time.perf_counter(), time.process_time()
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(folder + "/high.obj")
    meshes.load_new_mesh(folder + "/low.obj")
    meshes.apply_filter("compute_texcoord_transfer_wedge_to_vertex")
    meshes.apply_filter("transfer_attributes_to_texture_per_vertex", sourcemesh=0, targetmesh=1,
                        attributeenum="Texture Color", textname="meshlab.png", textw=size, texth=size,
                        overwrite=False, pullpush=True)
    os.makedirs(folder + "/meshlab", exist_ok=True)
    meshes.save_current_mesh(folder + "/meshlab/low.obj")
    return time.perf_counter() - start, time.process_time() - processors, folder + "/meshlab/meshlab.png"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kiln")
    parser.add_argument("folder")
    parser.add_argument("--size", type=int, default=4096)
    parser.add_argument("--grid", type=int, default=187)
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    folder, size = os.path.abspath(arguments.folder), arguments.size
    os.makedirs(folder, exist_ok=True)
    write_scene(folder, size, arguments.grid)
    bakers = {"kiln": lambda: bake_with_kiln(arguments.kiln, folder, size), "MeshLab": lambda: bake_with_meshlab(folder, size)}
    runs = {name: [] for name in bakers}
    bake_with_kiln(arguments.kiln, folder, size)  # compiles the kernels
    for _ in range(arguments.repeat):  # alternates between both programs
        for name, way in bakers.items():
            runs[name].append(way())
    for name, all_runs in runs.items():
        seconds, _, path = sorted(all_runs)[(len(all_runs) - 1) // 2]
        cpu = sorted(run[1] for run in all_runs)[(len(all_runs) - 1) // 2]
        print(json.dumps({"program": name, "size": size, "seconds": round(seconds, 3), "cpu_seconds": round(cpu, 3),
                          **measure_error(path, size)}), flush=True)


if __name__ == "__main__":
    main()
