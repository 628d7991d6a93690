"""Draws the README's picture: a high poly beside the GLB that Kiln baked of it, both by Blender's Cycles.

    kiln bake urn.ply --faces 3000 --size 2048 --out urn.glb
    python readme_picture.py urn.ply urn.glb ../sample/urn.webp

Needs Blender as a module: pip install bpy==5.0.1 (Python 3.11).
"""

import math
import os
import sys

import bpy
from mathutils import Vector

HIGH, GLB, OUT = map(os.path.abspath, sys.argv[1:4])
WIDE, TALL = 480, 640  # pixels of a panel

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def high_poly():
    """With its vertices' colours, as the PLY has them: Y up, which Blender's importer turns if asked."""
    bpy.ops.wm.ply_import(filepath=HIGH, forward_axis="NEGATIVE_Z", up_axis="Y")
    mesh = bpy.context.selected_objects[0]
    material = bpy.data.materials.new("high")
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = 1  # as the GLB's
    if mesh.data.color_attributes:
        color = material.node_tree.nodes.new("ShaderNodeVertexColor")
        material.node_tree.links.new(color.outputs["Color"], shader.inputs["Base Color"])
    mesh.data.materials.append(material)
    mesh.data.shade_smooth()
    return mesh


def box(mesh):
    corners = [mesh.matrix_world @ Vector(corner) for corner in mesh.bound_box]
    return [Vector(f(corner[k] for corner in corners) for k in range(3)) for f in (min, max)]


high = high_poly()
bpy.ops.import_scene.gltf(filepath=GLB)
low = next(o for o in bpy.context.selected_objects if o.type == "MESH")
bpy.context.view_layer.update()
least, most = box(high)
for other, corner in zip(box(low), (least, most)):
    assert (other - corner).length < 0.1 * (most - least).length, "HIGH and the GLB lie apart"
panel = 1.1 * (most.z - least.z) * WIDE / TALL
view = Vector((0, -math.cos(0.25), math.sin(0.25)))
for mesh, side in (high, -0.5), (low, 0.5):
    mesh.location.x += side * panel - (least.x + most.x) / 2

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.data.type, camera.data.ortho_scale = "ORTHO", 2 * panel
camera.location = Vector((0, *((least + most) / 2).yz)) + 4 * panel * view
camera.rotation_euler = (-view).to_track_quat("-Z", "Y").to_euler()
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.rotation_euler = 2.6, (1, 0, -0.9)
scene.collection.objects.link(camera)
scene.collection.objects.link(sun)
scene.camera = camera
scene.world = bpy.data.worlds.new("sky")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.9, 0.95, 1, 1)
scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.45

scene.render.engine = "CYCLES"
scene.cycles.samples = 32
scene.cycles.use_denoising = False  # it would smooth what is compared
scene.render.resolution_x, scene.render.resolution_y = 2 * WIDE, TALL
scene.view_settings.view_transform = "Standard"
scene.render.image_settings.file_format = "WEBP"
scene.render.image_settings.quality = 85
scene.render.filepath = OUT
bpy.ops.render.render(write_still=True)
print(f"{len(high.data.polygons):,} faces, {len(low.data.polygons):,} with maps: {os.path.getsize(OUT):,} bytes")
