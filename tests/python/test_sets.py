"""Texture sets, height fields and match="auto"."""

import warnings

import numpy as np
import pytest
from conftest import sheet, waves
from test_glb import ball

import kiln


def tiled():
    """Two sheets beside each other, whose UVs lie in tiles 1001 and 1012, of the materials skin and a/b."""
    vertices, faces, uvs = sheet(4, lambda x, y: 0 * x)
    return kiln.Mesh(
        np.concatenate([vertices, vertices + [1, 0, 0]]),
        np.concatenate([faces, faces + len(vertices)]),
        np.concatenate([uvs, uvs + [1, 1]]),
        materials=np.repeat([0, 1], len(faces)),
        material_names=["skin", "a/b"],
        name="flat",
    )


def two_waves():
    vertices, faces, uvs = sheet(32, waves)
    return kiln.Mesh(np.concatenate([vertices, vertices + [1, 0, 0]]), np.concatenate([faces, faces + len(vertices)]))


@pytest.mark.parametrize("sets", ["udim", "material"])
def test_sets_are_the_commands(sets, tmp_path, command):
    low = tiled()
    if sets == "material":  # which share one square
        low = kiln.Mesh(
            low.vertices,
            low.faces,
            low.uvs - (np.arange(50) >= 25)[:, None],
            materials=low.materials,
            material_names=low.material_names,
            name="flat",
        )
    two_waves().save(tmp_path / "high.obj")
    low.save(tmp_path / "flat.obj")
    (tmp_path / "mine").mkdir()
    (tmp_path / "theirs").mkdir()
    # Through the files, so that both have the same floats.
    high, low = kiln.load(tmp_path / "high.obj"), kiln.load(tmp_path / "flat.obj")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # that the other sets have no UVs is no news
        baked = kiln.bake_sets(high, low, size=64, sets=sets, maps=["normal", "height"])
    assert list(baked) == (["1001", "1012"] if sets == "udim" else ["skin", "a/b"])
    files = [file for bake in baked.values() for file in bake.save(tmp_path / "mine", format="exr32")]
    command("bake", tmp_path / "high.obj", tmp_path / "flat.obj", "--size", 64, "--sets", sets, "--maps", "normal,height",
            "--clean", "none", "--format", "exr32", "--out", tmp_path / "theirs")  # fmt: skip
    for file in files:
        assert file.read_bytes() == (tmp_path / "theirs" / file.name).read_bytes(), file.name


def test_sets_whose_names_differ_in_case_have_their_own_files(tmp_path):
    low = tiled()
    uvs = low.uvs - (np.arange(50) >= 25)[:, None]
    low = kiln.Mesh(low.vertices, low.faces, uvs, materials=low.materials, material_names=["skin", "Skin"], name="flat")
    baked = kiln.bake_sets(two_waves(), low, size=16, sets="material")
    files = [file.name for bake in baked.values() for file in bake.save(tmp_path)]
    assert files == ["flat_skin_normal.png", "flat_Skin_2_normal.png"]


def test_sizes_of_sets():
    seen = []
    baked = kiln.bake_sets(
        two_waves(),
        tiled(),
        sets="udim",
        size={"1012": (32, 16)},
        progress=lambda done, stage: seen.append(done),
        gutter=2,
    )
    assert baked["1001"].coverage.shape == (2048, 2048) and baked["1012"].coverage.shape == (16, 32)
    assert seen == sorted(seen) and max(seen) <= 1
    with pytest.raises(kiln.Error, match="1012"):
        kiln.bake_sets(two_waves(), tiled(), sets="udim", size={"1002": 32})
    with pytest.raises(kiln.Error, match="auto, none, material"):
        kiln.bake_sets(two_waves(), tiled(), sets="tiles")


def test_sets_by_object():
    low = tiled()
    objects = np.repeat([0, 1], 32)
    uvs = low.uvs - (np.arange(50) >= 25)[:, None]
    low = kiln.Mesh(low.vertices, low.faces, uvs, objects=objects, object_names=["left", "right"])
    assert low.object_names == ["left", "right"] and (low.objects == objects).all()
    baked = kiln.bake_sets(two_waves(), low, size=32, sets="object")
    assert list(baked) == ["left", "right"] and all(bake.report.missed == 0 for bake in baked.values())


