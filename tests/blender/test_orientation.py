"""Tangents of a GLB, by Blender's own shading of its normal map."""

import math

import bpy
import kiln
import numpy as np
from conftest import pixels_of

CELLS = [(k % 4, k // 4) for k in range(8)]
GAP = 1.2  # between squares
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
SLOPE = np.array([0.3, 0.15])  # of the high poly over each square


def turned(uv, k):
    """The square's UVs by quarter turns; the last four are mirrored."""
    uv = uv - 0.5
    if k >= 4:
        uv = uv * [-1, 1]
    for _ in range(k % 4):
        uv = np.stack([-uv[:, 1], uv[:, 0]], axis=1)
    return uv + 0.5


def squares(height):
    places, uvs, faces = [], [], []
    for k, (x, y) in enumerate(CELLS):
        places += [[GAP * x + a, GAP * y + b, height((a, b))] for a, b in CORNERS]
        uvs += ((np.array([x, y]) + 0.1 + 0.8 * turned(CORNERS, k)) / [4, 2]).tolist()
        faces += [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]
    return kiln.Mesh(places, faces, uvs=uvs)


def shade_normals(scene, to):
    """Renders the normals that the materials' maps give, n/2 + 1/2, seen along -y. \\returns (H, W, 4)"""
    for material in bpy.data.materials:
        tree = material.node_tree
        maps = [node for node in tree.nodes if node.type == "NORMAL_MAP"] if tree else []
        if not maps:
            continue
        half = tree.nodes.new("ShaderNodeVectorMath")
        half.operation = "MULTIPLY_ADD"
        half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
        light = tree.nodes.new("ShaderNodeEmission")
        (end,) = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]
        tree.links.new(maps[0].outputs[0], half.inputs[0])
        tree.links.new(half.outputs[0], light.inputs[0])
        tree.links.new(light.outputs[0], end.inputs["Surface"])
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", 5
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.collection.objects.link(scene.camera)
    scene.camera.location = (1.5 * GAP + 0.5, -5, 0.5 * GAP + 0.5)
    scene.camera.rotation_euler = (math.pi / 2, 0, 0)
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 1, False
    scene.render.film_transparent = True
    scene.render.resolution_x, scene.render.resolution_y = 500, 250
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(to)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(to))
    image.colorspace_settings.name = "Non-Color"
    return pixels_of(image)


def test_all_eight_orientations_shade_alike(scene, tmp_path):
    """A map over UVs turned and mirrored in each way gives the slope's normal, within a step of 8 bits."""
    low = squares(lambda at: 0.0)
    high = squares(lambda at: float(SLOPE @ (np.array(at) - 0.5)))
    baked = kiln.bake(high, low, size=(512, 256), maps=["normal"], max_distance=0.5)
    kiln.pack_glb(low, {"normal": baked.stored("normal")}, path=tmp_path / "squares.glb")
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "squares.glb"))
    shaded = shade_normals(scene, tmp_path / "shaded.exr")
    normal = np.array([*-SLOPE, 1]) / math.hypot(*SLOPE, 1)
    wanted = 0.5 + 0.5 * np.array([normal[0], -normal[2], normal[1]])  # Blender turns Y up into Z up
    for x, y in CELLS:
        column, row = round(100 * (GAP * x + 0.7)), round(100 * (GAP * y + 0.65))  # 100 pixels a unit
        square = shaded[row - 35 : row + 35, column - 35 : column + 35]
        assert (square[..., 3] == 1).all(), (x, y)
        assert abs(square[..., :3] - wanted).max() <= 1 / 255, (x, y)
