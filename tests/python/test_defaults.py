"""What makers of generated and scanned meshes get without asking: hard edges, both sides, mips, and words at once."""

import io
import pickle
import warnings

import kiln
import numpy as np
import pytest
from test_glb import ball, document_of


def codes_of(told):
    return [w.message.code for w in told if isinstance(w.message, kiln.KilnWarning)]


def bowl(n):
    """The lower half of a ball."""
    vertices, faces = ball(n)
    return vertices, faces[vertices[faces][:, :, 1].mean(1) < 0]


def grids(n):
    """A cube of six grids."""
    steps = np.linspace(0, 1, n + 1)
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps))
    sides = []
    for axis in range(3):
        for level in (0, 1):
            corners = np.empty((len(u), 3))
            corners[:, axis], corners[:, (axis + 1) % 3], corners[:, (axis + 2) % 3] = level, u if level else 1 - u, v
            sides.append(corners)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    square = np.concatenate(
        [np.stack([corner, corner + 1, corner + n + 2], 1), np.stack([corner, corner + n + 2, corner + n + 1], 1)]
    )
    return np.concatenate(sides), np.concatenate([square + k * (n + 1) ** 2 for k in range(6)])


def test_split_vertices_of_arrays_are_hard_edges():
    """A cube of six grids was 3.8 degrees off."""
    vertices, faces = grids(16)
    glb = kiln.to_glb(vertices, faces, faces_target=12, texture_size=64, maps=["normal"])
    baked = kiln.bake((vertices, faces), glb.mesh, size=64, space="object", samples=1)
    normals = 2 * baked["normal"][baked.coverage == 1] - 1
    off = np.degrees(np.arccos(np.abs(normals).max(1).clip(-1, 1)))
    assert len(off) > 1000 and off.max() < 0.05


def sides_of(glb):
    return [material.get("doubleSided", False) for material in document_of(glb.data)["materials"]]


BY = {"faces_target": 300, "texture_size": 64, "maps": ["normal"]}


def test_open_shells_show_both_sides_and_say_so():
    with pytest.warns(kiln.KilnWarning, match="has open parts.*are back faces.*double-sided.*add double_sided=") as told:
        glb = kiln.to_glb(*bowl(12), **BY)
    assert codes_of(told) == ["double-sided"] and sides_of(glb) == [True]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert sides_of(kiln.to_glb(*bowl(12), double_sided=False, **BY)) == [False]
        assert sides_of(kiln.to_glb(*bowl(12), double_sided=True, **BY)) == [True]
        assert sides_of(kiln.to_glb(*ball(12), **BY)) == [False]
    with pytest.warns(kiln.KilnWarning, match="back faces"):
        packed = kiln.pack_glb(kiln.unwrap(*bowl(6), size=64), {})
    assert sides_of(packed) == [True]
    assert sides_of(kiln.pack_glb(kiln.unwrap(*ball(6), size=64), {})) == [False]


def test_what_a_gltf_says_of_sides_stays():
    low = kiln.unwrap(*bowl(6), size=64)
    for shown in (True, False):
        source = kiln.pack_glb(low, {"color": np.ones((4, 4, 3))}, double_sided=shown).data
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert sides_of(kiln.to_glb(source, faces_target=60, texture_size=64)) == [shown]


def largest_bias(glb):
    """By how many steps of 255 the mean of a level's texels, weighted by the charts under them, differs from the charts'."""
    Image = pytest.importorskip("PIL.Image")
    document = document_of(glb.data)
    start = 28 + int.from_bytes(glb.data[12:16], "little")
    covered = glb.bake.coverage == 1
    worst = 0
    for image in document["images"]:
        view = document["bufferViews"][image["bufferView"]]
        first = start + view.get("byteOffset", 0)
        picture = Image.open(io.BytesIO(glb.data[first : first + view["byteLength"]]))
        pixels = np.asarray(picture.convert("RGB"), float)
        wanted = pixels[covered].mean(0)
        weight = covered.astype(float)[..., None]
        while True:
            worst = max(worst, np.abs((pixels * weight).sum((0, 1)) / weight.sum() - wanted).max())
            if len(pixels) == 1:
                break
            half = len(pixels) // 2
            pixels, weight = (each.reshape(half, 2, half, 2, -1).mean((1, 3)) for each in (pixels, weight))
    return worst


