"""Sessions: kiln.BakeSession for a moving high poly, and kiln.ViewSession, which matches view by view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from . import _core
from ._bake import Bake, _source_of, bake_request
from ._core import Match, Mesh
from ._errors import Error, count_of, device_of
from ._meshes import as_high, as_mesh
from ._options import json_of, select_keywords

if TYPE_CHECKING:
    from typing import Unpack

    from ._keywords import Keywords


class BakeSession:
    """A bake of a moving high poly. Data stay on the device, and only affected texels are baked again.

    high, low, size, maps, match, cage_mesh, ao_occluders, textures, device, keywords
              as bake() takes them. Not supported: match="auto", a kiln.Match, cage="auto", report_error, recall,
              fallback_blend, visibility_clusters
    bounds    two corners, world units: the box within which the high poly moves. Its diagonal is the reference of
              lengths in %. Vertices may leave it by about half its size. Default: the box of the initial mesh
    high_normals
              as kiln.Source takes it. If the mesh has no normals, smooth ones are updated with its positions. Normals
              that "auto" computes for a hard surface are not; use "file" for smooth ones, which are

    With match="uv", texels whose triangles changed are baked again; other matches match all texels again. The bytes are
    equal to kiln.Source(session.mesh, bounds=session.bounds).bake(low, ...), and thus to kiln.bake() while the mesh's
    own box is unchanged.

    One thread at a time: concurrent calls raise an error (code "busy"). Arguments are copied, and results remain valid.
    close(), or the end of a `with` block, frees its memory. Ctrl-C stops bake(); the next one bakes everything again.
    Raises kiln.Error as bake() does.

    >>> import kiln
    >>> corners, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> square = kiln.Mesh(corners, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> with kiln.BakeSession(square, square, size=16, maps="height", match="uv") as session:
    ...     before = session.bake()
    ...     session.set_positions([[1, 1, 0.5]], first=2)
    ...     after = session.bake()
    >>> round(float(before["height"].max()), 2), round(float(after["height"].max()), 2)
    (0.0, 0.48)
    """

    class Update(NamedTuple):
        """Statistics of one call of bake()."""

        triangles: int  #: of the high poly with changed corners or normals
        texels: int  #: texels that were baked again
        matched: bool  #: samples were matched again
        dirty: tuple[int, int, int, int]  #: x, y, width, height, row 0 at the top: bytes outside are unchanged
        seconds: float  #: run time

    def __init__(
        self,
        high: Any,
        low: Any,
        *,
        size: int | tuple[int, int] = 2048,
        maps: str | Sequence[str] = "normal",
        match: str | None = None,
        cage_mesh: Any = None,
        ao_occluders: Sequence[Any] | str = "high",
        textures: Mapping[str, Any] | None = None,
        bounds: Any = None,
        high_normals: str | float = "auto",
        device: str | int = "",
        **keywords: Unpack[Keywords],
    ) -> None:
        if keywords.get("recall"):
            text = "recall: a session does not measure lost detail: leave it out, or call bake()."
            raise Error(text, "option-contradiction", "usage", "recall")
        self._keywords: Mapping[str, Any] = keywords
        given = bake_request(low, size, maps, match, cage_mesh, ao_occluders, textures, keywords)
        self._core = _core.BakeSessionCore(as_high(high, high_normals), *given, bounds, device_of(device))

    def set_positions(self, positions: Any, first: int | None = None) -> None:
        """Moves vertices of the high poly. The next bake() uses them.

        positions  (N, 3) float, world units, finite: rows in the order of session.mesh.vertices, which of a mesh from
                   arrays is the caller's, and of a file that of kiln.load()
        first      index of the first row; default: `positions` has all rows

        Computed normals follow. Explicit normals do not: see set_normals(). If any row is invalid, none is moved.
        """
        self._core.set_positions(positions, None if first is None else count_of(first, "first", 0, 2**32 - 1))

    def set_normals(self, normals: Any, first: int | None = None) -> None:
        """Changes the high poly's own normals.

        normals  (N, 3) float of any length above 0: rows in the order of session.mesh.normals
        first    the row that they begin at; without: they are all rows
        """
        self._core.set_normals(normals, None if first is None else count_of(first, "first", 0, 2**32 - 1))

    def bake(self) -> Bake:
        """Bakes all outdated texels. Returns a copy of all maps, which later bakes do not change."""
        made = Bake(self._core.bake(), self._keywords)
        made.report.errors.measure = _refuse_error_measurement
        return made

    @property
    def last_update(self) -> Update:
        """Statistics of the last bake(): zeros if nothing had changed."""
        return self.Update(*self._core.last_update())

    @property
    def mesh(self) -> Mesh:
        """A copy of the current high poly."""
        return self._core.mesh()

    @property
    def bounds(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Two corners of the box, world units: as given, or those of the initial mesh."""
        return self._core.bounds()

    @property
    def closed(self) -> bool:
        """Whether close() was called."""
        return self._core.closed

    def close(self) -> None:
        """Frees the memory, after a running call has finished."""
        self._core.close()

    def __enter__(self) -> BakeSession:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()


def _refuse_error_measurement(name: str) -> NoReturn:
    text = "report: a session does not measure errors: use kiln.Source(session.mesh, bounds=session.bounds).bake()."
    raise Error(text, "option-contradiction", "usage", "report")


class ViewSession:
    """An incremental match by depth views: each added view improves it.

    source          a kiln.Source, which may be closed after, or a high poly as bake() takes it
    low, size, samples, max_distance, two_sided, view_size, view_criterion, no_view_refine
                    as bake() takes them
    device          as bake() takes it

    After any views the match is, to the bit, that of kiln.match(source, low, match="views", views=0, view=[...]) with
    the same directions in the same order. Threads, close() and errors as of kiln.BakeSession. A view is added whole:
    Ctrl-C waits for it.

    >>> import kiln
    >>> corners, faces = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    >>> square = kiln.Mesh(corners, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> with kiln.ViewSession(square, square, size=16) as session:
    ...     gained = session.add((0, 0, 1)).changed, session.add((0, 0, 1)).changed
    ...     match = session.match()
    >>> gained, kiln.bake(square, square, size=16, match=match).report.missed
    ((256, 0), 0)
    """

    class Step(NamedTuple):
        """How many samples one view has improved."""

        samples: int  #: samples of the low poly
        decided: int  #: samples with a point from any view so far
        changed: int  #: samples whose point this view found first or improved

    def __init__(
        self,
        source: Any,
        low: Any,
        *,
        size: int | tuple[int, int] = 2048,
        samples: int = 1,
        max_distance: float | str | None = None,
        two_sided: bool = False,
        view_size: int | None = None,
        view_criterion: str | None = None,
        no_view_refine: bool = False,
        device: str | int = "",
    ) -> None:
        options = select_keywords(
            {
                "size": size,
                "match": "views",
                "samples": samples,
                "max_distance": max_distance,
                "two_sided": two_sided,
                "view_size": view_size,
                "view_criterion": view_criterion,
                "no_view_refine": no_view_refine,
            }
        )
        low_mesh = as_mesh(low, "low")
        self._core = _core.ViewSessionCore(_source_of(source, device, None)._core, low_mesh, json_of(options))

    def add(self, direction: Any) -> Step:
        """Adds a view. direction: three numbers, from the mesh to the viewer, of any length above 0."""
        return self.Step(*self._core.add(direction))

    def match(self) -> Match:
        """A copy of the current match, for bake(match=...) with this size and samples."""
        return self._core.match()

    @property
    def closed(self) -> bool:
        """Whether close() was called."""
        return self._core.closed

    def close(self) -> None:
        """Frees the memory, after a running call has finished."""
        self._core.close()

    def __enter__(self) -> ViewSession:
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()
