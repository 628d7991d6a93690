"""kiln.run(): everything that the command `kiln bake` does, in one call."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _core
from ._core import Mesh
from ._errors import Error
from ._meshes import as_mesh
from ._options import json_of
from ._progress import callback_of

if TYPE_CHECKING:
    import numpy as np


class JobMap(NamedTuple):
    """A map of a job in memory: name ("normal"), set and tile of texture sets (else empty), and pixels, (H, W, C) float32
    as files hold them: in [0, 1], colours sRGB-encoded; row 0 at the top."""

    name: str
    set: str
    tile: str
    pixels: np.ndarray


class JobResult(NamedTuple):
    """The result of a job.

    files    written files, in order
    glb      bytes of the GLB of a job in memory, else empty
    maps     list of JobMap of a job in memory without a GLB
    mesh     the low poly
    report   the report of the command's --json
    summary  the lines that the command prints
    failure  the limit that was exceeded, for which the command exits with 1; else empty
    """

    files: list[str]
    glb: bytes
    maps: list[JobMap]
    mesh: Mesh
    report: dict[str, Any]
    summary: list[str]
    failure: str


def run(
    job: Mapping[str, Any] | str | None = None, /, *, in_memory: bool = False, progress: Any = None, **options: Any
) -> JobResult:
    """Runs a job like `kiln bake`, with its options as keywords.

    job        a dict of options, or its JSON text; keyword arguments take precedence
    high, low  a path, a list of paths, or a mesh as kiln.as_mesh() takes it. Without low, Kiln makes it (faces=, max_error=)
    out        a folder, or NAME.glb, NAME.gltf or NAME.obj
    options    flags of `kiln bake` with underscores: faces=5000, maps=["normal", "ao"], max_distance="2%";
               kiln.job_schema() describes all
    in_memory  write no files: the result has the GLB's bytes, or the maps
    progress   as kiln.bake() takes it

    Warnings are kiln.KilnWarning. Returns a JobResult. Raises kiln.Error.
    """
    if isinstance(job, str):
        try:
            job = json.loads(job)
        except ValueError as error:
            raise Error(f"job: it is not valid JSON ({error}).", "option-type", "usage", "job") from None
    if job is not None and not isinstance(job, Mapping):
        raise Error(f"job: expected a dict or JSON of an object, not {type(job).__name__}.", "option-type", "usage", "job")
    given = {**(job or {}), **options}
    meshes = {side: as_mesh(given.pop(side), side) for side in ("high", "low") if not _is_file(given.get(side))}
    made = _core.run_job(json_of(given), meshes.get("high"), meshes.get("low"), in_memory, callback_of(progress))
    maps = [JobMap(each["name"], each["set"], each["tile"], each["pixels"]) for each in made["maps"]]
    report = json.loads(made["report"])
    return JobResult(made["files"], made["glb"], maps, made["mesh"], report, made["summary"], made["failure"])


def _is_file(given: Any) -> bool:
    """True for paths, which the job reads itself, and for None."""
    files = given if isinstance(given, (list, tuple)) else [given]
    return given is None or all(isinstance(file, (str, os.PathLike)) for file in files)


def job_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of run()'s options."""
    return dict(json.loads(_core.job_schema()))

