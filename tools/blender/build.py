#!/usr/bin/env python3
"""Builds the extension package for Blender: kiln_bake-VERSION.zip, which contains Kiln's wheels.

    build.py OUT [WHEEL...]

OUT    folder, made where it is missing
WHEEL  of the kiln package, one a platform and Python (3.11 of Blender 4.2 to 5.0); without: made here by pip
"""

import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
PLATFORMS = {"linux_x86_64": "linux-x64", "win_amd64": "windows-x64", "macosx_arm64": "macos-arm64"}


def platform_of(wheel):
    tag = wheel.stem.split("-")[-1].split(".")[0]
    tag = re.sub(r"^manylinux[\d_]+_x86_64$|^manylinux\d+_x86_64$", "linux_x86_64", tag)
    tag = re.sub(r"^macosx_\d+_\d+_arm64$", "macosx_arm64", tag)
    if tag not in PLATFORMS:
        sys.exit(f"build.py: '{wheel.name}': no platform of Blender has the tag '{tag}'.")
    return PLATFORMS[tag]


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    out, wheels = Path(sys.argv[1]), [Path(word) for word in sys.argv[2:]]
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        if not wheels:
            subprocess.run(
                [sys.executable, "-m", "pip", "wheel", "--no-deps", "-w", folder, str(HERE.parent / "python")],
                check=True,
            )
            wheels = sorted(Path(folder).glob("*.whl"))
        manifest = (HERE / "kiln_bake" / "blender_manifest.toml").read_text()
        version = re.search(r'^version = "(.*)"', manifest, re.MULTILINE).group(1)
        names = ", ".join(f'"./wheels/{wheel.name}"' for wheel in wheels)
        platforms = ", ".join(f'"{name}"' for name in sorted({platform_of(wheel) for wheel in wheels}))
        made = re.sub(
            r"^# wheels and platforms.*$",
            f"platforms = [{platforms}]\nwheels = [{names}]",
            manifest,
            flags=re.MULTILINE,
        )
        target = out / f"kiln_bake-{version}.zip"
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("blender_manifest.toml", made)
            for source in sorted((HERE / "kiln_bake").glob("*.py")):
                file.write(source, source.name)
            for wheel in wheels:
                file.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)
    print(target)


if __name__ == "__main__":
    main()
