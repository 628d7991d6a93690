"""to_glb(), bake(), match() and plan() write the bytes of the command: a table of jobs."""

from __future__ import annotations

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
    halves(48, waves).save(folder / "high.obj")
    halves(2, lambda x, y: 0 * x).save(folder / "low.obj")
    halves(2, lambda x, y: 0 * x + 0.1).save(folder / "cage.obj")
    kiln.Mesh(CARD[0] * 0.4 + [0.3, 0.3, 0.1], CARD[1]).save(folder / "roof.obj")
    (folder / "two.glb").write_bytes(with_materials(pbr, LOOKS))
    kiln.Mesh(*ball(20)).save(folder / "ball.obj")
    own = "float4 kiln_map(const kiln_point* p) {\n  return (float4)(p->normal.x * 0.5f + 0.5f, 0, 0, 0);\n}\n"
    (folder / "steep.cl").write_text(own)
    return folder


def loaded(scene: Path, name: str) -> kiln.Mesh:
    return kiln.load(scene / name)


def match_of(scene: Path) -> kiln.Match:
    found = kiln.match(scene / "high.obj", scene / "low.obj", size=64)
    found.save(scene / "match.exr")
    return found


#: Keywords of bake(), by the scene's folder, and the flags of the command.
BAKES: dict[str, tuple[Callable[[Path], dict[str, Any]], str]] = {
    "maps": (
        lambda s: {"maps": ["normal", "height", "position", "curvature"], "origin": (0, 0, 1)},
        "--maps normal,height,position,curvature --origin 0,0,1",
    ),
    "ranges": (lambda s: {"maps": "height", "range": {"height": (-0.1, 0.1)}}, "--maps height --range height=-0.1,0.1"),
    "mips": (lambda s: {"mips": True, "samples": np.int64(2), "flip_y": True}, "--mips --samples 2 --flip-y"),
    "views": (
        lambda s: {"match": "views", "views": 12, "fallback": ["closest", "fill"]},
        "--match views --views 12 --fallback closest,fill",
    ),
    "axis": (lambda s: {"match": "axis", "view": [(0, 0, 1)]}, "--match axis --view 0,0,1"),
    "cage": (lambda s: {"cage": "5%"}, "--cage 5%"),
    "cage found": (lambda s: {"cage": "auto"}, "--cage auto"),
    "cage mesh": (lambda s: {"cage_mesh": loaded(s, "cage.obj")}, "--cage-mesh {0}/cage.obj"),
    "parts": (lambda s: {"match_by": "object"}, "--match-by object"),
    "occluders": (
        lambda s: {"maps": "ao", "ao_rays": 16, "ao_occluders": ["high", loaded(s, "roof.obj")]},
        "--maps ao --ao-rays 16 --ao-occluders high,{0}/roof.obj",
    ),
    "variants": (
        lambda s: {"maps": ["ao", "near=ao:ao-distance=5%"], "ao_rays": 16},
        "--maps ao,near=ao:ao-distance=5% --ao-rays 16",
    ),
    "own map": (lambda s: {"maps": f"steep={s}/steep.cl"}, "--maps steep={0}/steep.cl"),
    "chosen match": (lambda s: {"max_error": 8}, "--match auto --max-error normal=8"),
    "saved match": (
        lambda s: {"match": match_of(s), "maps": ["normal", "height"]},
        "--maps normal,height --load-match {0}/match.exr",
    ),
    "textures": (lambda s: {"transfer": f"{s}/plain.png:dust"}, "--transfer {0}/plain.png:dust"),
}


def saved(scene: Path) -> Path:
    """A picture over the high poly's UVs."""
    from kiln import _core

    grid = np.linspace(0, 1, 16, dtype=np.float32)
    pixels = np.stack([np.tile(grid, (16, 1))] * 3, axis=2)
    (scene / "plain.png").write_bytes(_core.encode(pixels, "png8", False))
    return scene


def files_in(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.suffix in (".png", ".exr")}


@pytest.mark.parametrize("name", BAKES)
@pytest.mark.parametrize("memory", [False, True], ids=["files", "memory"])
@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_bake(name: str, memory: bool, scene: Path, tmp_path: Path, command: Any) -> None:
    keywords, flags = BAKES[name]
    saved(scene)
    sides = [scene / "high.obj", scene / "low.obj"]
    ours = kiln.bake(*(map(kiln.load, sides) if memory else sides), size=64, **keywords(scene))
    ours.save(tmp_path / "ours", name="low")
    words = flags.format(scene).split()
    command("bake", *sides, "--sets", "none", "--size", 64, *words, "--out", tmp_path / "its", "--quiet")
    its = files_in(tmp_path / "its")
    assert its and files_in(tmp_path / "ours") == its


#: Keywords of to_glb(), and the flags of the command.
GLBS: dict[str, tuple[str, dict[str, Any], str]] = {
    "two materials and alpha": ("two.glb", {"faces_target": 300, "ao_rays": 16}, "--faces 300 --ao-rays 16"),
    "maps": (
        "two.glb",
        {"faces_target": 300, "maps": ["normal", "color", "opacity"]},
        "--faces 300 --maps normal,color,opacity",
    ),
    "looks": (
        "two.glb",
        {"faces_target": 300, "maps": ["color", "opacity"], "alpha": "blend", "double_sided": True},
        "--faces 300 --maps color,opacity --alpha blend --double-sided yes",
    ),
    "of materials": (
        "two.glb",
        {"faces_target": 300, "maps": ["normal", "roughness"]},
        "--faces 300 --maps normal --transfer mtl:roughness",
    ),
    "planned": ("ball.obj", {"max_error": 8, "screen": 300}, "--max-error normal=8 --screen 300px"),
    "no colours": ("ball.obj", {"faces_target": 200}, "--faces 200"),
    "normals": ("ball.obj", {"faces_target": 200, "high_normals": "flat"}, "--faces 200 --high-normals flat"),
}


@pytest.mark.parametrize("name", GLBS)
@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_to_glb(name: str, scene: Path, tmp_path: Path, command: Any) -> None:
    file, keywords, flags = GLBS[name]
    (tmp_path / "its").mkdir()
    command("bake", scene / file, "--sets", "one", "--size", 64, *flags.split(), "--out", tmp_path / "its/game.glb", "--quiet")
    its = (tmp_path / "its/game.glb").read_bytes()
    ours = kiln.to_glb(scene / file, texture_size=64, path=tmp_path / "game.glb", **keywords)
    assert ours.data == (tmp_path / "game.glb").read_bytes() == its
    if file == "two.glb":
        return  # a kiln.Mesh has no nodes, in whose spaces objects lie
    # Of a mesh in memory the document names no file.
    assert binary_of(kiln.to_glb(kiln.load(scene / file), texture_size=64, **keywords).data) == binary_of(its)


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
