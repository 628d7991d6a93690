"""How a device is found where the system has none: by the wheel kiln-cpu, or one that stands for it."""

import importlib.util
import os
import subprocess
import sys

import pytest

BAKE = """
import hashlib, sys
sys.path.insert(0, {tests!r})
from conftest import sheet, waves
import kiln
high, low = (kiln.Mesh(*sheet(n, waves if n > 4 else lambda x, y: 0 * x)) for n in (64, 4))
bake = kiln.bake(high, low, size=64, maps=["normal", "ao", "curvature"], ao_rays=8)
for name in bake:
    print(name, hashlib.sha256(bake[name].tobytes()).hexdigest())
"""


def bake_with(**changes):
    """Hashes of the maps, by a Python of its own. None takes a variable out of the environment."""
    changes = {"KILN_KEEP_BINARIES": None, **changes}
    environment = {**os.environ, **{name: str(value) for name, value in changes.items() if value is not None}}
    for name, value in changes.items():
        if value is None:
            environment.pop(name, None)
    program = BAKE.format(tests=os.path.dirname(__file__))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def right():
    return bake_with(KILN_OPENCL_DRIVER="")


def test_an_empty_cache_folder_is_none(right):
    assert bake_with(KILN_OPENCL_DRIVER="", POCL_CACHE_DIR="") == right


@pytest.fixture
def no_driver(tmp_path):
    """The environment of a system without OpenCL drivers."""
    vendors = tmp_path / "vendors"
    vendors.mkdir()
    return {"OCL_ICD_VENDORS": vendors, "OCL_ICD_FILENAMES": None}


def test_the_wheel_is_asked_where_the_system_has_no_device(tmp_path, no_driver, right):
    try:
        with open("/etc/OpenCL/vendors/pocl.icd") as file:
            library = file.read().strip()
    except OSError:
        pytest.skip("no Debian package of PoCL to stand for the wheel")
    (tmp_path / "kiln_cpu.py").write_text(f"library = {library!r}\n")
    path = os.pathsep.join([str(tmp_path), *sys.path])
    assert bake_with(PYTHONPATH=path, KILN_OPENCL_DRIVER=None, **no_driver) == right


def test_a_home_that_cannot_be_written(tmp_path, right):
    home = {"HOME": "/dev/null", "POCL_CACHE_DIR": None, "XDG_CACHE_HOME": None, "TMPDIR": tmp_path}
    assert bake_with(**home) == right
    kept = tmp_path / f"kiln-{os.getuid()}"
    assert list(kept.glob("kiln/*.bin")) and kept.stat().st_mode & 0o777 == 0o700
    kept.chmod(0o777)
    with pytest.raises(AssertionError, match=f"another user owns '{kept}' or may write to it"):
        bake_with(**home)


# Built apart (tools/python/README.md): it takes PoCL's compiler too long for every run of the tests.
@pytest.mark.skipif(importlib.util.find_spec("kiln_cpu") is None, reason="kiln-cpu is not installed")
@pytest.mark.parametrize("kernels", ["avx512", "avx2", "sse2"])
def test_the_wheel_has_the_bytes_of_the_system(tmp_path, no_driver, right, kernels):
    own = {"POCL_CACHE_DIR": tmp_path / "cache", "KILN_OPENCL_DRIVER": None, "POCL_KERNELLIB_NAME": kernels}
    for _ in range(2):  # compiled, then from binaries
        assert bake_with(PATH="", **own, **no_driver) == right
