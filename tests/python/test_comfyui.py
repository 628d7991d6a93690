"""The ComfyUI nodes, on a stand-in for its MESH."""

import importlib.util
from pathlib import Path

import kiln
import numpy as np
import pytest
from conftest import sheet, waves
from test_glb import ball, document_of

FOLDER = Path(__file__).resolve().parents[2] / "tools" / "comfyui"


class Mesh:
    """With the fields of ComfyUI's MESH (comfy_api, geometry_types)."""

    def __init__(self, vertices, faces, uvs=None, vertex_colors=None, texture=None, metallic_roughness=None,
                 vertex_counts=None, face_counts=None, unlit=False, normals=None, tangents=None, normal_map=None,
                 occlusion_in_mr=False, material=None, emissive=None):  # fmt: skip
        given = dict(locals())
        del given["self"]
        self.__dict__.update(given)


class Tensor:
    """As torch's on a GPU: NumPy sees it only after detach() and cpu()."""

    def __init__(self, values):
        self.values = values

    def detach(self):
        return self

    def cpu(self):
        return self.values


@pytest.fixture(scope="module")
def nodes():
    spec = importlib.util.spec_from_file_location(
        "kiln_nodes", FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)]
    )
    package = importlib.util.module_from_spec(spec)
    import sys

    sys.modules["kiln_nodes"] = package
    spec.loader.exec_module(package)
    assert "torch" not in sys.modules
    return {name: node() for name, node in package.NODE_CLASS_MAPPINGS.items()}


def run(nodes, name, **inputs):
    node = nodes[name]
    required = node.INPUT_TYPES()["required"]
    assert set(inputs) <= set(required)
    results = getattr(node, node.FUNCTION)(**inputs)
    assert len(results) == len(node.RETURN_TYPES) == len(node.RETURN_NAMES)
    return dict(zip(node.RETURN_NAMES, results))


def batch(*meshes):
    """Zeros fill up the smaller ones."""
    vertices = np.zeros((len(meshes), max(len(v) for v, f in meshes), 3), np.float32)
    faces = np.zeros((len(meshes), max(len(f) for v, f in meshes), 3), np.int64)
    for i, (v, f) in enumerate(meshes):
        vertices[i, : len(v)], faces[i, : len(f)] = v, f
    counts = [np.array([len(m[k]) for m in meshes]) for k in (0, 1)]
    return Mesh(Tensor(vertices), Tensor(faces), vertex_counts=counts[0], face_counts=counts[1])


def test_the_chain_is_that_of_the_package(nodes):
    vertices, faces = ball(24)
    high = Mesh(Tensor(vertices[None].astype(np.float32)), Tensor(faces[None]))
    light = run(nodes, "KilnSimplify", mesh=high, target_face_count=300)["mesh"]
    assert isinstance(light, Mesh) and light.faces.shape == (1, 300, 3) and light.uvs is None
    assert light.vertex_counts is None
    low = run(nodes, "KilnUnwrap", mesh=light, resolution=256)["mesh"]
    assert low.uvs.shape == (*low.vertices.shape[:2], 2) and low.uvs.min() >= 0 and low.uvs.max() <= 1
    baked = run(nodes, "KilnBake", low_poly=low, high_poly=high, resolution=256, match="ray")
    assert baked["normal_map"].shape == baked["occlusion"].shape == (1, 256, 256, 3)
    assert baked["normal_map"].dtype == np.float32
    # The same arrays, UVs turned over, through the package itself.
    mine = kiln.Mesh(low.vertices[0], low.faces[0], [0, 1] + low.uvs[0] * [1, -1], normals=low.normals[0])
    wanted = kiln.bake((vertices.astype(np.float32), faces), mine, size=256, maps=["normal", "ao"])
    np.testing.assert_array_equal(baked["normal_map"][0], wanted.stored("normal"))
    np.testing.assert_array_equal(baked["occlusion"][0], np.repeat(wanted.stored("ao"), 3, 2))
    mesh = baked["mesh"]
    assert mesh.tangents.shape == (*mesh.vertices.shape[:2], 4) and mesh.occlusion_in_mr
    np.testing.assert_array_equal(mesh.metallic_roughness[..., 0], baked["occlusion"][..., 0])
    assert (mesh.metallic_roughness[..., 1] == 1).all() and (mesh.metallic_roughness[..., 2] == 0).all()
    assert mesh.texture is None


