"""Kiln's exception and warning."""

from __future__ import annotations

import operator
import os
import reprlib
import warnings as _warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any


class Error(RuntimeError):
    """An error, described in one or two sentences with the remedy.

    code       stable identifier for programs, such as "mesh-index", or else the kind
    kind       usage, input, device, output, cancelled or internal
    parameter  the argument's name, or None
    value      the given value, if the error is about a value; else ""
    allowed    the allowed values, such as "1 to 16"; else ""
    remedies   other arguments that the message suggests, with values: [("format", "exr")]
    """

    def __init__(
        self,
        message: str,
        code: str = "usage",
        kind: str = "usage",
        parameter: str | None = None,
        value: str = "",
        allowed: str = "",
        remedies: list[tuple[str, str]] | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.kind = kind
        self.parameter = parameter
        self.value = value
        self.allowed = allowed
        self.remedies = remedies or []

    def __reduce__(self):  # type: ignore[no-untyped-def]
        facts = self.code, self.kind, self.parameter, self.value, self.allowed, self.remedies
        return type(self), (str(self), *facts)


class Cancelled(Error):
    """A progress callback returned False."""


class KilnWarning(UserWarning):
    """A warning about imperfect data that was handled, with the arguments code, message and count."""

    def __init__(self, message: str, code: str = "", count: int = 0) -> None:
        super().__init__(message)
        self.code = code
        self.count = count


def from_core(message: str, code: str, kind: str, facts: dict[str, Any]) -> Error:
    """Creates the exception for an error of the library. facts: parameter, remedies, value and allowed"""
    return (Cancelled if kind == "cancelled" else Error)(message, code, kind, **facts)


def count_of(value: Any, parameter: str, least: int, most: int) -> int:
    """Converts an argument to an integer."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if least <= number <= most:
        return number
    text = f"{parameter}: {value!r}: expected a whole number, {least} to {most}."
    raise Error(text, "option-range", "usage", parameter)


def path_of(given: Any, parameter: str = "path") -> str:
    """Converts a path from a string, bytes or os.PathLike."""
    try:
        path = os.fsdecode(given)
        if "\0" not in path and os.fsencode(path):
            return path
    except (TypeError, UnicodeError):
        pass
    text = f"{parameter}: expected a file's path, not {reprlib.repr(given)}."
    if isinstance(given, (bytes, bytearray, memoryview)):
        text += " For the bytes of a file, call kiln.as_mesh(data)."
    raise Error(text, "path", "input", parameter)


def device_of(device: Any) -> str:
    """Converts a device to its name or index for the library. Unknown names are rejected at once, before any work."""
    from . import _core

    if isinstance(device, str):
        if device:
            _core.check_device(device)
        return device
    if isinstance(device, bool) or not hasattr(device, "__index__"):
        text = f"device: {device!r}: expected an index or part of a name, as kiln.devices() lists them."
        raise Error(text, "option-type", "usage", "device")
    return str(operator.index(device))


#: Names of arguments in other packages.
_NAMES_IN_OTHER_PACKAGES = {
    "size": ("texture_size",),
    "resolution": ("texture_size", "size"),
    "texture_resolution": ("texture_size", "size"),
    "target_faces": ("faces_target", "target"),
    "target_count": ("faces_target", "target"),
    "target_face_count": ("faces_target", "target"),
    "face_count": ("faces_target", "target"),
    "faces": ("faces_target", "target"),
    "target": ("faces_target",),
    "out": ("path",),
    "output": ("path",),
    "filename": ("path",),
    "file": ("path",),
    "texture": ("textures", "maps"),
    "vertex_colors": ("colors",),
    "doublesided": ("double_sided",),
    "two_sided": ("double_sided",),
}


def unknown_keyword(name: str, function: str, own: Iterable[str], near: str | None) -> TypeError:
    """Returns the error for an unknown keyword of a function, with a suggestion.

    own   the function's own parameters
    near  the nearest keyword of a bake; None or "": none is near
    """
    import difflib

    names = list(own)
    word = name.lower().replace("-", "_")
    similar_names = [other for other in _NAMES_IN_OTHER_PACKAGES.get(word, ()) if other in names]
    known = [*names, near] if near else names
    similar_names = similar_names or difflib.get_close_matches(word, known, 1, 0.75) or ([near] if near else [])
    text = f"{function}() got an unexpected keyword argument '{name}'"
    return TypeError(text + (f"; did you mean {similar_names[0]}?" if similar_names else "; kiln.options() lists them"))


#: The texture set that is being baked. Triangles of other sets have no UVs meanwhile; no warning is issued for them.
texture_set: ContextVar[str] = ContextVar("texture_set", default="")


#: True while a bake is repeated, so that its warnings are not issued again.
quiet: ContextVar[bool] = ContextVar("quiet", default=False)


_suppressed_code: ContextVar[str | None] = ContextVar("suppressed_code", default=None)


@contextmanager
def suppress_warning(code: str | None) -> Iterator[None]:
    """Context in which warnings with a code are suppressed."""
    token = _suppressed_code.set(code)
    try:
        yield
    finally:
        _suppressed_code.reset(token)


def warn(code: str, message: str, count: int) -> None:
    if quiet.get() or code == _suppressed_code.get():
        return
    if name := texture_set.get():
        if code == "uv-missing":
            return
        message = f"Texture set '{name}': {message}"
    # The warning is attributed to the first caller outside this package.
    _warnings.warn(KilnWarning(message, code, count), stacklevel=_depth())


def _depth() -> int:
    import sys

    depth = 1
    frame = sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "kiln":
        depth += 1
        frame = frame.f_back  # type: ignore[assignment]
    return depth
