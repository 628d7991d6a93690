"""Bakes ambient occlusion with Blender's Cycles (PyPI bpy 5), to compare times and maps with Kiln's.

    python tools/bench/blender_ao.py HIGH.ply LOW.obj SIZE RAYS OUT.exr

Prints one JSON line: seconds of the bake alone, by the clock and by the processors, and of reading both meshes.
Selected to active, both meshes smooth, cage extrusion 0.02 d and ray distance 0.04 d with d the high poly's
largest extent, margin 16, distance unbounded: the settings of the reference in ../shared/data.
"""
import json
import sys
import time

import bpy

high_path, low_path, size, rays, out = sys.argv[1:]
size, rays = int(size), int(rays)
start = time.perf_counter()

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.ply_import(filepath=high_path)
high = bpy.context.selected_objects[0]
bpy.ops.object.select_all(action="DESELECT")
bpy.ops.wm.obj_import(filepath=low_path, forward_axis="Y", up_axis="Z")
low = bpy.context.selected_objects[0]
for item in (high, low):
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
loaded = time.perf_counter()

image = bpy.data.images.new("ao", size, size, float_buffer=True, is_data=True)
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
scene.cycles.samples = rays
scene.cycles.use_denoising = False
scene.cycles.use_adaptive_sampling = False
if scene.world is None:
    scene.world = bpy.data.worlds.new("world")
scene.world.light_settings.distance = 1e6
high.select_set(True)
low.select_set(True)
bpy.context.view_layer.objects.active = low
extent = max(high.dimensions)
loaded, processors = time.perf_counter(), time.process_time()
bpy.ops.object.bake(
    type="AO",
    use_selected_to_active=True,
    cage_extrusion=0.02 * extent,
    max_ray_distance=0.04 * extent,
    margin=16,
)
baked, processors = time.perf_counter(), time.process_time() - processors

image.filepath_raw = out
image.file_format = "OPEN_EXR"
image.save()
print(
    json.dumps(
        {
            "program": "Blender " + bpy.app.version_string,
            "size": size,
            "rays": rays,
            "load_seconds": round(loaded - start, 3),
            "bake_seconds": round(baked - loaded, 3),
            "bake_cpu_seconds": round(processors, 3),
        }
    )
)
