"""The Blender extension beside Cycles, without a window."""

import threading
import time

import bpy
import kiln
import numpy as np
import pytest
from conftest import bump, choose, cycles_normals, pixels_of, sheet
from kiln_bake import bake, cage, meshes


def unit(pixels):
    vectors = 2 * pixels[..., :3].astype(np.float64) - 1
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def degrees(a, b):
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(unit(a) - unit(b), axis=-1) / 2, 0, 1)))


def compare(scene, low, high, size=256, reach=0.1, scale=1, **settings):
    """Mean and 99th percentile of angles between both programs' normals, where both have some; and the share of those."""
    theirs = cycles_normals(low, high, size, reach / scale, 2 * reach)  # its cage is in the object's units
    for name, value in {"size": size, "cage": reach, "max_distance": 2 * reach, **settings}.items():
        setattr(scene.kiln_bake, name, value)
    choose(low, *high)
    assert bpy.ops.kiln.bake() == {"FINISHED"}
    ours = pixels_of(bpy.data.images[f"{low.name}_normal"])
    both = (theirs[..., 3] > 0) & (np.abs(theirs[..., :3] - 0.5).max(-1) > 0.01)
    angles = degrees(ours, theirs)[both]
    print(f"mean {angles.mean():.4f}, 99%: {np.percentile(angles, 99):.4f}, {both.mean():.2%}")
    return angles.mean(), np.percentile(angles, 99), both.mean()


# Blender keeps the map in half precision: 2^-11 of a component is 0.028 degrees, and a mean error is below 0.02.
LIMIT = 0.05


@pytest.mark.parametrize("quads", [True, False])
def test_normals_are_cycles(scene, quads):
    low, high = sheet("low", 6, quads=quads), sheet("high", 90, bump)
    mean, most, share = compare(scene, low, [high])
    assert mean < LIMIT and most < 0.2 and share > 0.99


def test_bent_low_poly_of_quads(scene):
    low = sheet("low", 5, lambda x, y: 0.2 * np.sin(3 * x) * np.cos(2 * y))
    high = sheet("high", 100, lambda x, y: 0.2 * np.sin(3 * x) * np.cos(2 * y) + 0.3 * bump(5 * x, 5 * y))
    mean, most, share = compare(scene, low, [high])
    assert mean < LIMIT and most < 0.2 and share > 0.97


def test_transforms_and_mirrors(scene):
    low, high = sheet("low", 5, lambda x, y: 0.1 * x * y), sheet("high", 60, lambda x, y: 0.1 * x * y + bump(x, y))
    for item in (low, high):
        item.scale = (2, 2, 2)
        item.rotation_euler = (0.3, 0.5, 0.7)
        item.location = (5, -3, 2)
    bpy.context.view_layer.update()
    mean, most, share = compare(scene, low, [high], reach=0.2, scale=2)
    assert mean < LIMIT and share > 0.99
    for item in (low, high):
        item.scale = (-2, 2, 2)
    bpy.context.view_layer.update()
    mean, most, share = compare(scene, low, [high], reach=0.2, scale=2)
    assert mean < LIMIT and share > 0.99


def test_scales_of_each_axis(scene):
    low, high = sheet("low", 4), sheet("high", 60, bump)
    high.scale = (1, 1, 2)
    bpy.context.view_layer.update()
    mean, most, share = compare(scene, low, [high])
    assert mean < LIMIT and share > 0.99
    assert not bake.Bake(bpy.context).notes
    low.scale = (-1, 1, 1)
    bpy.context.view_layer.update()
    assert not bake.Bake(bpy.context).notes
    low.scale = (1, 1, 2)
    bpy.context.view_layer.update()
    assert "Apply the scale of 'low'" in bake.Bake(bpy.context).notes[0]


