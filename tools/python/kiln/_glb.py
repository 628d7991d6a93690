"""kiln.to_glb(): converts a dense mesh to a light one with its maps in one file."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _core
from ._bake import Bake, error_bound
from ._core import Mesh
from ._errors import Error, count_of, device_of, path_of, suppress_warning, unknown_keyword
from ._meshes import as_mesh, scene_data
from ._options import json_of, select_keywords, to_plain_values
from ._plan import screen_of
from ._progress import callback_of
from ._surface import clean_with_progress

if TYPE_CHECKING:
    import numpy as np

#: Maps that a GLB's material can contain, with their numbers of channels.
SLOTS = {"normal": 3, "ao": 1, "color": 3, "opacity": 1, "roughness": 1, "metallic": 1, "emission": 3}
#: Maps that only a material of the high poly can provide.
OF_MATERIALS = ("roughness", "metallic", "emission")


#: Names of glTF extensions, as in the JSON, that compress triangles. A Glb cannot give such triangles as arrays.
_COMPRESSION_EXTENSIONS = (b"EXT_meshopt_compression", b"KHR_draco_mesh_compression")


class Glb:
    """A light mesh with its maps.

    data      the file's bytes
    mesh      the light kiln.Mesh
    maps      by name (H, W, C) float32 in [0, 1], as in the file: colours sRGB-encoded; row 0 at the top
    emission_strength
              radiance of the value 1 in the map emission
    bake      the kiln.Bake of the maps, with its report
    vertices, faces, uvs, normals, tangents
              as arrays for renderers, with one list of indices: (V, 3), (F, 3), (V, 2) with the origin at the lower
              left, (V, 3), and (V, 4) with the bitangent's sign
    """

    def __init__(
        self, data: bytes, mesh: Mesh, maps: dict[str, np.ndarray], baked: Bake | None, emission_strength: float = 1
    ) -> None:
        self.data = data
        self.mesh = mesh
        self.maps = maps
        self.bake = baked
        self.emission_strength = emission_strength
        self._parts: dict[str, np.ndarray] = {}

    def __bytes__(self) -> bytes:
        return self.data

    def __repr__(self) -> str:
        return f"<kiln.Glb of {len(self.mesh.faces)} faces, {', '.join(self.maps)}; {len(self.data)} bytes>"

    def _part(self, name: str) -> np.ndarray:
        if not self._parts:
            packed = any(name in self.data[: 20 + int.from_bytes(self.data[12:16], "little")] for name in _COMPRESSION_EXTENSIONS)
            plain = _core.encode_glb(self.mesh, {}, "mask", "no") if packed else self.data
            self._parts = arrays_of(plain)
        return self._parts[name]

    @property
    def vertices(self) -> np.ndarray:
        """(V, 3) float32, world units; float64 if the mesh is far from the origin."""
        return self._part("vertices")

    @property
    def faces(self) -> np.ndarray:
        """(F, 3) integers: rows of the other arrays."""
        return self._part("faces")

    @property
    def uvs(self) -> np.ndarray:
        """(V, 2) float32, origin at the lower left."""
        return self._part("uvs")

    @property
    def normals(self) -> np.ndarray:
        """(V, 3) float32."""
        return self._part("normals")

    @property
    def tangents(self) -> np.ndarray:
        """(V, 4) float32: along u, and the bitangent's sign; zeros at vertices of materials without a normal map,
        which alone needs tangents. (0, 4) if no material has one."""
        return self._part("tangents")


def arrays_of(data: bytes) -> dict[str, np.ndarray]:
    """Vertices with all attributes, and one list of indices, of a GLB written by Kiln, in scene space."""
    import json

    import numpy as np

    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    start = 20 + length + 8
    types = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}

    def values(index: int) -> np.ndarray:
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        first = start + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        dtype = types[accessor["componentType"]]
        stride = view.get("byteStride", width * np.dtype(dtype).itemsize)
        return np.ndarray((accessor["count"], width), dtype, data, first, (stride, np.dtype(dtype).itemsize))

    parts: dict[str, list[np.ndarray]] = {name: [] for name in ("vertices", "faces", "uvs", "normals", "tangents")}
    any_tangents: list[bool] = []
    count = 0

    def add(primitive: dict[str, Any], world: np.ndarray) -> None:
        nonlocal count
        attributes = primitive["attributes"]
        if "TEXCOORD_0" not in attributes:  # a primitive without UVs is a collision hull
            return
        positions, normals = values(attributes["POSITION"]), values(attributes["NORMAL"])
        has_tangents = "TANGENT" in attributes
        tangents = values(attributes["TANGENT"]) if has_tangents else np.zeros((len(positions), 4), np.float32)
        any_tangents.append(has_tangents)
        faces = values(primitive["indices"]).reshape(-1, 3).astype(np.uint32) + np.uint32(count)
        if (world != np.eye(4)).any():
            linear = world[:3, :3]
            positions = positions @ linear.T + world[:3, 3]
            normals = _unit(normals @ np.linalg.inv(linear)).astype(np.float32)
            if has_tangents:
                along = _unit(tangents[:, :3] @ linear.T)
                sign = tangents[:, 3:] * np.sign(np.linalg.det(linear))
                tangents = np.concatenate([along, sign], axis=1).astype(np.float32)
            if np.linalg.det(linear) < 0:
                faces = faces[:, ::-1]
        parts["vertices"].append(positions)
        parts["faces"].append(faces)
        parts["uvs"].append(np.array([0, 1], np.float32) + values(attributes["TEXCOORD_0"]) * np.array([1, -1], np.float32))
        parts["normals"].append(normals)
        parts["tangents"].append(tangents)
        count += len(positions)

    def visit(index: int, parent: np.ndarray) -> None:
        node = document["nodes"][index]
        world = parent @ _transform_of(node)
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            add(primitive, world)
        for child in node.get("children", ()):
            visit(child, world)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, np.eye(4))
    if not any(any_tangents):
        parts["tangents"] = [np.zeros((0, 4), np.float32)]
    return {name: np.concatenate(arrays) for name, arrays in parts.items()}


def _unit(vectors: np.ndarray) -> np.ndarray:
    import numpy as np

    lengths: np.ndarray = np.linalg.norm(vectors, axis=1, keepdims=True)
    scaled: np.ndarray = vectors / np.maximum(lengths, np.finfo(np.float64).tiny)
    return scaled


def _transform_of(node: Mapping[str, Any]) -> np.ndarray:
    """A node's local matrix as Kiln writes it: a matrix, or a translation and a scale."""
    import numpy as np

    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    matrix = np.eye(4)
    matrix[[0, 1, 2], [0, 1, 2]] = node.get("scale", [1, 1, 1])
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def sampled(
    found: _core.Match,
    sample: Callable[[np.ndarray], Any],
    device: str | int = "",
    padding: int = 16,
) -> dict[str, np.ndarray]:
    """Evaluates a function of positions into maps.

    found    result of kiln.match(): the points of the high poly
    sample   called with positions (N, 3) float64, world units. It returns (N, 3): the map color; (N, 4): color and
             opacity; or a dict of maps by name, (N,) or (N, C). uint8 values are divided by 255
    padding  texels filled around charts

    A texel is the mean of its matched samples. Returns a dict of (H, W, C) float32 by name.
    """
    import numpy as np

    if not isinstance(found, _core.Match):
        raise Error(f"found: expected a kiln.Match, not {type(found).__name__}.", "option-type", "usage", "found")
    hit = found.face >= 0
    values = sample(found.position[hit])
    if not isinstance(values, Mapping):
        array = np.asarray(values)
        if array.ndim != 2 or array.shape[1] not in (3, 4):
            raise Error(
                f"sample: expected ({hit.sum()}, 3) or ({hit.sum()}, 4), colours without or with opacity, or a dict of "
                f"maps, not {array.shape}.",
                "array-shape",
                "usage",
                "sample",
            )
        values = {"color": array[:, :3]}
        if array.shape[1] == 4:
            values["opacity"] = array[:, 3]
    n = found.samples
    height, width = hit.shape[0] // n, hit.shape[1] // n
    hits = hit.reshape(height, n, width, n).sum((1, 3))
    covered = (found.status != 0).reshape(height, n, width, n).any((1, 3))
    coverage = np.where(hits > 0, 1, np.where(covered, 2, 0)).astype(np.uint8)
    maps = {}
    for name, given in values.items():
        array = np.asarray(given)
        if array.dtype == np.uint8:
            array = array / np.float32(255)
        if array.ndim == 1:
            array = array[:, None]
        if array.ndim != 2 or len(array) != hit.sum() or not 1 <= array.shape[1] <= 4 or array.dtype.kind not in "fiu":
            raise Error(
                f"sample: '{name}' should be ({hit.sum()},) or ({hit.sum()}, 1 to 4) numbers, one row per matched sample, "
                f"not {array.dtype} {array.shape}.",
                "array-shape",
                "usage",
                "sample",
            )
        if not np.isfinite(array).all():
            raise Error(f"sample: '{name}' has values that are not finite.", "array-range", "usage", "sample")
        grid = np.zeros((*hit.shape, array.shape[1]), np.float64)
        grid[hit] = array
        sums = grid.reshape(height, n, width, n, -1).sum((1, 3))
        mean = (sums / np.maximum(hits, 1)[..., None]).astype(np.float32)
        maps[name] = _core.pad(device_of(device), mean, coverage, padding, True, False)
    return maps