def test_mips_of_a_glb_keep_the_mean_of_its_charts():
    """Black between charts darkened far levels."""
    vertices, faces = ball(24)
    shades = 0.5 + 0.4 * np.sin(3 * vertices)
    by = {"colors": shades, "faces_target": 300, "texture_size": 256, "maps": ["color", "ao"]}
    glb = kiln.to_glb(vertices, faces, **by)
    # Charts cover 77% of this atlas, and vary by 200 steps: what is left between them cannot cancel all biases.
    assert largest_bias(glb) < 1
    assert largest_bias(kiln.to_glb(vertices, faces, gutter=1, **by)) < 1
    # The maps are those of the file; what the bake itself holds is 16 texels of padding and a background.
    assert (glb.maps["color"] != glb.bake.stored("color")).any()
    plain = kiln.to_glb(vertices, faces, faces_target=300, texture_size=256, maps=["ao"], gutter=4)
    np.testing.assert_array_equal(plain.maps["ao"], plain.bake.stored("ao"))


WRONG = {
    "double_sided": ({"double_sided": 1}, kiln.Error, "double_sided: 1: give True, False or .auto."),
    "double_sided of text": ({"double_sided": "both"}, kiln.Error, "double_sided: 'both'"),
    "device": ({"device": "cuda"}, kiln.Error, "cuda"),
    "size": ({"size": 512}, TypeError, "to_glb.. got an unexpected keyword argument 'size'; did you mean texture_size"),
    "target_faces": ({"target_faces": 9}, TypeError, "'target_faces'; did you mean faces_target"),
    "texture_sise": ({"texture_sise": 9}, TypeError, "'texture_sise'; did you mean texture_size"),
    "sampels": ({"sampels": 2}, TypeError, "'sampels'; did you mean samples"),
    "faces": ({"faces": 500}, kiln.Error, "faces: 500: .*faces_target"),
    "up": ({"up": "w"}, kiln.Error, "up is 'w'|up 'w'"),
    "name": ({"name": 7}, kiln.Error, "name: expected text"),
    "path": ({"path": "here.obj"}, kiln.Error, "would hold a GLB"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_values_are_told_before_any_work(case):
    keywords, kind, text = WRONG[case]
    stages = []
    with pytest.raises(kind, match=text):
        kiln.to_glb("no_such_file.ply", progress=lambda done, stage: stages.append(stage), **keywords)
    assert not stages


def test_folders_are_made_as_the_command_makes_them(tmp_path):
    made = tmp_path / "new" / "game.glb"
    kiln.to_glb(*ball(6), path=made, faces_target=60, texture_size=32, maps=["normal"])
    assert made.read_bytes()[:4] == b"glTF"
    (tmp_path / "file").write_text("")
    with pytest.raises(kiln.Error, match="file") as told:
        kiln.to_glb("no_such_file.ply", path=tmp_path / "file" / "game.glb")
    assert told.value.kind == "output"


def test_names_and_axes_of_arrays():
    vertices, faces = ball(6)
    tall = vertices * [1, 1, 3]
    glb = kiln.to_glb(tall, faces, up="z", name="post", faces_target=200, texture_size=32, maps=["normal"])
    extent = np.ptp(glb.vertices, axis=0)
    np.testing.assert_allclose(extent, [2, 6, 2], atol=0.2)
    assert {material["name"] for material in document_of(glb.data)["materials"]} == {"post"}
    normals = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    for axis, turned in {
        "z": lambda p: np.stack([p[:, 0], p[:, 2], -p[:, 1]], 1),
        "x": lambda p: np.stack([-p[:, 1], p[:, 0], p[:, 2]], 1),
        "-y": lambda p: np.stack([p[:, 0], -p[:, 1], -p[:, 2]], 1),
        "y": lambda p: p,
    }.items():
        mesh = kiln.Mesh(vertices, faces, normals=normals, up=axis)
        np.testing.assert_allclose(mesh.vertices, turned(vertices), atol=1e-6)
        np.testing.assert_allclose(mesh.normals, turned(normals), atol=1e-6)
    with pytest.raises(kiln.Error, match="no effect on a kiln.Mesh"):
        kiln.to_glb(kiln.Mesh(vertices, faces), up="z")


def test_up_is_for_files_that_do_not_state_it(tmp_path):
    vertices, faces = ball(6)
    kiln.Mesh(vertices * [1, 1, 3], faces).save(tmp_path / "post.obj")
    assert np.ptp(kiln.load(tmp_path / "post.obj", up="z").vertices, axis=0).argmax() == 1
    glb = kiln.to_glb(tmp_path / "post.obj", up="z", faces_target=200, texture_size=32, maps=["normal"])
    assert np.ptp(glb.vertices, axis=0).argmax() == 1


def test_scenes_of_trimesh_keep_their_materials():
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("PIL")
    scene = trimesh.Scene()
    for i, color in enumerate(([255, 0, 0, 255], [0, 0, 255, 255])):
        vertices, faces = ball(6)
        material = trimesh.visual.material.PBRMaterial(name=f"m{i}", baseColorFactor=color, roughnessFactor=0.25)
        mesh = trimesh.Trimesh(vertices + [3 * i, 0, 0], faces, process=False)
        mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(vertices), 2)), material=material)
        scene.add_geometry(mesh, node_name=f"n{i}")
    assert len(kiln.as_mesh(scene).material_names) == 2
    glb = kiln.to_glb(scene, faces_target=400, texture_size=64)
    covered = glb.bake.coverage == 1
    colors = glb.maps["color"][covered]
    assert (colors[:, 0] > 0.9).any() and (colors[:, 2] > 0.9).any() and (colors.max(1) > 0.9).mean() > 0.95
    np.testing.assert_allclose(glb.maps["roughness"][covered], 0.25, atol=0.005)
    # Colours of vertices, which trimesh writes as they are.
    painted = trimesh.Scene([trimesh.Trimesh(*ball(4), vertex_colors=[128, 0, 0, 255], process=False)])
    assert (kiln.as_mesh(painted).colors[:, 0] == 128).all()
    job = kiln.run(high=scene, faces=100, size=32, maps=["normal"], out="x.glb", in_memory=True)
    assert job.glb[:4] == b"glTF"


