"""Nodes to simplify, unwrap, bake and write GLB: from MESH to MESH and IMAGE, the types of ComfyUI's own mesh nodes.

A MESH holds a batch of B meshes. Arrays of smaller meshes are padded with zeros; vertex_counts and face_counts state
the real lengths. Its fields: vertices (B, N, 3), faces
(B, M, 3), uvs (B, N, 2) with the origin at the upper left, vertex_colors (B, N, 3 or 4) linear, normals, tangents;
texture, normal_map, metallic_roughness and emissive are (B, H, W, 3) pictures; material is a dict of factors, as Set Mesh
Material makes it: base_color_factor, metallic_factor and roughness_factor (below 0: not given), emissive_factor,
emissive_strength, occlusion_strength, normal_scale, double_sided. Colours and pictures are floats in [0, 1], or uint8
from 0 to 255.

A MESH from a node of this file also has kiln_meshes: for each mesh of the batch, a hash of its arrays and the kiln.Mesh
they were made from, which knows its deviation from the high poly. If another node has changed the arrays, the hash
differs, and the arrays are used instead of the kiln.Mesh.
"""

from __future__ import annotations

import copy
import hashlib
import io
import json
import sys
import types
import warnings

import kiln
import numpy as np

#: Optional fields of MESH. Fields that a node does not set are missing in its result.
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
    "emissive",
)
FACES = ("INT", {"default": 10_000, "min": 4, "max": 50_000_000})
#: Types of the mesh inputs: ComfyUI's MESH, and the TRIMESH of other packages.
MESHES = ("MESH,TRIMESH",)
SIZE = ("INT", {"default": 2048, "min": 64, "max": 8192, "step": 64})
#: Half a step of 8 bits: values nearer than this to 0 or 1 are rounded to them.
HALF_STEP = 0.5 / 255


def as_numpy(values):
    """Converts a tensor on any device, or an array, to a NumPy array."""
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


def to_unit_range(values, name):
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


def arrays_by_mesh(mesh, name, dimensions):
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


def srgb_to_linear(values):
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def factor_of(material, name, default):
    """Returns a factor of a material; the default if it is missing or below 0."""
    value = material.get(name)
    return default if value is None or value < 0 else float(value)


class MaterialLook:
    """The material of one mesh of a batch.

    pictures      by kiln's names of maps: (H, W, C) float32 over the mesh's UVs, multiplied by the material's factors
    numbers       factors of the maps that have no picture
    double_sided  whether back faces are shown; None: the material does not state it
    """

    def __init__(self, mesh, i):
        self.material = dict(getattr(mesh, "material", None) or {})
        self.pictures, self.numbers = {}, {}
        self.double_sided = self.material.get("double_sided")
        self.strength = float(self.material.get("emissive_strength", 1))

        def picture(name):
            parts = arrays_by_mesh(mesh, name, 3)
            if parts is None or i >= len(parts) or parts[i] is None:
                return None
            return np.asarray(to_unit_range(parts[i], name), np.float32)

        base = np.array(self.material.get("base_color_factor") or (1, 1, 1, 1), float)
        base = np.append(base, 1) if len(base) == 3 else base
        self.tint = base[:3]
        texture = picture("texture")
        if texture is not None:
            tinted = texture[:, :, :3]
            if (self.tint != 1).any():
                tinted = linear_to_srgb(srgb_to_linear(tinted) * self.tint).clip(0, 1)
            self.pictures["color"] = tinted
            if texture.shape[2] == 4:
                self.pictures["opacity"] = texture[:, :, 3:] * base[3]
        if "opacity" not in self.pictures and base[3] < 1:
            self.numbers["opacity"] = float(base[3])
        surface = picture("metallic_roughness")
        for name, channel in (("roughness", 1), ("metallic", 2)):
            factor = factor_of(self.material, name + "_factor", None if surface is None else 1.0)
            if surface is not None:
                self.pictures[name] = surface[:, :, channel : channel + 1] * np.float32(factor)
            elif factor is not None:
                self.numbers[name] = factor
        if surface is not None and getattr(mesh, "occlusion_in_mr", False):
            strength = np.float32(self.material.get("occlusion_strength", 1))
            self.pictures["ao"] = 1 + strength * (surface[:, :, :1] - 1)
        emissive_color = np.array(self.material.get("emissive_factor") or (0, 0, 0), float).clip(0, 1)
        emissive = picture("emissive")
        if emissive is not None:
            emissive_color = emissive_color if emissive_color.any() else np.ones(3)  # the same default as in SaveGLB
            self.pictures["emission"] = linear_to_srgb(srgb_to_linear(emissive[:, :, :3]) * emissive_color)
        elif emissive_color.any():
            self.numbers["emission"] = emissive_color
        normal_map = picture("normal_map")
        if normal_map is not None:
            scale = float(self.material.get("normal_scale", 1))
            vectors = (2 * normal_map[:, :, :3].astype(float) - 1) * (scale, scale, 1)
            vectors /= np.maximum(np.linalg.norm(vectors, axis=2, keepdims=True), 1e-9)
            self.pictures["normal"] = (vectors / 2 + 0.5).astype(np.float32)
        self.pictures = {name: np.asarray(pixels, np.float32).clip(0, 1) for name, pixels in self.pictures.items()}


