"""Low polys: kiln.simplify() and kiln.unwrap()."""

from __future__ import annotations

import math
from typing import Any

from . import _core
from ._core import Mesh
from ._errors import Error, count_of
from ._meshes import as_high, as_mesh
from ._progress import callback_of, report_completion


def simplify(
    mesh: Any,
    faces: Any = None,
    *,
    target: int | None = None,
    max_error: float = 0.002,
    keep_uvs: bool = False,
    hull: bool = False,
    keep_parts: bool = False,
    high_normals: str | float = "auto",
    progress: Any = None,
) -> Mesh:
    """Simplifies a mesh to fewer triangles.

    mesh        as kiln.as_mesh() takes it; or the vertices, with faces beside them
    target      number of triangles; default: as few as max_error allows
    max_error   without target: maximum distance of the surfaces, as a share of the bounding box's diagonal
    keep_uvs    keep the UVs, groups and materials and their borders
    hull        make the result enclose the mesh
    keep_parts  keep parts of any size
    high_normals
                as kiln.Source takes it
    progress    as bake() takes it

    Returns a kiln.Mesh, whose report has faces, error, search_distance and near_distance (shares of the diagonal). Raises kiln.Error.

    >>> import kiln
    >>> tetrahedron = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> kiln.simplify(*tetrahedron, target=4).faces.shape
    (4, 3)
    """
    high = as_high(mesh if faces is None else (mesh, faces), high_normals, "mesh")
    count = 0 if target is None else count_of(target, "target", 1, 2**31)
    report = callback_of(progress)
    return report_completion(report, _core.simplify(high, count, max_error, keep_uvs, hull, keep_parts, True, report))


def clean(
    mesh: Any,
    faces: Any = None,
    *,
    weld: float = 1e-5,
    orient: bool = True,
    fill_holes: float | bool | str = True,
    drop_floaters: float | bool = True,
    drop_hidden: bool = True,
    progress: Any = None,
) -> Mesh:
    """Repairs typical defects of generated and scanned meshes; each repair is a kiln.KilnWarning.

    mesh           as kiln.as_mesh() takes it; or the vertices, with faces beside them
    weld           weld vertices of open edges within this distance, which closes cracks; 0: none
    orient         flip triangles that face against their neighbours, or away from all views
    fill_holes     fill holes of any number of edges that are up to so large across: by a surface that continues what is
                   around, or by a lid where it ends at an angle. "all": every rim, for a watertight mesh. True: pinholes
                   alone, of at most 12 edges and a perimeter of 0.02
    drop_floaters  remove separate bodies with a smaller diagonal; True: 0.01
    drop_hidden    remove parts that no view from outside sees
    progress       as bake() takes it

    Lengths are shares of the bounding box's diagonal; False: none. Returns a kiln.Mesh: the same one if no
    repair was needed.
    Raises kiln.Error.

    >>> import kiln
    >>> tetrahedron = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> kiln.clean(*tetrahedron).faces.shape
    (4, 3)
    """
    high = as_mesh(mesh if faces is None else (mesh, faces))
    report = callback_of(progress)
    return report_completion(report, clean_with_progress(high, weld, orient, fill_holes, drop_floaters, drop_hidden, report))


def clean_with_progress(
    high: Mesh,
    weld: float,
    orient: bool,
    fill_holes: float | bool | str,
    drop_floaters: float | bool,
    drop_hidden: bool,
    report: Any,
) -> Mesh:
    """clean() with a progress callback."""
    pinhole = 0.02 if fill_holes else 0
    hole = 0 if isinstance(fill_holes, bool) else hole_size(fill_holes)
    floater = (0.01 if drop_floaters else 0) if isinstance(drop_floaters, bool) else drop_floaters
    return _core.clean(high, weld, orient, pinhole, hole, floater, not drop_hidden, report)


def hole_size(fill_holes: Any) -> float:
    """The largest holes to fill as a number; math.inf for "all"."""
    if fill_holes == "all":
        return math.inf
    try:
        return float(fill_holes)
    except (TypeError, ValueError):
        text = f'fill_holes: {fill_holes!r}: give a share of the diagonal such as 0.1, True, False or "all".'
        raise Error(text, "option-type", "usage", "fill_holes", repr(fill_holes), "a share, True, False, all") from None


def unwrap(
    mesh: Any,
    faces: Any = None,
    *,
    size: int = 2048,
    method: str = "charts",
    border: int | None = None,
    detail_of: Any = None,
    progress: Any = None,
) -> Mesh:
    """Gives a mesh new UVs that do not overlap.

    mesh       as kiln.as_mesh() takes it; or the vertices, with faces beside them
    size       of the map that it is for, texels
    method     charts (few large ones), pairs (of triangles) or squares
    border     empty texels between charts; default: 1/256 of the size, at least 2
    detail_of  a high poly whose detail decides the texel density
    progress   as bake() takes it

    Returns a kiln.Mesh, whose report has charts and coverage. Raises kiln.Error.

    >>> import kiln
    >>> kiln.unwrap([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], size=64).report["charts"]
    1
    """
    low = as_mesh(mesh if faces is None else (mesh, faces))
    detail = None if detail_of is None else as_high(detail_of, "auto", "detail_of")
    size = count_of(size, "size", 16, 65536)
    border = None if border is None else count_of(border, "border", 1, size // 4)
    report = callback_of(progress)
    return report_completion(report, _core.unwrap(low, size, method, border, detail, report))
