"""Writes one scene of a high poly as GLB, glTF, FBX and OBJ, and its low poly, as Blender exports them.

    python blender_twins.py FOLDER

Needs Blender as a module: pip install bpy==5.0.1 (Python 3.11). tests/data/twins is what it wrote.
The scenes: three objects, one a mirrored instance of another, one turned and scaled under a parent; two materials, each
with a picture. All faces are triangles, since Blender cuts polygons for glTF and leaves them whole for FBX and OBJ.
"""

import math
import os
import sys

import bpy

OUTPUT_FOLDER = os.path.abspath(sys.argv[1])
PICTURE_SIDE = 8  # side of the pictures in texels


def make_picture(name, low, high):
    image = bpy.data.images.new(name, PICTURE_SIDE, PICTURE_SIDE)
    pixels = []
    for y in range(PICTURE_SIDE):
        for x in range(PICTURE_SIDE):
            share = (x + y) / (2 * PICTURE_SIDE - 2)
            pixels += [a + (b - a) * share for a, b in zip(low, high)] + [1]
    image.pixels = pixels
    image.filepath_raw = os.path.join(OUTPUT_FOLDER, name + ".png")
    image.file_format = "PNG"
    image.save()
    return bpy.data.images.load(image.filepath_raw)


def make_material(name, image):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    made.node_tree.links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return made


def make_dome(name, sides, rings, bumps, offset, of):
    """Makes a closed ball of triangles with bumps; its UVs fill a strip of the unit square that starts at `offset`."""
    vertices, faces, uvs = [], [], []
    for i in range(rings + 1):
        polar = math.pi * (0.02 + 0.96 * i / rings)
        for j in range(sides):
            around = 2 * math.pi * j / sides
            radius = 0.5 + bumps * math.cos(5 * around + 1) * math.sin(4 * polar) * math.sin(polar)
            vertices.append((radius * math.sin(polar) * math.cos(around),
                             0.7 * radius * math.sin(polar) * math.sin(around),
                             1.3 * radius * math.cos(polar) + 0.1 * radius * math.sin(polar)))
    for i in range(rings):
        for j in range(sides):
            a, b, c, d = (i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)
            for corners in ((a, d, c), (a, c, b)):
                faces.append([k * sides + l % sides for k, l in corners])
                uvs += [(offset + 0.02 + 0.29 * l / sides, 0.02 + 0.96 * (1 - k / rings))
                        for k, l in corners]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    layer = mesh.uv_layers.new(name="UVMap")
    for index, uv in enumerate(uvs):
        layer.data[index].uv = uv
    mesh.shade_smooth()
    mesh.materials.append(of)
    mesh.update()
    return mesh


def place_object(name, mesh, location, rotation, scale, parent=None):
    made = bpy.data.objects.new(name, mesh)
    made.location, made.rotation_euler, made.scale = location, rotation, scale
    made.parent = parent
    bpy.context.collection.objects.link(made)
    return made


def build_scene(sides, rings, bumps, shared):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    clay = make_material("clay", make_picture("clay", (0.9, 0.2, 0.1), (0.2, 0.6, 0.3)))
    glaze = make_material("glaze", make_picture("glaze", (0.1, 0.2, 0.8), (0.8, 0.9, 0.4)))
    pot = make_dome("pot", sides, rings, bumps, 0, clay)
    # In the high poly, instances share UVs. In the low poly, each instance needs texels of its own, so it is a copy.
    twin = pot if shared else make_dome("twin", sides, rings, bumps, 1 / 3, clay)
    lid = make_dome("lid", sides, rings, bumps, 2 / 3, glaze)
    place_object("pot", pot, (0, 0, 1), (0.3, 0.2, 0.1), (1, 1, 1))
    place_object("mirrored", twin, (2, 0.5, 1), (0.3, 0.2, 0.1), (-1, 1, 1))
    group = place_object("group", None, (0, 2, 0.5), (0, 0, math.radians(40)), (1, 1, 1))
    place_object("lid", lid, (0.3, 0.2, 0.1), (math.radians(70), 0, 0), (0.6, 0.6, 0.6), group)


def export_all():
    path = os.path.join(OUTPUT_FOLDER, "high")
    bpy.ops.export_scene.gltf(filepath=path + ".glb", export_format="GLB")
    bpy.ops.export_scene.gltf(filepath=path + ".gltf", export_format="GLTF_SEPARATE",
                              export_keep_originals=True)
    bpy.ops.export_scene.gltf(filepath=path + "_draco.glb", export_format="GLB",
                              export_draco_mesh_compression_enable=True,
                              export_draco_position_quantization=18,
                              export_draco_normal_quantization=14,
                              export_draco_texcoord_quantization=16)
    bpy.ops.export_scene.fbx(filepath=path + ".fbx", path_mode="RELATIVE")
    bpy.ops.export_scene.fbx(filepath=path + "_z.fbx", path_mode="COPY", embed_textures=True,
                             axis_forward="Y", axis_up="Z", apply_scale_options="FBX_SCALE_ALL")
    bpy.ops.wm.obj_export(filepath=path + ".obj", path_mode="RELATIVE")
    bpy.ops.wm.obj_export(filepath=path + "_z.obj", path_mode="RELATIVE", forward_axis="Y",
                          up_axis="Z", global_scale=100)


os.makedirs(OUTPUT_FOLDER, exist_ok=True)
build_scene(10, 6, 0.02, True)
export_all()
build_scene(6, 4, 0, False)
bpy.ops.export_scene.gltf(filepath=os.path.join(OUTPUT_FOLDER, "low.glb"), export_format="GLB",
                          export_image_format="NONE")
bpy.ops.wm.obj_export(filepath=os.path.join(OUTPUT_FOLDER, "low.obj"), export_materials=False)
