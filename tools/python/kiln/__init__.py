"""Kiln bakes the detail of dense meshes into textures of light ones, on any OpenCL device, CPUs included.

    import kiln
    low = kiln.unwrap(kiln.simplify("statue.ply", target=10_000), size=2048)
    bake = kiln.bake("statue.ply", low, size=2048, maps=["normal", "ao"])
    bake["normal"]           # (2048, 2048, 3) float32
    bake.save("out")
"""

from ._bake import Bake, MapError, Report, SampleStatus, Source, bake, bake_sets, match
from ._core import Match, Mesh
from ._core import devices as devices
from ._core import version as _version
from ._driver import prepare as _prepare
from ._errors import Cancelled, Error, KilnWarning
from ._glb import Glb, pack_glb, sampled, to_glb
from ._job import JobMap, JobResult, job_schema, run
from ._measure import NormalError, measure, render
from ._meshes import as_mesh, load
from ._notebook import install as _install_notebook
from ._options import options
from ._plan import Plan, plan
from ._session import BakeSession, ViewSession
from ._surface import clean, simplify, unwrap
from ._volume import HeightField, VolumeBake, contour, height_field, volume

_prepare()
_install_notebook()
__version__ = _version()
__all__ = [
    "Bake",
    "BakeSession",
    "Cancelled",
    "Error",
    "Glb",
    "HeightField",
    "JobMap",
    "JobResult",
    "KilnWarning",
    "MapError",
    "Match",
    "Mesh",
    "NormalError",
    "Plan",
    "Report",
    "SampleStatus",
    "Source",
    "ViewSession",
    "VolumeBake",
    "as_mesh",
    "bake",
    "bake_sets",
    "clean",
    "contour",
    "devices",
    "height_field",
    "job_schema",
    "load",
    "match",
    "measure",
    "options",
    "pack_glb",
    "plan",
    "render",
    "run",
    "sampled",
    "simplify",
    "to_glb",
    "unwrap",
    "volume",
]
