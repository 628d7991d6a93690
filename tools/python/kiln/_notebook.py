"""Shows a Mesh, a Bake or a Glb in a notebook as small pictures, of a few hundred KB at most."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any

from . import _core
from ._bake import Bake
from ._core import Mesh
from ._errors import Error
from ._glb import Glb

if TYPE_CHECKING:
    import numpy as np

_VIEW_PIXELS = 384  #: side of a rendered picture
_MAP_PIXELS = 192  #: longest side of a map beside others
_MAX_MAPS = 8  #: maps that are shown; others are named
_MAX_FACES = 2_000_000  #: larger meshes are not rendered to be shown


def _downsample(pixels: np.ndarray, longest: int) -> np.ndarray:
    """Reduces an image to three channels and at most `longest` pixels per side, by averaging blocks of texels."""
    import numpy as np

    height, width = pixels.shape[:2]
    step = -(-max(height, width) // longest)
    rows, columns = -(-height // step), -(-width // step)
    padded = np.pad(pixels, ((0, rows * step - height), (0, columns * step - width), (0, 0)), mode="edge")
    small = padded.reshape(rows, step, columns, step, -1).mean(axis=(1, 3))
    if small.shape[2] == 2:
        small = np.concatenate([small, np.zeros_like(small[:, :, :1])], axis=2)
    return np.ascontiguousarray(np.nan_to_num(small[:, :, :3]).clip(0, 1), dtype=np.float32)


def _png(pixels: np.ndarray) -> bytes:
    return _core.encode(pixels, "png8", False)


def _view(mesh: Mesh, normal: Any = None) -> bytes | None:
    """Renders a mesh to a PNG; None if the mesh is too large, or there is no device."""
    if len(mesh.faces) > _MAX_FACES:
        return None
    from ._measure import render

    try:
        return _png(render(mesh, normal, size=_VIEW_PIXELS))
    except Error:
        return None


def _image(png: bytes, caption: str, width: int) -> str:
    data = base64.b64encode(png).decode()
    return (
        f'<figure style="display:inline-block;margin:4px;text-align:center;vertical-align:top">'
        f'<img width="{width}" src="data:image/png;base64,{data}" alt="{html.escape(caption)}">'
        f'<figcaption style="font-size:small">{html.escape(caption)}</figcaption></figure>'
    )


def _maps(maps: dict[str, np.ndarray]) -> str:
    text = ""
    for name in list(maps)[:_MAX_MAPS]:
        height, width = maps[name].shape[:2]
        text += _image(_png(_downsample(maps[name], _MAP_PIXELS)), f"{name}, {width} × {height}", _MAP_PIXELS)
    others = list(maps)[_MAX_MAPS:]
    return text + (f"<p>and {html.escape(', '.join(others))}</p>" if others else "")


def _title(text: str) -> str:
    return f"<div><b>{html.escape(text)}</b></div>"


def _mesh_text(mesh: Mesh) -> str:
    text = f"kiln.Mesh '{mesh.name}': {len(mesh.faces):,} faces, {len(mesh.vertices):,} vertices"
    parts = [name for name in ("uvs", "normals", "colors") if getattr(mesh, name) is not None]
    return text + ("; " + ", ".join(parts) if parts else "")


def _mesh_html(mesh: Mesh) -> str:
    view = _view(mesh)
    return "<div>" + _title(_mesh_text(mesh)) + ("" if view is None else _image(view, "as clay", _VIEW_PIXELS)) + "</div>"


def _glb_view(glb: Glb) -> bytes | None:
    return _view(glb.mesh, glb.maps.get("normal"))


def _glb_html(glb: Glb) -> str:
    text = f"kiln.Glb: {len(glb.mesh.faces):,} faces, {len(glb.data):,} bytes"
    view = _glb_view(glb)
    caption = "as clay with its normal map" if "normal" in glb.maps else "as clay"
    return "<div>" + _title(text) + ("" if view is None else _image(view, caption, _VIEW_PIXELS)) + _maps(glb.maps) + "</div>"


def _bake_html(bake: Bake) -> str:
    report = bake.report
    height, width = bake.coverage.shape
    text = f"kiln.Bake: {width} × {height} texels, {report.missed:,} of {report.samples:,} samples missed"
    return "<div>" + _title(text) + _maps({name: bake.stored(name) for name in bake}) + "</div>"


def install() -> None:
    """Adds the methods that notebooks call to the classes."""
    classes: Any = Mesh, Glb, Bake
    mesh, glb, bake = classes
    mesh._repr_png_, mesh._repr_html_ = _view, _mesh_html
    glb._repr_png_, glb._repr_html_ = _glb_view, _glb_html
    bake._repr_html_ = _bake_html
