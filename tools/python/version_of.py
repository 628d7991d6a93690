"""The version of include/kiln/version.h, for scikit-build-core."""

import re
from pathlib import Path


def dynamic_metadata(field, settings=None):
    text = (Path(__file__).parents[2] / "include/kiln/version.h").read_text()
    return ".".join(re.findall(r"#define KILN_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", text))
