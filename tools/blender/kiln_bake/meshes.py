"""Converts Blender's objects to kiln.Mesh: evaluated, in world space, with Blender's triangulation."""

from contextlib import contextmanager

import bpy
import kiln
import numpy as np

TYPES_WITH_FACES = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES"}


def read_values(collection, name, width, dtype=np.float32):
    array = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, array)
    return array.reshape(-1, width) if width > 1 else array


def is_stretched(matrix):
    """True if a matrix scales non-uniformly."""
    sizes = [abs(size) for size in matrix.to_scale()]
    return max(sizes) > 1.01 * min(sizes)


def check_scale(objects, name):
    """Rejects objects with scale 0: they show nothing, and their matrix has no inverse, which normals need."""
    for item in objects:
        if item.type in TYPES_WITH_FACES and min(abs(size) for size in item.matrix_world.to_scale()) < 1e-12:
            raise kiln.Error(f"{name}: '{item.name}' has a scale of 0: change the scale, or deselect the object.")


def objects_and_instances(objects):
    """Returns the given objects, and those that they instantiate."""
    found, todo = [], list(objects)
    while todo:
        item = todo.pop()
        if item in found:
            continue
        found.append(item)
        if item.instance_type == "COLLECTION" and item.instance_collection:
            todo += item.instance_collection.all_objects
        todo += [child for child in item.children if item.instance_type in {"VERTS", "FACES"}]
    return found


@contextmanager
def render_settings(objects):
    """Sets modifiers to their render state: visibility and subdivision levels."""
    before = []
    try:
        for item in objects_and_instances(objects):
            for modifier in item.modifiers:
                for shown, rendered in (("show_viewport", "show_render"), ("levels", "render_levels")):
                    if not hasattr(modifier, shown) or not hasattr(modifier, rendered):
                        continue
                    old, new = getattr(modifier, shown), getattr(modifier, rendered)
                    if old != new:
                        before.append((modifier, shown, old))
                        setattr(modifier, shown, new)
        yield
    finally:
        for modifier, shown, old in before:
            setattr(modifier, shown, old)


class Gathered:
    """Collects triangles of several objects for one mesh."""

    def __init__(self):
        self.parts = {name: [] for name in ("vertices", "faces", "uvs", "normals", "colors", "tangents")}
        self.count = 0
        self.names = {"materials": [], "objects": []}
        self.numbers = {"materials": [], "objects": []}
        self.materials = {}  # materials of bpy by name

    def add(self, item, matrix, name, tangents, colored):
        sizes = np.linalg.norm(np.array(matrix, np.float64)[:3, :3], axis=0)
        if sizes.max() < 1e-12:
            return  # an instance with scale 0 shows nothing
        if sizes.min() < 1e-12:
            raise kiln.Error(f"'{name}' has an instance with a scale of 0 along an axis: change that scale.")
        mesh = item.to_mesh()
        try:
            if mesh is not None and mesh.polygons:
                self._add(mesh, np.array(matrix, np.float64), name, tangents, colored)
        finally:
            item.to_mesh_clear()

    def _add(self, mesh, matrix, name, tangents, colored):
        linear = matrix[:3, :3]
        mirrored = np.linalg.det(linear) < 0
        layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
        # UVs are read before the mesh is changed
        uvs = None if layer is None else read_values(layer.uv, "vector", 2)
        # MikkTSpace of quads differs from that of their triangles. Blender computes none for polygons with more corners.
        with_tangents = tangents and layer is not None and max(read_values(mesh.polygons, "loop_total", 1, np.int32)) <= 4
        if with_tangents:
            mesh.calc_tangents(uvmap=layer.name)
        mesh.calc_loop_triangles()
        corners = read_values(mesh.loop_triangles, "loops", 3, np.int32)
        if mirrored:
            corners = corners[:, ::-1]
        add = {name: array.append for name, array in self.parts.items()}

        points = read_values(mesh.vertices, "co", 3).astype(np.float64) @ linear.T + matrix[:3, 3]
        vertex_of = read_values(mesh.loops, "vertex_index", 1, np.int32)
        colors = self._colors(mesh, vertex_of) if colored else None
        if colors is None:
            add["faces"](vertex_of[corners] + self.count)
        else:  # with colours per corner, each corner gets a vertex of its own
            points = points[vertex_of]
            add["faces"](corners + self.count)
        add["colors"](np.full((len(points), 4), 255, np.uint8) if colors is None else colors)
        add["vertices"](points)
        first, self.count = self.count, self.count + len(points)

        normals = read_values(mesh.corner_normals, "vector", 3) @ np.linalg.inv(linear)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        normals = normals[corners]
        # The two triangles of a flat quad keep their own normals.
        flat = ~read_values(mesh.loop_triangles, "use_smooth", 1, bool)
        if flat.any():
            a, b, c = (points[self.parts["faces"][-1][flat, k] - first] for k in range(3))
            across = np.cross(b - a, c - a)
            normals[flat] = (across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30))[:, None]
        add["normals"](normals.astype(np.float32))
        add["uvs"](np.full((*corners.shape, 2), np.nan) if uvs is None else uvs[corners])
        if with_tangents:
            along = read_values(mesh.loops, "tangent", 3)[corners.ravel()] @ linear.T
            along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
            sign = read_values(mesh.loops, "bitangent_sign", 1)[corners.ravel()] * (-1 if mirrored else 1)
            add["tangents"](np.column_stack([along, sign]))

        slots = [material.name if material else "none" for material in mesh.materials] or ["none"]
        self.materials.update((material.name, material) for material in mesh.materials if material)
        index = np.clip(read_values(mesh.loop_triangles, "material_index", 1, np.int32), 0, len(slots) - 1)
        self.numbers["materials"].append(np.array([self._number("materials", slot) for slot in slots])[index])
        self.numbers["objects"].append(np.full(len(corners), self._number("objects", name)))

    def _number(self, kind, name):
        if name not in self.names[kind]:
            self.names[kind].append(name)
        return self.names[kind].index(name)

    @staticmethod
    def _colors(mesh, vertex_of):
        """Corner colours, sRGB-encoded; None if there are none."""
        attributes = mesh.color_attributes
        if not 0 <= attributes.render_color_index < len(attributes):
            return None
        attribute = attributes[attributes.render_color_index]
        rgba = np.rint(255 * np.clip(read_values(attribute.data, "color_srgb", 4), 0, 1)).astype(np.uint8)
        return rgba[vertex_of] if attribute.domain == "POINT" else rgba

    def mesh(self, name):
        if not self.count:
            raise kiln.Error(f"{name}: no faces. Choose objects that have some.")
        whole = {name: np.concatenate(arrays) for name, arrays in self.parts.items() if arrays}
        if np.isnan(whole["uvs"]).all():
            del whole["uvs"]
        if len(whole.get("tangents", ())) != 3 * len(whole["faces"]):
            whole.pop("tangents", None)
        if (whole["colors"] == 255).all():
            del whole["colors"]
        for kind, names in self.names.items():
            whole[kind], whole[kind[:-1] + "_names"] = np.concatenate(self.numbers[kind]), names
        return kiln.Mesh(whole.pop("vertices"), whole.pop("faces"), name=name, **whole)


