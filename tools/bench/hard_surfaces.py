"""Bakes the hard-surface scenes with Kiln and with Blender, and compares rendered normals.

    python tools/bench/hard_surfaces.py --kiln KILN --sample KILN_SAMPLE --out DIR [--size 1024] [--scenes cube,...]

Needs PyPI's `bpy` (5.0.1), numpy and pillow. Prints a table in Markdown, and writes DIR/hard_surfaces.json and, of the
assembly, DIR/hard_surfaces.png: high poly, low poly, Kiln, Kiln's plain cage, Blender with a cage, Blender
without, each with its error. The error is the mean angle to the high poly's normals over all pixels of the 30
views all around that `kiln render --json` compares. All bakers get the same low poly with its split normals, and 3% of the high poly's
diagonal as cage.
"""
import argparse
import json
import pathlib
import subprocess
import time

import bpy
import numpy
from PIL import Image, ImageDraw, ImageFont

CAGE_SHARE = 0.03
SCENES = "cube,cylinder,bracket,bolt,pipe,assembly"
METHODS = ["kiln", "cage auto", "cage 3%", "plain cage", "blender, cage", "blender, no cage"]
COLUMN_TITLES = {"kiln": "Kiln, defaults", "plain cage": "Kiln, plain cage", "blender, cage": "Blender 5, cage",
            "blender, no cage": "Blender 5, no cage"}


def parse_arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kiln", required=True)
    parser.add_argument("--sample", required=True)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--size", default=1024, type=int)
    parser.add_argument("--scenes", default=SCENES)
    return parser.parse_args()


def run(*command):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


def import_mesh(path):
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.wm.obj_import(filepath=str(path), forward_axis="Y", up_axis="Z")
    parts = list(bpy.context.selected_objects)
    bpy.context.view_layer.objects.active = parts[0]
    if len(parts) > 1:
        bpy.ops.object.join()
    return bpy.context.view_layer.objects.active


def measure_diagonal(item):
    corners = numpy.array([list(c) for c in item.bound_box])
    return float(numpy.linalg.norm(corners.max(0) - corners.min(0)))


def bake_with_blender(high_path, low_path, size, cage, out):
    """Bakes from selected to active, with Blender's cage or along the split normals."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    high, low = import_mesh(high_path), import_mesh(low_path)
    image = bpy.data.images.new("normal", size, size, float_buffer=True, is_data=True)
    material = bpy.data.materials.new("bake")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    low.data.materials.clear()
    low.data.materials.append(material)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 1
    high.select_set(True)
    low.select_set(True)
    bpy.context.view_layer.objects.active = low
    start = time.perf_counter()
    bpy.ops.object.bake(
        type="NORMAL",
        normal_space="TANGENT",
        use_selected_to_active=True,
        use_cage=cage,
        cage_extrusion=CAGE_SHARE * measure_diagonal(high),
        max_ray_distance=2 * CAGE_SHARE * measure_diagonal(high),
        margin=16,
    )
    seconds = time.perf_counter() - start
    image.filepath_raw = str(out)
    image.file_format = "OPEN_EXR"
    image.save()
    return seconds


def bake_with_kiln(program, high, low, size, folder, *flags):
    run(program, "bake", high, low, "--size", size, "--format", "exr", "--out", folder, "--quiet", *flags)
    return folder / (low.stem + "_normal.exr")


def measure_rendered_error(program, high, low, normal, draw_comparison):
    """Returns the mean angle of rendered normals in degrees, over all pixels of 30 views from all sides."""
    text = run(program, "render", low, "--normal", normal, "--reference", high, "--out", draw_comparison, "--size", 384,
               "--samples", 1, "--ambient-rays", 0, "--frames", 1, "--quiet", "--json", "-")
    return json.loads(text)["rendered_normals"]["around"]["with_map"]["mean_angle_degrees"]


def split_panels(path):
    """Splits a picture of `kiln render` into the pictures that it shows side by side."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = numpy.array(image.pixels[:], dtype=numpy.float32).reshape(height, width, 4)
    return numpy.split(pixels[:, : width // 3 * 3], 3, axis=1)


def save_picture(parts, columns, path):
    rows = [numpy.concatenate(parts[i : i + columns], axis=1) for i in range(0, len(parts), columns)]
    pixels = numpy.concatenate(rows[::-1], axis=0)
    image = bpy.data.images.new("sheet", pixels.shape[1], pixels.shape[0])
    image.pixels = pixels.ravel()
    image.filepath_raw = str(path)
    image.file_format = "PNG"
    image.save()


def write_labels(path, texts, columns):
    """Writes a text into the upper left corner of each part of a picture, and reduces it to 256 colours."""
    image = Image.open(path).convert("RGB")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=17)
    width, height = image.width // columns, image.height // (len(texts) // columns)
    for i, text in enumerate(texts):
        draw.text((i % columns * width + 10, i // columns * height + 6), text, fill=(40, 40, 40), font=font)
    image.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE).save(path)


def draw_comparison(options, scene, high, low, normals, errors):
    parts = []
    for way in COLUMN_TITLES:
        out = options.out / "panels.png"
        run(options.kiln, "render", low, "--normal", normals[way], "--reference", high, "--out", out,
            "--view", "30,15", "--size", 560, "--quiet")
        drawn = split_panels(out)
        parts += drawn if way == "kiln" else drawn[2:]
    save_picture(parts, 2, options.out / "hard_surfaces.png")
    texts = [f"{COLUMN_TITLES[way]}: {errors[way]:.2f}°" for way in COLUMN_TITLES]
    write_labels(options.out / "hard_surfaces.png", ["High poly", "Low poly", *texts], 2)


def main():
    options = parse_arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    results = {}
    print("| scene | " + " | ".join(METHODS) + " |\n| --- |" + " --: |" * len(METHODS))
    for scene in options.scenes.split(","):
        high, low = options.out / f"{scene}.obj", options.out / f"{scene}_low.obj"
        run(options.sample, "--out", high, "--low", low, "--scene", scene)
        normals = {
            "kiln": bake_with_kiln(options.kiln, high, low, options.size, options.out / "default"),
            "cage auto": bake_with_kiln(options.kiln, high, low, options.size, options.out / "auto", "--cage", "auto"),
            "cage 3%": bake_with_kiln(options.kiln, high, low, options.size, options.out / "wide", "--cage", f"{100 * CAGE_SHARE}%"),
            "plain cage": bake_with_kiln(options.kiln, high, low, options.size, options.out / "cage", "--cage",
                               f"{100 * CAGE_SHARE}%", "--direction", "averaged"),
        }
        seconds = {}
        for way, cage in (("blender, cage", True), ("blender, no cage", False)):
            normals[way] = options.out / f"{scene}_{'cage' if cage else 'plain'}.exr"
            seconds[way] = bake_with_blender(high, low, options.size, cage, normals[way])
        errors = {way: measure_rendered_error(options.kiln, high, low, normals[way], options.out / "view.png")
                  for way in METHODS}
        results[scene] = {"degrees": errors, "blender_seconds": seconds}
        print(f"| {scene} | " + " | ".join(f"{errors[way]:.2f}°" for way in METHODS) + " |", flush=True)
        if scene == "assembly":
            draw_comparison(options, scene, high, low, normals, errors)
    text = {"blender": bpy.app.version_string, "size": options.size, "scenes": results}
    (options.out / "hard_surfaces.json").write_text(json.dumps(text, indent=1) + "\n")


if __name__ == "__main__":
    main()