def is_trimesh(mesh):
    """True for a trimesh.Trimesh or Scene, which other packages pass as TRIMESH."""
    return hasattr(mesh, "visual") or hasattr(mesh, "geometry")


def mesh_items(mesh):
    """Yields a kiln.Mesh and its MaterialLook for each mesh of the batch; None, with a warning, for one without faces."""
    if is_trimesh(mesh):
        yield kiln.as_mesh(mesh), MaterialLook(None, 0)
        return
    parts = {name: arrays_by_mesh(mesh, name, 2) for name in ("vertices", "faces", "uvs", "vertex_colors", "normals")}
    counts = [arrays_by_mesh(mesh, name, 0) for name in ("vertex_counts", "face_counts")]
    known = dict(enumerate(getattr(mesh, "kiln_meshes", None) or ()))
    empty = 0
    for i in range(len(parts["vertices"])):
        vertices, faces = (None if count is None else int(count[i]) for count in counts)
        item = {
            name: None if part is None else part[i][: faces if name == "faces" else vertices]
            for name, part in parts.items()
        }
        if len(item["faces"]) == 0 or len(item["vertices"]) == 0:
            empty += 1
            yield None
            continue
        look = MaterialLook(mesh, i)
        if i in known and known[i][0] == digest_of(item):
            yield known[i][1], look
            continue
        uvs, colors = item.pop("uvs"), item.pop("vertex_colors")
        if uvs is not None:
            uvs = [0, 1] + uvs * [1, -1]
        if colors is not None:
            colors = to_unit_range(colors, "vertex_colors")
            colors = np.hstack([linear_to_srgb(colors[:, :3] * look.tint).clip(0, 1), colors[:, 3:]])
        yield kiln.Mesh(uvs=uvs, colors=colors, **item), look
    if empty:
        text = f"{empty} of {i + 1} meshes of the batch have no faces: they are left out."
        warnings.warn(kiln.KilnWarning(text, "empty-mesh", empty), stacklevel=2)
        if empty == i + 1:
            raise ValueError("No mesh of the batch has faces.")


def items_with_faces(mesh):
    """Returns those of mesh_items() that have faces."""
    return [item for item in mesh_items(mesh) if item is not None]


def new_mesh():
    """Creates a MESH of ComfyUI; outside ComfyUI, an object with the same fields."""
    try:
        from comfy_api.latest import Types
    except ImportError:
        fields = ("vertices", "faces", *OPTIONAL, "material")
        return types.SimpleNamespace(**dict.fromkeys(fields), unlit=False, occlusion_in_mr=False)
    return Types.MESH(vertices=None, faces=None)


def batch_of(mesh, batch, **fields):
    """Makes a MESH with the type of the given one from results of arrays_of()."""
    made = new_mesh() if mesh is None or is_trimesh(mesh) else copy.copy(mesh)
    for name in OPTIONAL:
        if hasattr(made, name):
            setattr(made, name, None)
    made.occlusion_in_mr = False
    for name in ("vertices", "faces", "uvs", "normals", "tangents"):
        arrays = [item[name] for item in batch if item.get(name) is not None]
        if not arrays:
            continue
        padded = np.zeros((len(arrays), max(map(len, arrays)), arrays[0].shape[1]), arrays[0].dtype)
        for i, array in enumerate(arrays):
            padded[i, : len(array)] = array
        setattr(made, name, as_tensor(padded))
    if len(batch) > 1:
        made.vertex_counts = as_tensor(np.array([len(item["vertices"]) for item in batch]))
        made.face_counts = as_tensor(np.array([len(item["faces"]) for item in batch]))
    for name, value in fields.items():
        setattr(made, name, value)
    made.kiln_meshes = [(digest_of(item), item["kiln_mesh"]) for item in batch]
    return made


