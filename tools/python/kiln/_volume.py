"""Meshes from voxels: kiln.contour() and kiln.volume()."""

from __future__ import annotations

import numbers
import os
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _core
from ._core import Mesh
from ._errors import Error, device_of, path_of
from ._progress import callback_of, report_completion

if TYPE_CHECKING:
    import numpy as np


class VolumeBake(NamedTuple):
    """A low poly and its normal map: (H, W, 3) float32, row 0 at the top."""

    mesh: Mesh
    normal: np.ndarray


class HeightField(NamedTuple):
    """A height field as a high poly, matched by UVs, and the plane under it: bake(*field)."""

    mesh: Mesh
    plane: Mesh


def height_field(heights: Any, *, height: float = 1.0, extent: tuple[float, float] | None = None) -> HeightField:
    """Makes the mesh of a height field, such as a terrain or a wall.

    heights  (H, W) float, uint8 or uint16 (shares of 255 and 65535), row 0 at the largest y; or a file's path (PNG, EXR, TIFF);
             NaN and the file's no-data value become holes
    height   world units of a value of 1; may be negative
    extent   width along x and depth along y, world units; default: the longer side is 1

    Pixels are points: the outermost are on the border. Returns (mesh, plane). Raises kiln.Error.

    >>> import kiln
    >>> field = kiln.height_field([[0.0, 0.5], [1.0, 0.5]], height=2, extent=(4, 4))
    >>> field.mesh.vertices[:, 2].tolist(), len(field.plane.faces)
    ([0.0, 1.0, 2.0, 1.0], 2)
    """
    width, depth = (0.0, 0.0) if extent is None else _floats(extent, 2, "extent")
    given = path_of(heights, "heights") if isinstance(heights, (str, os.PathLike)) else heights
    return HeightField(*_core.height_field(given, width, depth, *_floats([height], 1, "height")))


def _voxels_of(voxels: Any, spacing: Any, origin: Any) -> _core.VolumeCore:
    if isinstance(voxels, (str, os.PathLike)):
        return _core.VolumeCore.load(path_of(voxels, "voxels"))
    steps = (spacing,) * 3 if isinstance(spacing, numbers.Real) else spacing
    return _core.VolumeCore.of(voxels, _floats(steps, 3, "spacing"), _floats(origin, 3, "origin"), "volume")


def _floats(values: Any, count: int, parameter: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != count:
        raise Error(f"{parameter}: expected {count} numbers, not {values!r}.", "option-type", "usage", parameter)
    return numbers


def contour(
    voxels: Any,
    iso: float,
    *,
    spacing: float | tuple[float, float, float] = 1.0,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inside: str = "above",
    border: str = "closed",
    outer: bool = False,
    device: str | int = "",
    progress: Any = None,
) -> Mesh:
    """Contours a volume at full resolution, by dual contouring.

    voxels   (I, J, K) numbers: voxels[i, j, k] is at origin + (i, j, k) * spacing; or a file's path (NRRD,
             MetaImage, NIfTI), which has its own origin and spacing
    iso      value of the surface
    inside   which side is solid: above or below
    border   at the volume's border, the solid is closed (cut off flat) or open
    outer    only the outer surface

    Returns a closed kiln.Mesh with normals. Raises kiln.Error.

    >>> import kiln, numpy as np
    >>> x, y, z = np.mgrid[-8:9, -8:9, -8:9]
    >>> kiln.contour(6 - np.sqrt(x**2 + y**2 + z**2), 0, origin=(-8, -8, -8)).vertices.mean(0).round(2) + 0.0
    array([0., 0., 0.])
    """
    made = _voxels_of(voxels, spacing, origin)
    report = callback_of(progress)
    return report_completion(report, _core.contour(made, iso, inside, border, outer, device_of(device), report))


def volume(
    voxels: Any,
    iso: float,
    *,
    faces: int = 0,
    error: float | None = None,
    size: int | None = None,
    spacing: float | tuple[float, float, float] = 1.0,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inside: str = "above",
    border: str = "closed",
    outer: bool = False,
    unwrap: str = "pairs",
    flip_y: bool = False,
    device: str | int = "",
    progress: Any = None,
) -> VolumeBake:
    """Makes a low poly with a normal map directly from a volume. Parameters: see contour(), and

    faces    maximum number of triangles; default: as few as `error` allows
    error    without faces: maximum distance of vertices from the surface, cells; default: chosen for the volume
    size     texels of one side of the map, 16 to 8192; default: about one texel per cell
    unwrap   pairs (of triangles) or charts (few large ones)

    Returns (mesh, normal). Raises kiln.Error.
    """
    made = _voxels_of(voxels, spacing, origin)
    report = callback_of(progress)
    mesh, normal = _core.extract(
        made, iso, inside, border, outer, faces, error, size, unwrap, flip_y, device_of(device), report
    )
    return report_completion(report, VolumeBake(mesh, normal))
