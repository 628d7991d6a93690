"""What the environment tells the OpenCL driver, which is loaded at the first use of a device."""

from __future__ import annotations

import importlib
import os


def prepare() -> None:
    try:
        os.environ.setdefault("KILN_OPENCL_DRIVER", importlib.import_module("kiln_cpu").library)
    except ImportError:
        pass
    if os.environ.get("POCL_CACHE_DIR") == "":
        del os.environ["POCL_CACHE_DIR"]  # PoCL would end the process
    if "POCL_CACHE_DIR" not in os.environ and not _can_write(_cache_folder()):
        _keep_kernels_in_temporary_folder()


def _cache_folder() -> str:
    """Where PoCL and Kiln keep compiled kernels."""
    home = os.environ.get("HOME")
    return os.environ.get("XDG_CACHE_HOME") or (home and os.path.join(home, ".cache")) or ""


def _can_write(folder: str) -> bool:
    while folder and not os.path.lexists(folder) and os.path.dirname(folder) != folder:
        folder = os.path.dirname(folder)
    return bool(folder) and os.access(folder, os.W_OK | os.X_OK)


def _keep_kernels_in_temporary_folder() -> None:
    """PoCL is no device without a folder to write to. One that others can write to would let them run code here."""
    import stat
    import tempfile

    folder = os.path.join(tempfile.gettempdir(), f"kiln-{os.getuid()}")
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        found = os.lstat(folder)
    except OSError:
        return
    if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022:
        os.environ["POCL_CACHE_DIR"] = folder
