"""kiln.to_glb(), GLB bytes, simplify() and unwrap()."""

import json
import pickle
import tempfile
import warnings

import numpy as np
import pytest
from conftest import sheet, waves

import kiln


def ball(n):
    """A closed mesh of radius 1 with 12 n^2 triangles: a cube's faces, blown up."""
    steps = np.linspace(-1, 1, n + 1)
    a, b = (grid.ravel() for grid in np.meshgrid(steps, steps))
    one = np.ones_like(a)
    sides = [(one, a, b), (-one, b, a), (b, one, a), (a, -one, b), (a, b, one), (b, a, -one)]
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    square = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + n + 2], axis=1),
            np.stack([corner, corner + n + 2, corner + n + 1], axis=1),
        ]
    )
    vertices = np.concatenate([np.stack(side, axis=1) for side in sides])
    faces = np.concatenate([square + k * (n + 1) ** 2 for k in range(6)])
    return vertices / np.linalg.norm(vertices, axis=1)[:, None], faces


def colors_of(points):
    return 0.5 + 0.4 * points


@pytest.fixture(scope="module")
def glb():
    vertices, faces = ball(32)
    return kiln.to_glb(
        vertices, faces, colors=colors_of(vertices), faces_target=500, texture_size=256, maps=["normal", "ao", "color"], ao_rays=16
    )


def test_the_ball_is_outside_out():
    vertices, faces = ball(4)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) > 0).all()


def test_balls_inside_out_are_told():
    vertices, faces = ball(8)
    low = kiln.unwrap(vertices, faces, size=64)
    with pytest.raises(kiln.Error, match="inside out"):
        kiln.bake((vertices * 1.01, faces[:, ::-1]), low, size=64)
    two = np.concatenate([vertices, vertices + 3])
    both = kiln.unwrap(two, np.concatenate([faces, faces + len(vertices)]), size=64)
    with pytest.warns(kiln.KilnWarning) as caught:
        kiln.bake((two, np.concatenate([faces, faces[:, ::-1] + len(vertices)])), both, size=64)
    assert "high-inside-out" in {w.message.code for w in caught}


def test_repairs_are_of_the_names_of_to_glb():
    vertices, faces = ball(12)
    inner = vertices * 0.3
    crumb = vertices * 0.004 + 2.0
    many = np.concatenate([vertices, inner, crumb])
    parts = [faces[1:].copy(), faces + len(vertices), faces + 2 * len(vertices)]
    parts[0][100:120] = parts[0][100:120, ::-1]
    mesh = kiln.Mesh(many, np.concatenate(parts))
    off = {"weld": 0, "orient": False, "fill_holes": False, "drop_floaters": False, "drop_hidden": False}

    def codes(mesh=mesh, **on):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            kiln.to_glb(mesh, faces_target=1500, texture_size=64, maps="normal", **{**off, **on})
        return {w.message.code for w in caught if hasattr(w.message, "code")}

    assert not codes() & {"turned-triangles", "filled-holes", "dropped-floaters", "dropped-inner", "welded-vertices"}
    assert "turned-triangles" in codes(orient=True)
    assert "filled-large-holes" in codes(fill_holes=0.5)
    assert "dropped-floaters" in codes(drop_floaters=True)
    shells = kiln.Mesh(np.concatenate([vertices, inner]), np.concatenate([faces, faces + len(vertices)]))
    assert "dropped-inner" in codes(shells, drop_hidden=True)
    assert not codes(shells) & {"dropped-inner"}
    # The hole's three edges are 8% of the diagonal around, the crumb is 0.4% of the ball's across.
    assert not codes(fill_holes=True, drop_floaters=0.001) & {"filled-holes", "filled-large-holes", "dropped-floaters"}


def test_occlusion_of_a_glb_is_smoothed_where_nothing_is_said():
    mesh = kiln.Mesh(*ball(12))
    smooth = kiln.to_glb(mesh, faces_target=300, texture_size=1024, maps="ao")
    said = kiln.to_glb(mesh, faces_target=300, texture_size=1024, maps="ao", ao_error=1)
    small = kiln.to_glb(mesh, faces_target=300, texture_size=64, maps="ao")
    plain = kiln.to_glb(mesh, faces_target=300, texture_size=64, maps="ao", ao_rays=64)
    assert smooth.data == said.data
    assert small.data == plain.data  # below 1024 x 1024 texels plain rays are as fast
    np.testing.assert_array_equal(kiln.bake(mesh, plain.mesh, size=64, maps="ao")["ao"], plain.bake["ao"])


def test_glb_has_arrays_and_maps(glb):
    assert glb.data[:4] == b"glTF" and bytes(glb) == glb.data
    assert len(glb.faces) == len(glb.mesh.faces) <= 500
    assert glb.faces.max() == len(glb.vertices) - 1
    for name, width in (("vertices", 3), ("uvs", 2), ("normals", 3), ("tangents", 4)):
        assert getattr(glb, name).shape == (len(glb.vertices), width)
    # One part in 500 faces of a ball: all vertices lie near the unit sphere, and normals point along them.
    np.testing.assert_allclose(np.linalg.norm(glb.vertices, axis=1), 1, atol=0.03)
    assert (np.einsum("ij,ij->i", glb.vertices, glb.normals) > 0.95).all()
    assert set(glb.maps) == {"normal", "ao", "color"}
    assert 0 <= glb.uvs.min() and glb.uvs.max() <= 1
    assert glb.bake.report.missed == 0


def test_colours_of_vertices_reach_the_map(glb):
    covered = glb.bake.coverage == 1
    points = kiln.match(kiln.Mesh(*ball(32)), glb.mesh, size=256).position
    found = np.abs(glb.maps["color"] - colors_of(points))[covered & np.isfinite(points[..., 0])]
    # A face's corners are pi / 2 / 32 apart, and their colours differ by 0.4 of that; what lies between them differs by
    # no more. Bytes add 1/510.
    assert found.max() < 0.4 * np.pi / 2 / 32 + 1 / 510


