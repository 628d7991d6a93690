"""Writes the type stub for the keywords of kiln.bake(). The build runs it.

    python keywords_stub.py FILE
"""

import sys
from pathlib import Path

from kiln import _core

STUB_LINES = [
    '"""Keywords of bake() and match(): the command\'s flags."""',
    "",
    "from collections.abc import Mapping, Sequence",
    "from typing import TypedDict",
    "",
    "Value = str | float | Sequence[str | float | Sequence[float]] | Mapping[str, str | Sequence[float]] | None",
    "",
    "class Keywords(TypedDict, total=False):",
]

# Keywords that bake() and match() declare by hand, which are left out here.
DECLARED_KEYWORDS = {"size", "maps", "match"}

if __name__ == "__main__":
    for name, is_flag, text in _core.keywords():
        if name not in DECLARED_KEYWORDS:
            STUB_LINES.append(f"    {name}: {'bool' if is_flag else 'Value'}")
    Path(sys.argv[1]).write_text("\n".join(STUB_LINES) + "\n")
