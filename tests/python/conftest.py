"""Meshes by formula, and the command to compare with."""

import os
import subprocess

import numpy as np
import pytest

import kiln


def sheet(n, height):
    """n x n quads over the unit square, z by a function of x and y, with UVs."""
    steps = np.linspace(0, 1, n + 1)
    x, y = np.meshgrid(steps, steps)
    x, y = x.ravel(), y.ravel()
    vertices = np.stack([x, y, height(x, y)], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + n + 2], axis=1),
            np.stack([corner, corner + n + 2, corner + n + 1], axis=1),
        ]
    )
    return vertices, faces, np.stack([x, y], axis=1)


def waves(x, y):
    return 0.01 * np.sin(2 * np.pi * 3 * x) + 0 * y


def has_device():
    try:
        return bool(kiln.devices())
    except kiln.Error:
        return False


def pytest_collection_modifyitems(config, items):
    if has_device():
        return
    if os.environ.get("CI"):
        pytest.exit("No OpenCL device was found.", 1)
    for item in items:
        if "no_device" not in item.keywords:
            item.add_marker(pytest.mark.skip(reason="No OpenCL device was found."))


def pytest_configure(config):
    config.addinivalue_line("markers", "no_device: runs without an OpenCL device")


@pytest.fixture(scope="session")
def high():
    vertices, faces, uvs = sheet(64, waves)
    return kiln.Mesh(vertices, faces, uvs, name="waves")


@pytest.fixture(scope="session")
def low():
    vertices, faces, uvs = sheet(4, lambda x, y: 0 * x)
    return kiln.Mesh(vertices, faces, uvs, name="flat")


@pytest.fixture(scope="session")
def source(high):
    return kiln.Source(high)


@pytest.fixture
def command():
    """Runs the command; skips where it is not there."""
    program = os.environ.get("KILN_COMMAND")
    if not program:
        pytest.skip("KILN_COMMAND does not name the command.")

    def run(*words):
        done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done

    return run
