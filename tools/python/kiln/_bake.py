"""kiln.bake(), kiln.match() and kiln.Source."""

from __future__ import annotations

import enum
import os
import re
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _core
from ._core import Match, Mesh
from ._errors import Error, KilnWarning, device_of, path_of, quiet, texture_set
from ._meshes import as_high, as_mesh
from ._options import is_number, json_of, select_keywords, to_plain_values
from ._progress import callback_of

if TYPE_CHECKING:
    from typing import Unpack

    import numpy as np
    import numpy.typing as npt

    from ._keywords import Keywords

#: Formats by file extension; None for image formats that cannot be written.
_FORMATS = {
    ".png": "png16",
    ".exr": "exr",
    ".tif": "tiff16",
    ".tiff": "tiff16",
    ".tga": "tga",
    ".webp": "webp",
    ".ktx2": "ktx2",
    ".dds": "dds",
}
_UNWRITABLE_SUFFIXES = (".bmp", ".gif", ".hdr", ".jpeg", ".jpg")


class SampleStatus(enum.IntEnum):
    """How a sample of a Match was matched, or why it was not."""

    EMPTY = 0  #: not covered by the low poly
    OUTWARD = 1  #: ray along the sample's direction
    INWARD = 2  #: ray against it
    CAGE = 3  #: ray from the cage inward
    MISSED = 4  #: no point within the distance
    VIEW = 5  #: seen in a depth view
    CLOSEST = 6  #: the nearest point
    UV = 7  #: the point with the same UV
    OUTERMOST = 8  #: ray along the direction, past a nearer face


class MapError(float):
    """The error of a map against a finer evaluation: the mean, with rms, p95, max, unit and texels."""

    unit: str
    rms: float
    p95: float
    max: float
    texels: int
    against: str

    def __new__(cls, figures: Mapping[str, Any]) -> MapError:
        self = super().__new__(cls, figures["mean"])
        self.__dict__.update((key, value) for key, value in figures.items() if key != "mean")
        return self

    @property
    def mean(self) -> float:
        """The mean error, in the map's unit."""
        return float(self)

    @property
    def degrees(self) -> float:
        """The mean angle, for maps of unit vectors."""
        if self.unit != "degrees":
            raise AttributeError(f"this map's error is in {self.unit}: see mean")
        return float(self)


class _Errors(dict[str, MapError]):
    """Errors by map name. Maps that were not measured yet are measured on access."""

    measure: Callable[[str], Mapping[str, MapError]] | None = None

    def __missing__(self, name: str) -> MapError:
        if self.measure is not None:
            self.update(self.measure(name))
        if name not in self:
            raise KeyError(f"no error of '{name}': bake that map with report_error=True, which compares every map")
        return self[name]


class Report:
    """The report of a bake, with attributes such as samples, missed, max_distance and seconds_match.

    errors    error of each map by name: all with report_error=True, else measure_map on first access, which bakes that map
              again
    warnings  imperfect data that was handled: dicts of code, message and count
    plan      with match="auto": match, size, degrees, wanted, reached; else None
    """

    plan: dict[str, Any] | None = None
    errors: _Errors
    warnings: list[dict[str, Any]]
    samples: int
    texels: int
    missed: int
    max_distance: float

    def __init__(self, figures: Mapping[str, Any]) -> None:
        self.__dict__.update(figures)
        self.errors = _Errors((name, MapError(error)) for name, error in figures["errors"].items())

    def __repr__(self) -> str:
        return f"<kiln.Report: {self.samples} samples, {self.missed} missed>"


