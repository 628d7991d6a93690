"""Draws the pictures of README.md: python pictures.py FOLDER, where the examples were run."""

import runpy
import sys
from pathlib import Path

import numpy as np

import kiln
from kiln import _core

SIZE = 120
here = Path(__file__).parent
folder = Path(sys.argv[1])
scripts = {"generated": "generated_mesh", "scan": "scan", "volume": "volume", "field": "field", "lod": "many_assets"}
for name, script in scripts.items():
    made = runpy.run_path(str(here / f"{script}.py"))
    glb = made["glb"]
    if name == "generated":
        dense = kiln.Mesh(made["vertices"], made["faces"])
    elif name == "volume":
        dense = kiln.contour(made["voxels"], made["iso"])
    else:
        dense = made.get("scan", made.get("mesh", made.get("dense")))
    z_up = {"z_up": True}
    views = [
        kiln.render(dense, size=SIZE, **z_up),
        kiln.render(glb.mesh, size=SIZE, frame=dense, **z_up),
        kiln.render(glb.mesh, glb.maps["normal"], size=SIZE, frame=dense, **z_up),
    ]
    (here / f"{name}.png").write_bytes(_core.encode(np.ascontiguousarray(np.concatenate(views, axis=1)), "png8", False))
