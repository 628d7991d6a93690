"""Conversion of meshes to kiln.Mesh."""

from __future__ import annotations

import os
from typing import Any

from . import _core
from ._core import Mesh
from ._errors import Error, path_of, warn


def load(
    path: str | os.PathLike[str], *, triangulate: str = "auto", uv_set: int = 0, up: str | None = None
) -> Mesh:
    """Reads a mesh: PLY, OBJ, STL, OFF, glTF, and, if the build includes them, FBX, DAE, 3DS and X.

    triangulate  how polygons become triangles: auto, blender, fan or shortest
    uv_set       of several sets of UVs in a glTF
    up           the axis that points up in files that do not state theirs: x, y, z, -x, -y or -z; without: y

    Raises kiln.Error for a file that cannot be used.
    """
    return _core.load_file(path_of(path), triangulate, uv_set, up or "")


def as_mesh(given: Any, parameter: str = "mesh", up: str | None = None) -> Mesh:
    """Converts a mesh, a file's path, a file's bytes, (vertices, faces), or an object like trimesh's to a kiln.Mesh: a
    Trimesh, or a Scene with its materials.

    up  the axis that points up in arrays and in files that do not state theirs: x, y, z, -x, -y or -z; without: y

    >>> import kiln
    >>> kiln.as_mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).faces.shape
    (1, 3)
    """
    if up is not None and isinstance(getattr(given, "mesh", given), Mesh):
        text = "up has no effect on a kiln.Mesh: pass up=... to kiln.Mesh() instead, which rotates its arrays."
        raise Error(text, "option-contradiction", "usage", "up")
    if isinstance(given, Mesh):
        return given
    if isinstance(given, (str, os.PathLike)):
        return load(given, up=up)
    if (scene := scene_data(given)) is not None:
        return _core.load_bytes(scene, "mesh.glb")
    if isinstance(given, (bytes, bytearray, memoryview)):
        data = bytes(given)
        return _core.load_bytes(data, "mesh" + _extension(data), up or "")
    if isinstance(given, (tuple, list)) and len(given) == 2:
        return Mesh(given[0], given[1], up=up or "y")
    if isinstance(getattr(given, "mesh", None), Mesh):  # a kiln.Glb
        return given.mesh  # type: ignore[no-any-return]
    # Scenes with vertex or face colours, for which scene_data() returns None, are merged to one mesh.
    if hasattr(given, "geometry") and hasattr(given, "to_mesh"):
        given = given.to_mesh()
    if hasattr(given, "vertices") and hasattr(given, "faces"):
        return _mesh_of_trimesh(given, parameter not in ("low", "cage_mesh", "ao_occluders"), up)
    hint = ""
    raise Error(
        f"{parameter}: expected a kiln.Mesh, a path, a file's bytes, (vertices, faces), or an object with vertices "
        f"and faces, not {type(given).__name__}.{hint}",
        "mesh-type",
        "usage",
        parameter,
    )


def as_high(given: Any, high_normals: str | float = "auto", parameter: str = "high") -> Mesh:
    """Converts a high poly, with the normals that bakes use."""
    return _core.shaded(as_mesh(given, parameter), str(high_normals))


def scene_data(given: Any) -> bytes | None:
    """Returns the GLB of a trimesh.Scene, with its hierarchy and materials. None if the object is no scene, or if it
    has vertex colours, which trimesh does not write as glTF defines them."""
    if not (hasattr(given, "geometry") and hasattr(given, "graph") and hasattr(given, "export")):
        return None
    meshes = [each for each in given.geometry.values() if hasattr(each, "faces")]
    if not meshes:
        raise Error("The scene has no mesh.", "mesh-type", "usage")
    if any(getattr(getattr(each, "visual", None), "kind", None) in ("vertex", "face") for each in meshes):
        return None
    data: bytes = given.export(file_type="glb", include_normals=True)
    return data