def pack_glb(
    low: Any,
    maps: Mapping[str, Any],
    *,
    path: str | os.PathLike[str] | None = None,
    double_sided: bool | str = "auto",
    alpha: str = "mask",
) -> Glb:
    """Writes a mesh with UVs and your own maps as a GLB.

    low           the mesh, as kiln.as_mesh() takes it, with UVs
    maps          a dict of maps by name: normal, ao, color, opacity, roughness, metallic, emission; each (H, W) or
                  (H, W, C), uint8, or float in [0, 1], colours sRGB-encoded, row 0 at the top; may be empty. The maps
                  of a kiln.Bake are {name: bake.stored(name)}
    path          also write the GLB to this file, NAME.glb
    double_sided  whether back faces are shown: True, False, or "auto": if views from outside see many of them through
                  borders of an open mesh, which gives the warning `double-sided`
    alpha         alpha mode if there is a map opacity: mask or blend

    Returns a kiln.Glb. Raises kiln.Error.

    >>> import kiln
    >>> corners, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> square = kiln.Mesh(corners, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> kiln.pack_glb(square, {"normal": [[[0.5, 0.5, 1.0]]]}).tangents[0]
    array([1., 0., 0., 1.], dtype=float32)
    """
    from ._arrays import image

    if not isinstance(maps, Mapping):
        raise Error(f"maps: expected a dict by name, not {type(maps).__name__}.", "option-type", "usage", "maps")
    _check_slots("maps", maps)
    _check_output(path, alpha)
    sides = _sides_of(double_sided)
    mesh = as_mesh(low, "low")
    files = {name: image(maps[name], "maps") for name in SLOTS if name in maps}
    _check_pictures("maps", files)
    data = _core.encode_glb(mesh, files, alpha, sides)
    _write(data, path)
    return Glb(data, mesh, files, None)


