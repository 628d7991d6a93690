"""Compares simplification by kiln with meshoptimizer, MeshLab and Blender, by what the baked result looks like.

    python3 tools/bench/simplify_bench.py KILN OUT_DIR HIGH.ply ... [--faces 500 2000 10000] [--size 512]

Needs PyPI's numpy and trimesh; rows of meshoptimizer, pymeshlab and bpy are left out where these are missing.
bpy and pymeshlab may not load into one process: ask for them one at a time with --ways. Every
low poly goes the same way: charts by kiln, normals baked by rays to --size texels a side, rendered by
kiln beside the high poly. Prints one JSON line each:

    faces       triangles of the low poly
    seconds     of simplifying alone (kiln: as reported)
    degrees     mean angle between rendered normals and the high poly's, with the map
    silhouette  pixels that only one of the two covers, as a share of those that both cover
"""
import argparse
import json
import os
import subprocess
import time

import numpy

from charts_bench import read_obj


def write_obj(path, positions, faces):
    with open(path, "w") as file:
        file.writelines("v %.9g %.9g %.9g\n" % tuple(p) for p in positions)
        file.writelines("f %d %d %d\n" % tuple(f) for f in numpy.asarray(faces) + 1)


def by_kiln(kiln, high, positions, faces, target, path):
    report = path + ".json"
    subprocess.run([kiln, "simplify", high, "--faces", str(target), "--out", path, "--json", report, "--force",
                    "--quiet"], check=True)
    points, _, triangles, _ = read_obj(path)
    write_obj(path, points, triangles)
    with open(report) as file:
        return json.load(file)["seconds"]["simplify"]


def by_meshoptimizer(kiln, high, positions, faces, target, path):
    import meshoptimizer

    points = numpy.ascontiguousarray(positions, numpy.float32)
    indices = numpy.ascontiguousarray(faces, numpy.uint32).ravel()
    out = numpy.zeros_like(indices)
    start = time.perf_counter()
    count = meshoptimizer.simplify(out, indices, points, target_index_count=3 * target, target_error=1.0)
    seconds = time.perf_counter() - start
    used, numbers = numpy.unique(out[:count], return_inverse=True)
    write_obj(path, points[used], numbers.reshape(-1, 3))
    return seconds


def by_meshlab(kiln, high, positions, faces, target, path):
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(positions.astype(float), faces.astype(numpy.int32)))
    start = time.perf_counter()
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=target)
    seconds = time.perf_counter() - start
    write_obj(path, meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix())
    return seconds


def by_blender(kiln, high, positions, faces, target, path):
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


WAYS = {"kiln": by_kiln, "meshoptimizer": by_meshoptimizer, "meshlab": by_meshlab, "blender": by_blender}


def rate(kiln, high, low, size, folder):
    def run(*words):
        subprocess.run([kiln, *words], check=True, stdout=subprocess.DEVNULL)

    stem = os.path.splitext(os.path.basename(low))[0] + "_unwrapped"
    run("bake", high, low, "--unwrap=charts", "--match", "ray", "--size", str(size), "--out", folder, "--force",
        "--quiet")
    report = os.path.join(folder, stem + ".json")
    run("render", os.path.join(folder, stem + ".obj"), "--normal", os.path.join(folder, stem + "_normal.png"),
        "--reference", high, "--out", os.path.join(folder, stem + ".png"), "--json", report, "--quiet")
    with open(report) as file:
        rendered = json.load(file)["rendered_normals"]["with_map"]
    return {"degrees": round(rendered["mean_angle_degrees"], 3),
            "silhouette": round(rendered["one_sided_pixels"] / rendered["pixels"], 5)}


def read_high(path):
    """Welded, without normals and UVs."""
    import trimesh

    mesh = trimesh.load(path, process=False, force="mesh")
    points, numbers = numpy.unique(numpy.asarray(mesh.vertices, numpy.float32), axis=0, return_inverse=True)
    faces = numbers.ravel()[numpy.asarray(mesh.faces)]
    good = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return points, faces[good]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kiln")
    parser.add_argument("out")
    parser.add_argument("high", nargs="+")
    parser.add_argument("--faces", type=int, nargs="+", default=[500, 2000, 10000])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--ways", nargs="+", choices=list(WAYS), default=list(WAYS))
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    for high in options.high:
        positions, faces = read_high(high)
        name = os.path.splitext(os.path.basename(high))[0]
        for target in options.faces:
            for way in options.ways:
                make = WAYS[way]
                path = os.path.join(options.out, "%s_%d_%s.obj" % (name, target, way))
                try:
                    seconds = make(options.kiln, high, positions, faces, target, path)
                except ImportError:
                    continue
                row = {"mesh": name, "way": way, "faces": len(read_obj(path)[2]), "seconds": round(seconds, 3)}
                row.update(rate(options.kiln, high, path, options.size, options.out))
                print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
