"""kiln.to_glb(): a dense mesh to a light one with its maps in one file."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _core
from ._bake import Bake, Source, bake, error_bound, match, words_of
from ._core import Mesh
from ._errors import Error, count_of, device_of, path_of, untold, warn
from ._meshes import as_high, as_mesh
from ._plan import plan
from ._progress import callback_of, done
from ._surface import cleaned

if TYPE_CHECKING:
    import numpy as np

#: Maps that a GLB's material has places for, and their channels.
SLOTS = {"normal": 3, "ao": 1, "color": 3, "opacity": 1, "roughness": 1, "metallic": 1, "emission": 3}
#: Those that come from materials alone.
OF_MATERIALS = ("roughness", "metallic", "emission")


class Glb:
    """A light mesh with its maps.

    data      the file's bytes
    mesh      the light kiln.Mesh
    maps      by name (H, W, C) float32 in [0, 1], as the file holds them: colours sRGB-encoded; row 0 at the top
    emission_strength
              what 1 of the map emission stands for
    bake      the kiln.Bake that the maps are of, with its report
    vertices, faces, uvs, normals, tangents
              as renderers take them, with one list of indices: (V, 3), (F, 3), (V, 2) with the origin at the lower
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
            self._parts = arrays_of(self.data)
        return self._parts[name]

    @property
    def vertices(self) -> np.ndarray:
        """(V, 3) float32, world units; float64 where the mesh lies far from 0."""
        return self._part("vertices")

    @property
    def faces(self) -> np.ndarray:
        """(F, 3) whole numbers: rows of all the others."""
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
        """(V, 4) float32: along u, and the bitangent's sign."""
        return self._part("tangents")


def arrays_of(data: bytes) -> dict[str, np.ndarray]:
    """Vertices with all attributes, and one list of indices, of a GLB of Kiln's. Its nodes only translate or scale."""
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
    count = 0

    def visit(index: int, shift: np.ndarray, scale: np.ndarray) -> None:
        nonlocal count
        node = document["nodes"][index]
        shift = shift + scale * np.array(node.get("translation", [0, 0, 0]), float)
        scale = scale * np.array(node.get("scale", [1, 1, 1]), float)
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            attributes = primitive["attributes"]
            positions = values(attributes["POSITION"])
            if shift.any() or (scale != 1).any():
                positions = positions * scale + shift
            parts["vertices"].append(positions)
            parts["faces"].append(values(primitive["indices"]).reshape(-1, 3) + np.uint32(count))
            parts["uvs"].append(
                np.array([0, 1], np.float32) + values(attributes["TEXCOORD_0"]) * np.array([1, -1], np.float32)
            )
            parts["normals"].append(values(attributes["NORMAL"]))
            parts["tangents"].append(values(attributes["TANGENT"]))
            count += len(positions)
        for child in node.get("children", ()):
            visit(child, shift, scale)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, np.zeros(3), np.ones(3))
    return {name: np.concatenate(arrays) for name, arrays in parts.items()}


