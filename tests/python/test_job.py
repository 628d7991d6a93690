"""kiln.run() writes what the command writes."""

from __future__ import annotations

import os
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kiln

COMMAND = os.environ.get("KILN_COMMAND", "")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A bumpy grid, and a flat one with UVs."""
    n = 40
    v, u = np.mgrid[0 : n + 1, 0 : n + 1] / n
    z = 0.05 * np.sin(12 * u) * np.cos(9 * v)
    lines = [f"v {x} {y} {h}" for x, y, h in zip(u.flat, v.flat, z.flat)]
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i + 1
            lines.append(f"f {a} {a + 1} {a + n + 2} {a + n + 1}")
    (tmp_path / "high.obj").write_text("\n".join(lines))
    low = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    (tmp_path / "low.obj").write_text(low)
    return tmp_path


JOBS = {
    "maps": ({"low": "low.obj", "maps": ["normal", "height"], "max_distance": "10%"}, "door"),
    "packs": ({"low": "low.obj", "maps": ["ao", "height"], "ao_rays": 16, "pack": "both=ao,height"}, "door"),
    "made": ({"faces": 40, "size": 64}, "door/game.glb"),
    "planned": ({"max_error": "normal=4", "size": 128}, "door/game.gltf"),
    "sizes": ({"low": "low.obj", "size": "64x32", "range": {"height": [-0.1, 0.1]}, "maps": "height"}, "door"),
}


def bytes_in(folder: Path) -> dict[str, bytes]:
    return {
        path.name: path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.name.startswith(".") and "_plan" not in path.name
    }


@pytest.mark.skipif(not COMMAND, reason="no command")
@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
@pytest.mark.parametrize("name", JOBS)
def test_bytes_are_the_commands(name: str, scene: Path) -> None:
    options, out = JOBS[name]
    given = {"size": 64, "high": scene / "high.obj", **options}
    if "low" in given:
        given["low"] = scene / "low.obj"
    result = kiln.run({**given, "out": scene / "python" / out})
    assert result.files
    assert not result.failure
    words = [COMMAND, "bake", str(scene / "high.obj")]
    words += [str(given["low"])] if "low" in given else []
    for key, value in given.items():
        if key in ("high", "low"):
            continue
        texts = value if isinstance(value, list) else [value]
        if isinstance(value, dict):
            texts = [f"{k}={','.join(map(str, v))}" for k, v in value.items()]
        words += [f"--{key.replace('_', '-')}={text}" for text in texts]
    subprocess.run([*words, f"--out={scene / 'command' / out}"], check=True, capture_output=True)
    wanted = bytes_in(scene / "command")
    assert wanted
    assert bytes_in(scene / "python") == wanted


@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_in_memory(scene: Path) -> None:
    high = scene / "high.obj"
    written = kiln.run(high=high, faces=40, size=64, out=scene / "game.glb")
    kept = kiln.run(high=high, faces=40, size=64, out=scene / "game.glb", in_memory=True)
    assert kept.files == []
    assert kept.glb == (scene / "game.glb").read_bytes()
    assert len(kept.mesh.faces) == len(written.mesh.faces) <= 40
    maps = kiln.run(high=kiln.load(high), low=kiln.load(scene / "low.obj"), size=64, max_distance="10%", in_memory=True)
    assert [each.name for each in maps.maps] == ["normal"]
    assert maps.maps[0].pixels.shape == (64, 64, 3)
    assert maps.report["options"]["max_distance"] == "10%"


def test_wrong_options_are_told(scene: Path) -> None:
    for wrong, word in (
        ({"max_distanse": 1}, "max_distance"),
        ({"samples": 17}, "1 to 16"),
        ({"high": "gone.obj", "out": "x"}, "gone.obj"),
        ({"faces": object()}, "faces"),
        ({"maps": [["normal"]]}, "maps"),
    ):
        with pytest.raises(kiln.Error, match=word):
            kiln.run({"high": str(scene / "high.obj"), "out": str(scene / "x"), **wrong})
    with pytest.raises(kiln.Error, match="JSON"):
        kiln.run("{")


def test_errors_carry_their_data(scene: Path) -> None:
    def failure(**options: object) -> kiln.Error:
        with pytest.raises(kiln.Error) as caught:
            kiln.run(high=scene / "high.obj", low=scene / "low.obj", out=scene / "out", **options)
        return caught.value

    ranged = failure(samples=17)
    assert (ranged.parameter, ranged.value, ranged.allowed, ranged.remedies) == ("samples", "17", "1 to 16", [])
    pair = failure(layers=True)
    assert (pair.parameter, pair.remedies) == ("layers", [("format", "exr")])
    assert str(pair) == 'layers writes one EXR with several layers: add format="exr" or exr32.'
    again = pickle.loads(pickle.dumps(pair))
    assert (str(again), again.remedies) == (str(pair), pair.remedies)


def test_warnings_name_arguments(scene: Path) -> None:
    files = {"high": scene / "high.obj", "low": scene / "low.obj", "size": 64}
    far = scene / "far.obj"
    far.write_text("v 0 0 0.0499\nv 1 0 0.0499\nv 1 1 0.0499\nv 0 1 0.0499\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
    with pytest.raises(kiln.Error) as caught:
        kiln.run(high=scene / "high.obj", low=far, size=64, out=scene / "out", max_distance=1e-6)
    assert caught.value.parameter == "max_distance" and caught.value.code == "input"
    assert "raise max_distance, or check" in str(caught.value) and "--" not in str(caught.value)
    match = scene / "match.exr"
    kiln.run(**files, out=scene / "out", save_match=match)
    with pytest.warns(kiln.KilnWarning) as told:
        job = kiln.run(**files, out=scene / "out", load_match=match, clean="none")
    texts = {warning.message.code: str(warning.message) for warning in told}
    assert texts["match-of-clean"].startswith(f"load_match '{match}' is only valid if it was saved with the same clean,")
    # The report has the command's words, by every door.
    assert f"--load-match '{match}'" in str(job.report["warnings"])


def test_the_schema_names_all_options() -> None:
    schema = kiln.job_schema()
    assert schema["required"] == ["high", "out"]
    assert {"faces", "maps", "max_distance", "low"} <= set(schema["properties"])