def _check_slots(parameter: str, maps: Iterable[str]) -> None:
    wrong = [name for name in maps if not isinstance(name, str) or name not in SLOTS]
    if wrong:
        raise Error(
            f"{parameter}: a GLB's material has no place for {', '.join(map(str, wrong))}: give some of {', '.join(SLOTS)}.",
            "option-enum",
            "usage",
            parameter,
        )


def _check_pictures(parameter: str, files: Mapping[str, np.ndarray]) -> None:
    from ._arrays import check_shares

    for name, pixels in files.items():
        if pixels.shape[2] != SLOTS[name]:
            raise Error(
                f"{parameter}: '{name}' has {pixels.shape[2]} channels: give {SLOTS[name]}.",
                "array-shape",
                "usage",
                parameter,
            )
        check_shares(pixels, parameter, f"'{name}'")


def _check_output(path: str | os.PathLike[str] | None, alpha: str) -> None:
    if path is not None:
        if Path(path_of(path)).suffix.lower() not in ("", ".glb"):
            raise Error(f"path: '{path}' would hold a GLB: name it .glb.", "output-name", "usage", "path")
        _core.prepare_file(path_of(path))  # the folder is created, as the command does
    if not isinstance(alpha, str) or alpha not in ("mask", "blend"):
        raise Error(f"alpha: '{alpha}' is neither mask nor blend.", "option-enum", "usage", "alpha")


