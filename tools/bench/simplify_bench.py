"""Compares simplification by kiln with meshoptimizer, OpenMesh, MeshLab and Blender, by the rendered result of a bake.

    python3 tools/bench/simplify_bench.py KILN OUT_DIR HIGH.ply ... [--faces 500 2000 5000 10000] [--size 512]
        [--peer build/bench/tools/bench/decimate_peer] [--ways kiln meshlab]
    python3 tools/bench/simplify_bench.py --table ROWS.jsonl

Needs PyPI's numpy and trimesh; rows of pymeshlab and bpy are omitted if these are missing, those of
meshoptimizer and OpenMesh without --peer. bpy and pymeshlab cannot be loaded into one process: select them one at a
time with --ways. Every low poly is processed alike: charts by kiln, normals baked by rays to --size texels a side,
rendered by kiln beside the high poly from 30 directions all around. Prints one JSON line each:

    faces       triangles of the low poly
    seconds     of simplifying alone (kiln: as reported)
    degrees     mean angle between rendered normals and the high poly's, with the map
    silhouette  pixels that only one of the two covers, as a share of those that both cover

--table prints such lines as a table, and how far Kiln is over the best of the others.
"""
import argparse
import json
import os
import subprocess
import sys
import time

import numpy

from charts_bench import read_obj


def write_obj(path, positions, faces):
    with open(path, "w") as file:
        file.writelines("v %.9g %.9g %.9g\n" % tuple(p) for p in positions)
        file.writelines("f %d %d %d\n" % tuple(f) for f in numpy.asarray(faces) + 1)


def simplify_with_kiln(options, high, positions, faces, target, path):
    report = path + ".json"
    subprocess.run([options.kiln, "simplify", high, "--faces", str(target), "--out", path, "--json", report, "--force",
                    "--quiet"], check=True)
    points, _, triangles, _ = read_obj(path)
    write_obj(path, points, triangles)
    with open(report) as file:
        return json.load(file)["seconds"]["simplify"]


def make_peer_call(name):
    """\\param name  a library's name for decimate_peer"""
    def run_peer(options, high, positions, faces, target, path):
        if not options.peer:
            raise ImportError(name)
        welded = os.path.join(options.out, os.path.basename(high) + "_welded.obj")
        if not os.path.exists(welded):
            write_obj(welded, positions, faces)
        done = subprocess.run([options.peer, name, welded, str(target), path], check=True, capture_output=True,
                              text=True)
        return float(done.stdout)
    return run_peer


def simplify_with_meshlab(options, high, positions, faces, target, path):
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(positions.astype(float), faces.astype(numpy.int32)))
    start = time.perf_counter()
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=target)
    seconds = time.perf_counter() - start
    write_obj(path, meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix())
    return seconds


def simplify_with_blender(options, high, positions, faces, target, path):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("high")
    mesh.from_pydata(positions.tolist(), [], faces.tolist())
    item = bpy.data.objects.new("high", mesh)
    bpy.context.collection.objects.link(item)
    modifier = item.modifiers.new("decimate", "DECIMATE")
    modifier.ratio = target / len(faces)
    modifier.use_collapse_triangulate = True
    start = time.perf_counter()
    made = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    seconds = time.perf_counter() - start
    made.calc_loop_triangles()
    write_obj(path, [v.co[:] for v in made.vertices], [t.vertices[:] for t in made.loop_triangles])
    return seconds


SIMPLIFIERS = {"kiln": simplify_with_kiln, "meshoptimizer": make_peer_call("meshoptimizer"), "openmesh": make_peer_call("openmesh"),
        "meshlab": simplify_with_meshlab, "blender": simplify_with_blender}


def measure_quality(kiln, high, low, size, folder):
    def run(*words):
        subprocess.run([kiln, *words], check=True, stdout=subprocess.DEVNULL)

    stem = os.path.splitext(os.path.basename(low))[0] + "_unwrapped"
    run("bake", high, low, "--unwrap=charts", "--match", "ray", "--size", str(size), "--out", folder, "--force",
        "--quiet", "--recall", "0")
    report = os.path.join(folder, stem + ".json")
    run("render", os.path.join(folder, stem + ".obj"), "--normal", os.path.join(folder, stem + "_normal.png"),
        "--reference", high, "--out", os.path.join(folder, stem + ".png"), "--json", report, "--quiet",
        "--size", "64", "--samples", "1", "--ambient-rays", "0", "--frames", "1")
    with open(report) as file:
        rendered = json.load(file)["rendered_normals"]["around"]["with_map"]
    return {"degrees": round(rendered["mean_angle_degrees"], 4),
            "silhouette": round(rendered["one_sided_pixels"] / rendered["pixels"], 5)}


def read_high(path):
    """Reads a mesh and welds it, without normals and UVs."""
    import trimesh

    mesh = trimesh.load(path, process=False, force="mesh")
    points, numbers = numpy.unique(numpy.asarray(mesh.vertices, numpy.float32), axis=0, return_inverse=True)
    faces = numbers.ravel()[numpy.asarray(mesh.faces)]
    kiln_ratio = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return points, faces[kiln_ratio]


def print_table(path):
    """Prints a row for each mesh and number of faces: the errors of normals and silhouettes of every simplifier, then the worse of Kiln's two ratios to the best of the others."""
    rows, ways = {}, []
    with open(path) as file:
        for line in file:
            row = json.loads(line)
            rows.setdefault((row["mesh"], row["asked"]), {})[row["way"]] = row
            if row["way"] not in ways:
                ways.append(row["way"])
    print("| mesh | faces | " + " | ".join(ways) + " | over the best |")
    print("| --- | --: |" + " --- |" * len(ways) + " --- |")
    for (mesh, asked), found in rows.items():
        cells = []
        for way in ways:
            row = found.get(way)
            exact = row and row["faces"] <= 1.01 * asked
            cells.append("-" if not row else "%.3g°, %.2f%%%s" % (row["degrees"], 100 * row["silhouette"],
                                                                 "" if exact else " (%d faces)" % row["faces"]))
        over = []
        for figure in ("degrees", "silhouette"):
            others = [row[figure] for way, row in found.items() if way != "kiln" and row["faces"] <= 1.01 * asked]
            best = min(others, default=0)
            over.append("%.2f" % (found["kiln"][figure] / best) if best and "kiln" in found else "-")
        print("| %s | %d | %s | %s |" % (mesh, asked, " | ".join(cells), ", ".join(over)))


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--table":
        print_table(sys.argv[2])
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kiln")
    parser.add_argument("out")
    parser.add_argument("high", nargs="+")
    parser.add_argument("--faces", type=int, nargs="+", default=[500, 2000, 5000, 10000])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--peer", help="the program decimate_peer")
    parser.add_argument("--ways", nargs="+", choices=list(SIMPLIFIERS), default=list(SIMPLIFIERS))
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    for high in options.high:
        positions, faces = read_high(high)
        name = os.path.splitext(os.path.basename(high))[0]
        for target in [count for count in options.faces if count < len(faces)]:
            for way in options.ways:
                make = SIMPLIFIERS[way]
                path = os.path.join(options.out, "%s_%d_%s.obj" % (name, target, way))
                try:
                    seconds = make(options, high, positions, faces, target, path)
                except ImportError:
                    continue
                row = {"mesh": name, "way": way, "asked": target, "faces": len(read_obj(path)[2]), "seconds": round(seconds, 3)}
                row.update(measure_quality(options.kiln, high, path, options.size, options.out))
                print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
