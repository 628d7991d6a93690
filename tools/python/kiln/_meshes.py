"""What Kiln takes for a mesh."""

from __future__ import annotations

import os
from typing import Any

from . import _core
from ._core import Mesh
from ._errors import Error, warn


def load(path: str | os.PathLike[str], *, triangulate: str = "auto", uv_set: int = 0) -> Mesh:
    """Reads a mesh: PLY, OBJ, STL, OFF, glTF, and FBX, DAE, 3DS and X where they were built in.

    triangulate  how polygons become triangles: auto, blender, fan or shortest
    uv_set       of several sets of UVs in a glTF

    Raises kiln.Error for a file that cannot be used.
    """
    return _core.load_file(os.fspath(path), triangulate, uv_set)


def as_mesh(given: Any, parameter: str = "mesh") -> Mesh:
    """A kiln.Mesh of a mesh, a file's path, a file's bytes, (vertices, faces), or an object of trimesh's kind.

    >>> import kiln
    >>> kiln.as_mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).faces.shape
    (1, 3)
    """
    if isinstance(given, Mesh):
        return given
    if isinstance(given, (str, os.PathLike)):
        return load(given)
    if isinstance(given, (bytes, bytearray, memoryview)):
        data = bytes(given)
        if data[:4] == b"glTF":
            return _of_glb(data)
        return _core.load_bytes(data, "mesh" + _extension(data))
    if isinstance(given, (tuple, list)) and len(given) == 2:
        return Mesh(given[0], given[1])
    if isinstance(getattr(given, "mesh", None), Mesh):  # kiln.Glb
        return given.mesh  # type: ignore[no-any-return]
    if hasattr(given, "vertices") and hasattr(given, "faces"):
        return _of_object(given)
    hint = ""
    if hasattr(given, "to_mesh"):
        hint = " Of a scene, give scene.to_mesh()."
    raise Error(
        f"{parameter}: expected a kiln.Mesh, a path, a file's bytes, (vertices, faces), or an object with vertices "
        f"and faces, not {type(given).__name__}.{hint}",
        "mesh-type",
        "usage",
        parameter,
    )


def _of_glb(data: bytes) -> Mesh:
    """Through a file that lives as long as the mesh, since pictures of its materials are read when they are baked."""
    import shutil
    import tempfile
    import weakref

    folder = tempfile.mkdtemp()
    kept = _Kept()
    weakref.finalize(kept, shutil.rmtree, folder, ignore_errors=True)
    file = os.path.join(folder, "mesh.glb")
    with open(file, "wb") as out:
        out.write(data)
    return _core.load_file(file, "auto", 0, kept)


class _Kept:
    """What a mesh keeps, so that something is done when it is gone."""


def _extension(data: bytes) -> str:
    if data[:3] == b"ply":
        return ".ply"
    if data[:3] in (b"OFF", b"NOF", b"COF", b"STO"):
        return ".off"
    if data.lstrip()[:1] == b"{":
        return ".gltf"
    if data[:5] == b"solid" or (len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")):
        return ".stl"
    return ".obj"


def _of_object(given: Any) -> Mesh:
    """Duck typing of trimesh.Trimesh: visual.uv, visual.vertex_colors and the vertices' own normals. What is left out is
    told."""
    visual = getattr(given, "visual", None)
    uvs = getattr(visual, "uv", None)
    colors = None
    if getattr(visual, "kind", None) == "vertex":
        colors = getattr(visual, "vertex_colors", None)
    elif getattr(visual, "kind", None) == "face":
        warn(
            "colors-left-out",
            "The mesh has colours of faces, which are not taken: give each face vertices of its own, with their colours.",
            len(given.faces),
        )
    material = getattr(visual, "material", None)
    # A picture of 2 x 2 stands in for what trimesh was not given.
    size = getattr(getattr(material, "image", None), "size", (0, 0))
    if max(size) > 2 or any(getattr(material, "baseColor" + name, None) is not None for name in ("Texture", "Factor")):
        warn(
            "material-left-out",
            "The mesh's material is not taken, only its shape and UVs: give mesh.export(file_type='glb', "
            "include_normals=True) in its place, or its picture as textures={'color': ...} of kiln.bake().",
            1,
        )
    # Normals that were computed say nothing new; those that a file gave are in the cache.
    cache = getattr(given, "_cache", None)
    normals = None
    if cache is not None and "vertex_normals" in getattr(cache, "cache", {}):
        normals = given.vertex_normals
    name = "mesh"
    metadata = getattr(given, "metadata", None)
    if isinstance(metadata, dict):
        name = str(metadata.get("name") or metadata.get("file_name") or name)
    return Mesh(given.vertices, given.faces, uvs, normals=normals, colors=colors, name=os.path.splitext(name)[0])
