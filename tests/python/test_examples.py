"""The scripts of tools/python/examples, and what they say."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import sheet, waves

import kiln

FOLDER = Path(__file__).resolve().parents[2] / "tools" / "python" / "examples"


def run(script, *words, where=None):
    done = subprocess.run(
        [sys.executable, "-P", FOLDER / f"{script}.py", *words], capture_output=True, text=True, timeout=300, cwd=where
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


@pytest.mark.parametrize(
    "script, faces, says",
    [
        ("generated_mesh", 4000, r"normal, ao, color; \d+ bytes> 0 samples missed"),
        ("volume", 8000, r"normal; \d+ bytes> 0\.\d+ cells off"),
        ("field", 3000, r"normal, ao, color, roughness, metallic; \d+ bytes> \d+ faces before"),
    ],
)
def test_a_mesh_to_a_glb(script, faces, says, tmp_path):
    out, warnings = run(script, tmp_path)
    assert re.search(says, out), out
    (file,) = tmp_path.glob("*.glb")
    assert 0.9 * faces <= len(kiln.load(file).faces) <= faces
    if script == "generated_mesh":
        assert "no view from outside sees" in warnings and "left out" in warnings


def test_a_scan_within_its_error(tmp_path):
    out, warnings = run("scan", tmp_path)
    assert float(re.search(r"([\d.]+) degrees off", out).group(1)) <= 4.2  # other views than the plan's
    assert "filled" in warnings and "error-not-reached" not in warnings
    assert len(kiln.load(tmp_path / "scan.glb").faces) < 40_000


def test_assets_of_one_source(tmp_path):
    kiln.Mesh(*sheet(64, waves)).save(tmp_path / "dense.obj")
    run("many_assets", tmp_path, tmp_path / "dense.obj")
    for faces in (4000, 1000, 250):
        assert 0 < len(kiln.load(tmp_path / f"lod_{faces}.glb").faces) <= faces


def test_a_glb_to_a_glb_in_three_lines(tmp_path):
    program = (FOLDER / "asset.py").read_text()
    assert len(program.splitlines()) == 3
    assert f"```python\n{program}```" in (FOLDER.parents[2] / "README.md").read_text()
    vertices, faces, uvs = sheet(64, waves)
    kiln.pack_glb(kiln.Mesh(vertices, faces, uvs), {"color": [[[1.0, 0.0, 0.0]]]}, path=tmp_path / "statue.glb")
    out, _ = run("asset", where=tmp_path)
    faces, size = map(int, re.findall(r"\d+", out))
    made = (tmp_path / "game.glb").read_bytes()
    assert len(made) == size and 0 < faces <= 5000
    (material,) = json.loads(made[20 : 20 + int.from_bytes(made[12:16], "little")])["materials"]
    assert "baseColorTexture" in material["pbrMetallicRoughness"]
