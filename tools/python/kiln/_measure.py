"""kiln.measure() and kiln.render(): comparisons of rendered pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import _core
from ._bake import Bake
from ._errors import Error, device_of, warn
from ._meshes import as_high, as_mesh
from ._progress import callback_of, report_completion

if TYPE_CHECKING:
    import numpy as np


class NormalError(float):
    """The mean angle between rendered normals, degrees; with rms, median, p95, p99, max, pixels, one_sided_share and
    standard_error."""

    rms: float
    median: float
    p95: float
    p99: float
    max: float
    pixels: int
    one_sided_share: float
    standard_error: float

    def __new__(cls, figures: Mapping[str, Any]) -> NormalError:
        self = super().__new__(cls, figures["mean"])
        self.__dict__.update((key, value) for key, value in figures.items() if key != "mean")
        return self

    @property
    def degrees(self) -> float:
        """The mean."""
        return float(self)


def _check_layout(low: _core.Mesh, normal: Any) -> None:
    """Warns if a bake seems to belong to another low poly: if its map is empty at the centres of many triangles."""
    import numpy as np

    if not isinstance(normal, Bake) or low.uvs is None or low.uv_faces is None:
        return
    coverage = normal.coverage
    height, width = coverage.shape
    corners = low.uvs[low.uv_faces].astype(np.float64)
    sides = corners[:, 1:] - corners[:, :1]
    texels = 0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]) * width * height
    uv_centers = corners.mean(axis=1)
    seen = (texels >= 4) & np.all((uv_centers >= 0) & (uv_centers < 1), axis=1)
    columns = (uv_centers[seen, 0] * width).astype(np.int64)
    rows = ((1 - uv_centers[seen, 1]) * height).astype(np.int64).clip(0, height - 1)
    empty = ~np.isin(coverage[rows, columns], (1, 2))  # the texel is neither baked nor missed
    if empty.sum() > 0.1 * empty.size:
        text = f"{100 * empty.mean():.0f}% of the low poly's triangles lie where the map is empty: the bake belongs to "
        warn("other-layout", text + "another low poly, or to other UVs.", int(empty.sum()))


def _normal_map_with_encoding(
    normal: Any, space: str | None, flip_y: bool | None, bitangent: str | None
) -> tuple[Any, str, bool, str]:
    """Returns the pixels of a normal map, and their encoding."""
    pixels = normal
    if isinstance(normal, Bake):
        pixels = normal["normal"]
        baked = normal._keywords
        if baked.get("raw") or baked.get("two_component"):
            raise Error("normal: raw and two-component maps cannot be rendered: bake without these options.", "usage", "usage", "normal")
        space = space if space is not None else baked.get("space")
        flip_y = flip_y if flip_y is not None else baked.get("flip_y")
        bitangent = bitangent if bitangent is not None else baked.get("bitangent")
    return pixels, space or "tangent", bool(flip_y), bitangent or "pixel"


def render(
    mesh: Any,
    normal: Any = None,
    *,
    size: int = 512,
    azimuth: float = 30,
    elevation: float = 15,
    z_up: bool = False,
    show_normals: bool = False,
    frame: Any = None,
    space: str | None = None,
    flip_y: bool | None = None,
    bitangent: str | None = None,
    device: str | int = "",
    progress: Any = None,
) -> np.ndarray:
    """Renders a mesh as clay, with or without its normal map.

    mesh          as kiln.as_mesh() takes it
    normal        its normal map, as measure() takes it
    size          pixels a side, 1 to 8192
    azimuth       degrees around the up axis: 0 looks at the front, 90 from +X
    elevation     degrees above the horizon
    z_up          the up axis is +Z, else +Y
    show_normals  world-space normals as n/2 + 1/2, exactly 0 beside the mesh
    frame         the mesh that the picture frames, so that several pictures align

    Returns (size, size, 3) float32 in [0, 1], sRGB-encoded. Raises kiln.Error.
    """
    report = callback_of(progress)
    mesh = as_mesh(mesh)
    _check_layout(mesh, normal)
    pixels, space, flip_y, bitangent = _normal_map_with_encoding(normal, space, flip_y, bitangent)
    picture: np.ndarray = _core.render(
        mesh,
        pixels,
        space,
        flip_y,
        bitangent,
        size,
        azimuth,
        elevation,
        z_up,
        show_normals,
        None if frame is None else as_mesh(frame, "frame"),
        device_of(device),
        report,
    )
    return report_completion(report, picture)


def measure(
    high: Any,
    low: Any,
    normal: Any = None,
    *,
    space: str | None = None,
    flip_y: bool | None = None,
    bitangent: str | None = None,
    views: int = 30,
    size: int = 512,
    z_up: bool = False,
    high_normals: str | float = "auto",
    device: str | int = "",
    progress: Any = None,
) -> NormalError:
    """Compares pictures of the low poly's normals with the high poly's, from all around.

    high, low  as kiln.as_mesh() takes them
    normal     the low poly's normal map, (H, W, 3) as n/2 + 1/2, row 0 at the top, or the kiln.Bake that has it;
               without: its own normals. A bake of another low poly is a warning, `other-layout`
    space, flip_y, bitangent
               options of its bake; a kiln.Bake knows them
    views      directions, 1 to 4096
    size       pixels a side of each picture, 16 to 8192
    high_normals
               as kiln.Source takes it

    Returns a float, degrees. Raises kiln.Error.
    """
    report = callback_of(progress)
    low = as_mesh(low, "low")
    _check_layout(low, normal)
    pixels, space, flip_y, bitangent = _normal_map_with_encoding(normal, space, flip_y, bitangent)
    figures = NormalError(
        _core.measure(
            as_high(high, high_normals),
            low,
            pixels,
            space,
            flip_y,
            bitangent,
            views,
            size,
            z_up,
            device_of(device),
            report,
        )
    )
    return report_completion(report, figures)
