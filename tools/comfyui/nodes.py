"""Nodes to simplify, unwrap, bake and write GLB: from MESH to MESH and IMAGE, the types of ComfyUI's own mesh nodes.

A MESH holds a batch, filled up with zeros where vertex_counts and face_counts say less: vertices (B, N, 3), faces
(B, M, 3), uvs (B, N, 2) with the origin at the upper left, vertex_colors (B, N, 3 or 4) linear, normals, tangents;
texture, normal_map and metallic_roughness are (B, H, W, 3) pictures. Colours and pictures are floats in [0, 1], or
uint8 of as many steps.

A MESH that a node here returns has kiln_meshes, too: of each mesh of the batch the kiln.Mesh that the arrays are of,
which knows how far it strays from its high poly, and the arrays' digest. Where another node changed the arrays, the
digest differs, and the arrays count.
"""

from __future__ import annotations

import copy
import hashlib
import io
import sys
import warnings

import kiln
import numpy as np

#: Fields of MESH besides vertices and faces. Fields that a node does not set are missing in its result.
OPTIONAL = (
    "uvs",
    "vertex_colors",
    "texture",
    "metallic_roughness",
    "vertex_counts",
    "face_counts",
    "normals",
    "tangents",
    "normal_map",
)
FACES = ("INT", {"default": 10_000, "min": 4, "max": 50_000_000})
SIZE = ("INT", {"default": 2048, "min": 64, "max": 8192, "step": 64})
#: What lies nearer to 0 or 1 is rounded to them by pictures of 8 bits.
HALF_STEP = 0.5 / 255


def as_numpy(values):
    """Converts a tensor on any device, or an array, to NumPy."""
    for step in ("detach", "cpu"):
        if hasattr(values, step):
            values = getattr(values, step)()
    if hasattr(values, "__dlpack__") and not hasattr(values, "__array__"):
        return np.from_dlpack(values)
    return np.asarray(values)


def as_tensor(array):
    """Converts to a torch tensor, if torch is installed."""
    try:
        import torch
    except ImportError:
        return np.ascontiguousarray(array)
    return torch.from_numpy(np.array(array, order="C"))


def as_shares(values, name):
    """Converts to [0, 1]: floats are clipped, integers divided by their type's maximum."""
    if values.dtype in (np.uint8, np.uint16):
        return values / np.float32(np.iinfo(values.dtype).max)
    if values.dtype.kind != "f":
        raise ValueError(f"{name} should be floats in [0, 1], or uint8, not {values.dtype}.")
    outside = int(((values < -HALF_STEP) | (values > 1 + HALF_STEP)).sum())
    if outside:
        text = (
            f"{name}: {outside} of {values.size} numbers lie outside of [0, 1], from {np.nanmin(values):g} to "
            f"{np.nanmax(values):g}, and are clipped: bring colours of high dynamic range into [0, 1] before this node."
        )
        warnings.warn(kiln.KilnWarning(text, "colors-clipped", outside), stacklevel=2)
    return np.clip(values, 0, 1)


def linear_to_srgb(values):
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


def parts_of(mesh, name, dimensions):
    """One array per mesh of the batch, from a tensor (B, ...), a list of tensors, or one tensor without B."""
    value = getattr(mesh, name, None)
    if value is None:
        return None
    if isinstance(value, (list, tuple)):
        return [None if part is None else as_numpy(part) for part in value]
    array = as_numpy(value)
    return [array] if array.ndim == dimensions else list(array)


def digest_of(arrays):
    """Hash of the arrays that determine a mesh's shape and maps."""
    digest = hashlib.sha256()
    for name in ("vertices", "faces", "uvs", "vertex_colors", "normals"):
        array = arrays.get(name)
        if array is not None:
            digest.update(f"{name} {array.dtype} {array.shape} ".encode())
            digest.update(np.ascontiguousarray(array))
    return digest.digest()


def items(mesh):
    """Each mesh of the batch: a kiln.Mesh, and its texture (H, W, C) or None."""
    parts = {name: parts_of(mesh, name, 2) for name in ("vertices", "faces", "uvs", "vertex_colors", "normals")}
    counts = [parts_of(mesh, name, 0) for name in ("vertex_counts", "face_counts")]
    textures = parts_of(mesh, "texture", 3)
    known = dict(enumerate(getattr(mesh, "kiln_meshes", None) or ()))
    for i in range(len(parts["vertices"])):
        vertices, faces = (None if count is None else int(count[i]) for count in counts)
        item = {
            name: None if part is None else part[i][: faces if name == "faces" else vertices]
            for name, part in parts.items()
        }
        texture = None if textures is None or textures[i] is None else as_shares(textures[i], "texture")
        if i in known and known[i][0] == digest_of(item):
            yield known[i][1], texture
            continue
        uvs, colors = item.pop("uvs"), item.pop("vertex_colors")
        if uvs is not None:
            uvs = [0, 1] + uvs * [1, -1]
        if colors is not None:
            colors = as_shares(colors, "vertex_colors")
            colors = np.hstack([linear_to_srgb(colors[:, :3]), colors[:, 3:]])
        yield kiln.Mesh(uvs=uvs, colors=colors, **item), texture


