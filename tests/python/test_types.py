"""Stubs by mypy and pyright, where they are installed, and the examples of docstrings."""

import doctest
import importlib
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import kiln

PACKAGE = Path(kiln.__file__).parent

USE = """
import kiln
import numpy as np

low = kiln.unwrap(kiln.simplify(np.zeros((3, 3)), np.zeros((1, 3), int), target=10), size=2048)
bake = kiln.bake(low, low, size=(64, 32), maps=["normal"], samples=2, flip_y=True, fallback=["closest", "fill"])
normal: np.ndarray = bake["normal"]
degrees: float = bake.report.errors["normal"].degrees
rows: int = low.faces.shape[0]
with kiln.BakeSession(low, low, size=64, maps=["normal"], samples=2) as session:
    session.set_positions(np.zeros((1, 3)), first=0)
    left: int = session.last_update.dirty[0]
    again: kiln.Bake = session.bake()
changed: int = kiln.ViewSession(low, low, size=64).add((0, 0, 1)).changed
"""
WRONG = USE + """
kiln.bake(low, low, smaples=2)
kiln.BakeSession(low, low, tow_sided=True)
"""


@pytest.mark.no_device
@pytest.mark.parametrize("checker", [["mypy", "--strict", "--allow-any-generics"], ["pyright", "--pythonpath", sys.executable]], ids=["mypy", "pyright"])
def test_types(checker, tmp_path):
    pytest.importorskip(checker[0])
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent), "MYPY_CACHE_DIR": str(tmp_path / "cache")}

    def run(*words):
        program = [sys.executable, "-m", *checker, *map(str, words)]
        return subprocess.run(program, capture_output=True, text=True, env=environment, cwd=tmp_path)

    (tmp_path / "use.py").write_text(USE)
    (tmp_path / "wrong.py").write_text(WRONG)
    right = run("use.py", PACKAGE)
    if "nodeenv" in right.stderr or "network" in right.stderr.lower():
        pytest.skip("pyright could not get its own program.")
    assert right.returncode == 0, right.stdout + right.stderr
    wrong = run("wrong.py")
    assert wrong.returncode != 0 and "smaples" in wrong.stdout and "tow_sided" in wrong.stdout


@pytest.mark.parametrize("name", ["kiln._core"] + [f"kiln.{module.name}" for module in pkgutil.iter_modules([str(PACKAGE)])])
def test_examples_of_docstrings(name):
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert failed == 0


@pytest.mark.no_device
def test_everything_public_has_a_docstring():
    for name in kiln.__all__:
        thing = getattr(kiln, name)
        assert thing.__doc__, name
        if isinstance(thing, type):
            for part, value in vars(thing).items():
                if not part.startswith("_") and (callable(value) or isinstance(value, property)):
                    assert value.__doc__, f"{name}.{part}"


@pytest.mark.no_device
def test_import_takes_no_numpy():
    program = "import kiln, sys; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True)