def sampled(
    found: _core.Match,
    sample: Callable[[np.ndarray], Any],
    device: str | int = "",
    padding: int = 16,
) -> dict[str, np.ndarray]:
    """Maps of a function of places.

    found    of kiln.match(): where each texel's samples lie on the high poly
    sample   takes (N, 3) float64, world units. It returns (N, 3): the map color; (N, 4): color and opacity; or a dict
             of maps by name, (N,) or (N, C). Numbers are taken as they are; uint8 as shares of 255
    padding  texels filled around charts

    A texel is the mean of its samples that found a point. Returns (H, W, C) float32 by name.
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
                f"sample: '{name}' should be ({hit.sum()},) or ({hit.sum()}, 1 to 4) numbers, one row a place, not "
                f"{array.dtype} {array.shape}.",
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
    double_sided: bool = False,
    alpha: str = "mask",
) -> Glb:
    """A GLB of a mesh with UVs and the maps that you have for it.

    low           what kiln.as_mesh() takes, with UVs
    maps          of normal, ao, color, opacity, roughness, metallic, emission: (H, W) or (H, W, C), uint8, or float in
                  [0, 1], colours sRGB-encoded, row 0 at the top; none: {}. Of a kiln.Bake: {name: bake.stored(name)}
    path          where to write it, too: NAME.glb
    double_sided  back faces are shown
    alpha         with opacity: mask or blend

    Returns a kiln.Glb. Raises kiln.Error.

    >>> import kiln
    >>> corners, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> square = kiln.Mesh(corners, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> kiln.pack_glb(square, {"color": [[[1.0, 0.0, 0.0]]]}).tangents[0]
    array([1., 0., 0., 1.], dtype=float32)
    """
    from ._arrays import image

    if not isinstance(maps, Mapping):
        raise Error(f"maps: expected a dict by name, not {type(maps).__name__}.", "option-type", "usage", "maps")
    _check_slots("maps", maps)
    _check_output(path, alpha)
    mesh = as_mesh(low, "low")
    files = {name: image(maps[name], "maps") for name in SLOTS if name in maps}
    _check_pictures("maps", files)
    return Glb(_write(mesh, files, path, _Looks({}, alpha, double_sided), None), mesh, files, None)


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
    if path is not None and Path(path_of(path)).suffix.lower() not in ("", ".glb"):
        raise Error(f"path: '{path}' would hold a GLB: name it .glb.", "output-name", "usage", "path")
    if not isinstance(alpha, str) or alpha not in ("mask", "blend"):
        raise Error(f"alpha: '{alpha}' is neither mask nor blend.", "option-enum", "usage", "alpha")


def to_glb(
    vertices: Any,
    faces: Any = None,
    *,
    colors: Any = None,
    faces_target: int | None = None,
    max_error: str | float | None = None,
    texture_size: int = 2048,
    maps: Sequence[str] | None = None,
    sample: Callable[[np.ndarray], Any] | None = None,
    path: str | os.PathLike[str] | None = None,
    double_sided: bool | None = None,
    alpha: str | None = None,
    weld: float = 1e-5,
    orient: bool = True,
    fill_holes: float | bool = True,
    drop_floaters: float | bool = True,
    drop_hidden: bool = True,
    screen: int | str | None = None,
    max_outline: str | None = None,
    high_normals: str | float = "auto",
    device: str | int = "",
    progress: Any = None,
    **keywords: Any,
) -> Glb:
    """Turns a dense mesh into a GLB of a light one with baked maps.

    vertices, faces  (V, 3) and (F, 3); or what kiln.as_mesh() takes alone
    colors           (V, 3) or (V, 4) of the vertices, sRGB-encoded: uint8, or float in [0, 1]
    faces_target     triangles of the light mesh; without: 10,000. A mesh with fewer keeps them all
    max_error        instead of faces_target: how near rendered normals come, such as "normal=3deg"; see kiln.plan()
    texture_size     texels a side; with max_error, the most
    maps             of normal, ao, color, opacity, and roughness, metallic, emission of materials; without: normal and
                     ao, and what vertices and materials have, their normal maps and occlusion, too; with `sample`,
                     normal and ao
    sample           called once with the places of all texels on the dense mesh, (N, 3) float64; returns (N, 3)
                     colours, (N, 4) with opacity, or a dict: color, emission (N, 3), opacity, roughness, metallic
                     (N,), all in [0, 1], colours sRGB-encoded
    path             where to write it, too: NAME.glb
    double_sided     back faces are shown; without: where the dense mesh's materials show them
    alpha            with opacity: mask or blend; without: as the dense mesh's materials have it, with their cutoffs;
                     mask where none is transparent
    weld, orient, fill_holes, drop_floaters, drop_hidden
                     as kiln.clean() takes them, which is called first; with the map opacity, nothing hidden is dropped
    screen, max_outline
                     with max_error: as kiln.plan() takes them
    high_normals     as kiln.Source takes it
    progress         as bake() takes it
    keywords         as bake() takes them: match, samples, fallback... Ambient occlusion is smoothed (ao_error=1)
                     where none of ao_rays, ao_error, ao_by and ao_views is given, as in the command's GLB

    Repairs are warnings. Returns a kiln.Glb.
    """
    whole = vertices if faces is None else None
    high = as_mesh(whole, "vertices") if faces is None else Mesh(vertices, faces, colors=colors)
    if faces is None and colors is not None:
        high = Mesh(high.vertices, high.faces, colors=colors, name=high.name)
    _check_output(path, "mask" if alpha is None else alpha)
    unasked = maps is None
    high, has, transfers, of_materials = _of_materials(high, unasked and sample is None)
    looks = _Looks(of_materials, alpha, double_sided)
    if maps is None:
        maps = ["normal", "ao", *has] if sample is None else ["normal", "ao"]
        transfers = transfers if sample is None else []
    else:
        maps = [maps] if isinstance(maps, str) else list(maps)
        _check_slots("maps", maps)
        transfers = [f"mtl:{name}" for name in maps if name in OF_MATERIALS]
        maps = [name for name in maps if name not in OF_MATERIALS]
    texture_size = count_of(texture_size, "texture_size", 16, 16384)
    if faces_target is not None and max_error is not None:
        text = "faces_target: max_error chooses the number of triangles: leave one of them out."
        raise Error(text, "option-contradiction", "usage", "faces_target")
    faces_target = count_of(10_000 if faces_target is None else faces_target, "faces_target", 1, 2**31)
    words = words_of({"size": texture_size, **{key: value for key, value in keywords.items() if key != "match"}})
    for name in ("space", "flip_y", "two_component", "raw", "mips", "visibility_clusters"):
        if keywords.get(name):
            raise Error(f"{name}: is not for a GLB: leave it out.", "option-contradiction", "usage", name)
    report = callback_of(progress)
    drop_hidden = drop_hidden and "opacity" not in maps  # inner surfaces show through what is not opaque
    high = cleaned(high, weld, orient, fill_holes, drop_floaters, drop_hidden, _part(report, 0, 0.02))
    high = as_high(high, high_normals)
    if max_error is not None:
        words.append(("max_error", error_bound(max_error)))
    smooth = _core.glb_occlusion_error(words)
    if "ao" in maps and smooth > 0:
        keywords["ao_error"] = smooth
    given = keywords.pop("transfer", None)
    transfers += [given] if isinstance(given, str) else list(given or [])
    if max_error is not None:
        return _planned(
            high,
            max_error,
            texture_size,
            maps,
            transfers,
            unasked,
            sample,
            path,
            looks,
            device,
            report,
            {"screen": screen, "max_outline": max_outline, **keywords},
        )
    if screen is not None or max_outline is not None:
        parameter = "screen" if screen is not None else "max_outline"
        raise Error(f"{parameter}: is for max_error: give that, or leave it out.", "usage", "usage", parameter)
    low = _core.simplify(high, faces_target, 0.002, False, False, False, False, _part(report, 0.02, 0.2))
    low = _core.unwrap(low, texture_size, "charts", None, None, _part(report, 0.2, 0.35))
    low = _core.fit_normals(low, high, _part(report, 0.35, 0.4))
    with Source(high, device=device, progress=_part(report, 0.4, 0.5)) as source:
        files: dict[str, np.ndarray] = {}
        if sample is not None:
            found = match(source, low, size=texture_size, progress=_part(report, 0.5, 0.6), **_of_match(keywords))
            files = sampled(found, sample, device)
            _check_slots("sample", files)
            _check_pictures("sample", files)
            looks.opacity_is_own = "opacity" in files
            maps = [name for name in maps if name not in files]
            transfers = [text for text in transfers if text.removeprefix("mtl:") not in files]
        baked, strength = None, 1.0
        if maps or transfers:
            keywords |= _with_transfers(maps, transfers)
            with untold("material-value" if unasked else None):
                baked = bake(source, low, size=texture_size, progress=_part(report, 0.6, 0.95), **keywords)
            ours, strength = _pictures_of(baked, maps, unasked)
            strength = 1.0 if "emission" in files else strength
            files = {**ours, **files}
    files = {name: files[name] for name in SLOTS if name in files}
    data = _write(low, files, path, looks, baked, strength)
    return done(report, Glb(data, low, files, baked, strength))


def _planned(
    high: Mesh,
    max_error: str | float,
    size: int,
    maps: list[str],
    transfers: list[str],
    unasked: bool,
    sample: Callable[[np.ndarray], Any] | None,
    path: str | os.PathLike[str] | None,
    looks: _Looks,
    device: str | int,
    report: Any,
    keywords: dict[str, Any],
) -> Glb:
    with Source(high, device=device, progress=_part(report, 0.02, 0.1)) as source:
        by = keywords | _with_transfers(maps, transfers)
        with untold("material-value" if unasked else None):
            made = plan(source, max_error=max_error, size=size, progress=_part(report, 0.1, 0.8), **by)
        files: dict[str, np.ndarray] = {}
        strength = 1.0
        low = made.mesh
        if low.uvs is None:  # it needs no map, but a GLB has UVs
            low = _core.unwrap(low, size, "charts", None, None, None)
        if made.bake is not None:
            files, strength = _pictures_of(made.bake, maps, unasked)
        if sample is not None:
            words = _of_match({key: value for key, value in keywords.items() if key not in ("screen", "max_outline")})
            words["match"] = made.chosen["match"]
            if made.bake is not None and not {"max_distance", "cage"} & words.keys():
                words["max_distance"] = made.bake.report.max_distance  # so that all maps are of one match
            found = match(source, low, size=made.chosen["size"] or size, progress=_part(report, 0.8, 0.9), **words)
            ours = sampled(found, sample, device)
            _check_slots("sample", ours)
            _check_pictures("sample", ours)
            looks.opacity_is_own = "opacity" in ours
            files.update(ours)
            strength = 1.0 if "emission" in ours else strength
    files = {name: files[name] for name in SLOTS if name in files}
    data = _write(low, files, path, looks, made.bake, strength)
    return done(report, Glb(data, low, files, made.bake, strength))


class _Looks:
    """Alpha modes, cutoffs and sides of a GLB's materials."""

    def __init__(
        self, of_materials: Mapping[str, tuple[str, float, bool]], alpha: str | None, double_sided: bool | None
    ) -> None:
        self._of_materials = of_materials
        self._alpha = alpha
        self._double_sided = double_sided
        self.opacity_is_own = False  # of the caller's function, not of the materials

    def shown(self, has_opacity: bool) -> tuple[dict[str, tuple[str, float, bool]], tuple[str, float, bool]]:
        """As a file has them: by the high poly's materials, and of triangles that have none of these."""
        modes = {mode for mode, _, _ in self._of_materials.values()} - {"opaque"}
        as_they_are = self._alpha is None and bool(modes) and not self.opacity_is_own
        alike = self._alpha or ("blend" if "blend" in modes else "mask")

        def look(mode: str, cutoff: float, shows_back: bool) -> tuple[str, float, bool]:
            written = "opaque" if not has_opacity else mode if as_they_are else alike
            own_cutoff = written == mode == "mask" and not self.opacity_is_own
            sides = shows_back if self._double_sided is None else self._double_sided
            return written, cutoff if own_cutoff else 0.5, sides

        otherwise = look("opaque" if modes else "mask", 0.5, False)
        return {name: look(*said) for name, said in self._of_materials.items()}, otherwise


def _of_materials(
    high: Mesh, baked: bool
) -> tuple[Mesh, list[str], list[str], dict[str, tuple[str, float, bool]]]:
    """The mesh; what its materials ask for: maps, transfers; and their looks."""
    try:
        return _core.material_maps(high, baked)
    except Error:
        if baked:
            raise
        return high, [], [], {}  # files of materials that nothing is read from need not be there


def _with_transfers(maps: list[str], transfers: list[str]) -> dict[str, Any]:
    """Keywords of a bake, which has one map of the shape at least."""
    names = maps or ["normal"]
    return {"maps": names, "transfer": list(dict.fromkeys(transfers))} if transfers else {"maps": names}


def _pictures_of(baked: Bake, maps: list[str], unasked: bool) -> tuple[dict[str, np.ndarray], float]:
    """The maps as a material has them, and what 1 of emission stands for. What it has no place for is told."""
    files, strength, left = _core.asset_maps(baked._core, list(SLOTS))
    if left:
        warn("maps-left-out", f"A GLB's material has no place for {left}: bake them by kiln.bake().", 1)
    if unasked:
        baked.report.warnings = [w for w in baked.report.warnings if w["code"] != "material-value"]
    if not maps and "normals" not in baked:
        files.pop("normal", None)  # which was not asked for
    # A slot of one channel holds the first.
    return {name: file[:, :, : SLOTS[name]].copy() for name, file in files.items()}, strength


def _of_match(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Without what is of maps alone."""
    maps = (
        "transfer",
        "ao_",
        "range",
        "curvature_radius",
        "light",
        "id_by",
        "origin",
        "gutter",
        "report_error",
        "recall",
        "bitangent",
    )
    return {name: value for name, value in keywords.items() if not name.startswith(maps)}


def _part(report: Callable[[float, str], object] | None, start: float, end: float) -> Any:
    """A callback for a part of the work."""
    if report is None:
        return None
    return lambda done, stage: report(start + (end - start) * done, stage)


def _write(
    low: Mesh,
    files: dict[str, np.ndarray],
    path: str | os.PathLike[str] | None,
    looks: _Looks,
    baked: Bake | None,
    emission_strength: float = 1,
) -> bytes:
    import json
    import tempfile

    extras: dict[str, Any] = {"version": _core.version()}
    if baked is not None:
        extras["texels"] = {"covered": baked.report.texels, "missed_samples": baked.report.missed}
    shown = looks.shown("opacity" in files)
    text = json.dumps(extras)
    if path is not None:
        file = Path(path_of(path))
        _core.save_glb(low, files, emission_strength, file, *shown, text)
        return file.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "low.glb"
        _core.save_glb(low, files, emission_strength, file, *shown, text)
        return file.read_bytes()