def _sides_of(double_sided: Any) -> str:
    """Converts double_sided to a value of the command's flag."""
    if double_sided is None or double_sided is True or double_sided is False:
        return {None: "auto", True: "yes", False: "no"}[double_sided]
    if isinstance(double_sided, str) and double_sided in ("auto", "yes", "no"):
        return double_sided
    if type(double_sided).__name__ in ("bool", "bool_"):  # NumPy's booleans
        return "yes" if double_sided else "no"
    text = f'double_sided: {double_sided!r}: give True, False or "auto".'
    raise Error(text, "option-type", "usage", "double_sided", repr(double_sided), "True, False, auto")


def to_glb(
    vertices: Any,
    faces: Any = None,
    *,
    colors: Any = None,
    faces_target: int | None = None,
    max_error: str | float | None = None,
    max_bytes: int | str | None = None,
    texture_size: int = 2048,
    maps: Sequence[str] | None = None,
    sample: Callable[[np.ndarray], Any] | None = None,
    path: str | os.PathLike[str] | None = None,
    format: str | None = None,
    quality: int | None = None,
    normal_error: float | None = None,
    dither: str | bool | None = None,
    fallback_textures: bool = False,
    mesh_compression: str | None = None,
    double_sided: bool | str | None = "auto",
    alpha: str | None = None,
    weld: float = 1e-5,
    orient: bool = True,
    fill_holes: float | bool | str = True,
    drop_floaters: float | bool = True,
    drop_hidden: bool = True,
    screen: int | str | None = None,
    max_outline: str | None = None,
    high_normals: str | float = "auto",
    device: str | int = "",
    name: str | None = None,
    up: str | None = None,
    progress: Any = None,
    **keywords: Any,
) -> Glb:
    """Converts a dense mesh to a GLB of a light one with baked maps.

    vertices, faces  arrays (V, 3) and (F, 3); or only `vertices`: what kiln.as_mesh() takes
    colors           colours of the vertices, (V, 3) or (V, 4), sRGB-encoded: uint8, or float in [0, 1]
    faces_target     number of triangles of the light mesh; default: 10,000. A mesh with fewer triangles keeps them all
    max_error        instead of faces_target: the largest error of rendered normals, such as "normal=3deg"; see
                     kiln.plan()
    max_bytes        the largest size of the file, such as 500_000 or "500K". Within it, Kiln minimises the rendered
                     error: it chooses the number of triangles (without faces_target), and the sizes and encodings of
                     the pictures: PNG and JPEG, or only `format`
    texture_size     texels per side of the maps; with max_error or max_bytes, the largest size
    maps             names of maps: normal, ao, color, opacity; and roughness, metallic, emission from materials.
                     Default: normal and ao, and all maps that vertices and materials provide, including their normal
                     maps and occlusion; with `sample`, normal and ao
    sample           a function that is called once with the points of the dense mesh for all texels, (N, 3) float64. It
                     returns colours (N, 3), colours with opacity (N, 4), or a dict: color, emission (N, 3), opacity,
                     roughness, metallic (N,), all in [0, 1], colours sRGB-encoded
    path             also write the GLB to this file, NAME.glb
    format           format of the pictures: png (default), webp or jpeg. With jpeg, pictures with alpha and normal maps
                     are png
    quality          quality of lossy webp or jpeg, 1 to 100, for all pictures except normal maps
    normal_error     makes normal maps lossy, too: the largest mean error in degrees
    dither           on, off, or auto (default): dither if rounding to 8 bits would leave visible steps
    fallback_textures
                     store each WebP as PNG, too, so that readers need no extension
    mesh_compression compression of the triangles: meshopt, draco or none (default)
    double_sided     whether back faces are shown: True, False, or "auto": if materials of the dense mesh show them; and
                     without such materials, if views from outside see many of them through borders of an open mesh,
                     which gives the warning `double-sided`
    alpha            alpha mode if there is opacity: mask or blend. Default: the modes and cutoffs of the dense mesh's
                     materials, or mask if none of them is transparent
    weld, orient, fill_holes, drop_floaters, drop_hidden
                     repairs before everything else, as kiln.clean() takes them; with the map opacity, hidden parts
                     are kept
    screen, max_outline
                     with max_error: as kiln.plan() takes them
    high_normals     as kiln.Source takes it
    name             name of the mesh and its material; default: the dense mesh's name
    up               the axis that points up in arrays, and in files that do not state theirs: x, y, z, -x, -y or -z
    progress         as bake() takes it
    keywords         as bake() takes them: match, samples, fallback... Ambient occlusion is smoothed (ao_error=1)
                     unless ao_rays, ao_error, ao_by or ao_views is given, as in the command's GLB

    This runs the job of `kiln bake HIGH --sets one --out NAME.glb`: nodes and materials of a file are kept, and the
    bytes are those of the command. Repairs give warnings. Returns a kiln.Glb.
    """
    sides = _sides_of(double_sided)
    if faces is not None and hasattr(faces, "__index__") and not getattr(faces, "ndim", 0):
        text = f"faces: {faces!r}: these are triangles, (F, 3). Their number in the GLB is faces_target."
        raise Error(text, "array-type", "usage", "faces", repr(faces), "", [("faces_target", repr(faces))])
    options: dict[str, Any] = select_keywords(keywords, "to_glb", inspect.signature(to_glb).parameters)
    if "size" in options:
        raise unknown_keyword("size", "to_glb", ["texture_size"], None)
    device_name = device_of(device)
    _check_output(path, "mask" if alpha is None else alpha)
    texture_size = count_of(texture_size, "texture_size", 16, 16384)
    if faces_target is not None and max_error is not None:
        text = "faces_target: max_error chooses the number of triangles: leave one of them out."
        raise Error(text, "option-contradiction", "usage", "faces_target")
    count = count_of(10_000 if faces_target is None else faces_target, "faces_target", 1, 2**31)
    options |= {"size": texture_size, "sets": "one", "device": device_name or None, "alpha": alpha, "double_sided": sides}
    options |= {"screen": screen_of(screen), "max_outline": max_outline, "high_normals": str(high_normals)}
    options["max_bytes"] = to_plain_values(max_bytes)
    if max_error is not None:
        options["max_error"] = error_bound(max_error)
    elif max_bytes is None or faces_target is not None:
        options["faces"] = count
    options |= {"format": format, "quality": quality, "normal_error": normal_error, "dither": dither}
    options |= {"fallback_textures": fallback_textures or None, "mesh_compression": mesh_compression}
    wanted, left_out = _maps_of(maps, sample is not None)
    if wanted is not None:
        _check_slots("maps", wanted)
        options["maps"] = [name for name in wanted if name not in OF_MATERIALS] or ["normal"]
        if options["maps"] != wanted:
            given = options.get("transfer", [])
            given = [given] if isinstance(given, str) else list(given)
            transfers = [f"mtl:{name}" for name in wanted if name in OF_MATERIALS]
            options["transfer"] = list(dict.fromkeys(transfers + given)) or None
            left_out |= {"normal"} - set(wanted)
    report = callback_of(progress)
    repairs = (weld, orient, fill_holes, drop_floaters, drop_hidden)
    mesh = None
    if repairs == (1e-5, True, True, True, True) and faces is None and colors is None:
        if isinstance(vertices, (str, os.PathLike)):
            options |= {"high": path_of(vertices, "vertices"), "up": up}
        elif (data := _glb_bytes(vertices)) is not None:
            mesh = _core.load_bytes(data, "mesh.glb", up or "", True)
    if mesh is None and "high" not in options:
        high = as_mesh(vertices, "vertices", up) if faces is None else Mesh(vertices, faces, colors=colors, up=up or "y")
        if faces is None and colors is not None:
            high = Mesh(high.vertices, high.faces, colors=colors, name=high.name)
        mesh = high
        if repairs != (1e-5, True, True, True, True):
            shows_inside = "opacity" in (wanted or ()) or (wanted is None and _core.is_transparent(high))
            mesh = clean_with_progress(high, *repairs[:4], drop_hidden and not shows_inside, _part(report, 0, 0.02))
            options["clean"] = "none"
    options["out"] = _name_of(path, mesh, options.get("high"))
    if name is not None:
        options["out"] = _name_of(None, None, f"{_text_of(name, 'name')}.glb")
    files: dict[str, np.ndarray] = {}

    def call(found: _core.Match) -> dict[str, np.ndarray]:
        assert sample is not None
        files.update(sampled(found, sample, device))
        _check_slots("sample", files)
        _check_pictures("sample", files)
        return files

    with suppress_warning("low-heavy" if faces_target is None else None):
        function = None if sample is None else call
        data, low, core = _core.run_glb(json_of(options), mesh, left_out, function, report)
    baked = None if core is None else Bake(core, keywords)
    strength = 1.0
    if baked is not None:
        baked_pictures, strength = _pictures_of(baked, left_out)
        files = {**baked_pictures, **files}
    files = {name: files[name] for name in SLOTS if name in files}
    _write(data, path)
    return Glb(data, low, files, baked, strength)


