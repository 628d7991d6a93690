"""Compares UVs by kiln with xatlas and Blender's Smart UV Project, on the same low poly in one run.

    python3 tools/bench/charts_bench.py KILN HIGH.ply OUT_DIR [--faces 3000 5000] [--size 2048] [--bake 512]

Needs PyPI's numpy and xatlas; Blender's rows need bpy, and are left out where it is missing. For each number of
faces: the low poly of `kiln simplify`, laid out four ways with the same padding (size / 256 texels, as
`kiln simplify` does), then baked and rendered by kiln. Prints one JSON line a layout:

    vertices  after splitting at UV seams, over positions
    used      share of the square map that triangles cover
    seam      share of the length of all edges
    charts    pieces connected by edges
    seconds   of laying out alone, best of three (kiln: as reported)
    degrees   mean angle between rendered normals and the high poly's, map of --bake texels a side
    overlap   texels of --size that two triangles cover, centre by centre (0 for all but faults)
"""
import argparse
import json
import os
import subprocess
import tempfile
import time

import numpy
import xatlas


def read_obj(path):
    """Reads positions, UVs, and for each corner the indices of both (-1 if it has no UV)."""
    positions, uvs, corners = [], [], []
    with open(path) as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                positions.append([float(x) for x in words[1:4]])
            elif words[0] == "vt":
                uvs.append([float(x) for x in words[1:3]])
            elif words[0] == "f":
                parts = [word.split("/") for word in words[1:4]]
                corners.append([(int(p[0]) - 1, int(p[1]) - 1 if len(p) > 1 and p[1] else -1) for p in parts])
    corners = numpy.array(corners)
    return numpy.array(positions), numpy.array(uvs).reshape(-1, 2), corners[:, :, 0], corners[:, :, 1]


def write_obj(path, positions, faces, uvs, uv_faces):
    with open(path, "w") as file:
        file.writelines("v %.9g %.9g %.9g\n" % tuple(p) for p in positions)
        file.writelines("vt %.9g %.9g\n" % tuple(p) for p in uvs)
        for face, uv in zip(faces + 1, uv_faces + 1):
            file.write("f " + " ".join("%d/%d" % pair for pair in zip(face, uv)) + "\n")


def measure_layout(positions, faces, uvs, uv_faces, size):
    pairs = numpy.unique(numpy.stack([faces.ravel(), uv_faces.ravel()], 1), axis=0)
    corners = uvs[uv_faces]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * numpy.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    edges, root = {}, list(range(len(faces)))

    def find_root(t):
        while root[t] != t:
            root[t] = root[root[t]]
            t = root[t]
        return t

    for t, (face, uv) in enumerate(zip(faces, uv_faces)):
        for k in range(3):
            ends = sorted([(face[k], uv[k]), (face[(k + 1) % 3], uv[(k + 1) % 3])])
            edges.setdefault((ends[0][0], ends[1][0]), []).append((ends[0][1], ends[1][1], t))
    seam = total = 0.0
    for (i, j), sides in edges.items():
        length = float(numpy.linalg.norm(positions[i] - positions[j]))
        total += length
        if len(sides) == 2:
            if sides[0][:2] == sides[1][:2]:
                root[find_root(sides[0][2])] = find_root(sides[1][2])
            else:
                seam += length
    return {
        "charts": len({find_root(t) for t in range(len(faces))}),
        "vertices": round(len(pairs) / len(numpy.unique(faces)), 3),
        "used": round(float(area.sum()), 4),
        "seam": round(seam / total, 4),
        "overlap": measure_overlap(corners * size, size),
    }


def measure_overlap(corners, size):
    count = numpy.zeros((size, size), numpy.uint8)
    for p in corners:
        x0, y0 = numpy.maximum(numpy.floor(p.min(0)).astype(int), 0)
        x1, y1 = numpy.minimum(numpy.ceil(p.max(0)).astype(int), size)
        if x1 <= x0 or y1 <= y0:
            continue
        x, y = numpy.meshgrid(numpy.arange(x0, x1) + 0.5, numpy.arange(y0, y1) + 0.5)
        side = [(p[(k + 1) % 3][0] - p[k][0]) * (y - p[k][1]) - (p[(k + 1) % 3][1] - p[k][1]) * (x - p[k][0])
                for k in range(3)]
        inside = numpy.all([s > 0 for s in side], 0) | numpy.all([s < 0 for s in side], 0)
        count[y0:y1, x0:x1] += inside.astype(numpy.uint8)
    return int((count > 1).sum())