def spikes(n):
    """A ball whose rough low polys stray by more than bakes look by default."""
    vertices, faces = ball(n)
    x, y, z = vertices.T
    return (vertices * (1 + 0.35 * np.sin(9 * x) * np.sin(8 * y) * np.cos(7 * z))[:, None]).astype(np.float32), faces


@pytest.mark.parametrize("clean", [False, True])
def test_the_chain_knows_how_far_its_low_poly_strays(nodes, clean):
    vertices, faces = spikes(24)
    high = Mesh(Tensor(vertices[None]), Tensor(faces[None]))
    light = run(nodes, "KilnSimplify", mesh=high, target_face_count=150, clean=clean)["mesh"]
    low = run(nodes, "KilnUnwrap", mesh=light, resolution=256)["mesh"]
    baked = run(nodes, "KilnBake", low_poly=low, high_poly=high, resolution=256, match="ray")
    mine = kiln.Mesh(vertices, faces)
    simplified = kiln.simplify(kiln.clean(mine) if clean else mine, target=150)
    unwrapped = kiln.unwrap(simplified, size=256)
    wanted = kiln.bake(mine, unwrapped, size=256, maps=["normal", "ao"])
    np.testing.assert_array_equal(baked["normal_map"][0], wanted.stored("normal"))
    np.testing.assert_array_equal(baked["occlusion"][0], np.repeat(wanted.stored("ao"), 3, 2))
    # What another node changed counts; its default distance is too short for such a mesh.
    low.vertices = low.vertices * np.float32(2)
    twice = Mesh(Tensor(2 * vertices[None]), Tensor(faces[None]))
    forgotten = run(nodes, "KilnBake", low_poly=low, high_poly=twice, resolution=256, match="ray")
    arrays = kiln.Mesh(low.vertices[0], low.faces[0], [0, 1] + low.uvs[0] * [1, -1], normals=low.normals[0])
    plain = kiln.bake((2 * vertices, faces), arrays, size=256, maps=["normal"])
    np.testing.assert_array_equal(forgotten["normal_map"][0], plain.stored("normal"))
    assert plain.report.missed > wanted.report.missed


def test_batches_of_unequal_meshes(nodes):
    small, large = ball(6), ball(12)
    high = batch(large, (small[0] * 2, small[1]))
    low = run(
        nodes, "KilnUnwrap", mesh=run(nodes, "KilnSimplify", mesh=high, target_face_count=100)["mesh"], resolution=64
    )
    mesh = low["mesh"]
    assert list(mesh.face_counts) == [100, 100]
    sizes = [np.linalg.norm(mesh.vertices[i, : mesh.vertex_counts[i]], axis=1) for i in (0, 1)]
    assert sizes[0].max() < 1.1 and sizes[1].min() > 1.7
    baked = run(nodes, "KilnBake", low_poly=mesh, high_poly=high, resolution=64, match="ray")
    assert baked["normal_map"].shape == (2, 64, 64, 3)
    for i, high_item in enumerate((large, (small[0] * 2, small[1]))):
        counts = mesh.vertex_counts[i], mesh.face_counts[i]
        one = Mesh(*(np.asarray(part)[None] for part in (mesh.vertices[i, : counts[0]], mesh.faces[i, : counts[1]])))
        one.uvs, one.normals = mesh.uvs[i, None, : counts[0]], mesh.normals[i, None, : counts[0]]
        one.kiln_meshes = [mesh.kiln_meshes[i]]
        alone = run(
            nodes,
            "KilnBake",
            low_poly=one,
            high_poly=Mesh(*(part[None] for part in high_item)),
            resolution=64,
            match="ray",
        )
        np.testing.assert_array_equal(alone["normal_map"][0], baked["normal_map"][i])


