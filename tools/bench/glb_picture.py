"""Draws the README's picture: a dense GLB, the GLB that Kiln makes of it, and the same without its materials.

    python glb_picture.py KILN KILN_SAMPLE PICTURE.png

Needs Blender as a module: pip install bpy==5.0.1 (Python 3.11). Cycles renders the files as they are imported; the
dense one's vertex colours, which the importer leaves unused, are put on a plain material. Takes a few minutes.
"""

import math
import os
import subprocess
import sys
import tempfile

import bpy
import mathutils

KILN_PROGRAM, SAMPLE_PROGRAM, PICTURE_PATH = (os.path.abspath(path) for path in sys.argv[1:4])
WIDTH, HEIGHT, SAMPLES = 418, 640, 64  # pixels of each of the three pictures, and samples per pixel


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def clear_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def mesh_objects():
    return [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]


def make_plain_material(color=None):
    made = bpy.data.materials.new("plain")
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = 0.9
    if color is None:
        shader.inputs["Base Color"].default_value = (0.55, 0.47, 0.4, 1)
    else:
        node = made.node_tree.nodes.new("ShaderNodeVertexColor")
        node.layer_name = color
        made.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    for thing in mesh_objects():
        thing.data.materials.clear()
        thing.data.materials.append(made)


def add_light(name, strength, toward, size):
    data = bpy.data.lights.new(name, "SUN")
    data.energy, data.angle = strength, size
    thing = bpy.data.objects.new(name, data)
    thing.rotation_euler = mathutils.Vector(toward).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(thing)


def render(path):
    scene = bpy.context.scene
    corners = [thing.matrix_world @ mathutils.Vector(corner) for thing in mesh_objects() for corner in thing.bound_box]
    low = [min(c[k] for c in corners) for k in range(3)]
    high = [max(c[k] for c in corners) for k in range(3)]
    middle = mathutils.Vector([(a + b) / 2 for a, b in zip(low, high)])
    size = high[2] - low[2]
    data = bpy.data.cameras.new("camera")
    camera = bpy.data.objects.new("camera", data)
    data.lens, data.sensor_fit, data.sensor_height = 85, "VERTICAL", 24
    away = mathutils.Vector((0.25, -1, 0.28)).normalized()
    camera.location = middle + away * size * 1.12 * 85 / 24
    camera.rotation_euler = (-away).to_track_quat("-Z", "Y").to_euler()
    data.clip_end = 100 * size
    scene.collection.objects.link(camera)
    scene.camera = camera
    add_light("key", 3.2, (0.7, 0.8, -0.7), math.radians(4))
    add_light("rim", 1.2, (-1, -0.3, -0.2), math.radians(20))
    world = scene.world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.82, 0.84, 0.87, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.55
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, True
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.image_settings.file_format, scene.render.filepath = "PNG", path
    bpy.ops.render.render(write_still=True)


def main():
    with tempfile.TemporaryDirectory() as folder:
        ply, statue, game = (os.path.join(folder, name) for name in ("urn.ply", "statue.glb", "game.glb"))
        run(SAMPLE_PROGRAM, "--colors", "stone", "--out", ply)
        clear_scene()
        bpy.ops.wm.ply_import(filepath=ply, forward_axis="NEGATIVE_Z", up_axis="Y")
        bpy.ops.export_scene.gltf(filepath=statue, export_vertex_color="ACTIVE",
                                  export_all_vertex_colors=True, export_active_vertex_color_when_no_material=True)
        run(KILN_PROGRAM, "bake", statue, "--faces", 5000, "--size", 2048, "--out", game)
        panels = [os.path.join(folder, name) for name in ("a.png", "b.png", "c.png")]
        clear_scene()
        bpy.ops.import_scene.gltf(filepath=statue)
        make_plain_material(mesh_objects()[0].data.color_attributes[0].name)
        render(panels[0])
        clear_scene()
        bpy.ops.import_scene.gltf(filepath=game)
        make_plain_material()
        for thing in mesh_objects():
            thing.data.shade_flat()
        render(panels[1])
        clear_scene()
        bpy.ops.import_scene.gltf(filepath=game)
        render(panels[2])
        join_pictures(panels)
        faces = [sum(len(thing.data.polygons) for thing in mesh_objects()), os.path.getsize(statue), os.path.getsize(game)]
        print("faces of game.glb %d, bytes of statue.glb %d and game.glb %d" % tuple(faces))


def join_pictures(panels):
    """Joins the pictures side by side on a pale background."""
    import numpy

    ground = numpy.array([0.93, 0.935, 0.945], numpy.float32)
    rows = []
    for path in panels:
        image = bpy.data.images.load(path)
        pixels = numpy.array(image.pixels[:], numpy.float32).reshape(HEIGHT, WIDTH, 4)
        alpha = pixels[..., 3:]
        rows.append(pixels[..., :3] * alpha + ground * (1 - alpha))
    all_three = numpy.concatenate(rows, axis=1)
    picture = bpy.data.images.new("all", 3 * WIDTH, HEIGHT)
    picture.pixels = numpy.concatenate([all_three, numpy.ones_like(all_three[..., :1])], axis=2).ravel()
    picture.filepath_raw, picture.file_format = PICTURE_PATH, os.path.splitext(PICTURE_PATH)[1][1:].upper()
    picture.save(quality=90)


main()
