"""Checks of the caller's arrays. Imported at the first use, since NumPy takes longer to import than all of Kiln."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core
from ._errors import Error

_MIN_BYTES_TO_CHECK = 16 << 20  #: bytes: smaller arrays skip the memory check
_MAX_FACE_ROWS = 0xFFFFFFFF  // 3 #: corner indices have 32 bits


def _fail(parameter: str, what: str, code: str) -> None:
    raise Error(f"{parameter}: {what}", code, "usage", parameter)


def as_array(values: Any, parameter: str) -> np.ndarray:
    """Converts a list, or an object with __array__ or DLPack (on the CPU), to an array."""
    try:
        if hasattr(values, "__dlpack__") and not hasattr(values, "__array__"):
            array = np.from_dlpack(values)
        else:
            array = np.asarray(values)
    except (ValueError, TypeError, RuntimeError, BufferError) as error:
        raise Error(
            f"{parameter}: cannot be read as an array of numbers ({error}). Give a NumPy array; "
            "copy a tensor on a GPU to the CPU first.",
            "array-type",
            "usage",
            parameter,
        ) from error
    if array.dtype.kind not in "biufc":
        _fail(parameter, f"expected numbers, not {type(values).__name__}.", "array-type")
    # A broadcast array needs no memory for repeated values, but a copy of it does.
    needed = 4 * array.size
    if needed > _MIN_BYTES_TO_CHECK and needed > (left := _core.memory_left()):
        raise Error(
            f"{parameter}: {array.shape} would take {needed >> 20} MiB of memory, but only {left >> 20} MiB are left.",
            "memory",
            "input",
            parameter,
        )
    return array


def _refuse_repeats(array: np.ndarray, parameter: str) -> None:
    """Refuses views by broadcast_to(): they may have billions of equal rows, which need memory only once they are copied."""
    if array.ndim > 0 and len(array) > 1 and array.strides[0] == 0:
        raise Error(
            f"{parameter}: all {len(array)} rows share one place in memory, as after numpy.broadcast_to(). "
            "Copy the array first.",
            "array-shape",
            "input",
            parameter,
        )


def check_array(
    values: Any, parameter: str, dtype: str, shape: tuple[int, ...], below: int | None
) -> np.ndarray:
    """Converts to a contiguous array of a type and a shape; -1 in the shape allows any number."""
    array = as_array(values, parameter)
    wanted = ", ".join("N" if side < 0 else str(side) for side in shape)
    if array.ndim != len(shape) or any(
        side >= 0 and side != found for side, found in zip(shape, array.shape)
    ):
        _fail(parameter, f"expected the shape ({wanted}), not {array.shape}.", "array-shape")
    if array.size == 0:
        _fail(parameter, f"is empty; expected the shape ({wanted}).", "array-empty")
    if parameter in ("faces", "vertices"):
        _refuse_repeats(array, parameter)
    kind = array.dtype.kind
    if below is not None and array.shape[0] > _MAX_FACE_ROWS:
        raise Error(f"{parameter}: at most {_MAX_FACE_ROWS} rows, not {array.shape[0]}.", "array-shape", "input", parameter)
    if below is not None:
        if kind not in "iu":
            _fail(parameter, f"expected whole numbers, not {array.dtype}.", "array-type")
        low, high = int(array.min()), int(array.max())
        if low < 0 or high >= below:
            wrong = low if low < 0 else high
            place = np.unravel_index(int(np.argmax(array == wrong)), array.shape)
            at = ", ".join(str(int(i)) for i in place)
            _fail(
                parameter,
                f"element [{at}] is {wrong}: expected 0 to {below - 1}.",
                "mesh-index",
            )
    elif dtype == "uint8":
        if array.dtype != np.uint8:
            _fail(parameter, f"expected uint8, not {array.dtype}.", "array-type")
    elif kind not in "fiub" or array.dtype.itemsize > 8:
        _fail(parameter, f"expected real numbers, not {array.dtype}.", "array-type")
    return np.ascontiguousarray(array, dtype=dtype)


def corner_values(
    values: Any, faces: Any, parameter: str, channels: int, vertices: int, triangles: int
) -> tuple[np.ndarray, str]:
    """Checks values per vertex, values per corner, or a pool of values with its own faces. Returns them and their kind."""
    array = as_array(values, parameter)
    if faces is not None:
        _refuse_repeats(array, parameter)  # the rows of this array, of any number
        return check_array(array, parameter, "float32", (-1, channels), None), "pool"
    if array.shape == (triangles, 3, channels):
        return check_array(array, parameter, "float32", (triangles, 3, channels), None), "corner"
    if array.shape != (vertices, channels):
        _fail(
            parameter,
            f"expected ({vertices}, {channels}), one per vertex, or ({triangles}, 3, {channels}), one per corner of "
            f"each face, not {array.shape}; give {parameter[:-1]}_faces beside rows of their own.",
            "array-shape",
        )
    return check_array(array, parameter, "float32", (vertices, channels), None), "vertex"


def vertex_colors(values: Any, vertices: int) -> np.ndarray:
    """Converts colours to (V, 4) uint8."""
    array = as_array(values, "colors")
    if array.ndim != 2 or array.shape[0] != vertices or array.shape[1] not in (3, 4):
        _fail("colors", f"expected ({vertices}, 3) or ({vertices}, 4), not {array.shape}.", "array-shape")
    return np.ascontiguousarray(_with_alpha(as_bytes(array, "colors")))


def as_bytes(array: np.ndarray, parameter: str) -> np.ndarray:
    """Converts floats in [0, 1] to uint8 by rounding; uint8 is unchanged."""
    if array.dtype == np.uint8:
        return array
    if array.dtype.kind != "f":
        _fail(parameter, f"expected uint8, or float in [0, 1], not {array.dtype}.", "array-type")
    if not np.isfinite(array).all() or array.min() < 0 or array.max() > 1:
        _fail(
            parameter,
            f"floats are colours in [0, 1], but these go from {array.min():g} to {array.max():g}; "
            "colours of 0 to 255 are uint8.",
            "array-range",
        )
    rounded: np.ndarray = np.rint(array * 255).astype(np.uint8)
    return rounded


def _with_alpha(colors: np.ndarray) -> np.ndarray:
    if colors.shape[1] == 4:
        return colors
    return np.concatenate([colors, np.full((len(colors), 1), 255, np.uint8)], axis=1)


def check_shares(pixels: np.ndarray, parameter: str, what: str) -> None:
    """Checks that numbers are in [0, 1], with a tolerance of half a step of 8 bits."""
    if pixels.size == 0:
        return
    low, high = float(pixels.min()), float(pixels.max())
    if not -1 / 512 < low <= high < 1 + 1 / 512:  # the negated comparison also rejects NaN
        _fail(
            parameter,
            f"{what} is in [0, 1], but these numbers go from {low:g} to {high:g}; bytes of 0 to 255 are uint8.",
            "array-range",
        )


def image(values: Any, parameter: str) -> np.ndarray:
    """Converts an image to (H, W, C) float32; uint8 and uint16 are divided by 255 and 65535."""
    array = as_array(values, parameter)
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or not 1 <= array.shape[2] <= 4 or array.size == 0:
        _fail(parameter, f"expected (H, W) or (H, W, 1 to 4), not {array.shape}.", "array-shape")
    if array.dtype == np.uint8:
        array = array / np.float32(255)
    elif array.dtype == np.uint16:
        array = array / np.float32(65535)
    elif array.dtype.kind != "f":
        _fail(parameter, f"expected uint8, uint16 or float, not {array.dtype}.", "array-type")
    return np.ascontiguousarray(array, dtype=np.float32)


def voxels(values: Any) -> np.ndarray:
    """Converts voxels to (I, J, K) of a type that volumes support."""
    array = as_array(values, "voxels")
    if array.ndim != 3 or min(array.shape) < 2:
        _fail("voxels", f"expected (I, J, K), each 2 or more, not {array.shape}.", "array-shape")
    if array.dtype == bool:
        array = array.astype(np.uint8)
    if array.dtype == np.float16:
        array = array.astype(np.float32)
    if array.dtype.kind not in "iuf" or array.dtype.itemsize > (8 if array.dtype.kind == "f" else 4):
        _fail("voxels", f"expected 8 to 32-bit whole numbers or floats, not {array.dtype}.", "array-type")
    return np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
