"""Draws the cage over the active object: its edges, offset along the vertex normals."""

import bpy
import numpy as np

from .meshes import read_values

handler = None


def cage_edges(context):
    """End points of the cage's edges, (2 N, 3), world units; None if there is no cage."""
    item, offset = context.active_object, context.scene.kiln_bake.cage
    if item is None or item.type != "MESH" or not offset:
        return np.zeros((0, 3), np.float32)
    mesh = item.evaluated_get(context.evaluated_depsgraph_get()).data
    matrix = np.array(item.matrix_world)
    normals = read_values(mesh.vertex_normals, "vector", 3) @ np.linalg.inv(matrix[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    points = read_values(mesh.vertices, "co", 3) @ matrix[:3, :3].T + matrix[:3, 3] + offset * normals
    return points[read_values(mesh.edges, "vertices", 2, np.int32).ravel()].astype(np.float32)


def draw():
    import gpu
    from gpu_extras.batch import batch_for_shader

    ends = cage_edges(bpy.context)
    if not len(ends):
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", (1.0, 0.5, 0.1, 0.6))
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    batch_for_shader(shader, "LINES", {"pos": ends}).draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def set_shown(shown):
    global handler
    if handler is not None:
        bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
        handler = None
    if shown and not bpy.app.background:
        handler = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")