def test_colours_of_vertices_and_of_textures(nodes):
    vertices, faces, uvs = sheet(16, waves)
    # Linear 0.2158605 is 0.5 as sRGB has it; 128/255 is its nearest byte.
    colors = np.full((1, len(vertices), 3), 0.2158605, np.float32)
    high = Mesh(vertices[None].astype(np.float32), faces[None], vertex_colors=colors)
    made = run(nodes, "KilnToGLB", mesh=high, target_face_count=100, texture_size=64)
    np.testing.assert_allclose(made["base_color"], 128 / 255, atol=1e-3)
    # Upper half red, lower half blue: v = 0 is the upper border. Textures repeat, so the borders are mixed.
    texture = np.zeros((1, 8, 8, 3), np.float32)
    texture[:, :4, :, 0] = texture[:, 4:, :, 2] = 1
    high = Mesh(vertices[None].astype(np.float32), faces[None], uvs=uvs[None].astype(np.float32), texture=texture)
    flat = sheet(2, lambda x, y: 0 * x)
    low = Mesh(*(part[None] for part in flat[:2]), uvs=flat[2][None])
    color = run(nodes, "KilnBake", low_poly=low, high_poly=high, resolution=64, match="ray")["base_color"][0]
    assert (color[8:24] > 0.9)[..., 0].all() and (color[40:56] > 0.9)[..., 2].all()
    made = run(nodes, "KilnToGLB", mesh=high, target_face_count=100, texture_size=64)
    assert made["model_3d"][:4] == b"glTF"
    mesh = made["mesh"]
    rows = np.clip((mesh.uvs[0] * 64).astype(int), 0, 63)
    found = mesh.texture[0][rows[:, 1], rows[:, 0]]
    upper = mesh.vertices[0, :, 1] < 0.3  # y is v of the sheet
    assert upper.any() and (found[upper & (mesh.vertices[0, :, 1] > 0.1), 0] > 0.9).all()


@pytest.mark.parametrize("dtype, most", [(np.float32, 1), (np.uint8, 255), (np.uint16, 65535)])
def test_colours_are_floats_or_whole_numbers(nodes, dtype, most):
    """Whole numbers came out white, and as a texture black."""
    vertices, faces, uvs = sheet(16, waves)
    shares = np.array([51, 102, 204]) / 255
    inputs = {"target_face_count": 100, "texture_size": 64}
    given = np.broadcast_to(most * shares, (1, len(vertices), 3)).astype(dtype)
    high = Mesh(vertices[None].astype(np.float32), faces[None], vertex_colors=given)
    encoded = np.where(shares <= 0.0031308, 12.92 * shares, 1.055 * shares ** (1 / 2.4) - 0.055)  # they are linear
    found = run(nodes, "KilnToGLB", mesh=high, **inputs)["base_color"]
    np.testing.assert_allclose(found, np.broadcast_to(encoded, found.shape), atol=1 / 255)
    picture = np.broadcast_to(most * shares, (1, 8, 8, 3)).astype(dtype)
    high = Mesh(vertices[None].astype(np.float32), faces[None], uvs=uvs[None].astype(np.float32), texture=picture)
    found = run(nodes, "KilnToGLB", mesh=high, **inputs)["base_color"]
    np.testing.assert_allclose(found, np.broadcast_to(shares, found.shape), atol=1 / 255)
    with pytest.raises(ValueError, match="vertex_colors should be floats"):
        run(nodes, "KilnToGLB", mesh=Mesh(vertices[None], faces[None], vertex_colors=given.astype(np.int64)), **inputs)


def test_colours_of_high_dynamic_range_are_told(nodes):
    """They were clipped in silence."""
    vertices, faces, uvs = sheet(16, waves)
    shape = {"vertices": vertices[None].astype(np.float32), "faces": faces[None]}
    bright = np.full((1, len(vertices), 3), 0.5, np.float32)
    bright[0, 0] = [3, 1, -1]
    with pytest.warns(kiln.KilnWarning, match="vertex_colors: 2 of 867 numbers lie outside of .* from -1 to 3"):
        run(nodes, "KilnSimplify", mesh=Mesh(**shape, vertex_colors=bright), target_face_count=100)
    picture = np.full((1, 8, 8, 3), 0.5, np.float32)
    picture[0, :, :, 1] = 7
    high = Mesh(**shape, uvs=uvs[None].astype(np.float32), texture=picture)
    with pytest.warns(kiln.KilnWarning, match="texture: 64 of 192 numbers"):
        color = run(nodes, "KilnToGLB", mesh=high, target_face_count=100, texture_size=64)["base_color"]
    np.testing.assert_allclose(color[..., 1], 1)
    flat = sheet(2, lambda x, y: 0 * x)
    low = Mesh(*(part[None] for part in flat[:2]), uvs=flat[2][None])
    with pytest.warns(kiln.KilnWarning, match="texture: 64 of 192 numbers"):
        color = run(nodes, "KilnBake", low_poly=low, high_poly=high, resolution=64, match="ray")["base_color"]
    np.testing.assert_allclose(color[..., 1], 1)


