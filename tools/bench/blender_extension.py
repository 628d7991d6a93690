#!/usr/bin/env python3
"""Times the same normal map baked by Cycles and by Kiln's extension in Blender: wall-clock and processor seconds.

    python blender_extension.py HIGH.ply LOW.obj [--sizes 2048,4096] [--runs N] [--json FILE]

Needs PyPI's bpy and the kiln package, of a release build, in one Python. Both are timed from the operator's call to
the image: Kiln's meshes are taken from Blender and its source is built each time. The quickest of N runs of each, in
turns. Cage extrusion 0.02 d and ray distance 0.04 d, d being the high poly's largest extent; margin 16. Maps are
compared where Cycles hit.
"""

import argparse
import json
import sys
import time
import warnings
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "blender"))
import kiln_bake  # noqa: E402

warnings.simplefilter("ignore")


def read_map(path):
    if path.endswith(".ply"):
        bpy.ops.wm.ply_import(filepath=path)
    else:
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    item = bpy.context.selected_objects[0]
    item.data.polygons.foreach_set("use_smooth", np.ones(len(item.data.polygons), bool))
    return item


def time_call(call):
    clock, processor = time.perf_counter(), time.process_time()
    assert call() == {"FINISHED"}
    return time.perf_counter() - clock, time.process_time() - processor


def bake_with_cycles(extent, margin=16):
    return bpy.ops.object.bake(
        type="NORMAL",
        normal_space="TANGENT",
        use_selected_to_active=True,
        cage_extrusion=0.02 * extent,
        max_ray_distance=0.04 * extent,
        margin=margin,
    )


def read_pixels(image):
    array = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(array)
    return array.reshape(-1, 4)


def decode_unit_vectors(map_):
    vectors = 2 * map_[:, :3].astype(np.float64) - 1
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("high")
    parser.add_argument("low")
    parser.add_argument("--sizes", default="2048,4096")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--json", help="file to which the results are appended")
    arguments = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    kiln_bake.register()
    high, low = read_map(arguments.high), read_map(arguments.low)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 1, False
    extent = max(high.dimensions)
    settings = scene.kiln_bake
    settings.cage, settings.max_distance = 0.02 * extent, 0.04 * extent
    for item in (high, low):
        item.select_set(True)
    bpy.context.view_layer.objects.active = low
    for size in map(int, arguments.sizes.split(",")):
        image = bpy.data.images.new(f"cycles {size}", size, size, float_buffer=True, is_data=True)
        material = bpy.data.materials.new("cycles")
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
        settings.size = size
        seconds = {"cycles": [], "kiln": []}
        for _ in range(arguments.runs):
            low.data.materials.clear()
            low.data.materials.append(material)
            material.node_tree.nodes.active = node
            seconds["cycles"].append(time_call(lambda: bake_with_cycles(extent)))
            low.data.materials.clear()
            seconds["kiln"].append(time_call(bpy.ops.kiln.bake))
        low.data.materials.clear()
        low.data.materials.append(material)
        image.generated_color = (0, 0, 0, 0)
        bake_with_cycles(extent, margin=0)  # a margin of 0, since padding is not compared
        low.data.materials.clear()
        theirs, ours = read_pixels(image), read_pixels(bpy.data.images[f"{low.name}_normal"])
        # Cycles writes (0.5, 0.5, 1) where its rays miss
        both = (theirs[:, 3] > 0) & (np.abs(theirs[:, :3] - [0.5, 0.5, 1]).max(1) > 1e-6)
        angles = np.degrees(
            2 * np.arcsin(np.clip(np.linalg.norm(decode_unit_vectors(ours[both]) - decode_unit_vectors(theirs[both]), axis=1) / 2, 0, 1))
        )
        row = {
            "bench": "blender_extension",
            "blender": bpy.app.version_string,
            "size": size,
            "faces": len(high.data.polygons),
        }
        for name, runs in seconds.items():
            row[name] = {"clock_s": round(min(r[0] for r in runs), 3), "processor_s": round(min(r[1] for r in runs), 3)}
            row[name]["first_clock_s"] = round(runs[0][0], 3)
        row["ratio_clock"] = round(row["cycles"]["clock_s"] / row["kiln"]["clock_s"], 2)
        row["ratio_processor"] = round(row["cycles"]["processor_s"] / row["kiln"]["processor_s"], 2)
        row["mean_degrees"] = round(float(angles.mean()), 4)
        row["median_degrees"] = round(float(np.median(angles)), 4)
        print(json.dumps(row), flush=True)
        if arguments.json:
            with open(arguments.json, "a") as file:
                file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