def collect_mesh(context, objects, name, *, tangents=False, colored=False):
    """Converts objects with their modifiers, transforms and instances to one kiln.Mesh; also returns materials by name."""
    hidden = [item.name for item in objects if item.type in TYPES_WITH_FACES and not item.visible_get()]
    if hidden:
        raise kiln.Error(f"{name}: '{hidden[0]}' is hidden, one of {len(hidden)}: show it, or choose without it.")
    check_scale(objects, name)
    wanted = set(objects)
    gathered = Gathered()
    with render_settings(objects):
        for instance in context.evaluated_depsgraph_get().object_instances:
            owner = instance.parent if instance.is_instance else instance.object
            if owner.original in wanted and instance.object.type in TYPES_WITH_FACES:
                gathered.add(instance.object, instance.matrix_world, owner.original.name, tangents, colored)
    return gathered.mesh(name), gathered.materials


def picture_of(materials):
    """The colour texture that all materials share, (H, W, 4), with its kind; None if there is none."""
    images = set()
    for material in materials.values():
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.type == "BSDF_PRINCIPLED" and node.inputs["Base Color"].is_linked:
                origin = node.inputs["Base Color"].links[0].from_node
                images.add(origin.image if origin.type == "TEX_IMAGE" else None)
    images.discard(None)
    if not images:
        return None
    if len(images) > 1 or len(materials) > 1:
        raise kiln.Error(
            "color: the high poly has several materials or pictures: bake each separately, or bake vertex colours."
        )
    image = images.pop()
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    kind = "linear" if image.is_float or image.colorspace_settings.name != "sRGB" else "srgb"
    return pixels.reshape(image.size[1], image.size[0], 4)[::-1], kind


def new_object(context, mesh, name):
    """Creates an object from a kiln.Mesh, with its UVs and normals."""
    vertices, faces = np.asarray(mesh.vertices, np.float32), mesh.faces.astype(np.int32)
    # Blender drops one of two faces with the same vertices, as in two-sided sheets, so the second gets separate vertices.
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    again = np.setdiff1d(np.arange(len(faces)), first)
    vertices = np.concatenate([vertices, vertices[faces[again]].reshape(-1, 3)])
    faces[again] = len(mesh.vertices) + np.arange(3 * len(again), dtype=np.int32).reshape(-1, 3)
    made = bpy.data.meshes.new(name)
    made.vertices.add(len(vertices))
    made.vertices.foreach_set("co", vertices.ravel())
    made.loops.add(faces.size)
    made.loops.foreach_set("vertex_index", faces.ravel())
    made.polygons.add(len(faces))
    made.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    if mesh.uvs is not None:
        made.uv_layers.new(name="UVMap").uv.foreach_set("vector", mesh.uvs[mesh.uv_faces].ravel())
    made.update(calc_edges=True)
    made.validate()
    if mesh.normals is not None:
        made.normals_split_custom_set(mesh.normals[mesh.normal_faces].reshape(-1, 3))
    item = bpy.data.objects.new(name, made)
    context.collection.objects.link(item)
    return item