def test_glb_bytes_are_a_mesh_and_a_textured_source(glb):
    mesh = kiln.as_mesh(glb.data)
    assert len(mesh.faces) == len(glb.faces) and mesh.uvs is not None
    # Its own picture, baked back onto itself.
    again = kiln.bake(glb.data, mesh, size=256, maps="color")
    covered = again.coverage == 1
    np.testing.assert_allclose(
        again.stored("color")[covered], np.round(glb.maps["color"][covered] * 255) / 255, atol=0.02
    )


def test_channels_from_a_function_of_places():
    vertices, faces = ball(32)
    seen = []

    def field(points):
        seen.append(points)
        return {"color": colors_of(points), "roughness": np.full(len(points), 0.25), "metallic": points[:, 2] > 0}

    def numbers(points):
        values = field(points)
        values["metallic"] = values["metallic"].astype(np.float32)
        return values

    glb = kiln.to_glb(vertices, faces, faces_target=500, texture_size=128, sample=numbers, samples=2)
    assert len(seen) == 1 and seen[0].dtype == np.float64 and seen[0].shape[1] == 3
    np.testing.assert_allclose(np.linalg.norm(seen[0], axis=1), 1, atol=0.01)
    assert list(glb.maps) == ["normal", "ao", "color", "roughness", "metallic"]
    assert (np.abs(glb.maps["roughness"][glb.maps["roughness"] > 0] - 0.25) < 1e-6).all()
    covered = glb.bake.coverage == 1
    points = kiln.match(kiln.Mesh(vertices, faces), glb.mesh, size=128).position
    far = np.abs(glb.maps["color"] - colors_of(points))[covered]
    # The mean of 2 x 2 samples is the value at the middle, but where a texel is covered in part: half a texel then,
    # at most 0.4 * 4 / 128.
    assert np.nanmax(far) < 0.4 * 4 / 128
    document = document_of(glb.data)
    assert "metallicRoughnessTexture" in document["materials"][0]["pbrMetallicRoughness"]


@pytest.mark.parametrize(
    "values",
    [lambda p: p[:, :2], lambda p: p[:-1], lambda p: p.sum(), lambda p: {"gloss": p[:, 0]}, lambda p: {"color": p * np.nan}, lambda p: None],
)
def test_wrong_values_of_a_function(values):
    vertices, faces = ball(8)
    with pytest.raises(kiln.Error) as caught:
        kiln.to_glb(vertices, faces, faces_target=100, texture_size=64, sample=values)
    assert caught.value.parameter == "sample"


@pytest.mark.parametrize(
    "maps",
    [
        {"color": 255 * np.ones((4, 4, 3))},
        {"color": np.full((4, 4, 3), np.nan)},
        {"normal": -np.ones((4, 4, 3))},
        {"color": np.ones((4, 4, 4))},
        {"roughness": np.ones((4, 4, 3))},
        {"color": np.ones((4, 4))},
    ],
)
def test_numbers_that_no_picture_holds(maps):
    """They came out white, black, or without some of their channels."""
    vertices, faces = ball(4)
    low = kiln.unwrap(vertices, faces, size=64)
    with pytest.raises(kiln.Error) as caught:
        kiln.pack_glb(low, maps)
    assert caught.value.code in ("array-range", "array-shape") and caught.value.parameter == "maps"
    ((name, pixels),) = maps.items()
    values = pixels.reshape(-1, pixels.shape[2] if pixels.ndim == 3 else 1)[:1]
    for how in ({"faces_target": 100}, {"max_error": 20}):
        with pytest.raises(kiln.Error) as caught:
            kiln.to_glb(
                vertices, faces, texture_size=64, maps="normal", sample=lambda p: {name: np.tile(values, (len(p), 1))}, **how
            )
        assert caught.value.parameter == "sample"


def test_pictures_of_a_source_are_in_range_too(low):
    for picture in (np.full((4, 4, 3), 200.0), (np.full((4, 4, 3), -1.0), "normal")):
        with pytest.raises(kiln.Error) as caught:
            kiln.bake(low, low, size=16, maps="color", textures={"color": picture})
        assert (caught.value.code, caught.value.parameter) == ("array-range", "textures")
    light = kiln.bake(low, low, size=16, maps="color", textures={"color": (np.full((4, 4, 3), 3.0), "linear")})
    np.testing.assert_allclose(light["color"], 3)


def test_with_a_plan_a_function_is_sampled_as_maps_are():
    vertices, faces = ball(12)
    counts = []

    def field(points):
        counts.append(len(points))
        return colors_of(points)

    for samples in (1, 2):
        kiln.to_glb(vertices, faces, texture_size=64, max_error=10, maps="normal", sample=field, samples=samples, match="ray")
    # Charts and sizes are about alike, and each texel has four places.
    assert 3 < counts[1] / counts[0] < 5


def document_of(data):
    return json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])


def binary_of(data):
    return data[20 + int.from_bytes(data[12:16], "little") :]


def with_document(data, document):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = binary_of(data)
    return b"glTF" + b"".join(n.to_bytes(4, "little") for n in (2, 20 + len(text) + len(rest), len(text))) + b"JSON" + text + rest


#: Slopes along u and v of each channel of each picture, so that each map can be told from all others.
SLOPES = {
    "color": [(0.5, 0.1), (0.0, 0.6), (0.3, 0.3)],
    "ao": [(0.4, 0.0)],
    "roughness": [(0.3, 0.5)],
    "metallic": [(0.1, 0.7)],
    "emission": [(0.6, 0.2), (0.2, 0.0), (0.0, 0.5)],
}
FACTORS = {"baseColorFactor": [0.5, 0.75, 1, 1], "roughnessFactor": 0.5, "metallicFactor": 0.8}
SHINE, STRENGTH = [1, 0.5, 0.25], 3