def batch_of(mesh, batch, **fields):
    """A MESH like the one given, of what arrays_of() returns."""
    made = copy.copy(mesh)
    for name in OPTIONAL:
        if hasattr(made, name):
            setattr(made, name, None)
    for name in ("vertices", "faces", "uvs", "normals", "tangents"):
        arrays = [item[name] for item in batch if item.get(name) is not None]
        if not arrays:
            continue
        whole = np.zeros((len(arrays), max(map(len, arrays)), arrays[0].shape[1]), arrays[0].dtype)
        for i, array in enumerate(arrays):
            whole[i, : len(array)] = array
        setattr(made, name, as_tensor(whole))
    if len(batch) > 1:
        made.vertex_counts = as_tensor(np.array([len(item["vertices"]) for item in batch]))
        made.face_counts = as_tensor(np.array([len(item["faces"]) for item in batch]))
    for name, value in fields.items():
        setattr(made, name, value)
    made.kiln_meshes = [(digest_of(item), item["kiln_mesh"]) for item in batch]
    return made


def arrays_of(low):
    """Arrays by MESH field from a kiln.Mesh or kiln.Glb, with one index list for all; also the kiln.Mesh."""
    parts = {
        "vertices": np.asarray(low.vertices, np.float32),
        "faces": low.faces.astype(np.int64),
        "normals": low.normals,
        "kiln_mesh": getattr(low, "mesh", low),
    }
    if low.uvs is not None:
        parts["uvs"] = np.float32([0, 1]) + low.uvs * np.float32([1, -1])
    return parts


def pictures(maps, name, size, background):
    """IMAGE (B, H, W, 3) with each item's map, or the background colour for items without it."""
    empty = np.full((size, size, 3), background, np.float32)
    return as_tensor(
        np.stack([np.broadcast_to(item.get(name, empty)[:, :, :3], empty.shape) for item in maps]).astype(np.float32)
    )


def textured(mesh, baked, maps, size):
    """What SaveGLB writes with its maps; and the maps as IMAGEs."""
    normal, occlusion = pictures(maps, "normal", size, (0.5, 0.5, 1)), pictures(maps, "ao", size, 1)
    color = pictures(maps, "color", size, 1)
    rough = np.array(as_numpy(occlusion))
    rough[..., 1:] = 1, 0
    has = {name for item in maps for name in item}
    batch = [{**arrays_of(item), "tangents": item.tangents} for item in baked]
    made = batch_of(
        mesh,
        batch,
        texture=color if "color" in has else None,
        normal_map=normal if "normal" in has else None,
        metallic_roughness=as_tensor(rough) if "ao" in has else None,
        occlusion_in_mr="ao" in has,
    )
    return made, normal, occlusion, color


def progress():
    """Updates ComfyUI's progress bar and checks its cancel button, if ComfyUI runs."""
    utils, management = (sys.modules.get("comfy." + name) for name in ("utils", "model_management"))
    bar = utils.ProgressBar(1000) if utils else None

    def report(done, stage):
        if management:
            management.throw_exception_if_processing_interrupted()
        if bar:
            bar.update_absolute(int(1000 * done), 1000)

    return report


def maps_of(names, mesh, texture):
    colored = mesh.colors is not None or (texture is not None and mesh.uvs is not None)
    return [name for name in names if name != "color" or colored]


class KilnSimplify:
    """Simplifies a dense mesh, after repairing cracks and removing duplicate and hidden parts."""

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "mesh": ("MESH",),
                "target_face_count": FACES,
                "clean": ("BOOLEAN", {"default": True}),
            }
        }

    RETURN_TYPES = ("MESH",)
    RETURN_NAMES = ("mesh",)
    FUNCTION = "run"
    CATEGORY = "3d/mesh"

    def run(self, mesh, target_face_count, clean=True):
        batch = []
        for high, _ in items(mesh):
            high = kiln.clean(high, progress=progress()) if clean else high
            batch.append(arrays_of(kiln.simplify(high, target=target_face_count, progress=progress())))
        return (batch_of(mesh, batch),)