def test_one_set_is_a_bake(high, low):
    assert list(kiln.bake_sets(high, low, size=32)) == [""]
    np.testing.assert_array_equal(
        kiln.bake_sets(high, low, size=32)[""]["normal"], kiln.bake(high, low, size=32)["normal"]
    )


def test_height_field():
    n = 65
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(1, 0, n))
    field = kiln.height_field(0.02 * np.sin(2 * np.pi * x) + 0 * y, extent=(1, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        normal = 2 * kiln.bake(*field, size=64, gutter=0)["normal"] - 1
    u = (np.arange(64) + 0.5) / 64
    slope = -0.02 * 2 * np.pi * np.cos(2 * np.pi * u)
    # Cells are flat in x: a normal is that of some place within half a cell, 1/64; the slope changes by
    # 0.02 (2 pi)^2 / 128 over that.
    np.testing.assert_allclose(normal[..., 0] / normal[..., 2], np.broadcast_to(slope, (64, 64)), atol=0.0065)
    np.testing.assert_allclose(normal[..., 1], 0, atol=1e-6)


def test_height_field_of_a_file(tmp_path, command):
    pixels = np.random.default_rng(1).random((9, 13)).astype(np.float32)
    low = kiln.height_field(pixels, height=2, extent=(3, 2))
    from kiln import _core

    (tmp_path / "heights.png").write_bytes(_core.encode(pixels[:, :, None], "png16", False))
    of_file = kiln.height_field(tmp_path / "heights.png", height=2, extent=(3, 2))
    np.testing.assert_allclose(of_file.mesh.vertices, low.mesh.vertices, atol=2 / 65535)
    command("bake", tmp_path / "heights.png", "--height", 2, "--extent", "3,2", "--size", 32, "--out", tmp_path,
            "--format", "exr32", "--quiet")  # fmt: skip
    mine = tmp_path / "mine.exr"
    kiln.bake(*of_file, size=32).save(mine, format="exr32")
    theirs = [file for file in tmp_path.glob("*_normal.exr")]
    assert len(theirs) == 1 and theirs[0].read_bytes() == mine.read_bytes()


def test_the_match_is_chosen():
    vertices, faces = ball(48)
    high = vertices * (1 + 0.01 * np.sin(20 * vertices[:, :1])), faces
    low = kiln.unwrap(kiln.simplify(*high, target=600), size=512)
    baked = kiln.bake(high, low, size=512, max_error="normal=4deg")
    plan = baked.report.plan
    assert plan["reached"] and plan["degrees"] <= 4 and plan["wanted"] == 4
    height, width = baked.coverage.shape
    assert plan["size"] == (width, height) and width < 512
    again = kiln.bake(high, low, size=plan["size"], match=plan["match"])
    np.testing.assert_array_equal(baked["normal"], again["normal"])
    assert again.report.plan is None
    with pytest.warns(kiln.KilnWarning, match="were requested"):
        kiln.bake(high, low, size=16, max_error=0.001)
    with pytest.raises(kiln.Error, match="max_error"):
        kiln.bake(high, low, size=16, max_error="4")
    with pytest.raises(kiln.Error, match="auto"):
        kiln.match(high, low, size=16, match="auto")


def test_wrong_heights():
    for heights in (np.zeros((1, 5)), np.zeros(5), np.full((3, 3), np.nan), np.zeros((3, 3), complex), "no.png"):
        with pytest.raises(kiln.Error):
            kiln.height_field(heights)
    with pytest.raises(kiln.Error):
        kiln.height_field(np.zeros((3, 3)), extent=(-1, 1))


def test_materials_that_span_tiles_have_a_map_a_tile(tmp_path):
    low = tiled()
    uvs = low.uvs.copy()
    uvs[25:] = (uvs[25:, ::-1] - 1) * [0.9, 1] + [1, 0]  # no copy of the other half's
    low = kiln.Mesh(low.vertices, low.faces, uvs, materials=0 * low.materials, material_names=["skin"], name="flat")
    baked = kiln.bake_sets(two_waves(), low, size={"skin": 16}, sets="material")
    assert list(baked) == ["skin.1001", "skin.1002"]
    files = [file.name for bake in baked.values() for file in bake.save(tmp_path)]
    assert files == ["flat_skin_normal.1001.png", "flat_skin_normal.1002.png"]
    assert all(bake.report.missed == 0 and bake.coverage.shape == (16, 16) for bake in baked.values())
