"""Converts keywords to the JSON of a job's options."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from typing import Any

from . import _core
from ._errors import Error, unknown_keyword

_known_keywords: dict[str, bool] = {}


def options() -> dict[str, str]:
    """Returns the keywords of bake() with the help texts of the command.

    >>> import kiln
    >>> "samples" in kiln.options()
    True
    """
    return {name: text for name, is_flag, text in _core.keywords()}


def select_keywords(given: Mapping[str, Any], function: str = "bake", own: Iterable[str] = ()) -> dict[str, Any]:
    """Returns the keywords that have a value. Raises TypeError for unknown ones.

    function, own  whose keywords they are, and its own parameters: for messages
    """
    if not _known_keywords:
        _known_keywords.update((name, is_flag) for name, is_flag, text in _core.keywords())
    for name, value in given.items():
        if name not in _known_keywords:
            raise unknown_keyword(name, function, own, _core.nearest_keyword(name))
        if _known_keywords[name] and value is not None and not isinstance(value, bool):
            raise Error(f"{name}: expected True or False, not {value!r}.", "option-type", "usage", name)
    return {name: value for name, value in given.items() if value is not None and not (_known_keywords[name] and not value)}


def json_of(options: Mapping[str, Any]) -> str:
    """Converts options and their values to JSON."""
    return json.dumps({name: _json_value(name, value) for name, value in options.items() if value is not None})


def to_plain_values(value: Any) -> Any:
    """Converts NumPy's numbers and arrays to Python's numbers and lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [to_plain_values(part) for part in value]
    return value


def is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _json_value(name: str, value: Any) -> Any:
    value = to_plain_values(value)
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, list) and value:
        return [_json_value(name, part) for part in value]
    if isinstance(value, Mapping) and value:
        return {str(key): _json_value(name, part) for key, part in value.items()}
    if is_number(value):
        # JSON cannot represent infinite and huge numbers, so they become text; the library's error
        # then names the option.
        return value if math.isfinite(value) and abs(value) < 2**63 else repr(value)
    if isinstance(value, bool) or (isinstance(value, str) and value):
        return value
    raise Error(f"{name}: cannot be {value!r}.", "option-type", "usage", name)