def arrays_of(low):
    """Returns the arrays of a kiln.Mesh or kiln.Glb by the names of MESH fields, with the kiln.Mesh as "kiln_mesh"."""
    parts = {
        "vertices": np.asarray(low.vertices, np.float32),
        "faces": low.faces.astype(np.int64),
        "normals": low.normals,
        "kiln_mesh": getattr(low, "mesh", low),
    }
    if low.uvs is not None:
        parts["uvs"] = np.float32([0, 1]) + low.uvs * np.float32([1, -1])
    return parts


def image_batch(maps, name, size, background):
    """Returns an IMAGE (B, H, W, 3) with the map of each item, or the background colour for items without it."""
    empty = np.full((size, size, 3), background, np.float32)
    return as_tensor(
        np.stack([np.broadcast_to(item.get(name, empty)[:, :, :3], empty.shape) for item in maps]).astype(np.float32)
    )


def make_textured_mesh(mesh, baked, maps, looks, size, double_sided):
    """Returns a MESH with all maps, which SaveGLB writes unchanged; then each map as an output of the node.

    maps          per mesh of the batch: its maps by kiln's names, with the values that files store
    double_sided  per mesh of the batch: whether back faces are shown; None: not stated
    """
    for item, look in zip(maps, looks):
        for name in ("roughness", "metallic", "opacity"):
            if name not in item and name in look.numbers:
                item[name] = np.full((1, 1, 1), look.numbers[name], np.float32)
    normal, occlusion = image_batch(maps, "normal", size, (0.5, 0.5, 1)), image_batch(maps, "ao", size, 1)
    color = image_batch(maps, "color", size, 1)
    channels = [as_numpy(image_batch(maps, name, size, other)) for name, other in (("ao", 1), ("roughness", 1), ("metallic", 0))]
    surface = as_tensor(np.concatenate([part[..., :1] for part in channels], axis=3))
    alpha = as_tensor(np.ascontiguousarray(as_numpy(image_batch(maps, "opacity", size, 1))[..., 0]))
    has = {name for item in maps for name in item}
    texture = color
    if "color" in has and "opacity" in has:
        texture = as_tensor(np.concatenate([as_numpy(color), as_numpy(alpha)[..., None]], axis=3))
    # The pictures include the factors, so the factors become 1.
    material = dict(looks[0].material)
    for name in ("metallic_factor", "roughness_factor", "occlusion_strength", "normal_scale"):
        material.pop(name, None)
    if "color" in has:
        material.pop("base_color_factor", None)
    if "emission" in has:
        material.pop("emissive_factor", None)
    if any(sides is not None for sides in double_sided):
        material["double_sided"] = any(double_sided)
    batch = [{**arrays_of(item), "tangents": item.tangents} for item in baked]
    made = batch_of(
        mesh,
        batch,
        texture=texture if "color" in has else None,
        normal_map=normal if "normal" in has else None,
        metallic_roughness=surface if has & {"ao", "roughness", "metallic"} else None,
        occlusion_in_mr="ao" in has,
        emissive=image_batch(maps, "emission", size, 0) if "emission" in has else None,
        material=material or None,
    )
    return made, normal, occlusion, color, surface, alpha


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


def maps_of(names, mesh, look):
    colored = mesh.colors is not None or ("color" in look.pictures and mesh.uvs is not None)
    return [name for name in names if name != "color" or colored]


class KilnSimplify:
    """Simplifies a dense mesh, after repairing cracks and removing duplicate and hidden parts."""

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "mesh": MESHES,
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
        for high, _ in items_with_faces(mesh):
            high = kiln.clean(high, progress=progress()) if clean else high
            batch.append(arrays_of(kiln.simplify(high, target=target_face_count, progress=progress())))
        return (batch_of(mesh, batch),)


class KilnUnwrap:
    """Unwraps a mesh into few charts. Vertices at seams are duplicated."""

    @classmethod
    def INPUT_TYPES(cls):
        return {"required": {"mesh": MESHES, "resolution": SIZE}}

    RETURN_TYPES = ("MESH",)
    RETURN_NAMES = ("mesh",)
    FUNCTION = "run"
    CATEGORY = "3d/mesh"

    def run(self, mesh, resolution):
        batch = [
            arrays_of(kiln.pack_glb(kiln.unwrap(item, size=resolution, progress=progress()), {}, double_sided=False))
            for item, _ in items_with_faces(mesh)
        ]
        return (batch_of(mesh, batch),)