def _maps_of(maps: Sequence[str] | None, samples: bool) -> tuple[list[str] | None, set[str]]:
    """Returns the requested maps, or None for those of the materials; and the maps that are baked only for other maps."""
    if maps is None:
        return (["normal", "ao"] if samples else None), set()
    wanted = [maps] if isinstance(maps, str) else list(maps)
    return wanted, set() if wanted else {"normal"}


def _glb_bytes(given: Any) -> bytes | None:
    """Returns the bytes of a high poly that is given as a GLB in memory, else None."""
    if isinstance(given, (bytes, bytearray, memoryview)):
        return bytes(given) if bytes(given[:4]) == b"glTF" else None
    return scene_data(given)


def _text_of(given: Any, parameter: str) -> str:
    if isinstance(given, str) and given:
        return given
    raise Error(f"{parameter}: expected text, not {given!r}.", "option-type", "usage", parameter)


def _name_of(path: str | os.PathLike[str] | None, mesh: Mesh | None, file: str | None) -> str:
    """Returns the name of a GLB, which is also the name of its low poly."""
    if path is not None:
        name = Path(path_of(path))
        return str(name if name.suffix else name.with_name(name.name + ".glb"))
    name_of_high = mesh.name if mesh is not None else Path(file or "").stem
    plain = "".join("_" if c in "\0/\\" else c for c in name_of_high)
    return f"{plain if plain.strip('.') else 'mesh'}.glb"


def _pictures_of(baked: Bake, left_out: set[str]) -> tuple[dict[str, np.ndarray], float]:
    """Returns the maps as pictures of a material, and the emission that the value 1 represents."""
    files, strength, _ = _core.asset_maps(baked._core, list(SLOTS), "gutter" not in baked._keywords)
    if "normal" in left_out and "normals" not in baked:
        files.pop("normal", None)
    # A slot uses only the first channels of its file.
    return {name: file[:, :, : SLOTS[name]].copy() for name, file in files.items()}, strength


def _part(report: Callable[[float, str], object] | None, start: float, end: float) -> Any:
    """A progress callback for a part of the work."""
    if report is None:
        return None
    return lambda done, stage: report(start + (end - start) * done, stage)


def _write(data: bytes, path: str | os.PathLike[str] | None) -> None:
    if path is not None:
        _core.write_file(path_of(path), data)
