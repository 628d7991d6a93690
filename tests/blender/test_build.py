"""The zip that Blender installs."""

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

BUILD = Path(__file__).resolve().parents[2] / "tools" / "blender" / "build.py"


def test_the_zip_has_what_the_format_asks_for(tmp_path):
    wheels = [tmp_path / f"kiln-1.0-cp{n}-cp{n}-manylinux_2_36_x86_64.whl" for n in (311, 313)]
    for wheel in wheels:
        wheel.write_bytes(b"wheel")
    subprocess.run([sys.executable, BUILD, tmp_path, *wheels], check=True)
    (made,) = tmp_path.glob("*.zip")
    with zipfile.ZipFile(made) as file:
        names = set(file.namelist())
        manifest = tomllib.loads(file.read("blender_manifest.toml").decode())
    assert manifest["schema_version"] == "1.0.0" and manifest["type"] == "add-on"
    assert manifest["wheels"] == [f"./wheels/{wheel.name}" for wheel in wheels]
    assert manifest["platforms"] == ["linux-x64"]
    assert {name[2:] for name in manifest["wheels"]} | {"__init__.py", "bake.py", "meshes.py"} < names


def test_a_wheel_of_no_platform_of_blenders_is_refused(tmp_path):
    wheel = tmp_path / "kiln-1.0-cp311-cp311-musllinux_1_2_x86_64.whl"
    wheel.write_bytes(b"")
    done = subprocess.run([sys.executable, BUILD, tmp_path, wheel], capture_output=True, text=True)
    assert done.returncode != 0 and "musllinux" in done.stderr


def test_blender_finds_the_manifest_valid(tmp_path):
    """By the program that Blender's own `extension validate` runs."""
    import bpy

    tool = Path(bpy.utils.resource_path("LOCAL")) / "scripts/addons_core/bl_pkg/cli/blender_ext.py"
    wheel = tmp_path / "kiln-1.0-cp311-cp311-linux_x86_64.whl"
    wheel.write_bytes(b"wheel")
    subprocess.run([sys.executable, BUILD, tmp_path, wheel], check=True)
    (made,) = tmp_path.glob("*.zip")
    done = subprocess.run([sys.executable, tool, "validate", made], capture_output=True, text=True)
    assert done.returncode == 0 and "Success" in done.stdout, done.stdout + done.stderr
