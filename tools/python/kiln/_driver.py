"""Environment variables for the OpenCL driver, which is loaded at the first use of a device."""

from __future__ import annotations

import importlib
import os


def prepare() -> None:
    try:
        os.environ.setdefault("KILN_OPENCL_DRIVER", importlib.import_module("kiln_cpu").library)
    except ImportError:
        pass