def test_wrong_meshes_are_told(nodes):
    vertices, faces = ball(2)
    with pytest.raises(ValueError, match="has no UVs"):
        mesh = Mesh(vertices[None], faces[None])
        run(nodes, "KilnBake", low_poly=mesh, high_poly=mesh, resolution=64, match="ray")
    two = batch(ball(2), ball(2))
    three = batch(*[ball(2)] * 3)
    three.uvs = np.zeros((3, len(vertices), 2))
    with pytest.raises(ValueError, match="3 low polys, but 2 high polys"):
        run(nodes, "KilnBake", low_poly=three, high_poly=two, resolution=64, match="ray")
    with pytest.raises(kiln.Error, match="vertices"):
        run(nodes, "KilnSimplify", mesh=Mesh(vertices[None, None], faces[None]), target_face_count=8)


def test_lists_and_single_meshes_are_batches_too(nodes):
    (vertices, faces), other = ball(4), ball(6)
    listed = Mesh([vertices, other[0]], [faces, other[1]])
    light = run(nodes, "KilnSimplify", mesh=listed, target_face_count=50)["mesh"]
    assert light.faces.shape == (2, 50, 3)
    single = run(nodes, "KilnSimplify", mesh=Mesh(vertices, faces), target_face_count=50)["mesh"]
    np.testing.assert_array_equal(single.vertices[0], light.vertices[0, : len(single.vertices[0])])


def test_tensors_where_torch_is_there(nodes, monkeypatch):
    import sys
    import types

    monkeypatch.setitem(sys.modules, "torch", types.SimpleNamespace(from_numpy=Tensor))
    vertices, faces = ball(6)
    mesh = Mesh(Tensor(vertices[None]), Tensor(faces[None]))
    low = run(nodes, "KilnUnwrap", mesh=mesh, resolution=64)["mesh"]
    baked = run(nodes, "KilnBake", low_poly=low, high_poly=mesh, resolution=64, match="ray")
    assert isinstance(low.uvs, Tensor) and isinstance(baked["normal_map"], Tensor)
    assert isinstance(baked["mesh"].metallic_roughness, Tensor)


MATERIAL = {"metallic_factor": 1.0, "roughness_factor": 0.25, "double_sided": False}


def painted(material=None, **pictures):
    """A waving sheet whose pictures have one value each."""
    vertices, faces, uvs = sheet(16, waves)
    grown = {name: np.broadcast_to(np.float32(value), (1, 8, 8, len(value))) for name, value in pictures.items()}
    mesh = Mesh(vertices[None].astype(np.float32), faces[None], uvs=uvs[None].astype(np.float32), material=material)
    for name, value in grown.items():
        setattr(mesh, name, value)
    return mesh


def both_nodes(nodes, high):
    flat = sheet(2, lambda x, y: 0 * x)
    low = Mesh(*(part[None] for part in flat[:2]), uvs=flat[2][None])
    yield run(nodes, "KilnBake", low_poly=low, high_poly=high, resolution=64, match="ray")
    yield run(nodes, "KilnToGLB", mesh=high, target_face_count=100, texture_size=64)


def test_numbers_of_materials_go_through(nodes):
    """0.25 and 1 became 1 and 0."""
    for made in both_nodes(nodes, painted(MATERIAL)):
        surface = made["mesh"].metallic_roughness
        np.testing.assert_allclose(surface[..., 1:], np.broadcast_to([0.25, 1], surface[..., 1:].shape), atol=0.005)
        np.testing.assert_array_equal(made["metallic_roughness"], surface)
        # SaveGLB multiplies by factors, which are in the picture now.
        assert not {"metallic_factor", "roughness_factor"} & set(made["mesh"].material)
    pbr = document_of(made["model_3d"])["materials"][0]["pbrMetallicRoughness"]
    assert (pbr["roughnessFactor"], pbr["metallicFactor"]) == (0.25, 1)


def test_a_look_has_what_its_material_states(nodes):
    import sys

    def look_of(**fields):
        return sys.modules["kiln_nodes.nodes"].MaterialLook(Mesh(None, None, **fields), 0)

    surface = np.full((1, 4, 4, 3), 0.5, np.float32)
    plain = look_of(metallic_roughness=surface)
    assert set(plain.pictures) == {"roughness", "metallic"} and not plain.numbers
    factors = {"occlusion_strength": 0.5, "roughness_factor": 0.5, "metallic_factor": 0, "base_color_factor": (1, 1, 1, 0.25)}
    look = look_of(metallic_roughness=surface, occlusion_in_mr=True, material=factors)
    for name, value in (("ao", 0.75), ("roughness", 0.25), ("metallic", 0)):
        np.testing.assert_allclose(look.pictures[name], value)
    assert look.numbers == {"opacity": 0.25}
    assert look_of(material={"base_color_factor": (0.5, 0.5, 0.5, 1)}).numbers == {}