@pytest.fixture(scope="module")
def pbr():
    """A GLB of a waving sheet whose material has all pictures and factors."""
    vertices, faces, uvs = sheet(16, waves)
    v, u = (np.mgrid[0:64, 0:64] + 0.5) / 64
    v = 1 - v
    maps = {name: np.stack([0.2 + a * u + b * v for a, b in slopes], 2) for name, slopes in SLOPES.items()}
    # Bytes of a fold that is not there, by a normal map.
    maps["normal"] = np.tile(np.array([0.8, 0.5, 0.9]), (64, 64, 1))
    made = kiln.pack_glb(kiln.Mesh(vertices, faces, uvs, name="waves"), {k: m.astype(np.float32) for k, m in maps.items()}).data
    document = document_of(made)
    (material,) = document["materials"]
    material["pbrMetallicRoughness"].update(FACTORS)
    material["emissiveFactor"] = SHINE
    material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": STRENGTH}}
    document["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    return with_document(made, document)


def linear(values):
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def test_materials_reach_a_glb_unasked_as_in_the_command(pbr, tmp_path, command):
    (tmp_path / "waves.glb").write_bytes(pbr)
    command("bake", tmp_path / "waves.glb", "--faces", 100, "--size", 64, "--out", tmp_path / "its.glb", "--quiet")
    its = (tmp_path / "its.glb").read_bytes()
    for source in (pbr, tmp_path / "waves.glb"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ours = kiln.to_glb(source, faces_target=100, texture_size=64)
        assert list(ours.maps) == ["normal", "ao", "color", "roughness", "metallic", "emission"]
        assert binary_of(its) == binary_of(ours.data)
        (mine,), (yours,) = (document_of(data)["materials"] for data in (ours.data, its))
        assert {**mine, "name": ""} == {**yours, "name": ""}
        assert mine["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] == pytest.approx(ours.emission_strength)


def trimesh_of(data):
    """As trimesh loads it."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("PIL")
    return trimesh.load(trimesh.util.wrap_as_stream(data), file_type="glb", force="mesh")


FACES = {"faces_target": 100}


@pytest.mark.parametrize("mode", ["BLEND", "MASK", "OPAQUE"])
def test_looks_of_materials_reach_a_glb_as_in_the_command(mode, pbr, tmp_path, command):
    """What is 0.4 opaque is not there where it is masked."""
    document = document_of(pbr)
    (material,) = document["materials"]
    material |= {"alphaMode": mode, "doubleSided": True}
    material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 0.4]
    (tmp_path / "waves.glb").write_bytes(with_document(pbr, document))
    command("bake", tmp_path / "waves.glb", "--faces", 100, "--size", 64, "--out", tmp_path / "its.glb", "--quiet")
    by = {"faces_target": 100, "texture_size": 64}
    ours = kiln.to_glb(tmp_path / "waves.glb", **by)
    (mine,), (yours,) = (document_of(data)["materials"] for data in (ours.data, (tmp_path / "its.glb").read_bytes()))
    assert {**mine, "name": ""} == {**yours, "name": ""}
    assert mine["doubleSided"] and mine.get("alphaMode", "OPAQUE") == mode
    (said,) = document_of(kiln.to_glb(tmp_path / "waves.glb", alpha="blend", double_sided=False, **by).data)["materials"]
    assert "doubleSided" not in said and said.get("alphaMode", "OPAQUE") == ("OPAQUE" if mode == "OPAQUE" else "BLEND")


LOOKS = [
    {"alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": True},
    {"alphaMode": "OPAQUE"},
    {"alphaMode": "BLEND"},
    {"alphaMode": "MASK", "alphaCutoff": 0.75},
    {},
]


def with_materials(data, looks, opacity=0.4):
    """The mesh of a GLB once for each of several materials, side by side."""
    document = document_of(data)
    (material,) = document["materials"]
    material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, opacity]
    (mesh,) = document["meshes"]
    (primitive,) = mesh["primitives"]
    n = range(len(looks))
    document["materials"] = [{**material, "doubleSided": False, **look, "name": f"material {i}"} for i, look in enumerate(looks)]
    document["meshes"] = [{"primitives": [{**primitive, "material": i}]} for i in n]
    document["nodes"] = [{"mesh": i, "translation": [0, 0, 2.0 * i]} for i in n]
    document["scenes"] = [{"nodes": list(n)}]
    return with_document(data, document)


def looks_of(data):
    return {
        material["name"]: (
            material.get("alphaMode", "OPAQUE"),
            round(material["alphaCutoff"], 4) if "alphaCutoff" in material else None,
            material.get("doubleSided", False),
        )
        for material in document_of(data)["materials"]
    }


def test_several_materials_keep_their_looks_as_in_the_command(pbr, tmp_path, command):
    """One that blended made all blend, every mask was cut at 0.5, one that showed back faces made all show them."""
    file, its = tmp_path / "waves.glb", tmp_path / "its.glb"
    file.write_bytes(with_materials(pbr, LOOKS))
    command("bake", file, "--faces", 500, "--size", 128, "--sets", "one", "--out", its, "--quiet")
    by = {"faces_target": 500, "texture_size": 128}
    ours = kiln.to_glb(file, **by)
    asked = {f"material {i}": (look.get("alphaMode", "OPAQUE"), look.get("alphaCutoff"), "doubleSided" in look) for i, look in enumerate(LOOKS)}
    assert looks_of(its.read_bytes()) == asked
    assert looks_of(ours.data) == asked
    assert len(ours.faces) == len(ours.mesh.faces) and len(ours.normals) == len(ours.vertices)
    # What is said goes before what materials say, but a mask has its own cutoff.
    blended = looks_of(kiln.to_glb(file, alpha="blend", double_sided=False, **by).data)
    assert blended == {name: ("BLEND", None, False) for name in asked}
    masked = looks_of(kiln.to_glb(file, alpha="mask", **by).data)
    assert [masked[name] for name in sorted(asked)] == [("MASK", c, c == 0.3) for c in (0.3, 0.5, 0.5, 0.75, 0.5)]
    # A function's own opacity is all materials'.
    own = kiln.to_glb(file, sample=lambda p: np.full((len(p), 4), 0.5), **by)
    assert {look[:2] for look in looks_of(own.data).values()} == {("BLEND", None)}
    # Without opacity nothing is cut out.
    shape = kiln.to_glb(file, maps="normal", **by)
    assert looks_of(shape.data) == {name: ("OPAQUE", None, sides) for name, (_, _, sides) in asked.items()}


def test_what_is_inside_of_glass_stays(tmp_path):
    """It was left out as hidden."""
    (outer, faces), (inner, _) = ball(12), ball(12)
    shape = np.concatenate([outer, 0.5 * inner]), np.concatenate([faces, faces + len(outer)])
    made = kiln.pack_glb(kiln.unwrap(shape, size=64), {"color": np.ones((1, 1, 3))}).data
    document = document_of(made)
    clear = {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.3]}}
    for material, seen in (clear, True), ({}, False):
        document["materials"] = [material]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            glb = kiln.to_glb(with_document(made, document), faces_target=400, texture_size=64)
        assert (np.linalg.norm(glb.mesh.vertices, axis=1).min() < 0.6) == seen


@pytest.mark.parametrize("mode", ["BLEND", "MASK", "OPAQUE"])
def test_alpha_of_vertex_colours_counts_where_the_material_says_so(mode, tmp_path, command):
    """It was dropped without a word, here and in the command's GLB."""
    vertices, faces = ball(8)
    colors = np.full((len(vertices), 4), 0.25)
    made = kiln.pack_glb(kiln.unwrap(kiln.Mesh(vertices, faces, colors=colors), size=64), {}).data
    document = document_of(made)
    assert "COLOR_0" in document["meshes"][0]["primitives"][0]["attributes"]
    document["materials"] = [{"name": "veil", "alphaMode": mode}]
    file, its = tmp_path / "veil.glb", tmp_path / "its.glb"
    file.write_bytes(with_document(made, document))
    command("bake", file, "--faces", 100, "--size", 64, "--out", its, "--quiet")
    glb = kiln.to_glb(file, faces_target=100, texture_size=64)
    assert looks_of(glb.data) == looks_of(its.read_bytes()) == {"veil": (mode, 0.5 if mode == "MASK" else None, False)}
    assert binary_of(glb.data) == binary_of(its.read_bytes())
    assert ("opacity" in glb.maps) == (mode != "OPAQUE")
    if mode != "OPAQUE":
        np.testing.assert_allclose(glb.maps["opacity"][glb.bake.coverage == 1], 64 / 255, atol=1e-6)


def test_colours_of_vertices_end_where_a_picture_has_them(tmp_path):
    """`_COLOR_0`, which no renderer reads, was a quarter of the bytes of compressed triangles."""
    vertices, faces = ball(16)
    high = kiln.Mesh(vertices, faces, colors=np.full((len(vertices), 3), 0.25))
    file, low = tmp_path / "high.glb", tmp_path / "low.glb"
    made = kiln.pack_glb(kiln.unwrap(high, size=64), {}).data
    file.write_bytes(made)

    def colors_of(out, **options):
        kiln.run(high=file, size=64, out=out, **options)
        keys = document_of(out.read_bytes())["meshes"][0]["primitives"][0]["attributes"]
        return [key for key in keys if "COLOR" in key]

    assert colors_of(tmp_path / "a.glb", faces=200, maps="normal") == ["COLOR_0"]
    for options in {}, {"mesh_compression": "meshopt"}, {"mesh_compression": "draco"}:
        assert colors_of(tmp_path / "b.glb", faces=200, maps=["normal", "color"], **options) == []
    # A plan by bytes counts what is written.
    assert colors_of(tmp_path / "c.glb", max_bytes="20K", maps="normal") == ["COLOR_0"]
    assert colors_of(tmp_path / "d.glb", max_bytes="20K", maps=["normal", "color"]) == []
    for name in "cd":
        assert (tmp_path / f"{name}.glb").stat().st_size <= 20_000
    # Those of a given low poly may be its author's masks.
    low.write_bytes(made)
    assert colors_of(tmp_path / "e.glb", low=low, maps=["normal", "color"]) == ["_COLOR_0"]


def test_alpha_of_vertex_colours_without_a_material_is_told():
    vertices, faces = ball(8)
    by = {"colors": np.full((len(vertices), 4), 0.25), "faces_target": 100, "texture_size": 64}
    with pytest.warns(kiln.KilnWarning, match="vertex colours have alpha, which is ignored") as told:
        assert "opacity" not in kiln.to_glb(vertices, faces, **by).maps
    assert [w.message.code for w in told if isinstance(w.message, kiln.KilnWarning)] == ["opacity-left-out"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        glb = kiln.to_glb(vertices, faces, maps=["color", "opacity"], **by)
    assert looks_of(glb.data) == {"mesh": ("MASK", 0.5, False)}


@pytest.mark.parametrize(
    "how, source, strength",
    [
        (FACES, bytes, STRENGTH),
        ({"max_error": 1, "match": "closest", "samples": 1}, bytes, STRENGTH),
        (FACES, trimesh_of, 1),  # it knows no strength of emission
    ],
    ids=["faces", "plan", "trimesh"],
)
def test_maps_of_materials_are_the_pictures_times_the_factors(pbr, how, source, strength):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        glb = kiln.to_glb(source(pbr), texture_size=64, **how)
    covered = glb.bake.coverage == 1
    size = len(covered)
    points = kiln.match(pbr, glb.mesh, size=size, match="closest").position[covered]
    wanted = {
        name: np.stack([0.2 + a * points[:, 0] + b * points[:, 1] for a, b in slopes], 1) for name, slopes in SLOPES.items()
    }
    got = {name: glb.maps[name][covered] for name in glb.maps}
    # Bytes of the picture and slopes of at most 0.8 over half a texel of it, with borders, which repeat, left aside.
    inside = (np.abs(points[:, :2] - 0.5) < 0.45).all(1)
    near = {"atol": 0.012}
    np.testing.assert_allclose(got["roughness"][inside], 0.5 * wanted["roughness"][inside], **near)
    np.testing.assert_allclose(got["metallic"][inside], 0.8 * wanted["metallic"][inside], **near)
    factors = np.array(FACTORS["baseColorFactor"][:3])
    np.testing.assert_allclose(linear(got["color"])[inside], (factors * linear(wanted["color"]))[inside], **near)
    light = strength * np.array(SHINE) * linear(wanted["emission"])
    np.testing.assert_allclose(glb.emission_strength * linear(got["emission"])[inside], light[inside], atol=3 * near["atol"])
    # The lesser of both: the sheet itself is open to the sky.
    assert (got["ao"][inside, 0] <= wanted["ao"][inside, 0] + near["atol"]).all()
    flat = kiln.bake(kiln.Mesh(*sheet(16, waves)), glb.mesh, size=size)["normal"][covered]
    tilt = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", flat * 2 - 1, got["normal"] * 2 - 1), -1, 1)))
    # (0.6, 0, 0.8) is 36.9 degrees from the shape's own normal.
    assert abs(np.median(tilt[inside]) - 36.87) < 1


def test_maps_of_materials_that_are_asked_for(pbr):
    by = {"faces_target": 100, "texture_size": 64}
    all_of_them = kiln.to_glb(pbr, **by)
    some = kiln.to_glb(pbr, maps=["roughness", "emission"], **by)
    assert list(some.maps) == ["roughness", "emission"] and some.emission_strength == all_of_them.emission_strength
    for name, pixels in some.maps.items():
        np.testing.assert_array_equal(pixels, all_of_them.maps[name])
    assert list(kiln.to_glb(pbr, maps=["normal"], **by).maps) == ["normal"]
    sampled = kiln.to_glb(pbr, maps=["normal", "metallic"], sample=lambda p: {"metallic": np.full(len(p), 0.5)}, **by)
    assert (sampled.maps["metallic"][sampled.bake.coverage == 1] == 0.5).all()
    with pytest.raises(kiln.Error) as caught:
        kiln.to_glb(*ball(4), maps=["roughness"], **by)
    assert caught.value.parameter == "transfer"
    baked = kiln.bake(pbr, all_of_them.mesh, size=64, transfer=["mtl:roughness", "mtl:metallic"])
    assert list(baked) == ["normal", "roughness", "metallic"]
    with pytest.warns(kiln.KilnWarning, match="dust"):
        file = baked.save(tempfile.mkdtemp(), format="png8")[1]
        kiln.to_glb(pbr, maps=["normal"], transfer=f"{file}:dust", **by)


def test_materials_that_lack_a_value_are_the_default_without_a_word(tmp_path):
    kiln.Mesh(*ball(6)).save(tmp_path / "plain.obj")
    lines = (tmp_path / "plain.obj").read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("f "))
    lines[first:first] = ["mtllib two.mtl", "usemtl rough"]
    lines.insert(-200, "usemtl bare")
    (tmp_path / "two.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "two.mtl").write_text("newmtl rough\nPr 0.25\nnewmtl bare\nillum 2\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        glb = kiln.to_glb(tmp_path / "two.obj", faces_target=100, texture_size=64)
    assert "material-value" not in {w["code"] for w in glb.bake.report.warnings}
    rough = glb.maps["roughness"][glb.bake.coverage == 1]
    assert np.isclose(rough, 0.25, atol=0.01).any() and np.isclose(rough, 1, atol=0.01).any()
    with pytest.warns(kiln.KilnWarning) as caught:
        kiln.to_glb(tmp_path / "two.obj", faces_target=100, texture_size=64, maps=["roughness"])
    assert "material-value" in {w.message.code for w in caught}
    (tmp_path / "two.mtl").unlink()
    assert list(kiln.to_glb(tmp_path / "two.obj", faces_target=100, texture_size=64, maps=["normal"]).maps) == ["normal"]
    with pytest.warns(kiln.KilnWarning, match="two.mtl"):
        assert list(kiln.to_glb(tmp_path / "two.obj", faces_target=100, texture_size=64).maps) == ["normal", "ao"]


def test_options_that_would_do_nothing_are_refused(tmp_path):
    vertices, faces = ball(4)
    for options, parameter in (
        ({"faces_target": 50, "max_error": 5}, "faces_target"),
        ({"path": tmp_path / "ball.gltf"}, "path"),
        ({"path": tmp_path / "ball.obj"}, "path"),
    ):
        with pytest.raises(kiln.Error) as caught:
            kiln.to_glb(vertices, faces, texture_size=64, **options)
        assert caught.value.parameter == parameter
    assert not list(tmp_path.iterdir())


def test_numbers_of_numpy_are_numbers():
    vertices, faces = ball(6)
    by = {"texture_size": 64, "maps": "normal"}
    mine = kiln.to_glb(vertices, faces, max_error=np.float32(8), screen=np.int64(100), device=0, **by)
    assert mine.data == kiln.to_glb(vertices, faces, max_error=8.0, screen="100px", device="0", **by).data
    with pytest.raises(kiln.Error, match="index or part of a name"):
        kiln.to_glb(vertices, faces, device=0.5, **by)
    with kiln.Source((vertices, faces)) as source, pytest.raises(kiln.Error, match="property of the source"):
        kiln.match(source, mine.mesh, size=64, device=0)


def test_a_mesh_inside_out_is_told():
    vertices, faces = ball(8)
    with pytest.warns(kiln.KilnWarning) as caught:
        kiln.to_glb(vertices * [-1, 1, 1], faces, faces_target=100, texture_size=64, maps="normal")
    assert "faces-inwards" in {w.message.code for w in caught}


def test_exceptions_of_a_function_come_through():
    class Mine(Exception):
        pass

    def fail(points):
        raise Mine

    with pytest.raises(Mine):
        kiln.to_glb(*ball(8), faces_target=100, texture_size=64, sample=fail)


def test_to_glb_writes_the_file_and_tells_progress(tmp_path):
    told = []
    glb = kiln.to_glb(
        *ball(16), faces_target=200, texture_size=128, maps="normal", path=tmp_path / "ball.glb", progress=lambda *t: told.append(t)
    )
    assert (tmp_path / "ball.glb").read_bytes() == glb.data
    shares = [done for done, stage in told]
    assert shares == sorted(shares) and shares[-1] <= 1
    with pytest.raises(kiln.Error, match="curvature"):
        kiln.to_glb(*ball(4), maps=["curvature"])
    with pytest.raises(TypeError, match="did you mean samples"):
        kiln.to_glb(*ball(4), smaples=2)


@pytest.mark.parametrize(
    "call",
    [
        lambda told: kiln.simplify(*ball(6), target=50, progress=told),
        lambda told: kiln.unwrap(*ball(6), size=64, progress=told),
        lambda told: kiln.clean(*ball(6), progress=told),
        lambda told: kiln.contour(np.random.default_rng(1).random((8, 8, 8)), 0.5, progress=told),
        lambda told: kiln.volume(np.random.default_rng(1).random((8, 8, 8)), 0.5, size=64, progress=told),
        lambda told: kiln.measure(ball(6), ball(4), size=16, views=2, progress=told),
        lambda told: kiln.render(ball(4), size=16, progress=told),
        lambda told: kiln.bake(ball(6), kiln.unwrap(*ball(4), size=64), size=16, progress=told),
        lambda told: kiln.to_glb(*ball(6), faces_target=50, texture_size=64, maps="normal", progress=told),
        lambda told: kiln.to_glb(*ball(6), max_error=20, texture_size=64, maps="normal", progress=told),
    ],
)
@pytest.mark.filterwarnings("ignore::kiln.KilnWarning")
def test_bars_reach_their_end(call):
    told = []
    call(lambda *heard: told.append(heard))
    assert told[-1] == (1.0, "done")


def test_the_command_makes_the_same_low_poly_and_maps(tmp_path, command):
    kiln.Mesh(*ball(24)).save(tmp_path / "ball.obj")
    command("bake", tmp_path / "ball.obj", "--faces", 300, "--size", 128, "--out", tmp_path / "its.glb", "--maps", "normal,ao", "--quiet")
    ours = kiln.to_glb(tmp_path / "ball.obj", faces_target=300, texture_size=128, path=tmp_path / "ours.glb")
    its = (tmp_path / "its.glb").read_bytes()
    assert binary_of(its) == binary_of(ours.data)  # all but the names in the document


def head_of(data):
    return json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])


def pictures_of(data):
    head = head_of(data)
    start = 28 + int.from_bytes(data[12:16], "little")
    views = [head["bufferViews"][image["bufferView"]] for image in head["images"]]
    return {
        image["name"]: (image["mimeType"], data[start + view["byteOffset"] :][: view["byteLength"]])
        for image, view in zip(head["images"], views, strict=True)
    }


def test_encodings_reach_a_glb():
    """Pictures by another decoder, and arrays of packed triangles."""
    image = pytest.importorskip("PIL.Image")
    import io

    vertices, faces = ball(16)
    how = {"faces_target": 300, "texture_size": 64, "maps": ["normal", "ao"], "ao_rays": 8}
    plain = kiln.to_glb(vertices, faces, **how)
    exact = {name: np.array(image.open(io.BytesIO(data))) for name, (_, data) in pictures_of(plain.data).items()}
    webp = kiln.to_glb(vertices, faces, format="webp", quality=60, normal_error=2, mesh_compression="meshopt", **how)
    assert head_of(webp.data)["extensionsRequired"] == [
        "EXT_texture_webp",
        "EXT_meshopt_compression",
        "KHR_mesh_quantization",
    ]
    assert len(webp.data) < 0.7 * len(plain.data)
    for name, (mime, data) in pictures_of(webp.data).items():
        assert mime == "image/webp"
        shown = np.array(image.open(io.BytesIO(data)).convert("RGB"))
        assert np.abs(shown.astype(int) - exact[name]).mean() < 6
    assert len(webp.faces) == len(plain.faces)
    assert webp.vertices.shape == plain.vertices.shape
    both = kiln.to_glb(vertices, faces, format="webp", fallback_textures=True, dither=False, **how)
    assert "extensionsRequired" not in head_of(both.data)
    with pytest.raises(kiln.Error, match="quality"):
        kiln.to_glb(vertices, faces, quality=60, **how)


def test_a_glb_stays_within_bytes():
    vertices, faces = ball(32)
    how = {"texture_size": 128, "maps": ["normal", "ao"], "ao_rays": 8}
    small = kiln.to_glb(vertices, faces, max_bytes=20_000, **how)
    assert len(small.data) <= 20_000
    assert kiln.to_glb(vertices, faces, max_bytes="20K", **how).data == small.data
    large = kiln.to_glb(vertices, faces, max_bytes="60K", **how)
    assert len(small.data) < len(large.data) <= 60_000
    fixed = kiln.to_glb(vertices, faces, max_bytes="60K", faces_target=300, **how)
    assert len(fixed.faces) <= 300 and len(fixed.data) <= 60_000
    for bad in (0, -1, "few", 900):
        with pytest.raises(kiln.Error, match="max.bytes"):
            kiln.to_glb(vertices, faces, max_bytes=bad, **how)


def test_simplify_and_unwrap_take_arrays():
    low = kiln.simplify(*ball(16), target=200)
    assert isinstance(low, kiln.Mesh) and len(low.faces) == 200 == low.report["faces"]
    laid = kiln.unwrap(low, size=128)
    assert laid.report["charts"] >= 1 and laid.uvs.min() >= 0 and laid.uvs.max() <= 1
    assert len(kiln.simplify(*ball(16), max_error=0.01).faces) < 3072
    with pytest.raises(kiln.Error):
        kiln.simplify(*ball(4), target=10, keep_uvs=True)
    with pytest.raises(kiln.Error):
        kiln.unwrap(low, method="patches")


def test_trimesh_objects():
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = ball(8)
    colored = trimesh.Trimesh(vertices, faces, process=False, vertex_colors=(255 * colors_of(vertices)).astype(np.uint8))
    mesh = kiln.as_mesh(colored)
    assert len(mesh.faces) == len(faces) and mesh.colors.shape == (len(vertices), 4)
    high, flat, uvs = sheet(4, waves)
    textured = trimesh.Trimesh(high, flat, process=False, visual=trimesh.visual.TextureVisuals(uv=uvs))
    np.testing.assert_allclose(kiln.as_mesh(textured).uvs, uvs, atol=1e-7)
    glb = kiln.to_glb(colored, faces_target=100, texture_size=64, maps=["color"])
    again = trimesh.load(trimesh.util.wrap_as_stream(glb.data), file_type="glb", force="mesh")
    assert len(again.faces) == len(glb.faces)
    # trimesh turns v round, so that both have the origin at the lower left.
    np.testing.assert_allclose(again.visual.uv, glb.uvs, atol=1e-6)
    assert len(kiln.as_mesh(trimesh.Scene(colored)).faces) == len(faces)


@pytest.mark.no_device
def test_what_is_not_taken_of_trimesh_objects_is_told():
    trimesh = pytest.importorskip("trimesh")
    vertices, faces, uvs = sheet(4, waves)

    def codes(visual):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            kiln.as_mesh(trimesh.Trimesh(vertices, faces, process=False, visual=visual))
        return [w.message.code for w in caught if hasattr(w.message, "code")]

    visual = trimesh.visual
    red = visual.material.PBRMaterial(baseColorFactor=[255, 0, 0, 255])
    many = visual.material.MultiMaterial([red, red])
    assert codes(visual.TextureVisuals(uv=uvs)) == []
    assert codes(visual.TextureVisuals(uv=uvs, material=red)) == []
    assert codes(visual.TextureVisuals(uv=uvs, material=many)) == ["material-left-out"]
    painted = visual.TextureVisuals(uv=uvs, material=red)
    painted.vertex_attributes["color"] = np.full((len(vertices), 4), 9, np.uint8)
    assert codes(painted) == ["colors-left-out"]
    assert codes(visual.ColorVisuals(vertex_colors=np.full((len(vertices), 4), 9, np.uint8))) == []
    assert codes(visual.ColorVisuals(face_colors=np.full((len(faces), 4), 9, np.uint8))) == ["colors-left-out"]
    image = pytest.importorskip("PIL.Image").new("RGB", (8, 8))
    for bare in (visual.material.PBRMaterial(baseColorTexture=image), visual.material.SimpleMaterial(image=image)):
        assert codes(visual.TextureVisuals(material=bare)) == ["material-left-out"]


@pytest.mark.parametrize("kind", ["pbr", "simple", "simple with a colour", "plain", "one texel"])
def test_materials_of_trimesh_objects(kind):
    trimesh = pytest.importorskip("trimesh")
    picture = pytest.importorskip("PIL.Image")
    vertices, faces, uvs = sheet(16, waves)
    v, u = (np.mgrid[0:64, 0:64] + 0.5) / 64
    pixels = np.uint8(255 * np.stack([0.2 + 0.6 * u, 0.9 - 0.7 * v, 0.3 + 0.3 * u], 2) + 0.5)  # row 0 is v = 1
    image = picture.fromarray(pixels)
    materials = trimesh.visual.material
    factor = np.ones(3)
    if kind == "pbr":
        material = materials.PBRMaterial(baseColorTexture=image, roughnessFactor=0.25, metallicFactor=0)
    elif kind == "simple":
        material = materials.SimpleMaterial(image=image)
    elif kind == "simple with a colour":
        material = materials.SimpleMaterial(image=image, diffuse=[255, 128, 64, 255])
        factor = np.array([255, 128, 64]) / 255
    elif kind == "plain":
        material = materials.PBRMaterial(baseColorFactor=[255, 128, 64, 255])
        pixels[:], factor = 255, np.array([255, 128, 64]) / 255
    else:
        pixels[:] = 200, 100, 50
        material = materials.SimpleMaterial(image=picture.fromarray(pixels[:2, :2]))
    far = np.array([1e6, 0, 0]) if kind == "pbr" else np.zeros(3)
    mesh = trimesh.Trimesh(
        vertices + far, faces, process=False, visual=trimesh.visual.TextureVisuals(uv=uvs, material=material)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        glb = kiln.to_glb(mesh, texture_size=64, faces_target=100)
    covered = glb.bake.coverage == 1
    places = kiln.match(mesh, glb.mesh, size=64).position[covered] - far
    inside = (np.abs(places[:, :2] - 0.5) < 0.45).all(1)
    # The texture looked up, between its texels.
    x, y = 64 * places[inside, 0] - 0.5, 64 * (1 - places[inside, 1]) - 0.5
    column, row = x.astype(int), y.astype(int)
    a, b = (x - column)[:, None], (y - row)[:, None]
    light = linear(pixels / 255)
    rows = [(1 - a) * light[row + k, column] + a * light[row + k, column + 1] for k in (0, 1)]
    wanted = factor * ((1 - b) * rows[0] + b * rows[1])
    np.testing.assert_allclose(linear(glb.maps["color"][covered][inside]), wanted, atol=0.01)
    roughness = glb.maps["roughness"][covered]
    assert np.allclose(roughness, 0.25 if kind == "pbr" else 1, atol=0.01) and ("metallic" in glb.maps) == (kind == "plain")


@pytest.mark.no_device
def test_materials_of_low_polys_are_not_asked():
    trimesh = pytest.importorskip("trimesh")
    vertices, faces, uvs = sheet(4, waves)
    red = trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 0, 0, 255])
    mesh = trimesh.Trimesh(vertices, faces, process=False, visual=trimesh.visual.TextureVisuals(uv=uvs, material=red))
    assert kiln.as_mesh(mesh).material_names and not kiln.as_mesh(mesh, "low").material_names


def test_bytes_of_a_file_need_no_temporary_file(tmp_path, monkeypatch):
    low = kiln.unwrap(*ball(2), size=64)
    glb = kiln.pack_glb(low, {"color": np.full((4, 4, 3), 0.25)}).data
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    mesh = kiln.as_mesh(glb)
    assert kiln.bake(mesh, mesh, size=16, maps=["color"])["color"].max() == pytest.approx(0.0513, abs=1e-3)  # linear
    assert kiln.to_glb(glb, faces_target=100, texture_size=64).data
    assert kiln.as_mesh(pickle.loads(pickle.dumps(mesh))).material_names == mesh.material_names


def test_arrays_of_primitives_with_16_bit_indices_are_joined():
    """Two primitives of 40,000 vertices: faces of the second begin at 40,000. The second alone has tangents."""
    count = 40000
    arrays = {
        "POSITION": np.zeros((count, 3), np.float32),
        "NORMAL": np.tile(np.array([0, 0, 1], np.float32), (count, 1)),
        "TEXCOORD_0": np.zeros((count, 2), np.float32),
        "TANGENT": np.tile(np.array([1, 0, 0, -1], np.float32), (count, 1)),
        "indices": np.array([[0], [count - 1], [1]], np.uint16),
    }
    views, accessors, body = [], [], b""
    for array in arrays.values():
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": array.nbytes})
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[array.shape[1]]
        component = 5123 if array.dtype == np.uint16 else 5126
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind})
        body += array.tobytes() + bytes(-array.nbytes % 4)
    bare = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}
    primitives = [{"attributes": bare, "indices": 4}, {"attributes": bare | {"TANGENT": 3}, "indices": 4}]

    def joined(some):
        document = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                    "meshes": [{"primitives": some}], "accessors": accessors, "bufferViews": views,
                    "buffers": [{"byteLength": len(body)}]}
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        chunks = len(text).to_bytes(4, "little") + b"JSON" + text + len(body).to_bytes(4, "little") + b"BIN\0" + body
        return kiln._glb.arrays_of(b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks)

    both = joined(primitives)
    assert both["faces"].tolist() == [[0, count - 1, 1], [count, 2 * count - 1, count + 1]]
    assert both["tangents"].shape == (2 * count, 4)
    assert (both["tangents"][:count] == 0).all() and (both["tangents"][count:] == [1, 0, 0, -1]).all()
    assert joined(primitives[:1])["tangents"].shape == (0, 4)


