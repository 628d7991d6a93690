"""Converts maps to images, and connects images in materials."""

import os
import tempfile

import bpy
import numpy as np

#: Maps that hold colours; all others hold data.
COLOR_MAPS = {"color", "vertex_color"}
#: Inputs of Principled BSDF.
INPUT_OF_MAP = {"color": "Base Color", "opacity": "Alpha"}


def image_of(pixels, name, is_data):
    """Creates a float image from (H, W, C), row 0 at the top; reuses an image of the same name and size."""
    height, width, channels = pixels.shape
    image = bpy.data.images.get(name)
    if image is not None and (
        tuple(image.size) != (width, height) or image.source != "GENERATED" or not image.is_float
    ):
        image.name = name + ".old"
        image = None
    if image is None:
        image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=is_data)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[:, :, : 3 if channels == 1 else channels] = pixels[::-1]
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    return image


def tiled_image(bakes, name, map_name, folder):
    """Creates a tiled (UDIM) image from bakes by tile; packed into the file if no folder is given."""
    keep = folder or tempfile.mkdtemp(dir=bpy.app.tempdir)
    first = None
    for tile, bake in bakes.items():
        path = os.path.join(keep, f"{name}_{map_name}.{tile}.exr")
        bake._core.save_map(map_name, path, "exr", False)
        first = first or path
    image = bpy.data.images.load(first)
    image.name = f"{name}_{map_name}"
    image.source = "TILED"
    image.filepath = os.path.join(keep, f"{name}_{map_name}.<UDIM>.exr")
    for tile in bakes:
        if image.tiles.get(int(tile)) is None:
            image.tiles.new(int(tile))
    if map_name not in COLOR_MAPS:
        image.colorspace_settings.name = "Non-Color"
    if not folder:
        image.pack()
    return image


def images_by_set(bakes, name, folder):
    """Converts the result of kiln.bake_sets() to {set: {map: image}}."""
    tiled = any(word.isdigit() and len(word) >= 4 for word in bakes)
    if tiled:
        maps = next(iter(bakes.values()))
        return {"": {map_name: tiled_image(bakes, name, map_name, folder) for map_name in maps}}
    made = {}
    for word, bake in bakes.items():
        stem = f"{name}_{word}" if word else name
        if folder:
            files = bake.save(folder, format="exr", name=name)
            loaded = [bpy.data.images.load(str(file), check_existing=True) for file in files]
            for image, map_name in zip(loaded, bake):
                image.reload()
                if map_name not in COLOR_MAPS:
                    image.colorspace_settings.name = "Non-Color"
            made[word] = dict(zip(bake, loaded))
        else:
            made[word] = {
                map_name: image_of(bake[map_name], f"{stem}_{map_name}", map_name not in COLOR_MAPS) for map_name in bake
            }
    return made


def socket_of_opengl_normals(tree, node, flipped):
    """The socket with an image's normals in OpenGL convention, which Blender expects."""
    turn = tree.nodes.get("Kiln green")
    if not flipped:
        if turn is not None:
            tree.nodes.remove(turn)
        return node.outputs["Color"]
    if turn is None:
        turn = tree.nodes.new("ShaderNodeRGBCurve")
        turn.name = turn.label = "Kiln green"
        for point, location in zip(turn.mapping.curves[1].points, ((0, 1), (1, 0))):
            point.location, point.handle_type = location, "VECTOR"
        turn.mapping.update()
        turn.location = (node.location.x, node.location.y - 300)
    tree.links.new(node.outputs["Color"], turn.inputs["Color"])
    return turn.outputs["Color"]


def wire(material, images, uv_layer, flipped):
    """Adds images to a material: normals and colours are linked, others are added unlinked."""
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    shader = next((node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"), None)
    for row, (name, image) in enumerate(images.items()):
        node = tree.nodes.get("Kiln " + name) or tree.nodes.new("ShaderNodeTexImage")
        node.name = node.label = "Kiln " + name
        node.image = image
        x, y = shader.location if shader else (0, 0)
        node.location = (x - 600, y - 300 * row)
        if shader is None:
            continue
        if name == "normal":
            bump = tree.nodes.get("Kiln tangent space") or tree.nodes.new("ShaderNodeNormalMap")
            bump.name = "Kiln tangent space"
            bump.uv_map = uv_layer
            bump.location = (x - 250, y - 300 * row)
            tree.links.new(socket_of_opengl_normals(tree, node, flipped), bump.inputs["Color"])
            tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
        elif name in INPUT_OF_MAP:
            tree.links.new(node.outputs["Color"], shader.inputs[INPUT_OF_MAP[name]])


def show(objects, images, flipped):
    """Connects images by set in the materials of the low poly's objects. Objects without a material get one; materials
    that other objects use are copied first."""
    others = {slot.material for item in bpy.data.objects if item not in objects for slot in item.material_slots}
    copies = {}
    for item in objects:
        if not item.data.materials:
            item.data.materials.append(bpy.data.materials.new(f"{item.name} Kiln"))
        layer = next((layer.name for layer in item.data.uv_layers if layer.active_render), "")
        for slot in item.material_slots:
            if slot.material is None:
                slot.material = bpy.data.materials.new(f"{item.name} Kiln")
            found = images.get(slot.material.name, images.get(item.name, images.get("")))
            if not found:
                continue
            # a material of a texture set must not be shared
            if item.name in images and slot.material.users > 1:
                slot.material = slot.material.copy()
            elif slot.material in others:
                if slot.material not in copies:
                    copies[slot.material] = slot.material.copy()
                slot.material = copies[slot.material]
            wire(slot.material, found, layer, flipped)