def _extension(data: bytes) -> str:
    """The extension of the format that a file's first bytes show."""
    if data[:4] == b"glTF":
        return ".glb"
    if data[:3] == b"ply":
        return ".ply"
    if data[:3] in (b"OFF", b"NOF", b"COF", b"STO"):
        return ".off"
    if data.lstrip()[:1] == b"{":
        return ".gltf"
    if data[:5] == b"solid" or (len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")):
        return ".stl"
    return ".obj"


#: Members of a trimesh material that are read.
_FACTOR_MEMBERS = ("baseColorFactor", "metallicFactor", "roughnessFactor", "emissiveFactor")
_PICTURE_MEMBERS = ("baseColorTexture", "metallicRoughnessTexture", "normalTexture", "occlusionTexture", "emissiveTexture")


def _mesh_of_trimesh(given: Any, with_material: bool, up: str | None = None) -> Mesh:
    """Converts an object like trimesh.Trimesh: visual.uv, visual.vertex_colors, explicit vertex normals, and the
    material. Warnings state what is left out."""
    visual = getattr(given, "visual", None)
    uvs = getattr(visual, "uv", None)
    colors = None
    if getattr(visual, "kind", None) == "vertex":
        colors = getattr(visual, "vertex_colors", None)
    elif getattr(visual, "kind", None) == "face":
        warn(
            "colors-left-out",
            "The mesh has colours of faces, which are not read: give each face separate vertices, with their colours.",
            len(given.faces),
        )
    # Computed normals are redundant and are not read; explicit ones from a file are in the cache.
    cache = getattr(given, "_cache", None)
    normals = None
    if cache is not None and "vertex_normals" in getattr(cache, "cache", {}):
        normals = given.vertex_normals
    name = "mesh"
    metadata = getattr(given, "metadata", None)
    if isinstance(metadata, dict):
        name = str(metadata.get("name") or metadata.get("file_name") or name)
    mesh = Mesh(given.vertices, given.faces, uvs, normals=normals, colors=colors, name=os.path.splitext(name)[0], up=up or "y")
    material = getattr(visual, "material", None)
    return mesh if material is None or not with_material else _with_material(mesh, material, visual)


def _with_material(mesh: Mesh, material: Any, visual: Any) -> Mesh:
    """Adds a material of trimesh: writes a GLB of one triangle with it, and reads the material from there."""
    if hasattr(material, "diffuse") and hasattr(material, "to_pbr"):
        material = _pbr_of_simple(material)
    pictures = [name for name in _PICTURE_MEMBERS if getattr(material, name, None) is not None]
    factors = [name for name in _FACTOR_MEMBERS if getattr(material, name, None) is not None]
    has_several_materials = len(getattr(material, "materials", ())) > 0
    if not pictures and not factors and not has_several_materials:
        return mesh
    known = type(material).__module__.startswith("trimesh.") and not has_several_materials
    if known and (mesh.uvs is not None or not pictures):
        import importlib

        trimesh: Any = importlib.import_module("trimesh")
        corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        triangle = trimesh.Trimesh(
            corners,
            [[0, 1, 2]],
            visual=trimesh.visual.TextureVisuals(uv=[corner[:2] for corner in corners], material=material),
            process=False,
        )
        data: bytes = triangle.export(file_type="glb", include_normals=True)
        # trimesh silently omits pictures that it cannot write.
        if all(name.encode() in data for name in pictures):
            beside = getattr(visual, "vertex_attributes", {}).get("color")
            if beside is not None and (beside != beside.dtype.type(1 if beside.dtype.kind == "f" else 255)).any():
                warn("colors-left-out", "The mesh has vertex colours in addition to its material, which are not read.", 1)
            return _core.with_material(mesh, _core.load_bytes(data, "mesh.glb"))
    warn(
        "material-left-out",
        "The mesh's material is not read, only its shape and UVs: pass mesh.export(file_type='glb', "
        "include_normals=True) in its place, or its picture as textures={'color': ...} of kiln.bake().",
        1,
    )
    return mesh


def _pbr_of_simple(material: Any) -> Any:
    """Converts a SimpleMaterial without the default greys by which its own to_pbr() multiplies pictures."""
    made = material.to_pbr()
    made.metallicFactor = 0.0
    if getattr(material, "_glossiness", None) is None:
        made.roughnessFactor = 1.0
    if list(material.diffuse) == [102, 102, 102, 255]:
        made.baseColorFactor = None
    image = material.image
    if getattr(image, "size", None) == (2, 2) and image.convert("RGBA").tobytes() == 4 * bytes([100, 100, 100, 255]):
        made.baseColorTexture = None
    if made.baseColorTexture is None and made.baseColorFactor is None:
        return None
    return made
