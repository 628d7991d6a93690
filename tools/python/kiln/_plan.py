"""kiln.plan(): the lightest low poly and maps that reach an error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _core
from ._bake import Bake, _source_of, error_bound
from ._core import Mesh
from ._errors import KilnWarning, count_of
from ._options import json_of, select_keywords
from ._progress import callback_of

if TYPE_CHECKING:
    from typing import Unpack

    from ._keywords import Keywords


class Plan(NamedTuple):
    """The result of plan(): the mesh, its maps (None if it needs none), and chosen: faces, size, samples, bits, match,
    search_distance (a share of the diagonal), measured degrees, wanted and reached."""

    mesh: Mesh
    bake: Bake | None
    chosen: dict[str, Any]


def plan(
    high: Any,
    *,
    max_error: str | float,
    size: int = 2048,
    maps: str | Sequence[str] = "normal",
    screen: int | str | None = None,
    max_outline: str | None = None,
    high_normals: str | float | None = None,
    device: str | int = "",
    progress: Any = None,
    **keywords: Unpack[Keywords],
) -> Plan:
    """Finds the low poly and maps with the fewest bytes whose rendered normals are within an error.

    high         a kiln.Source, or what kiln.as_mesh() takes
    max_error    mean angle between rendered normals: degrees, or "normal=3deg"; with bounds of other maps:
                 "normal=3,ao=2/255"
    size         maximum size of maps, texels
    screen       maximum size of the mesh on screen, pixels: finer detail is ignored
    max_outline  maximum share by which outlines may differ, such as "2%"
    high_normals
                 as kiln.Source takes it; without: "auto"
    keywords     see bake(); match and samples are chosen unless given

    Warns if the error is not reached. Returns a kiln.Plan.
    """
    names = [maps] if isinstance(maps, str) else list(maps)
    options = select_keywords({"size": size, "maps": names, **keywords})
    options |= {"max_error": error_bound(max_error), "screen": screen_of(screen), "max_outline": max_outline}
    report = callback_of(progress)
    mesh, core, chosen = _core.plan(_source_of(high, device, report, high_normals)._core, json_of(options), report)
    if not chosen["reached"]:
        import warnings

        text = f"Rendered normals deviate by {chosen['degrees']:.3g} degrees, but {chosen['wanted']:.3g} were requested."
        warnings.warn(KilnWarning(text, "error-not-reached", 1), stacklevel=2)
    return Plan(mesh, None if core is None else Bake(core, keywords), chosen)


def screen_of(screen: int | str | None) -> str | None:
    """Converts the size on screen to the form that a job takes."""
    if screen is None or isinstance(screen, str):
        return screen
    return f"{count_of(screen, 'screen', 16, 16384)}px"