class KilnBake:
    """Bakes the dense mesh's normals, occlusion and material into pictures for the light mesh's UVs.

    The resulting mesh contains them and its tangents: SaveGLB writes it unchanged.
    """

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "low_poly": MESHES,
                "high_poly": MESHES,
                "resolution": SIZE,
                "match": (["ray", "closest", "visibility", "hybrid", "views"],),
            },
            "optional": {
                "cage_distance": (
                    "FLOAT",
                    {
                        "default": 0.0,
                        "min": 0.0,
                        "max": 1e9,
                        "step": 0.001,
                        "tooltip": "Rays start at this distance outside, in the mesh's units; 0: chosen from the meshes",
                    },
                ),
                "two_sided": ("BOOLEAN", {"default": False, "tooltip": "Rays hit back faces of the dense mesh, too"}),
                "double_sided": (DOUBLE_SIDED_CHOICES, {"tooltip": "Whether the light mesh shows back faces; auto: if it is open"}),
            },
        }

    RETURN_TYPES = ("MESH", "IMAGE", "IMAGE", "IMAGE", "IMAGE", "MASK")
    RETURN_NAMES = ("mesh", "normal_map", "occlusion", "base_color", "metallic_roughness", "alpha")
    FUNCTION = "run"
    CATEGORY = "3d/texturing"

    def run(self, low_poly, high_poly, resolution, match="ray", cage_distance=0.0, two_sided=False, double_sided="auto"):
        highs, lows = list(mesh_items(high_poly)), list(mesh_items(low_poly))
        if len(highs) not in (1, len(lows)):
            raise ValueError(f"{len(lows)} low polys, but {len(highs)} high polys: give one, or one for each.")
        baked, maps, looks, sides = [], [], [], []
        for i, low_item in enumerate(lows):
            high_item = highs[i % len(highs)]
            if low_item is None or high_item is None:
                continue
            (low, _), (high, look) = low_item, high_item
            if low.uvs is None:
                raise ValueError("low_poly has no UVs: insert Kiln Unwrap before this node.")
            names = maps_of(["normal", "ao", "color"], high, look)
            given, keywords = {}, {}
            if high.uvs is not None:
                for name, pixels in look.pictures.items():
                    transfer_name, kind = TRANSFER_BY_PICTURE[name]
                    given[transfer_name] = (pixels, kind)
            elif look.pictures:
                text = f"high_poly has no UVs: its pictures are left out ({', '.join(look.pictures)})."
                warnings.warn(kiln.KilnWarning(text, "pictures-left-out", len(look.pictures)), stacklevel=2)
            if cage_distance > 0:
                keywords["cage"] = float(cage_distance)
            if two_sided:
                keywords["two_sided"] = True
            bake = kiln.bake(
                high, low, size=resolution, maps=names, match=match, textures=given, progress=progress(), **keywords
            )
            own = {name: bake.stored(name) for name in bake}
            if "normals" in own:
                own["normal"] = own.pop("normals")
            if "alpha" in own:
                own["opacity"] = own.pop("alpha")
            if "occlusion" in own:
                own["ao"] = np.minimum(own["ao"], own.pop("occlusion")[:, :, :1])
            maps.append(own)
            looks.append(look)
            packed = kiln.pack_glb(low, {}, double_sided=double_sided_of(double_sided, look))
            sides.append(material_of(packed.data).get("doubleSided", False))
            baked.append(packed)
        if not baked:
            raise ValueError("No pair of meshes has faces: connect meshes with faces.")
        return make_textured_mesh(low_poly, baked, maps, looks, resolution, sides)


#: Values for whether back faces are shown.
DOUBLE_SIDED_CHOICES = ["auto", "yes", "no"]
#: Per picture of a mesh: the name of the transferred map, and its kind for kiln.bake(). The pictures of normals and
#: occlusion need names of their own, since kiln.bake() also bakes `normal` and `ao` from the mesh's shape.
TRANSFER_BY_PICTURE = {
    "color": ("color", "srgb"),
    "emission": ("emission", "srgb"),
    "opacity": ("alpha", "linear"),
    "roughness": ("roughness", "linear"),
    "metallic": ("metallic", "linear"),
    "normal": ("normals", "normal"),
    "ao": ("occlusion", "linear"),
}