def test_arrays_are_in_the_scene_space_of_turned_and_stretched_nodes(tmp_path):
    """Nodes stay as the file has them; a plane z = x through them is a plane, and its normal known."""
    vertices, faces, uvs = sheet(8, lambda x, y: x)
    made = kiln.pack_glb(kiln.Mesh(vertices, faces, uvs, name="ramp"), {"color": np.full((2, 2, 3), 0.5)}).data
    document = document_of(made)
    half = np.radians(15)
    stretch = np.array([1, 2, 3.0])
    (index,) = document["scenes"][0]["nodes"]
    document["nodes"].append({"children": [index], "rotation": [np.sin(half), 0, 0, np.cos(half)], "translation": [5, 0, 1]})
    document["nodes"][index]["scale"] = stretch.tolist()
    document["scenes"][0]["nodes"] = [len(document["nodes"]) - 1]
    (tmp_path / "ramp.glb").write_bytes(with_document(made, document))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        glb = kiln.to_glb(tmp_path / "ramp.glb", faces_target=20, texture_size=64, maps=["normal"])
    assert any("matrix" in node for node in document_of(glb.data)["nodes"])
    turn = np.array([[1, 0, 0], [0, np.cos(2 * half), -np.sin(2 * half)], [0, np.sin(2 * half), np.cos(2 * half)]])
    corners = (np.array([[0, 0, 0], [1, 0, 1], [0, 1, 0]]) * stretch) @ turn.T + [5, 0, 1]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    np.testing.assert_allclose((glb.vertices - corners[0]) @ normal, 0, atol=1e-5)
    np.testing.assert_allclose(glb.normals @ normal, 1, atol=1e-4)
    np.testing.assert_allclose(glb.tangents[:, :3] @ normal, 0, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(glb.tangents[:, :3], axis=1), 1, atol=1e-5)
    a, b, c = (glb.vertices[glb.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a) @ normal > 0).all()


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (2, -1, 3), (-1, -2, 1)])
def test_arrays_of_mirrored_nodes_keep_their_outside_and_their_tangents(scale):
    """Faces look along their normals, and tangents and bitangents point where u and v grow."""
    vertices, faces, uvs = sheet(4, waves)
    made = kiln.pack_glb(kiln.Mesh(vertices, faces, uvs), {"normal": np.full((2, 2, 3), [0.5, 0.5, 1])}, double_sided=True).data
    document = document_of(made)
    (index,) = document["scenes"][0]["nodes"]
    document["nodes"][index]["scale"] = list(scale)
    arrays = kiln._glb.arrays_of(with_document(made, document))
    assert (arrays["vertices"].max(axis=0)[:2] > 0).tolist() == [side > 0 for side in scale[:2]]
    corner = arrays["faces"][:, 0]
    along = [arrays["vertices"][arrays["faces"][:, k]] - arrays["vertices"][corner] for k in (1, 2)]
    (u1, v1), (u2, v2) = ((arrays["uvs"][arrays["faces"][:, k]] - arrays["uvs"][corner]).T[..., None] for k in (1, 2))
    area = u1 * v2 - u2 * v1
    grows_u, grows_v = (along[0] * v2 - along[1] * v1) / area, (along[1] * u1 - along[0] * u2) / area
    normals, tangents = arrays["normals"][corner], arrays["tangents"][corner]
    bitangents = tangents[:, 3:] * np.cross(normals, tangents[:, :3])
    for a, b in ((np.cross(*along), normals), (tangents[:, :3], grows_u), (bitangents, grows_v)):
        assert (np.einsum("ij,ij->i", a, b) > 0).all()


