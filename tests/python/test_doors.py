"""to_glb(), bake(), match() and plan() write the bytes of the command: the jobs of tests/data/jobs.json."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import sheet, waves
from test_glb import LOOKS, ball, binary_of, pbr, with_materials  # noqa: F401

import kiln

CARD = sheet(2, lambda x, y: 0 * x)


def halves(n: int, height: Callable[..., np.ndarray]) -> kiln.Mesh:
    """A sheet of two objects and two materials, which lie beside each other."""
    vertices, faces, uvs = sheet(n, height)
    right = (vertices[faces].mean(1)[:, 0] > 0.5).astype(int)
    names = ["left", "right"]
    return kiln.Mesh(
        vertices, faces, uvs, objects=right, object_names=names, materials=right, material_names=names, name="low"
    )


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, pbr: bytes) -> Path:  # noqa: F811
    folder = tmp_path_factory.mktemp("doors")
    for name in ("high.obj", "laid_out.obj", "parts.obj"):
        halves(48, waves).save(folder / name)
    halves(2, lambda x, y: 0 * x).save(folder / "low.obj")
    halves(2, lambda x, y: 0 * x).save(folder / "parts_low.obj")
    halves(2, lambda x, y: 0 * x + 0.1).save(folder / "cage.obj")
    kiln.Mesh(CARD[0] * 0.4 + [0.3, 0.3, 0.1], CARD[1]).save(folder / "roof.obj")
    for name in ("two.glb", "rough.glb"):
        (folder / name).write_bytes(with_materials(pbr, LOOKS))
    kiln.Mesh(*ball(20)).save(folder / "ball.obj")
    own = "float4 kiln_map(const kiln_point* p) {\n  return (float4)(p->normal.x * 0.5f + 0.5f, 0, 0, 0);\n}\n"
    (folder / "steep.cl").write_text(own)
    return folder


#: Jobs, which cli/doors_test.cpp reads, too.
JOBS: dict[str, dict[str, Any]] = {
    job["name"]: job for job in json.loads((Path(__file__).parent.parent / "data/jobs.json").read_text())
}


def keyword(value: Any, scene: Path) -> Any:
    """A keyword's value: meshes and matches in memory where the table names their files."""
    if isinstance(value, dict):
        if "mesh" in value:
            return kiln.load(scene / value["mesh"])
        if "match" in value:
            found = kiln.match(scene / "high.obj", scene / "low.obj", size=64)
            found.save(scene / value["match"])
            return found
        return {key: keyword(entry, scene) for key, entry in value.items()}
    if isinstance(value, list):
        entries = [keyword(entry, scene) for entry in value]
        return tuple(entries) if all(isinstance(entry, (int, float)) for entry in entries) else entries
    if isinstance(value, str):
        return value.replace("{scene}", str(scene))
    return np.int64(value) if type(value) is int else value


def keywords_of(job: dict[str, Any], function: str, scene: Path) -> dict[str, Any]:
    return {name: keyword(value, scene) for name, value in job[function].items()}


def words_of_command(job: dict[str, Any], scene: Path) -> list[str]:
    """The command line of a job beside its size and output."""
    options = {name: [value.replace("{scene}", str(scene)) for value in values] for name, values in job["options"].items()}
    words = ["bake", *options.pop("high"), *options.pop("low", [])]
    for name, values in options.items():
        flag = "--" + name.replace("_", "-")
        words += [flag if value == "true" else f"{flag}={value}" for value in values]
    return words


def saved(scene: Path) -> Path:
    """A picture over the high poly's UVs."""
    from kiln import _core

    grid = np.linspace(0, 1, 16, dtype=np.float32)
    pixels = np.stack([np.tile(grid, (16, 1))] * 3, axis=2)
    (scene / "plain.png").write_bytes(_core.encode(pixels, "png8", False))
    return scene


def files_in(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.suffix in (".png", ".exr")}


@pytest.mark.parametrize("name", [name for name, job in JOBS.items() if "bake" in job])
@pytest.mark.parametrize("memory", [False, True], ids=["files", "memory"])
@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_bake(name: str, memory: bool, scene: Path, tmp_path: Path, command: Any) -> None:
    job = JOBS[name]
    saved(scene)
    words = words_of_command(job, scene)
    sides = [Path(side) for side in words[1:3]]
    keywords = keywords_of(job, "bake", scene)
    ours = kiln.bake(*(map(kiln.load, sides) if memory else sides), size=64, **keywords)
    ours.save(tmp_path / "ours", name=sides[1].stem)
    command(*words, "--sets", "none", "--size", 64, "--out", tmp_path / "its", "--quiet")
    its = files_in(tmp_path / "its")
    assert its and files_in(tmp_path / "ours") == its


@pytest.mark.parametrize("name", [name for name, job in JOBS.items() if "to_glb" in job])
@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_to_glb(name: str, scene: Path, tmp_path: Path, command: Any) -> None:
    job = JOBS[name]
    words = words_of_command(job, scene)
    file = Path(words[1])
    keywords = keywords_of(job, "to_glb", scene)
    (tmp_path / "its").mkdir()
    command(*words, "--sets", "one", "--size", 64, "--out", tmp_path / "its/game.glb", "--quiet")
    its = (tmp_path / "its/game.glb").read_bytes()
    ours = kiln.to_glb(file, texture_size=64, path=tmp_path / "game.glb", **keywords)
    assert ours.data == (tmp_path / "game.glb").read_bytes() == its
    if file.suffix == ".glb":
        return  # a kiln.Mesh has no nodes, in whose spaces objects lie
    # Of a mesh in memory the document names no file.
    assert binary_of(kiln.to_glb(kiln.load(file), texture_size=64, **keywords).data) == binary_of(its)


@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_plan(scene: Path, tmp_path: Path, command: Any) -> None:
    made = kiln.plan(scene / "high.obj", max_error=1, size=128, maps=["normal", "height"])
    assert made.bake is not None
    made.bake.save(tmp_path / "ours", format=f"png{made.chosen['bits']}", name="high_low")
    command("bake", scene / "high.obj", "--max-error", "normal=1", "--size", 128, "--maps", "normal,height", "--out", tmp_path / "its", "--quiet")
    its = files_in(tmp_path / "its")
    its = {name: data for name, data in its.items() if "_plan" not in name}
    assert its and files_in(tmp_path / "ours") == its
    its_low = kiln.load(tmp_path / "its/high_low.obj")
    assert len(its_low.faces) == len(made.mesh.faces) == made.chosen["faces"]


def test_a_match_refuses_what_it_does_not_obey(scene: Path) -> None:
    found = kiln.match(scene / "high.obj", scene / "low.obj", size=16)
    with pytest.raises(kiln.Error) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        kiln.bake(scene / "high.obj", scene / "low.obj", size=16, match=found, max_distance=1)
    assert caught.value.parameter == "max_distance"