@pytest.mark.parametrize("clean", [True, False])
def test_hidden_parts_go_where_repairs_are_wanted(nodes, clean):
    """A ball within a ball, which no view from outside sees."""
    vertices, faces = ball(24)
    both = np.concatenate([vertices, 0.3 * vertices]).astype(np.float32)
    high = Mesh(Tensor(both[None]), Tensor(np.concatenate([faces, faces + len(vertices)])[None]))
    light = run(nodes, "KilnSimplify", mesh=high, target_face_count=800, clean=clean)["mesh"]
    radii = np.linalg.norm(np.asarray(light.vertices[0]), axis=1)
    assert (radii.min() > 0.5 * radii.max()) == clean


def test_factors_below_0_are_not_given(nodes):
    import sys

    factor_of = sys.modules["kiln_nodes.nodes"].factor_of
    for default in (None, 1.0):
        assert [factor_of({"roughness_factor": value}, "roughness_factor", default) for value in (0, 0.5, 1)] == [0, 0.5, 1]
        assert factor_of({"roughness_factor": -1}, "roughness_factor", default) == default
        assert factor_of({"roughness_factor": None}, "roughness_factor", default) == default
        assert factor_of({}, "roughness_factor", default) == default


def test_pictures_of_materials_go_through_with_their_factors(nodes):
    material = {**MATERIAL, "roughness_factor": 0.5, "emissive_factor": [1, 1, 0.0], "base_color_factor": [0.25, 1, 1, 1]}
    high = painted(
        material, texture=[0.8, 0.4, 0.2], metallic_roughness=[0.5, 0.6, 0.7], emissive=[0.9, 0.3, 0.6], normal_map=[0.8, 0.5, 0.9]
    )
    high.occlusion_in_mr = True
    for made in both_nodes(nodes, high):
        mesh = made["mesh"]
        middle = (0, slice(24, 40), slice(24, 40))
        found = mesh.metallic_roughness[middle].reshape(-1, 3)
        covered = np.abs(found[:, 1] - 0.3) < 0.01
        assert covered.mean() > 0.9
        np.testing.assert_allclose(np.median(found, axis=0), [0.5, 0.3, 0.7], atol=0.01)
        tint = linear_to_srgb(0.25 * srgb_to_linear(0.8))
        np.testing.assert_allclose(np.median(mesh.texture[middle].reshape(-1, 3), axis=0), [tint, 0.4, 0.2], atol=0.01)
        np.testing.assert_allclose(np.median(mesh.emissive[middle].reshape(-1, 3), axis=0), [0.9, 0.3, 0], atol=0.01)
        tilted = np.median(mesh.normal_map[middle].reshape(-1, 3), axis=0)
        assert abs(np.degrees(np.arccos(2 * tilted[2] - 1)) - 36.87) < 4
        assert not {"base_color_factor", "emissive_factor", "roughness_factor"} & set(mesh.material)


def linear_to_srgb(value):
    return 1.055 * value ** (1 / 2.4) - 0.055


def srgb_to_linear(value):
    return ((value + 0.055) / 1.055) ** 2.4


def test_an_emissive_picture_does_not_stay_on_new_uvs(nodes):
    high = painted(emissive=[0.9, 0.3, 0.6])
    light = run(nodes, "KilnSimplify", mesh=high, target_face_count=100)["mesh"]
    assert light.emissive is None and run(nodes, "KilnUnwrap", mesh=light, resolution=64)["mesh"].emissive is None


def test_alpha_is_an_output(nodes):
    high = painted(texture=[0.8, 0.4, 0.2, 0.5])
    for made in both_nodes(nodes, high):
        assert made["alpha"].shape == (1, 64, 64)
        np.testing.assert_allclose(np.median(made["alpha"]), 0.5, atol=0.01)
        assert made["mesh"].texture.shape[-1] == 4
    opaque = next(both_nodes(nodes, painted(texture=[0.8, 0.4, 0.2])))
    assert (opaque["alpha"] == 1).all() and opaque["mesh"].texture.shape[-1] == 3


