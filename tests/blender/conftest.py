"""The extension, registered as Blender registers it, and scenes by formula."""

import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender as a module (PyPI's bpy) is not installed.")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "blender"))
import kiln_bake


@pytest.fixture(autouse=True)
def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    kiln_bake.register()
    yield bpy.context.scene
    kiln_bake.unregister()


def sheet(name, n, height=lambda x, y: 0 * x, uvs=True, move=(0, 0, 0), quads=True):
    """n x n cells over the unit square, as an object with smooth normals."""
    steps = np.linspace(0, 1, n + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps))
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], axis=1)
    if not quads:
        faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.stack([x, y, height(x, y)], axis=1).tolist(), [], faces.tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    if uvs:
        layer = mesh.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", np.stack([x, y], axis=1)[faces.ravel()].astype(np.float32).ravel())
    item = bpy.data.objects.new(name, mesh)
    item.location = move
    bpy.context.collection.objects.link(item)
    return item


def choose(active, *others):
    bpy.ops.object.select_all(action="DESELECT")
    for item in (*others, active):
        item.select_set(True)
    bpy.context.view_layer.objects.active = active


def pixels_of(image):
    """(H, W, 4), row 0 at the bottom."""
    array = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(array)
    return array.reshape(image.size[1], image.size[0], 4)


def bump(x, y):
    return 0.02 * np.sin(9 * x + 1) * np.cos(7 * y)


def cycles_normals(low, high, size, cage, distance):
    """What Cycles bakes: (H, W, 4)."""
    image = bpy.data.images.new("cycles", size, size, float_buffer=True, is_data=True)
    material = bpy.data.materials.new("cycles")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    low.data.materials.clear()
    low.data.materials.append(material)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", 1
    scene.cycles.use_denoising = False
    choose(low, *high)
    bpy.ops.object.bake(
        type="NORMAL",
        normal_space="TANGENT",
        use_selected_to_active=True,
        cage_extrusion=cage,
        max_ray_distance=distance,
        margin=0,
    )
    low.data.materials.clear()
    return pixels_of(image)
