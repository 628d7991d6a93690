"""Opens a GLB that Kiln wrote with pygltflib, trimesh and Blender, and checks that they find the same in it.

    python glb_readers.py FILE.glb...

    pip install pygltflib trimesh pillow bpy==5.0.1    # Python 3.11

Checked: numbers of triangles and vertices, pictures by their place in the material, tangents (unit length, square to
the normals, a sign of 1 or -1). Prints a line a file; exits with 1 where something is amiss.
"""

import struct
import sys

import numpy as np

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


def by_pygltflib(path):
    """What the file says of itself: triangles, vertices, and sizes of pictures by their place."""
    from pygltflib import GLTF2

    gltf = GLTF2().load(path)
    blob = gltf.binary_blob()

    def view(index):
        start = gltf.bufferViews[index].byteOffset or 0
        return blob[start:start + gltf.bufferViews[index].byteLength]

    def values(index):
        accessor = gltf.accessors[index]
        array = np.frombuffer(view(accessor.bufferView), TYPES[accessor.componentType])
        return array[:accessor.count * WIDTHS[accessor.type]].reshape(accessor.count, -1)

    triangles = vertices = 0
    for mesh in gltf.meshes:
        for primitive in mesh.primitives:
            of = primitive.attributes
            positions, normals, tangents, uvs = map(values, (of.POSITION, of.NORMAL, of.TANGENT, of.TEXCOORD_0))
            assert len(positions) == len(normals) == len(tangents) == len(uvs)
            assert values(primitive.indices).max() < len(positions)
            assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5), "normals"
            assert np.allclose(np.linalg.norm(tangents[:, :3], axis=1), 1, atol=1e-5), "tangents"
            assert np.all(np.abs(tangents[:, 3]) == 1), "signs of tangents"
            # MikkTSpace projects tangents onto the plane of the normal.
            assert np.abs((normals * tangents[:, :3]).sum(1)).max() < 1e-4, "tangents lean"
            triangles += gltf.accessors[primitive.indices].count // 3
            vertices += len(positions)
    pictures = set()
    for material in gltf.materials:
        surface = material.pbrMetallicRoughness
        for place, texture in (("color", surface.baseColorTexture), ("surface", surface.metallicRoughnessTexture),
                               ("normal", material.normalTexture), ("occlusion", material.occlusionTexture),
                               ("emission", material.emissiveTexture)):
            if texture is None:
                continue
            image = gltf.images[gltf.textures[texture.index].source]
            png = view(image.bufferView)
            assert image.mimeType == "image/png" and png[:8] == b"\x89PNG\r\n\x1a\n", place
            pictures.add((place, struct.unpack(">II", png[16:24])))
    return triangles, vertices, pictures


def by_trimesh(path):
    import trimesh

    scene = trimesh.load_scene(path)
    meshes = list(scene.geometry.values())
    pictures = set()
    for mesh in meshes:
        material = mesh.visual.material
        for place, picture in (("color", material.baseColorTexture), ("surface", material.metallicRoughnessTexture),
                               ("normal", material.normalTexture), ("occlusion", material.occlusionTexture),
                               ("emission", material.emissiveTexture)):
            if picture is not None:
                pictures.add((place, picture.size))
    return sum(len(m.faces) for m in meshes), sum(len(m.vertices) for m in meshes), pictures


def by_blender(path):
    """Vertices are not counted: Blender joins those that only normals or UVs tell apart."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    meshes = [o.data for o in bpy.data.objects if o.type == "MESH"]
    places = {"Base Color": "color", "Roughness": "surface", "Metallic": "surface", "Normal": "normal",
              "Emission Color": "emission", "Occlusion": "occlusion"}
    pictures = set()

    def follow(node, place):
        if node.type == "TEX_IMAGE":
            pictures.add((place, tuple(node.image.size)))
        for socket in node.inputs:
            for link in socket.links:
                follow(link.from_node, place)

    for material in {m for mesh in meshes for m in mesh.materials}:
        for node in material.node_tree.nodes:
            if node.type != "BSDF_PRINCIPLED" and not (node.type == "GROUP" and "Occlusion" in node.inputs):
                continue
            for socket in node.inputs:
                for link in socket.links:
                    if socket.name in places:
                        follow(link.from_node, places[socket.name])
    return sum(len(mesh.polygons) for mesh in meshes), None, pictures


failed = False
for file in sys.argv[1:]:
    told = by_pygltflib(file)
    for name, reader in (("trimesh", by_trimesh), ("Blender", by_blender)):
        triangles, vertices, pictures = reader(file)
        same = triangles == told[0] and vertices in (None, told[1]) and pictures == told[2]
        if not same:
            print(f"{file}: {name} finds {triangles, vertices, sorted(pictures)}")
        failed = failed or not same
    print(f"{file}: {told[0]:,} triangles, {told[1]:,} vertices, pictures {sorted(told[2])}")
sys.exit(failed)