def test_empty_meshes_of_a_batch_are_left_out(nodes):
    """They ended the whole batch."""
    high = batch(ball(6), ball(8))
    high.face_counts[0] = 0
    with pytest.warns(kiln.KilnWarning, match="1 of 2 meshes of the batch have no faces"):
        light = run(nodes, "KilnSimplify", mesh=high, target_face_count=100)["mesh"]
    assert light.faces.shape[0] == 1
    high.face_counts[1] = 0
    with pytest.raises(ValueError, match="No mesh of the batch has faces"), pytest.warns(kiln.KilnWarning):
        run(nodes, "KilnSimplify", mesh=high, target_face_count=100)


def test_files_are_meshes(nodes, tmp_path):
    vertices, faces, uvs = sheet(8, waves)
    source = kiln.pack_glb(kiln.Mesh(vertices, faces, uvs), {"color": np.full((4, 4, 3), 0.5), "roughness": np.full((4, 4), 0.25)})
    (tmp_path / "sheet.glb").write_bytes(source.data)
    loaded = run(nodes, "KilnLoadMesh", path=str(tmp_path / "sheet.glb"))["mesh"]
    assert loaded.faces.shape == (1, 128, 3) and loaded.uvs.shape[-1] == 2 and loaded.normals is not None
    made = run(nodes, "KilnToGLB", mesh=loaded, target_face_count=50, texture_size=64)  # with the file's material
    np.testing.assert_allclose(np.median(made["base_color"]), 0.5, atol=0.01)
    np.testing.assert_allclose(np.median(made["metallic_roughness"][..., 1]), 0.25, atol=0.01)
    with pytest.raises(ValueError, match="path is empty"):
        run(nodes, "KilnLoadMesh", path=" ")
    with pytest.raises(kiln.Error, match="no_such"):
        run(nodes, "KilnLoadMesh", path="no_such.ply")


def test_trimesh_is_taken(nodes):
    trimesh = pytest.importorskip("trimesh")
    given = trimesh.Trimesh(*ball(8), process=False)
    light = run(nodes, "KilnSimplify", mesh=given, target_face_count=100)["mesh"]
    assert light.faces.shape == (1, 100, 3)


def optional(nodes, name, **inputs):
    node = nodes[name]
    kinds = node.INPUT_TYPES()
    assert set(inputs) <= set(kinds["required"]) | set(kinds["optional"])
    return dict(zip(node.RETURN_NAMES, getattr(node, node.FUNCTION)(**inputs)))


def test_choices_of_sides_bytes_and_cages(nodes):
    vertices, faces = ball(12)
    half = faces[vertices[faces][:, :, 1].mean(1) < 0]
    bowl = Mesh(vertices[None].astype(np.float32), half[None])
    by = {"target_face_count": 200, "texture_size": 128}
    with pytest.warns(kiln.KilnWarning, match="has open parts"):
        assert optional(nodes, "KilnToGLB", mesh=bowl, **by)["mesh"].material["double_sided"] is True
    shut = optional(nodes, "KilnToGLB", mesh=bowl, double_sided="no", **by)
    assert shut["mesh"].material["double_sided"] is False
    assert "doubleSided" not in document_of(shut["model_3d"])["materials"][0]
    small = optional(nodes, "KilnToGLB", mesh=bowl, double_sided="no", max_bytes=16_000, **by)
    assert len(small["model_3d"]) <= 16_000 < len(shut["model_3d"])
    # A flat sheet near the low poly, and a tilted one that rays from a cage reach first.
    flat = sheet(2, lambda x, y: 0 * x)
    (near, faces, _), (far, _, _) = sheet(16, lambda x, y: 0.001 + 0 * x), sheet(16, lambda x, y: 0.3 + 0.1 * x)
    low = Mesh(*(part[None] for part in flat[:2]), uvs=flat[2][None])
    high = Mesh(np.concatenate([near, far])[None], np.concatenate([faces, faces + len(near)])[None])
    for distance, slope in ((0.0, 0), (0.6, 0.1)):
        found = optional(nodes, "KilnBake", low_poly=low, high_poly=high, resolution=32, match="ray", cage_distance=distance)
        x, _, z = 2 * np.median(found["normal_map"].reshape(-1, 3), axis=0) - 1
        np.testing.assert_allclose(abs(x / z), slope, atol=0.01)