class KilnUnwrap:
    """Unwraps a mesh into few charts. Vertices at seams are duplicated."""

    @classmethod
    def INPUT_TYPES(cls):
        return {"required": {"mesh": ("MESH",), "resolution": SIZE}}

    RETURN_TYPES = ("MESH",)
    RETURN_NAMES = ("mesh",)
    FUNCTION = "run"
    CATEGORY = "3d/mesh"

    def run(self, mesh, resolution):
        batch = [
            arrays_of(kiln.pack_glb(kiln.unwrap(item, size=resolution, progress=progress()), {}))
            for item, _ in items(mesh)
        ]
        return (batch_of(mesh, batch),)


class KilnBake:
    """The dense mesh's normals, occlusion and colours as pictures for the light one's UVs.

    The mesh that comes out has them and its tangents: SaveGLB writes it as it is.
    """

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "low_poly": ("MESH",),
                "high_poly": ("MESH",),
                "resolution": SIZE,
                "match": (["ray", "closest", "visibility", "hybrid", "views"],),
            }
        }

    RETURN_TYPES = ("MESH", "IMAGE", "IMAGE", "IMAGE")
    RETURN_NAMES = ("mesh", "normal_map", "occlusion", "base_color")
    FUNCTION = "run"
    CATEGORY = "3d/texturing"

    def run(self, low_poly, high_poly, resolution, match="ray"):
        highs, lows = list(items(high_poly)), list(items(low_poly))
        if len(highs) not in (1, len(lows)):
            raise ValueError(f"{len(lows)} low polys, but {len(highs)} high polys: give one, or one for each.")
        baked, maps = [], []
        for i, (low, _) in enumerate(lows):
            if low.uvs is None:
                raise ValueError("low_poly has no UVs: put Kiln Unwrap before this node.")
            high, texture = highs[i % len(highs)]
            names = maps_of(["normal", "ao", "color"], high, texture)
            given = {"color": texture} if "color" in names and texture is not None and high.uvs is not None else {}
            bake = kiln.bake(high, low, size=resolution, maps=names, match=match, textures=given, progress=progress())
            maps.append({name: bake.stored(name) for name in bake})
            baked.append(kiln.pack_glb(low, {}))
        return textured(low_poly, baked, maps, resolution)


class KilnToGLB:
    """All steps in one: simplifies, unwraps and bakes a dense mesh, and returns the light mesh with maps, and its GLB."""

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "mesh": ("MESH",),
                "target_face_count": FACES,
                "texture_size": SIZE,
            },
            "optional": {
                "format": (["png", "webp", "jpeg"], {"tooltip": "Pictures in the GLB"}),
                "quality": (
                    "INT",
                    {"default": 100, "min": 1, "max": 100, "tooltip": "webp and jpeg: 100 is the best; normals stay exact"},
                ),
                "mesh_compression": (["none", "meshopt", "draco"], {"tooltip": "Readers need the extension"}),
            },
        }

    RETURN_TYPES = ("MESH", "IMAGE", "IMAGE", "IMAGE", "FILE_3D_GLB")
    RETURN_NAMES = ("mesh", "normal_map", "occlusion", "base_color", "model_3d")
    FUNCTION = "run"
    CATEGORY = "3d"

    def run(self, mesh, target_face_count, texture_size, format="png", quality=100, mesh_compression="none"):
        baked = []
        lossy = quality if format == "jpeg" or (format == "webp" and quality < 100) else None
        packing = {"format": format, "quality": lossy, "mesh_compression": mesh_compression}
        for high, texture in items(mesh):
            names = maps_of(["normal", "ao", "color"], high, texture)
            if "color" in names and texture is not None and high.uvs is not None:
                high = kiln.pack_glb(high, {"color": texture[:, :, :3]}).data
            baked.append(
                kiln.to_glb(
                    high,
                    faces_target=target_face_count,
                    texture_size=texture_size,
                    maps=names,
                    progress=progress(),
                    **packing,
                )
            )
        return (*textured(mesh, baked, [glb.maps for glb in baked], texture_size), file_of(baked[0].data))


def file_of(data):
    """ComfyUI's File3D, or bytes outside of ComfyUI. Contains the first mesh of a batch; SaveGLB writes all."""
    try:
        from comfy_api.latest import Types
    except ImportError:
        return data
    return Types.File3D(io.BytesIO(data), "glb")


NODES = {"Kiln Simplify": KilnSimplify, "Kiln Unwrap": KilnUnwrap, "Kiln Bake": KilnBake, "Kiln to GLB": KilnToGLB}
NODE_CLASS_MAPPINGS = {node.__name__: node for node in NODES.values()}
NODE_DISPLAY_NAME_MAPPINGS = {node.__name__: name for name, node in NODES.items()}
for node in NODES.values():
    node.DESCRIPTION = node.__doc__