def unwrap_with_xatlas(positions, faces, size, padding):
    """Adjusts the scale until the atlas fits the square, since xatlas takes either a scale or a size."""
    chart_seconds, best = None, None
    low, high = 0.05, 1.0
    edges = positions[faces]
    area = 0.5 * numpy.linalg.norm(numpy.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0]), axis=1).sum()
    for _ in range(8):
        used = 0.5 * (low + high)
        atlas = xatlas.Atlas()
        atlas.add_mesh(positions.astype(numpy.float32), faces.astype(numpy.uint32))
        options = xatlas.PackOptions()
        options.padding = padding
        options.resolution = 0
        options.texels_per_unit = float(numpy.sqrt(used / area) * size)
        start = time.perf_counter()
        atlas.generate(pack_options=options)
        seconds = time.perf_counter() - start
        chart_seconds = seconds if chart_seconds is None else min(chart_seconds, seconds)
        if max(atlas.width, atlas.height) <= size and atlas.atlas_count == 1:
            low = used
            origin, indices, uvs = atlas[0]
            best = uvs * [atlas.width / size, atlas.height / size], indices
        else:
            high = used
    return best[0], best[1].astype(int), chart_seconds


def unwrap_with_blender(path, size, padding):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    positions, _, faces, _ = read_obj(path)
    mesh = bpy.data.meshes.new("low")
    mesh.from_pydata(positions.tolist(), [], faces.tolist())
    item = bpy.data.objects.new("low", mesh)
    bpy.context.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    best = None
    for _ in range(3):
        start = time.perf_counter()
        bpy.ops.uv.smart_project(island_margin=padding / size, margin_method="FRACTION")
        seconds = time.perf_counter() - start
        best = seconds if best is None else min(best, seconds)
    bpy.ops.object.mode_set(mode="OBJECT")
    corners = numpy.array([loop.uv[:] for loop in mesh.uv_layers.active.data]).reshape(-1, 2)
    uvs, indices = numpy.unique(numpy.round(corners, 7), axis=0, return_inverse=True)
    return uvs, indices.reshape(-1, 3), best


def measure_rendered_degrees(kiln, high, low, size, folder):
    run = lambda *words: subprocess.run([kiln, *words], check=True, stdout=subprocess.DEVNULL)
    stem = os.path.splitext(os.path.basename(low))[0]
    run("bake", high, low, "--size", str(size), "--out", folder, "--force", "--quiet")
    report = os.path.join(folder, "look.json")
    run("render", low, "--normal", os.path.join(folder, stem + "_normal.png"), "--reference", high,
        "--out", os.path.join(folder, stem + ".png"), "--json", report, "--quiet")
    with open(report) as file:
        return round(json.load(file)["rendered_normals"]["with_map"]["mean_angle_degrees"], 3)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kiln")
    parser.add_argument("high")
    parser.add_argument("out")
    parser.add_argument("--faces", type=int, nargs="+", default=[3000, 5000])
    parser.add_argument("--size", type=int, default=2048)
    parser.add_argument("--bake", type=int, default=512)
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    padding = max(2, options.size // 256)
    for faces in options.faces:
        layouts = {}
        for method in ("charts", "pairs"):
            path = os.path.join(options.out, "%s_%d.obj" % (method, faces))
            with tempfile.NamedTemporaryFile(suffix=".json") as report:
                subprocess.run([options.kiln, "simplify", options.high, "--faces", str(faces), "--size",
                                str(options.size), "--unwrap", method, "--out", path, "--json", report.name,
                                "--force", "--quiet"], check=True)
                seconds = json.load(open(report.name))["seconds"]["unwrap"]
            layouts[method] = path, seconds
        positions, _, triangles, _ = read_obj(layouts["charts"][0])
        peers = {"xatlas": lambda: unwrap_with_xatlas(positions, triangles, options.size, padding),
                 "blender": lambda: unwrap_with_blender(layouts["charts"][0], options.size, padding)}
        for name, peer in peers.items():
            try:
                uvs, uv_faces, seconds = peer()
            except ImportError:
                continue
            path = os.path.join(options.out, "%s_%d.obj" % (name, faces))
            write_obj(path, positions, triangles, uvs, uv_faces)
            layouts[name] = path, seconds
        for name, (path, seconds) in layouts.items():
            positions, uvs, triangles, uv_faces = read_obj(path)
            row = {"layout": name, "faces": len(triangles), "padding": padding, "seconds": round(seconds, 3)}
            row.update(measure_layout(positions, triangles, uvs, uv_faces, options.size))
            row["degrees"] = measure_rendered_degrees(options.kiln, options.high, path, options.bake, options.out)
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