@pytest.mark.parametrize("samples", [1, 2])
def test_places_without_a_point_are_filled_from_the_others(samples):
    """HIGH lies over half of the map and half a texel more. Texels have the mean of the samples that found a point, and
    the others, far beyond the padding, have the colours of these."""
    vertices, faces, uvs = sheet(8, lambda x, y: 0 * x)
    high, low = kiln.Mesh(vertices * [64.5 / 128, 1, 1], faces), kiln.Mesh(vertices, faces, uvs)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = kiln.match(high, low, size=128, max_distance=0.01, samples=samples)
    assert found.samples == samples and 0.4 < (found.face < 0).mean() < 0.6
    color = kiln.sampled(found, lambda places: np.full((len(places), 3), 0.5), padding=4)["color"]
    np.testing.assert_allclose(color, 0.5, atol=1e-6)


def test_own_emission_has_a_strength_of_1(pbr):
    glow = kiln.to_glb(
        pbr, faces_target=100, texture_size=64, maps=["normal", "emission"], sample=lambda p: {"emission": np.full((len(p), 3), 0.5)}
    )
    assert glb_strength(glow.data) == glow.emission_strength == 1
    np.testing.assert_allclose(glow.maps["emission"][glow.bake.coverage == 1], 0.5)


def glb_strength(data):
    (material,) = document_of(data)["materials"]
    return material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)


def test_names_of_meshes_lead_nowhere():
    vertices, faces = ball(4)
    glb = kiln.to_glb(kiln.Mesh(vertices, faces, name="../a/b"), faces_target=50, texture_size=64, maps="normal")
    assert glb.mesh.name == ".._a_b"