def test_faces_of_many_corners(scene):
    low, high = sheet("low", 3, lambda x, y: 0.05 * x * y), sheet("high", 60, lambda x, y: 0.05 * x * y + bump(x, y))
    import bmesh

    edited = bmesh.new()
    edited.from_mesh(low.data)
    edited.faces.ensure_lookup_table()
    bmesh.ops.dissolve_faces(edited, faces=[edited.faces[3], edited.faces[4]])
    edited.to_mesh(low.data)
    assert max(len(face.vertices) for face in low.data.polygons) == 6
    mean, most, share = compare(scene, low, [high])
    # Tangents are MikkTSpace's of triangles then.
    assert mean < LIMIT and share > 0.99


def test_modifiers_at_the_levels_of_a_render(scene):
    low, high = sheet("low", 4), sheet("high", 8, bump)
    modifier = high.modifiers.new("smooth", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 3
    off = high.modifiers.new("off", "DISPLACE")
    off.show_render = False
    mean, most, share = compare(scene, low, [high])
    assert mean < LIMIT and share > 0.95
    assert modifier.levels == 0 and off.show_viewport


def test_custom_normals_and_flat_faces(scene):
    low, high = sheet("low", 4), sheet("high", 20, bump)
    normals = np.random.default_rng(1).normal(size=(len(high.data.loops), 3)) * 0.2 + [0, 0, 1]
    high.data.normals_split_custom_set(normals / np.linalg.norm(normals, axis=1)[:, None])
    mean, most, share = compare(scene, low, [high])
    assert mean < LIMIT and share > 0.99
    flat = sheet("flat", 20, bump)
    flat.data.polygons.foreach_set("use_smooth", np.zeros(len(flat.data.polygons), bool))
    mean, most, share = compare(scene, low, [flat])
    assert mean < LIMIT and share > 0.99


def test_instances_of_collections(scene):
    high = sheet("high", 60, bump)
    own = bpy.data.collections.new("own")
    own.objects.link(high)
    scene.collection.objects.unlink(high)
    empty = bpy.data.objects.new("instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", own
    empty.rotation_euler = (0, 0, np.pi)
    empty.location = (1, 1, 0)
    scene.collection.objects.link(empty)
    low = sheet("low", 4)
    scene.kiln_bake.size, scene.kiln_bake.max_distance = 64, 0.2
    choose(low, empty)
    assert bpy.ops.kiln.bake() == {"FINISHED"}
    turned = pixels_of(bpy.data.images["low_normal"])
    straight = sheet("straight", 60, lambda x, y: bump(1 - x, 1 - y))
    choose(low, straight)
    bpy.ops.kiln.bake()
    # Diagonals of its quads run the other way: quads are flat but for 0.02 * 63 / 60^2 / 4.
    assert degrees(turned, pixels_of(bpy.data.images["low_normal"])).mean() < 0.2


def test_images_are_wired(scene):
    low, high = sheet("low", 2), sheet("high", 8, bump)
    colors = high.data.color_attributes.new("Col", "FLOAT_COLOR", "CORNER")
    # Linear 0.2158605 is 0.5 sRGB-encoded, whose nearest byte is 128: 0.2158605 again within 1/255.
    colors.data.foreach_set("color", np.tile([0.2158605, 1, 0, 1], len(high.data.loops)))
    high.data.color_attributes.render_color_index = 0
    scene.kiln_bake.maps = {"normal", "color", "ao"}
    scene.kiln_bake.size = 32
    choose(low, high)
    assert bpy.ops.kiln.bake() == {"FINISHED"}
    (material,) = low.data.materials
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    normal = shader.inputs["Normal"].links[0].from_node
    assert normal.type == "NORMAL_MAP" and normal.uv_map == "UVMap"
    image = normal.inputs["Color"].links[0].from_node.image
    assert image.name == "low_normal" and image.colorspace_settings.name == "Non-Color"
    color = shader.inputs["Base Color"].links[0].from_node.image
    assert color.name == "low_color" and color.colorspace_settings.name != "Non-Color"
    np.testing.assert_allclose(pixels_of(color)[16, 16], [0.2158605, 1, 0, 1], atol=0.004)
    count = len(material.node_tree.nodes)
    assert bpy.ops.kiln.bake() == {"FINISHED"}  # once more: nothing is doubled
    assert len(material.node_tree.nodes) == count and "low_normal.001" not in bpy.data.images


def test_green_of_directx_is_turned_for_blender(scene):
    low, high = sheet("low", 2), sheet("high", 8, bump)
    scene.kiln_bake.maps = {"normal"}
    scene.kiln_bake.size = 32
    choose(low, high)
    source = {}
    for flipped in (False, True, False):
        scene.kiln_bake.flip_y = flipped
        assert bpy.ops.kiln.bake() == {"FINISHED"}
        nodes = low.data.materials[0].node_tree.nodes
        source[flipped] = nodes["Kiln tangent space"].inputs["Color"].links[0].from_node
        assert source[flipped].type == ("CURVE_RGB" if flipped else "TEX_IMAGE")
        assert ("Kiln green" in nodes) == flipped
        if flipped:
            assert source[True].inputs["Color"].links[0].from_node.image.name == "low_normal"
            curves = source[True].mapping
            for channel, at in ((0, 0.25), (1, 0.75), (2, 0.25)):
                assert curves.evaluate(curves.curves[channel], 0.25) == pytest.approx(at, abs=1e-6)


def test_a_material_of_the_high_poly_stays(scene):
    lows, high = [sheet("one", 2), sheet("two", 2, move=(2, 0, 0))], sheet("high", 8, bump)
    shared = bpy.data.materials.new("shared")
    for item in (*lows, high):
        item.data.materials.append(shared)
    scene.kiln_bake.maps = {"normal"}
    scene.kiln_bake.size = 32
    for _ in range(2):
        choose(lows[0], high)
        assert bpy.ops.kiln.bake() == {"FINISHED"}
        assert high.data.materials[0] is shared and lows[1].data.materials[0] is shared
        assert "Kiln normal" not in shared.node_tree.nodes
        assert "Kiln normal" in lows[0].data.materials[0].node_tree.nodes
    assert len(bpy.data.materials) == 2  # the copy serves the second bake, too


def test_a_picture_as_colour(scene):
    low, high = sheet("low", 2), sheet("high", 8, bump)
    picture = bpy.data.images.new("picture", 4, 4)
    rows = np.zeros((4, 4, 4), np.float32)
    rows[:2, :, 0] = rows[2:, :, 2] = rows[..., 3] = 1  # red below
    picture.pixels.foreach_set(rows.ravel())
    material = bpy.data.materials.new("painted")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    high.data.materials.append(material)
    scene.kiln_bake.maps, scene.kiln_bake.size = {"color"}, 32
    choose(low, high)
    bpy.ops.kiln.bake()
    color = pixels_of(bpy.data.images["low_color"])
    np.testing.assert_allclose(color[10, 16], [1, 0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(color[22, 16], [0, 0, 1, 1], atol=1e-3)
    choose(high)
    scene.kiln_bake.mode, scene.kiln_bake.by_error = "NEW", True
    with pytest.raises(RuntimeError, match="cannot be planned by error"):
        bpy.ops.kiln.bake()
    scene.kiln_bake.by_error, scene.kiln_bake.faces = False, 50
    assert bpy.ops.kiln.bake() == {"FINISHED"}


def test_by_name_parts_do_not_meet(scene):
    # Each part's high poly lies where the other's low poly is.
    lows = [sheet("a_low", 2), sheet("b_low", 2, move=(0, 0, 0.05))]
    lows[1].data.uv_layers[0].uv.foreach_set("vector", np.float32([0.5, 0.5, 1, 0.5, 1, 1, 0.5, 1] * 4))
    sheet("a_high", 2, lambda x, y: 0.05 + 0 * x)
    sheet("b_high", 2)
    bpy.ops.object.select_all(action="DESELECT")
    scene.kiln_bake.mode, scene.kiln_bake.maps, scene.kiln_bake.size = "NAME", {"height"}, 16
    scene.kiln_bake.max_distance = 0.1
    scene.kiln_bake.sets = "none"
    assert bpy.ops.kiln.bake() == {"FINISHED"}
    assert pixels_of(bpy.data.images["a_low_height"])[2, 2, 0] == pytest.approx(0.05, abs=1e-6)


def test_collections_and_udim(scene, tmp_path):
    pair = [bpy.data.collections.new(name) for name in ("light", "dense")]
    for collection, item in zip(pair, (sheet("low", 4), sheet("high", 40, bump))):
        scene.collection.objects.unlink(item)
        collection.objects.link(item)
        scene.collection.children.link(collection)
    low = pair[0].objects[0]
    uv = np.empty(len(low.data.loops) * 2, np.float32)
    low.data.uv_layers[0].uv.foreach_get("vector", uv)
    low.data.uv_layers[0].uv.foreach_set("vector", uv * 1.999)  # four tiles
    settings = scene.kiln_bake
    settings.mode, settings.low_collection, settings.high_collection = "COLLECTIONS", *pair
    settings.size, settings.sets, settings.max_distance = 64, "udim", 0.2
    for folder in ("", str(tmp_path)):
        settings.folder = folder
        assert bpy.ops.kiln.bake() == {"FINISHED"}
        image = low.data.materials[0].node_tree.nodes["Kiln normal"].image
        assert image.source == "TILED" and [tile.number for tile in image.tiles] == [1001, 1002, 1011, 1012]
        assert bool(image.packed_files) == (not folder)
    assert sorted(file.name for file in tmp_path.glob("*.exr")) == [
        f"low_normal.{tile}.exr" for tile in (1001, 1002, 1011, 1012)
    ]


def test_sets_by_material(scene):
    low, high = sheet("low", 2), sheet("high", 30, bump)
    for name in ("skin", "cloth"):
        low.data.materials.append(bpy.data.materials.new(name))
    low.data.polygons.foreach_set("material_index", np.int32([0, 1, 0, 1]))
    scene.kiln_bake.sets, scene.kiln_bake.size, scene.kiln_bake.max_distance = "material", 32, 0.2
    choose(low, high)
    assert bpy.ops.kiln.bake() == {"FINISHED"}
    for name in ("skin", "cloth"):
        assert bpy.data.materials[name].node_tree.nodes["Kiln normal"].image.name == f"low_{name}_normal"


@pytest.mark.parametrize("by_error", [False, True])
def test_a_new_low_poly(scene, by_error):
    high = sheet("wall", 80, lambda x, y: bump(4 * x, 4 * y))
    settings = scene.kiln_bake
    settings.mode, settings.faces, settings.size = "NEW", 400, 128
    settings.by_error, settings.max_error = by_error, 3
    choose(high)
    assert bpy.ops.kiln.bake() == {"FINISHED"}
    low = bpy.data.objects["wall_low"]
    assert len(low.data.polygons) <= 1000 and low.data.uv_layers
    assert by_error or 390 <= len(low.data.polygons) <= 400
    assert low.data.materials[0].node_tree.nodes["Kiln normal"].image.size[0] <= 128


def test_repairs_before_a_new_low_poly_are_told(scene):
    wall = sheet("wall", 40, bump, quads=False)
    for polygon in list(wall.data.polygons)[:100]:
        polygon.flip()
    settings = scene.kiln_bake
    settings.mode, settings.faces, settings.size = "NEW", 300, 64
    choose(wall)
    work = bake.Bake(bpy.context)
    bakes = work.run(None)
    told = work.finish(bpy.context, bakes)
    assert [text for text in told if "turned round" in text]
    assert len(told) == len(set(told))


def test_a_new_low_poly_that_strays_far_is_found(scene):
    wall = sheet("wall", 60, lambda x, y: 0.15 * np.sin(40 * x) * np.sin(40 * y + 1), quads=False)
    settings = scene.kiln_bake
    settings.mode, settings.faces, settings.size = "NEW", 40, 64
    choose(wall)
    (made,) = bake.Bake(bpy.context).run(None).values()
    assert made.report.missed < 0.05 * made.report.samples


def test_both_sides_of_a_sheet_stay(scene):
    square, faces = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    normals = np.repeat(np.float32([[0, 0, 1], [0, 0, -1]]), 2, axis=0)[:, None].repeat(3, axis=1)
    mesh = kiln.Mesh(square, np.concatenate([faces, faces[:, ::-1]]), square[:, :2], normals=normals)
    made = meshes.new_object(bpy.context, mesh, "sheet").data
    assert len(made.polygons) == 4
    assert [round(polygon.normal.z) for polygon in made.polygons] == [1, 1, -1, -1]


def test_a_bake_on_a_thread_tells_and_stops(scene):
    low, high = sheet("low", 4), sheet("high", 200, bump)
    scene.kiln_bake.size, scene.kiln_bake.maps, scene.kiln_bake.ao_rays = 1024, {"ao"}, 4096
    choose(low, high)
    job = bake.Job(bake.Bake(bpy.context))
    assert job.thread is not threading.current_thread()
    while job.done == 0 and job.thread.is_alive():
        time.sleep(0.01)
    assert job.stage
    job.stop()
    job.thread.join(60)
    assert not job.thread.is_alive() and isinstance(job.error, kiln.Cancelled)
    assert "low_ao" not in bpy.data.images and not low.data.materials
    scene.kiln_bake.ao_rays, scene.kiln_bake.size = 4, 32
    work = bake.Bake(bpy.context)
    job = bake.Job(work)
    job.thread.join(60)
    work.finish(bpy.context, job.result)
    assert "low_ao" in bpy.data.images


class Screen:
    """What modal() sees of Blender's window."""

    def __init__(self):
        self.screen = self
        self.areas, self.window_manager, self.timers, self.said = [], self, 1, []

    def event_timer_remove(self, timer):
        self.timers -= 1

    def report(self, kind, text):
        self.said.append((kind, text))


@pytest.mark.parametrize("key", ["A", "ESC"])
def test_the_operator_in_the_background(scene, key):
    low, high = sheet("low", 4), sheet("high", 100, bump)
    scene.kiln_bake.size, scene.kiln_bake.maps, scene.kiln_bake.ao_rays = 512, {"ao"}, 512 if key == "ESC" else 4
    choose(low, high)

    class Operator(Screen):
        done, failed = bake.KILN_OT_bake.done, bake.KILN_OT_bake.failed
        modal = bake.KILN_OT_bake.modal

    class Event:
        def __init__(self, type):
            self.type = type

    operator = Operator()
    operator.work, operator.timer = bake.Bake(bpy.context), None
    bake.Job.running = bake.Job(operator.work)
    assert not bpy.ops.kiln.bake.poll()  # one at a time
    assert operator.modal(operator, Event(key)) == {"PASS_THROUGH"}  # others get the keys, too
    result = {"PASS_THROUGH"}
    while result == {"PASS_THROUGH"}:
        time.sleep(0.01)
        result = operator.modal(operator, Event("TIMER"))
    assert operator.timers == 0 and bake.Job.running is None and bpy.ops.kiln.bake.poll()
    if key == "ESC":
        assert result == {"CANCELLED"} and operator.said == [({"INFO"}, "Cancelled by the callback.")]
        assert "low_ao" not in bpy.data.images
    else:
        assert result == {"FINISHED"} and operator.said[-1] == ({"INFO"}, "Baked ao")
        assert "low_ao" in bpy.data.images and low.data.materials


def test_one_undo_step(scene):
    low, high = sheet("low", 2), sheet("high", 8, bump)
    scene.kiln_bake.size = 16
    choose(low, high)
    try:
        bpy.ops.ed.undo_push(message="before")
    except RuntimeError:
        pytest.skip("This Blender has no undo without a window.")
    bpy.ops.kiln.bake("EXEC_DEFAULT", True)
    assert bpy.data.objects["low"].data.materials
    bpy.ops.ed.undo()
    assert not bpy.data.objects["low"].data.materials


def test_what_cannot_be_baked_is_told(scene):
    low = sheet("low", 2)
    choose(low)
    for mode in ("SELECTED", "COLLECTIONS"):
        scene.kiln_bake.mode = mode
        with pytest.raises(RuntimeError, match="Nothing to bake"):
            bpy.ops.kiln.bake()
    scene.kiln_bake.mode = "SELECTED"
    bare = sheet("bare", 2, uvs=False)
    choose(bare, low)
    with pytest.raises(RuntimeError, match="UV"):
        bpy.ops.kiln.bake()
    choose(low, bare)
    scene.kiln_bake.maps = set()
    with pytest.raises(RuntimeError, match="No map"):
        bpy.ops.kiln.bake()


def test_hidden_parts_and_deleted_low_polys_are_told(scene):
    pair = [bpy.data.collections.new(name) for name in ("light", "dense")]
    for collection in pair:
        scene.collection.children.link(collection)
    low, high, other = sheet("low", 2), sheet("high", 8, bump), sheet("other", 8, bump)
    for item, collection in ((low, pair[0]), (high, pair[1]), (other, pair[1])):
        scene.collection.objects.unlink(item)
        collection.objects.link(item)
    settings = scene.kiln_bake
    settings.mode, settings.low_collection, settings.high_collection, settings.size = "COLLECTIONS", *pair, 16
    other.hide_set(True)
    with pytest.raises(RuntimeError, match="'other' is hidden"):
        bpy.ops.kiln.bake()
    other.hide_set(False)
    work = bake.Bake(bpy.context)
    bakes = work.run(None)
    bpy.data.objects.remove(low)
    screen = Screen()
    screen.failed = lambda error: bake.KILN_OT_bake.failed(screen, error)
    assert bake.KILN_OT_bake.done(screen, bpy.context, work, bakes) == {"CANCELLED"}
    assert "deleted" in screen.said[0][1]


def test_the_cage_follows_the_mesh(scene):
    low = sheet("low", 1, move=(0, 0, 3))
    low.scale = (2, 2, 2)
    choose(low)
    bpy.context.view_layer.update()
    scene.kiln_bake.cage = 0.25
    ends = cage.cage_edges(bpy.context)
    assert ends.shape == (8, 3) and ends[:, 2] == pytest.approx(3.25) and ends[:, 0].max() == pytest.approx(2)
    scene.kiln_bake.show_cage = True  # draws nothing where there is no window
    scene.kiln_bake.show_cage = False


def test_wrong_scenes_are_sentences(scene, tmp_path):
    """They were tracebacks, the folder's after the whole bake."""
    low, high = sheet("low", 4), sheet("high", 20, bump)
    choose(low, high)
    high.scale = (0, 1, 1)
    bpy.context.view_layer.update()
    with pytest.raises(kiln.Error, match="'high' has a scale of 0"):
        bake.Bake(bpy.context)
    high.scale = (1, 1, 1)
    bpy.context.view_layer.update()
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "inside"):
        scene.kiln_bake.folder = str(folder)
        with pytest.raises(kiln.Error, match="Folder '.*file.*': maps cannot be written there"):
            bake.Bake(bpy.context)
    scene.kiln_bake.folder = str(tmp_path / "new" / "deep")
    bake.Bake(bpy.context)
    assert (tmp_path / "new" / "deep").is_dir()
    scene.kiln_bake.folder = ""


def test_a_dense_active_mesh_is_asked_about(scene, monkeypatch):
    monkeypatch.setattr(bake, "MIN_FACES_TO_ASK", 1000)
    low, high = sheet("low", 4), sheet("high", 40, bump)
    settings = scene.kiln_bake
    choose(low, high)
    assert bake.ask_if_low_is_dense(bpy.context, settings) == ""
    choose(high, low)
    assert "'high' has" in bake.ask_if_low_is_dense(bpy.context, settings)
    settings.mode = "NEW"
    assert bake.ask_if_low_is_dense(bpy.context, settings) == ""
    settings.mode = "SELECTED"