def test_broken_pickles_of_meshes_are_errors():
    """An empty tuple ended the process."""
    mesh = kiln.Mesh(*ball(2))
    whole = mesh.__getstate__()
    assert len(pickle.loads(pickle.dumps(mesh)).faces) == len(mesh.faces)
    broken = [(), (whole[0],), whole[:-1], (*whole, 0), (whole[0], [], *whole[2:]), (whole[0], whole[1][:4], *whole[2:])]
    broken += [(1, *whole[1:]), (whole[0], None, *whole[2:]), (whole[0], [7] * len(whole[1]), *whole[2:])]
    broken += [(*whole[:5], [1], whole[6]), (*whole[:5], None, whole[6]), (*whole[:6], "no")]
    for state in broken:
        with pytest.raises(kiln.Error) as told:
            kiln.Mesh.__new__(kiln.Mesh).__setstate__(state)
        assert told.value.code in ("pickle", "mesh-index", "mesh-empty") or told.value.kind == "input"


def test_notebooks_show_small_pictures():
    glb = kiln.to_glb(*ball(16), colors=np.full((6 * 17**2, 3), 0.5), faces_target=200, texture_size=1024)
    for shown in (glb, glb.mesh, glb.bake):
        picture, page = shown._repr_png_(), shown._repr_html_()
        assert picture[:8] == b"\x89PNG\r\n\x1a\n" and len(picture) < 400_000
        assert page.count("<img") >= 1 and page.count("<div") == page.count("</div>") and len(page) < 600_000
    assert "200 faces" in glb._repr_html_() and "normal, 1024 × 1024" in glb._repr_html_()
    assert "&lt;b&gt;" in kiln.Mesh(*ball(2), name="<b>")._repr_html_()


def test_smooth_angle_and_hard_edges_agree():
    vertices, faces = grids(4)
    flat = kiln.Mesh(vertices, faces, smooth_angle=30)
    np.testing.assert_allclose(np.abs(flat.normals).max(1), 1, atol=1e-6)
