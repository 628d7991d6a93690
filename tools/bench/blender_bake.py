"""Bakes the same tangent-space normal map with Blender's Cycles, to compare times and maps.

    blender --background --factory-startup --python tools/bench/blender_bake.py -- HIGH.ply LOW.obj SIZE OUT.exr
    python tools/bench/blender_bake.py -- HIGH.ply LOW.obj SIZE OUT.exr

The second with PyPI's bpy.

Prints one JSON line: seconds of the bake alone, and of reading both meshes. Selected to active, both meshes
smooth, cage extrusion 0.02 d and ray distance 0.04 d with d the high poly's largest extent, margin 16: the
settings of the reference in ../shared/data. Made for Blender 3.4 (Debian 12) and 5.
"""
import json
import sys
import time

import bpy

high_path, low_path, size, out = sys.argv[sys.argv.index("--") + 1 :]
size = int(size)
start = time.perf_counter()

for item in list(bpy.data.objects):
    bpy.data.objects.remove(item)
own_importers = bpy.app.version >= (4, 0, 0)
if own_importers:
    bpy.ops.wm.ply_import(filepath=high_path)
else:
    bpy.ops.import_mesh.ply(filepath=high_path)
high = bpy.context.selected_objects[0]
bpy.ops.object.select_all(action="DESELECT")
if own_importers:
    bpy.ops.wm.obj_import(filepath=low_path, forward_axis="Y", up_axis="Z")
else:
    bpy.ops.import_scene.obj(filepath=low_path, axis_forward="Y", axis_up="Z")
low = bpy.context.selected_objects[0]
for item in (high, low):
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
if hasattr(low.data, "use_auto_smooth"):
    low.data.use_auto_smooth = False
loaded = time.perf_counter()

image = bpy.data.images.new("normal", size, size, float_buffer=True, is_data=True)
material = bpy.data.materials.new("bake")
material.use_nodes = True
node = material.node_tree.nodes.new("ShaderNodeTexImage")
node.image = image
material.node_tree.nodes.active = node
low.data.materials.clear()
low.data.materials.append(material)

scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = 1
scene.cycles.use_denoising = False  # Debian's Blender has no denoiser, and bakes nothing if one is enabled.
high.select_set(True)
low.select_set(True)
bpy.context.view_layer.objects.active = low
extent = max(high.dimensions)
bpy.ops.object.bake(
    type="NORMAL",
    normal_space="TANGENT",
    use_selected_to_active=True,
    cage_extrusion=0.02 * extent,
    max_ray_distance=0.04 * extent,
    margin=16,
)
baked = time.perf_counter()

image.filepath_raw = out
image.file_format = "OPEN_EXR"
image.save()
print(
    json.dumps(
        {
            "program": "Blender " + bpy.app.version_string,
            "size": size,
            "load_seconds": round(loaded - start, 3),
            "bake_seconds": round(baked - loaded, 3),
            "save_seconds": round(time.perf_counter() - baked, 3),
        }
    )
)
