"""Bakes GLB to GLB and GLB to OBJ, and has other programs open what Kiln wrote: trimesh, pygltflib, Assimp, Blender.

    python asset_clients.py KILN HIGH.glb LOW.glb

Each client that is there must see the same triangles, materials, pictures by slot, and (where it tells) tangents; one
that is missing is named. PyPI: trimesh, pygltflib, pillow, numpy, bpy==5.0.1; Debian: assimp-utils. Exit code 1 where
one disagrees. tests/data/twins has a HIGH and a LOW.
"""

import io
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy

KILN_PROGRAM, HIGH_PATH, LOW_PATH = (os.path.abspath(path) for path in sys.argv[1:4])
MAP_NAMES = "normal,ao,color"
failures = []


def check_value(client, what, value_found, expected):
    if value_found != expected:
        failures.append(f"{client}: {what} is {value_found!r}, not {expected!r}")


def check_with_pygltflib(path):
    """Parses the GLB by pygltflib, and returns the values that the other programs are compared with."""
    import pygltflib
    from PIL import Image

    glb = pygltflib.GLTF2().load(path)
    blob = glb.binary_blob()
    facts = {"triangles": 0, "materials": sorted(m.name for m in glb.materials), "nodes": len(glb.nodes)}
    for mesh in glb.meshes:
        for primitive in mesh.primitives:
            facts["triangles"] += glb.accessors[primitive.indices].count // 3
            tangents = glb.accessors[primitive.attributes.TANGENT]
            view = glb.bufferViews[tangents.bufferView]
            start = view.byteOffset + (tangents.byteOffset or 0)
            values = numpy.frombuffer(blob, "<f4", 4 * tangents.count, start).reshape(-1, 4)
            check_value("pygltflib", "tangents are unit", bool(abs(numpy.linalg.norm(values[:, :3], axis=1) - 1).max() < 1e-5),
                   True)
            check_value("pygltflib", "signs are 1 or -1", bool((abs(values[:, 3]) == 1).all()), True)
    sizes = []
    for image in glb.images:
        view = glb.bufferViews[image.bufferView]
        picture = Image.open(io.BytesIO(blob[view.byteOffset:view.byteOffset + view.byteLength]))
        sizes.append(picture.size)
    check_value("pygltflib", "sizes of pictures", set(sizes), {(256, 256)})
    for material in glb.materials:
        surface = material.pbrMetallicRoughness
        for slot in (material.normalTexture, material.occlusionTexture, surface.baseColorTexture):
            check_value("pygltflib", f"a slot of {material.name} is filled", slot is not None, True)
    check_value("pygltflib", "asset.extras.kiln has a version", "version" in glb.asset.extras["kiln"], True)
    return facts


def check_with_trimesh(path, facts):
    import trimesh

    scene = trimesh.load_scene(path)
    check_value("trimesh", "triangles", sum(len(g.faces) for g in scene.geometry.values()), facts["triangles"])
    names = {g.visual.material.name for g in scene.geometry.values()}
    check_value("trimesh", "materials", sorted(names), facts["materials"])
    for geometry in scene.geometry.values():
        check_value("trimesh", "UVs", len(geometry.visual.uv), len(geometry.vertices))
        if path.endswith(".glb"):
            material = geometry.visual.material
            for slot in ("baseColorTexture", "normalTexture", "occlusionTexture"):
                picture = getattr(material, slot)
                check_value("trimesh", f"size of {slot}", picture.size if picture else None, (256, 256))
        else:
            check_value("trimesh", "size of map_Kd", geometry.visual.material.image.size, (256, 256))


def check_with_assimp(path, facts):
    if shutil.which("assimp") is None:
        raise ImportError("assimp (assimp-utils)")
    tool_output = subprocess.run(["assimp", "info", path, "-r"], capture_output=True, text=True).stdout
    number = lambda what: int(re.search(rf"{what}:\s+(\d+)", tool_output).group(1))
    check_value("Assimp", "triangles", number("Faces"), facts["triangles"])
    names = re.findall(r"^    '(.+)' \(prop\)", tool_output, re.M)
    check_value("Assimp", "materials", sorted(set(names) - {"DefaultMaterial"}), facts["materials"])
    for slot in ("Diffuse", "Normals" if path.endswith(".glb") else "Height"):
        check_value("Assimp", f"pictures of {slot}", len(re.findall(rf"\(\$tex\.file\): .*\| {slot}\]", tool_output)), len(facts["materials"]))


def check_with_blender(path, facts):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    (bpy.ops.import_scene.gltf if path.endswith(".glb") else bpy.ops.wm.obj_import)(filepath=path)
    things = [thing.data for thing in bpy.context.scene.objects if thing.type == "MESH"]
    check_value("Blender", "triangles", sum(len(mesh.polygons) for mesh in things), facts["triangles"])
    used = {slot.name for mesh in things for slot in mesh.materials}
    check_value("Blender", "materials", sorted(used), facts["materials"])
    for name in used:
        nodes = bpy.data.materials[name].node_tree.nodes
        shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
        for slot in ("Base Color", "Normal"):
            check_value("Blender", f"{name}: {slot} is linked", shader.inputs[slot].is_linked, True)
        pictures = [node.image for node in nodes if node.type == "TEX_IMAGE"]
        spaces = {image.colorspace_settings.name for image in pictures}
        if path.endswith(".glb"):  # Blender's OBJ importer treats normal maps as sRGB
            check_value("Blender", f"{name}: colour spaces", spaces, {"sRGB", "Non-Color"})
        check_value("Blender", f"{name}: pictures are there", all(image.has_data or image.size[0] for image in pictures), True)


def main():
    with tempfile.TemporaryDirectory() as folder:
        glb, obj = os.path.join(folder, "a.glb"), os.path.join(folder, "a.obj")
        for out in (glb, obj):
            subprocess.run([KILN_PROGRAM, "bake", HIGH_PATH, LOW_PATH, "--size", "256", "--maps", MAP_NAMES, "--out", out], check=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        facts = check_with_pygltflib(glb)
        print("GLB:", facts)
        for client in (check_with_trimesh, check_with_assimp, check_with_blender):
            for path in (glb, obj):
                try:
                    client(path, facts)
                    print(client.__name__.removeprefix("check_with_"), os.path.basename(path), "opened")
                except ImportError as missing:
                    print(client.__name__.removeprefix("check_with_"), "is not here:", missing)
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


main()