class Bake(Mapping[str, "np.ndarray"]):
    """The maps of a bake by name: (H, W, C) float32, row 0 at the top, where v is 1.

    The arrays are views of the bake's memory and keep it alive.
    """

    def __init__(self, core: _core.BakeCore, keywords: Mapping[str, Any] | None = None) -> None:
        self._core = core
        # options that decide how the bake's normals are decoded
        self._keywords = dict(keywords or {})
        # the text before and after the map's name in file names of texture sets
        self._endings: tuple[str, str] = "", ""
        self.report = Report(core.report)

    def __getitem__(self, name: str) -> np.ndarray:
        array: np.ndarray = self._core.pixels(name)
        return array

    def __iter__(self) -> Iterator[str]:
        return iter(self._core.names)

    def __len__(self) -> int:
        return len(self._core.names)

    def __repr__(self) -> str:
        height, width = self.coverage.shape
        return f"<kiln.Bake of {width} x {height} texels: {', '.join(self)}>"

    @property
    def coverage(self) -> np.ndarray:
        """(H, W) uint8: 0 empty, 1 baked, 2 missed, 3 padding."""
        array: np.ndarray = self._core.coverage()
        return array

    def mips(self, name: str) -> list[np.ndarray]:
        """Levels 1 and on of a map baked with mips=True."""
        return self._core.mips(name)

    def origin(self, name: str) -> tuple[float, float, float]:
        """The origin of a map of positions, world units."""
        return self._core.origin(name)

    def ranges(self, name: str) -> list[tuple[float, float]]:
        """For each channel, the values that integer formats store as 0 and 1."""
        return self._core.ranges(name)

    def stored(self, name: str) -> np.ndarray:
        """The map as integer formats store it: (H, W, C) float32 in [0, 1], colours sRGB-encoded."""
        array: np.ndarray = self._core.stored(name)
        return array

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        format: str | None = None,
        dither: bool = False,
        name: str | None = None,
    ) -> list[Path]:
        """Writes the same files as the command, byte for byte: all maps into a folder, or one to a file.

        path    a folder, for files NAME_MAP.png; it is created if its parent exists. Or, for a single map, a file
                with the extension png, exr, tif, tga, webp, ktx2 or dds
        format  png16 (default), png8, exr (half), exr32, tiff8, tiff16, tiff32, tga, webp, ktx2 or dds
        dither  png8: ordered dither instead of rounding
        name    NAME of the files; default: the low poly's name

        Returns the written files.
        """
        target = Path(path_of(path))
        suffix = target.suffix.lower()
        if suffix in _UNWRITABLE_SUFFIXES and not target.is_dir():
            text = f"path: '{target}' is not a picture format that Kiln writes: use .png, .exr, .tif, .tga, .webp, .ktx2 or .dds."
            raise Error(text, "output", "usage", "path")
        if suffix in _FORMATS and not target.is_dir():
            if len(self) != 1:
                raise Error(
                    f"path: '{target}' is one file, but {len(self)} maps were baked: name a folder.",
                    "output",
                    "usage",
                    "path",
                )
            if format is not None and _core.extension_of(format) != suffix.replace(".tiff", ".tif"):
                text = f"format: '{target}' would hold {format}: leave format out, or rename the file."
                raise Error(text, "option-contradiction", "usage", "format")
            self._core.save_map(next(iter(self)), target, format or _FORMATS[suffix], dither)
            return [target]
        format = format or "png16"
        format_extension = _core.extension_of(format)
        target.mkdir(exist_ok=True)
        # The name of a mesh may come from an untrusted file, so separators of paths are replaced.
        stem = name or re.sub(r"[\x00/\\]", "_", self._core.low_name)
        files = []
        for map_name in self:
            before, after = self._endings
            files.append(target / f"{stem}{before}_{map_name}{after}{format_extension}")
            self._core.save_map(map_name, files[-1], format, dither)
        return files

    def _repr_png_(self) -> bytes:
        import numpy as np

        pixels = self.stored(next(iter(self)))[:, :, :3]
        step = -(-max(pixels.shape[:2]) // 512)
        if pixels.shape[2] == 2:
            pixels = np.concatenate([pixels, np.zeros_like(pixels[:, :, :1])], axis=2)
        return _core.encode(np.ascontiguousarray(pixels[::step, ::step]), "png8", False)


class Source:
    """A high poly on the device, for many bakes. Any number of threads may bake from it at once.

    high      as bake() takes it
    bounds    two corners of a box in world units, which should be about as large as the mesh. Its diagonal is the
              reference of lengths in %, and positions are quantised in it; see kiln.BakeSession. Default: the box of
              the mesh
    device    index or part of its name, as kiln.devices() lists them; "": the first GPU, else the first CPU
    progress  as bake() takes it
    high_normals
              source of its normals: "auto" (the mesh's own; if it has none, smooth normals for scans, and hard edges for
              hard surfaces, as the angles at its edges suggest), "file" (the mesh's own, else smooth), "smooth",
              "flat", or the smallest angle in degrees at which edges are hard

    close(), or the end of a `with` block, frees its memory on the device; results remain valid.
    """

    def __init__(
        self,
        high: Any,
        *,
        bounds: Any = None,
        device: str | int = "",
        progress: Any = None,
        high_normals: str | float = "auto",
    ) -> None:
        self._device = device_of(device)
        mesh = as_high(high, high_normals)
        self._core = _core.SourceCore(mesh, bounds, self._device, callback_of(progress))

    def close(self) -> None:
        """Frees the memory on the device, after running bakes have finished."""
        self._core.close()

    @property
    def closed(self) -> bool:
        """Whether close() was called."""
        return self._core.closed

    @property
    def mesh(self) -> Mesh:
        """The high poly."""
        return self._core.high

    @property
    def diagonal(self) -> float:
        """The diagonal of the high poly's bounding box, world units."""
        return self._core.diagonal

    @property
    def device_bytes(self) -> int:
        """Memory used on the device, bytes."""
        return self._core.device_bytes

    def bake(self, low: Any, **keywords: Any) -> Bake:
        """kiln.bake(self, low, ...)."""
        return bake(self, low, **keywords)

    def match(self, low: Any, **keywords: Any) -> Match:
        """kiln.match(self, low, ...)."""
        return match(self, low, **keywords)

    def __enter__(self) -> Source:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()


def _source_of(high: Any, device: str | int, progress: Any, high_normals: str | float | None = None) -> Source:
    if isinstance(high, Source):
        if high_normals is not None:
            raise Error("high_normals: this is a property of the source: leave it out.", "usage", "usage", "high_normals")
        if device != "":
            raise Error("device: this is a property of the source: leave it out.", "usage", "usage", "device")
        return high
    return Source(high, device=device, progress=progress, high_normals="auto" if high_normals is None else high_normals)


def _textures_of(textures: Mapping[str, Any] | None) -> list[tuple[str, Any, str]]:
    if textures is None:
        return []
    if not isinstance(textures, Mapping):
        wrong = type(textures).__name__
        raise Error(f"textures: expected a dict of pictures by name, not {wrong}.", "option-type", "usage", "textures")
    from ._arrays import check_shares, image

    rows = []
    for name, value in textures.items():
        default_kind = "normal" if name == "normal" else "srgb" if name in ("color", "emission") else "linear"
        pixels, kind = value if isinstance(value, tuple) and len(value) == 2 else (value, default_kind)
        if not isinstance(name, str) or not isinstance(kind, str):
            text = f"textures: names and kinds are text, not {name!r} of the kind {kind!r}."
            raise Error(text, "option-type", "usage", "textures")
        pixels = image(pixels, "textures")
        if kind in ("srgb", "normal"):
            check_shares(pixels, "textures", f"a picture of the kind {kind}")
        rows.append((name, pixels, kind))
    return rows


class BakeRequest(NamedTuple):
    """The arguments of bake(), converted for the extension module."""

    low: Mesh
    options: str
    cage: Mesh | None
    others: list[Mesh]
    by_high: bool
    by_low: bool
    textures: list[tuple[str, Any, str]]


def bake_request(
    low: Any,
    size: Any,
    maps: str | Sequence[str],
    match: str | None,
    cage_mesh: Any,
    ao_occluders: Sequence[Any] | str,
    textures: Mapping[str, Any] | None,
    keywords: Mapping[str, Any],
    **more: Any,
) -> BakeRequest:
    occluders = [ao_occluders] if isinstance(ao_occluders, str) else list(ao_occluders)
    named = [item for item in occluders if isinstance(item, str) and item in ("high", "low")]
    others = [as_mesh(item, "ao_occluders") for item in occluders if not (isinstance(item, str) and item in named)]
    names = [maps] if isinstance(maps, str) else list(maps)
    if not names:
        raise Error("maps: the list is empty.", "option-type", "usage", "maps")
    options = json_of({**select_keywords({"size": size, "maps": names, "match": match, **keywords}), **more})
    low_mesh = as_mesh(low, "low")
    cage = None if cage_mesh is None else as_mesh(cage_mesh, "cage_mesh")
    return BakeRequest(low_mesh, options, cage, others, "high" in named, "low" in named, _textures_of(textures))


def bake(
    high: Any,
    low: Any,
    *,
    size: int | tuple[int, int] = 2048,
    maps: str | Sequence[str] = "normal",
    match: str | Match | None = None,
    max_error: str | float | None = None,
    cage_mesh: Any = None,
    ao_occluders: Sequence[Any] | str = "high",
    textures: Mapping[str, Any] | None = None,
    high_normals: str | float | None = None,
    device: str | int = "",
    progress: Callable[[float, str], object] | Any = None,
    **keywords: Unpack[Keywords],
) -> Bake:
    """Bakes maps of the high poly for the low poly.

    high          a kiln.Source, or what kiln.as_mesh() takes: mesh, path, bytes, (vertices, faces), trimesh
    low           the same, with UVs; for one from simplify() or plan(), the search distance covers its deviation
    size          texels: one side, or (width, height), 1 to 16384
    maps          names, such as ["normal", "ao", "color"]; "NAME=FILE.cl" is your own map, code that runs with your rights
    match         method of matching ("ray", "closest", "visibility"...), or a kiln.Match; "auto": the cheapest match
                  that reaches max_error, and the smallest size up to `size`; report.plan states the choice
    max_error     largest mean angle between rendered normals in degrees, or a text as kiln.plan() takes it; implies
                  match="auto"
    cage_mesh     a mesh from which rays start, as the command's --cage-mesh
    ao_occluders  occluders of ao: "high", "low" and meshes
    textures      textures on the high poly's UVs by the name of a map: (H, W, C), or a pair with the kind "srgb",
                  "linear" or "normal", such as (pixels, "srgb")
    high_normals  as kiln.Source takes it; default: "auto"
    device        as kiln.Source takes it
    progress      called with (completed share, stage), ten times a second. Returning False stops the bake;
                  exceptions propagate. Or a tqdm bar with a total of 1
    keywords      the command's long flags with underscores: kiln.options() lists them. Lengths are numbers in world
                  units, or "2%" of the high poly's diagonal

    The same input gives the same bytes as the command, on every run and device. Ctrl-C stops within half a second.
    Raises kiln.Error with code and parameter; TypeError for unknown keywords.

    >>> import kiln
    >>> corners, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> square = kiln.Mesh(corners, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> baked = kiln.bake(square, square, size=(64, 32), maps=["normal", "height"])
    >>> baked["normal"].shape, baked["height"].shape, baked["normal"].dtype.name
    ((32, 64, 3), (32, 64, 1), 'float32')
    """
    saved = match if isinstance(match, Match) else None
    method = None if isinstance(match, Match) else match
    if max_error is not None and match is None:
        method = "auto"
    bound = None if max_error is None else error_bound(max_error)
    given = bake_request(low, size, maps, method, cage_mesh, ao_occluders, textures, keywords, max_error=bound)
    report = callback_of(progress)
    source = _source_of(high, device, report, high_normals)
    core = _core.bake(source._core, *given, saved, report)
    made = Bake(core, keywords)
    if made.report.plan:
        if not made.report.plan["reached"] and max_error is not None:
            warn_about_missed_bound(made.report.plan)
        return made
    # Only weak references are kept, so that the source may be closed or temporary without keeping device memory.
    origin, mesh, opened = weakref.ref(source), source.mesh, source._device
    again: dict[str, Any] = {**keywords, "report_error": True}
    names = [maps] if isinstance(maps, str) else list(maps)
    named = [name for name, darkens in (("high", given.by_high), ("low", given.by_low)) if darkens]
    # This copies only the names: a reference cycle would keep the bake's memory until the next garbage collection
    baked = tuple(made)

    def measure_map(name: str) -> Mapping[str, MapError]:
        if name not in baked:
            return {}
        kept = origin()
        is_source_open = kept is not None and not kept.closed
        token = quiet.set(True)
        try:
            return bake(
                kept if is_source_open else mesh,
                given.low,
                size=size,
                maps=name if name in names else names,
                match=match,
                cage_mesh=given.cage,
                ao_occluders=[*named, *given.others],
                textures=textures,
                device="" if is_source_open else opened,
                **again,
            ).report.errors
        finally:
            quiet.reset(token)

    made.report.errors.measure = measure_map
    return made


def error_bound(max_error: str | float) -> str:
    """Converts max_error to the command's form: degrees of rendered normals, or bounds by map name."""
    max_error = to_plain_values(max_error)
    if is_number(max_error):
        return f"normal={max_error!r}"
    if not isinstance(max_error, str) or "=" not in max_error:
        raise Error(
            f"max_error: expected degrees, or text such as 'normal=3deg', not {max_error!r}.",
            "option-type",
            "usage",
            "max_error",
        )
    return ",".join(part.strip().removesuffix("deg").strip() for part in max_error.split(","))


def warn_about_missed_bound(chosen: Mapping[str, Any]) -> None:
    import warnings

    text = f"Rendered normals deviate by {chosen['degrees']:.3g} degrees, but {chosen['wanted']:.3g} were requested."
    if chosen["degrees"] <= chosen["wanted"]:
        text = "A map exceeds its error in max_error: allow a larger size."
    warnings.warn(KilnWarning(text, "error-not-reached", 1), stacklevel=3)


def bake_sets(
    high: Any,
    low: Any,
    *,
    sets: str = "auto",
    size: int | tuple[int, int] | Mapping[str, Any] = 2048,
    **keywords: Any,
) -> dict[str, Bake]:
    """Bakes a low poly with several texture sets, each with its own maps.

    sets      one set per "material", "object" or "udim" tile of the low poly; "auto": by material or tile if UVs
              overlap otherwise; "none"
    size      texels of all sets; or a dict by set name, such as {"skin": 4096}, others 2048
    keywords  as bake() takes them

    Returns a dict of kiln.Bake by set name ("1001" and so on for tiles, "skin.1001" for a material that spans several
    tiles; "" for a single set). Their save() names files as the command does. Raises kiln.Error.
    """
    low_mesh = as_mesh(low, "low")
    parts = _core.texture_sets(low_mesh, sets) or [("", "", low_mesh)]
    names = [f"{own}.{tile}" if own and tile else own or tile for own, tile, mesh in parts]
    sizes = size if isinstance(size, Mapping) else dict.fromkeys(names, size)
    unknown = [name for name in sizes if name not in names and name not in [own for own, tile, mesh in parts]]
    if unknown:
        raise Error(
            f"size: '{unknown[0]}' is no texture set of the low poly, which has {names}.", "usage", "usage", "size"
        )
    report = callback_of(keywords.pop("progress", None))
    source = _source_of(
        high,
        keywords.pop("device", ""),
        None if report is None else _progress_share(report, 0, 0.1),
        keywords.pop("high_normals", None),
    )
    if len(parts) > 1:
        keywords["recall"] = 0  # each set covers only a part of the high poly's surface
    baked: dict[str, Bake] = {}
    words: dict[str, str] = {}  # names of materials and objects as used in file names
    for i, (name, (own, tile, mesh)) in enumerate(zip(names, parts)):
        part = None if report is None else _progress_share(report, 0.1 + 0.9 * i / len(parts), 0.9 / len(parts))
        token = texture_set.set(name)
        try:
            made = bake(source, mesh, size=sizes.get(name, sizes.get(own, 2048)), progress=part, **keywords)
        finally:
            texture_set.reset(token)
        if own and own not in words:
            safe_name = re.sub(r'[\x00- \x7f/\\:*?"<>|]', "_", own).encode()[:100].decode(errors="ignore") or "set"
            word, k = safe_name, 1
            while word.lower() in [other.lower() for other in words.values()]:
                k += 1
                word = f"{safe_name}_{k}"
            words[own] = word
        if name:
            made.report.warnings = [w for w in made.report.warnings if w["code"] != "uv-missing"]
            made._endings = ("_" + words[own] if own else "", "." + tile if tile else "")
        baked[name] = made
    return baked


def _progress_share(report: Callable[[float, str], object], start: float, share: float) -> Callable[[float, str], object]:
    return lambda done, stage: report(start + share * done, stage)


def match(
    high: Any,
    low: Any,
    *,
    size: int | tuple[int, int] = 2048,
    match: str | None = None,
    cage_mesh: Any = None,
    high_normals: str | float | None = None,
    device: str | int = "",
    progress: Callable[[float, str], object] | Any = None,
    **keywords: Unpack[Keywords],
) -> Match:
    """Matches each texel sample to a point of the high poly, without baking. Parameters: see bake().

    Use the result for bake(match=...), or to evaluate your own values at its positions.

    >>> import kiln
    >>> corners, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> square = kiln.Mesh(corners, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> found = kiln.match(square, square, size=16)
    >>> found.face.shape, found.position.shape, found.barycentrics.shape
    ((16, 16), (16, 16, 3), (16, 16, 3))
    """
    options = json_of(select_keywords({"size": size, "match": match, **keywords}))
    low_mesh = as_mesh(low, "low")
    cage = None if cage_mesh is None else as_mesh(cage_mesh, "cage_mesh")
    report = callback_of(progress)
    source = _source_of(high, device, report, high_normals)
    return _core.match(source._core, low_mesh, options, cage, report)