def double_sided_of(choice, look):
    """Returns double_sided for kiln.pack_glb() and to_glb(): the node's choice, else the material's, else auto."""
    if choice != "auto" or look.double_sided is None:
        return choice
    return bool(look.double_sided)


def gltf_json_of(data):
    return json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])


def material_of(data):
    return gltf_json_of(data)["materials"][0]


def replace_gltf_json(data, document):
    """Returns a GLB with its JSON replaced."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + int.from_bytes(data[12:16], "little") :]
    head = b"".join(number.to_bytes(4, "little") for number in (2, 20 + len(text) + len(rest), len(text)))
    return b"glTF" + head + b"JSON" + text + rest


def as_source_glb(high, look):
    """Returns a dense mesh with its pictures and factors as a GLB for kiln.to_glb(); the mesh itself if it has none."""
    if high.uvs is None or not look.pictures:
        if look.pictures:
            text = f"The mesh has no UVs: its pictures are left out ({', '.join(look.pictures)})."
            warnings.warn(kiln.KilnWarning(text, "pictures-left-out", len(look.pictures)), stacklevel=2)
        return high
    data = kiln.pack_glb(high, look.pictures, alpha="blend", double_sided=bool(look.double_sided)).data
    document = gltf_json_of(data)
    (material,) = document["materials"]
    for name, value in look.numbers.items():
        set_material_factor(material, name, value)
    if "emission" in look.pictures and look.strength != 1:
        material.setdefault("extensions", {})["KHR_materials_emissive_strength"] = {"emissiveStrength": look.strength}
        document["extensionsUsed"] = sorted({*document.get("extensionsUsed", []), "KHR_materials_emissive_strength"})
    return replace_gltf_json(data, document)


def set_material_factor(material, name, value):
    """Sets a factor of a glTF material that no picture contains."""
    surface = material.setdefault("pbrMetallicRoughness", {})
    if name in ("roughness", "metallic"):
        surface[name + "Factor"] = value
    elif name == "opacity":
        surface["baseColorFactor"] = [*surface.get("baseColorFactor", [1, 1, 1])[:3], value]
        material["alphaMode"] = "BLEND"
    elif name == "emission":
        material["emissiveFactor"] = [float(part) for part in value]


class KilnToGLB:
    """Simplifies, unwraps and bakes a dense mesh in one step, and returns the light mesh with its maps, and its GLB."""

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {
                "mesh": MESHES,
                "target_face_count": FACES,
                "texture_size": SIZE,
            },
            "optional": {
                "format": (
                    ["png", "webp", "jpeg"],
                    {"tooltip": "Format of the GLB's pictures; png with max_bytes: PNG or JPEG, whichever is smaller"},
                ),
                "quality": (
                    "INT",
                    {
                        "default": 100,
                        "min": 1,
                        "max": 100,
                        "tooltip": "Quality of webp and jpeg; normals stay exact",
                    },
                ),
                "mesh_compression": (
                    ["none", "meshopt", "draco"],
                    {"tooltip": "Compresses the mesh; programs that read the GLB need this extension"},
                ),
                "max_bytes": (
                    "INT",
                    {
                        "default": 0,
                        "min": 0,
                        "max": 2**31 - 1,
                        "tooltip": "Maximum size of the GLB, from which sizes and encodings of pictures are chosen; 0: no limit",
                    },
                ),
                "double_sided": (DOUBLE_SIDED_CHOICES, {"tooltip": "Whether back faces are shown; auto: if the mesh is open"}),
            },
        }

    RETURN_TYPES = ("MESH", "IMAGE", "IMAGE", "IMAGE", "FILE_3D_GLB", "IMAGE", "MASK")
    RETURN_NAMES = ("mesh", "normal_map", "occlusion", "base_color", "model_3d", "metallic_roughness", "alpha")
    FUNCTION = "run"
    CATEGORY = "3d"

    def run(
        self,
        mesh,
        target_face_count,
        texture_size,
        format="png",
        quality=100,
        mesh_compression="none",
        max_bytes=0,
        double_sided="auto",
    ):
        baked, maps, looks, sides, files = [], [], [], [], []
        lossy = quality if format == "jpeg" or (format == "webp" and quality < 100) else None
        packing = {"format": format, "quality": lossy, "mesh_compression": mesh_compression}
        if max_bytes:
            packing["max_bytes"] = max_bytes
            if format == "png":
                del packing["format"]  # PNG or JPEG is chosen, whichever is smaller
        for high, look in items_with_faces(mesh):
            asset = as_source_glb(high, look)
            glb = kiln.to_glb(
                asset,
                faces_target=target_face_count,
                texture_size=texture_size,
                double_sided=double_sided_of(double_sided, look),
                progress=progress(),
                **packing,
            )
            data = glb.data
            if asset is high and look.numbers:
                document = gltf_json_of(data)
                for material in document["materials"]:
                    for name, value in look.numbers.items():
                        set_material_factor(material, name, value)
                data = replace_gltf_json(data, document)
            baked.append(glb)
            files.append(data)
            maps.append(dict(glb.maps))
            looks.append(look)
            sides.append(material_of(data).get("doubleSided", False))
        made, normal, occlusion, color, surface, alpha = make_textured_mesh(mesh, baked, maps, looks, texture_size, sides)
        return made, normal, occlusion, color, file_of(files[0]), surface, alpha


class KilnLoadMesh:
    """Loads a file as MESH: PLY, OBJ, STL, OFF, glTF, FBX, DAE, 3DS or X. Its materials are kept for Kiln to GLB."""

    @classmethod
    def INPUT_TYPES(cls):
        return {
            "required": {"path": ("STRING", {"default": ""})},
            "optional": {"up_axis": (["y", "z", "x", "-x", "-y", "-z"], {"tooltip": "Up axis of files that do not state it"})},
        }

    RETURN_TYPES = ("MESH",)
    RETURN_NAMES = ("mesh",)
    FUNCTION = "run"
    CATEGORY = "3d/mesh"

    def run(self, path, up_axis="y"):
        if not path.strip():
            raise ValueError("path is empty: give the file of a mesh.")
        loaded = kiln.load(path.strip(), up=up_axis)
        return (mesh_of(loaded),)

    @classmethod
    def IS_CHANGED(cls, path, up_axis="y"):
        """Tells ComfyUI to run the node again if the file was saved again."""
        try:
            with open(path.strip(), "rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            return float("nan")


def mesh_of(loaded):
    """Converts a kiln.Mesh to MESH: one row per vertex, which is split where UVs or normals differ."""
    corner = [loaded.faces, loaded.uv_faces, loaded.normal_faces]
    used = [part for part in corner if part is not None]
    keys = np.stack([part.ravel().astype(np.int64) for part in used], axis=1)
    rows, inverse = np.unique(keys, axis=0, return_inverse=True)
    item = {
        "vertices": np.asarray(loaded.vertices, np.float32)[rows[:, 0]],
        "faces": inverse.reshape(-1, 3).astype(np.int64),
        "kiln_mesh": loaded,
    }
    if loaded.uvs is not None:
        item["uvs"] = np.float32([0, 1]) + loaded.uvs[rows[:, 1]] * np.float32([1, -1])
    if loaded.normals is not None:
        item["normals"] = loaded.normals[rows[:, len(used) - 1]]
    made = batch_of(None, [item])
    if loaded.colors is not None:
        colors = loaded.colors[rows[:, 0]].astype(np.float32) / 255
        colors[:, :3] = srgb_to_linear(colors[:, :3])
        made.vertex_colors = as_tensor(colors[None].astype(np.float32))
        made.kiln_meshes = [(digest_of({**item, "vertex_colors": colors.astype(np.float32)}), loaded)]
    return made


def file_of(data):
    """Returns ComfyUI's File3D, or bytes outside ComfyUI. It contains the first mesh of a batch; SaveGLB writes all."""
    try:
        from comfy_api.latest import Types
    except ImportError:
        return data
    return Types.File3D(io.BytesIO(data), "glb")


NODES = {
    "Kiln Load Mesh": KilnLoadMesh,
    "Kiln Simplify": KilnSimplify,
    "Kiln Unwrap": KilnUnwrap,
    "Kiln Bake": KilnBake,
    "Kiln to GLB": KilnToGLB,
}
NODE_CLASS_MAPPINGS = {node.__name__: node for node in NODES.values()}
NODE_DISPLAY_NAME_MAPPINGS = {node.__name__: name for name, node in NODES.items()}
for node in NODES.values():
    node.DESCRIPTION = node.__doc__
