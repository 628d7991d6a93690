"""Draws panel.png. Needs a Blender with a window, for example under Xvfb, in which `kiln` can be imported.

xvfb-run -a blender --window-geometry 0 0 400 660 --python tools/blender/picture.py -- OUT.png
"""

import sys
from pathlib import Path

import bpy

sys.path[:0] = [str(Path(__file__).resolve().parent), *sys.argv[sys.argv.index("--") + 2 :]]
import kiln_bake  # noqa: E402

OUT = sys.argv[sys.argv.index("--") + 1]
# Shows the panel by itself, expanded, instead of within Render > Bake.
for panel in bpy.types.Panel.__subclasses__():
    if getattr(panel, "bl_context", "") == "render" and hasattr(bpy.types, panel.__name__):
        bpy.utils.unregister_class(panel)
kiln_bake.register()
bpy.utils.unregister_class(kiln_bake.KILN_PT_render)
if hasattr(kiln_bake.KILN_PT_render, "bl_parent_id"):
    del kiln_bake.KILN_PT_render.bl_parent_id
kiln_bake.KILN_PT_render.bl_options = set()
bpy.utils.register_class(kiln_bake.KILN_PT_render)
bpy.context.preferences.view.show_splash = False
settings = bpy.context.scene.kiln_bake
settings.maps = {"normal", "ao", "color"}
settings.cage = 0.02
settings.by_error = True
steps = iter(("arrange", "wait", "shoot"))


def step():
    window = bpy.context.window_manager.windows[0]
    area = max(window.screen.areas, key=lambda area: area.width * area.height)
    what = next(steps)
    if what == "arrange":
        area.ui_type = "PROPERTIES"
        return 1.0
    if what == "wait":
        area.spaces.active.context = "RENDER"
        return 1.0
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.screen.screenshot_area(filepath=OUT)
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(step, first_interval=1.0)
