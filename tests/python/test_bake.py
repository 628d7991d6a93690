"""kiln.bake(), kiln.match() and their results."""

import gc
import hashlib
import warnings
import weakref

import numpy as np
import pytest
from conftest import sheet, waves

import kiln


def test_normals_of_waves_are_right(high, low):
    bake = kiln.bake(high, low, size=256, samples=2)
    normal = bake["normal"]
    assert normal.shape == (256, 256, 3) and normal.dtype == np.float32
    x = (np.arange(256) + 0.5) / 256
    slope = 0.01 * 2 * np.pi * 3 * np.cos(2 * np.pi * 3 * x)
    right = np.stack([-slope, 0 * x, 0 * x + 1], axis=1) / np.hypot(1, slope)[:, None]
    found = 2 * normal[128] - 1
    angle = np.degrees(np.arccos(np.clip((right * found).sum(1) / np.linalg.norm(found, axis=1), -1, 1)))
    # With h = 2 pi 3 / 64, a vertex's normal is the central difference, off by h^2 / 6 of the slope's amplitude of
    # 0.188, and interpolation between two is off by h^2 / 8 at most: 0.27 degrees together.
    assert angle.max() < 0.28


def test_rows_run_from_the_top():
    # Height rises with y, and so with v: row 0 is at v = 1.
    high = sheet(8, lambda x, y: 0.01 * y)
    low = sheet(1, lambda x, y: 0 * x)
    bake = kiln.bake(
        kiln.Mesh(*high), kiln.Mesh(*low), size=(32, 16), maps="height", max_distance=0.1
    )
    assert bake["height"].shape == (16, 32, 1)
    # Across the middle of the first row of 16 texels, y is 31/32.
    assert bake["height"][0, 16, 0] == pytest.approx(0.01 * 31 / 32, abs=1e-6)
    assert bake["height"][-1, 16, 0] == pytest.approx(0.01 * 1 / 32, abs=1e-6)


def test_same_bytes_as_the_command(tmp_path, command):
    kiln.Mesh(*sheet(64, waves), colors=np.tile([[200, 40, 90]], (65 * 65, 1)).astype(np.uint8)).save(
        tmp_path / "high.obj"
    )
    kiln.Mesh(*sheet(4, lambda x, y: 0 * x)).save(tmp_path / "low.obj")
    maps = ["normal", "ao", "curvature", "height", "position", "color", "mask"]
    flags = {"size": 128, "samples": 2, "ao_rays": 16, "flip_y": True, "fallback": ["closest", "fill"]}
    for format in ("png16", "png8", "exr"):
        command(
            *("bake", tmp_path / "high.obj", tmp_path / "low.obj", "--out", tmp_path / "command"),
            *("--maps", ",".join(maps), "--size", 128, "--samples", 2, "--ao-rays", 16, "--flip-y"),
            *("--fallback", "closest,fill", "--format", format, "--quiet"),
        )
        bake = kiln.bake(tmp_path / "high.obj", tmp_path / "low.obj", maps=maps, **flags)
        files = bake.save(tmp_path / "python", format=format)
        assert len(files) == len(maps)
        for file in files:
            ours, its = (hashlib.sha256(f.read_bytes()).hexdigest() for f in (file, tmp_path / "command" / file.name))
            assert ours == its, file.name


def test_report_and_errors(high, low):
    bake = kiln.bake(high, low, size=64, report_error=True)
    assert bake.report.samples == 64 * 64 and bake.report.missed == 0
    assert 0 <= bake.report.errors["normal"].degrees < 1
    assert bake.report.errors["normal"].rms >= bake.report.errors["normal"].mean


def test_an_error_is_measured_when_it_is_asked_for(high, low):
    wanted = kiln.bake(high, low, size=64, maps=["normal", "height"], samples=2, report_error=True).report.errors
    with kiln.Source(high) as source:
        made = source.bake(low, size=64, maps=["normal", "height"], samples=2)
        assert not made.report.errors
        assert made.report.errors["height"].rms == wanted["height"].rms
        assert set(made.report.errors) == {"height"}
    assert made.report.errors["normal"].degrees == wanted["normal"].degrees  # the source is closed
    with pytest.raises(KeyError, match="report_error"):
        made.report.errors["ao"]
    gone = weakref.ref(made)
    gc.disable()
    del made
    gc.enable()
    assert gone() is None


def test_messages_name_functions_of_python(high):
    with pytest.raises(kiln.Error, match=r"do it: kiln\.unwrap\(\) gives .* and kiln\.simplify\(\) makes"):
        kiln.bake(high, kiln.Mesh(high.vertices, high.faces), size=16)


def test_a_wrong_keyword_is_a_type_error_that_names_the_nearest(high, low):
    with pytest.raises(TypeError, match="did you mean max_distance"):
        kiln.bake(high, low, max_distnace=1)
    with pytest.raises(kiln.Error) as caught:
        kiln.bake(high, low, samples=17)
    assert caught.value.parameter == "samples" and caught.value.kind == "usage"
    with pytest.raises(kiln.Error) as caught:
        kiln.bake(high, low, maps="ambient_oclusion")
    assert caught.value.parameter == "maps" and "ao" in str(caught.value)
    with pytest.raises(kiln.Error) as caught:
        kiln.bake(high, low, flip_y="yes")
    assert caught.value.parameter == "flip_y"


def test_options_of_all_kinds_of_values(high, low):
    plain = kiln.bake(high, low, size=16, flip_y=False, no_view_refine=False, max_distance=None)
    np.testing.assert_array_equal(plain["normal"], kiln.bake(high, low, size=16)["normal"])
    for number in (np.nan, np.inf, 2**64):
        with pytest.raises(kiln.Error) as caught:
            kiln.bake(high, low, size=16, samples=number)
        assert caught.value.parameter == "samples"
    wide = kiln.bake(high, low, size=(np.int64(32), 16), maps="position", origin=(1, 0, 0), view=None)
    assert wide["position"].shape == (16, 32, 3)
    assert wide.origin("position") == (1, 0, 0)
    ranged = kiln.bake(high, low, size=16, maps="height", range={"height": (-0.5, 0.5)}, max_distance="5%")
    assert ranged.ranges("height") == [(-0.5, 0.5)]
    along = kiln.bake(high, low, size=16, match="axis", view=[(0, 0, 1)])
    assert along.report.missed == 0


def test_match_gives_points_on_the_high_poly(source, high, low):
    match = source.match(low, size=64)
    assert match.face.shape == (64, 64) and match.face.dtype == np.int32 and (match.face >= 0).all()
    corners = high.vertices[high.faces[match.face]].astype(np.float64)
    weights = match.barycentrics.astype(np.float64)
    # Weights are rounded to floats, and the sheet's sides are 1.
    np.testing.assert_allclose((corners * weights[..., None]).sum(2), match.position, atol=1e-6)
    np.testing.assert_allclose(match.position[..., 2], match.distance, atol=1e-6)
    saved = source.bake(low, size=64, match=match)
    np.testing.assert_array_equal(saved["normal"], source.bake(low, size=64)["normal"])


def test_missed_samples_say_so(low):
    shifted = sheet(8, lambda x, y: 0 * x)
    half = (shifted[0] * [0.5, 1, 1], shifted[1], shifted[2])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        match = kiln.match(kiln.Mesh(*half), low, size=32)
    assert (match.face[:, 17:] == -1).all() and np.isnan(match.position[:, 17:]).all()
    assert (match.face[:, :15] >= 0).all()


def test_results_outlive_all_else(high, low):
    source = kiln.Source(high)
    bake = source.bake(low, size=32, maps=["normal", "mask"])
    match = source.match(low, size=32)
    normal, face, before = bake["normal"], match.face, bake["normal"].copy()
    source.close()
    del source, bake, match
    gc.collect()
    np.testing.assert_array_equal(normal, before)
    assert (face >= 0).all()


def test_a_closed_source_says_so(high, low):
    with kiln.Source(high) as source:
        source.bake(low, size=16)
    assert source.closed
    with pytest.raises(kiln.Error) as caught:
        source.bake(low, size=16)
    assert caught.value.code == "closed"


def test_textures_and_occluders(high, low):
    checks = (np.indices((64, 64)).sum(0) % 2 * 255).astype(np.uint8)
    bake = kiln.bake(
        high, low, size=64, maps=["color", "ao"], ao_rays=16, textures={"color": np.stack([checks] * 3, 2), "rough": checks}
    )
    assert set(bake) == {"color", "ao", "rough"}
    # Each texel is one texel of the picture, so that its value is the picture's.
    np.testing.assert_allclose(bake["rough"][8:-8, 8:-8, 0], checks[8:-8, 8:-8] / 255, atol=0.51)
    roof = kiln.Mesh(np.array([[0, 0, 0.2], [0, 1, 0.2], [1, 1, 0.2], [1, 0, 0.2]]), [[0, 1, 2], [0, 2, 3]])
    dark = kiln.bake(high, low, size=64, maps="ao", ao_rays=16, ao_occluders=["high", roof])
    assert dark["ao"].mean() < 0.5 * bake["ao"].mean()


def test_files_hold_what_their_names_say(low, tmp_path):
    mesh = kiln.Mesh(low.vertices, low.faces, low.uvs, uv_faces=low.uv_faces, name="../../outside")
    bake = kiln.bake(low, mesh, size=16)
    for format, ending in (("png8", ".png"), ("exr32", ".exr"), ("tiff16", ".tif"), ("tga", ".tga"), ("ktx2", ".ktx2")):
        (file,) = bake.save(tmp_path / "folder", format=format)
        assert file == tmp_path / "folder" / f".._.._outside_normal{ending}" and file.is_file()
    for name in ("a.png", "a.exr", "a.tif", "a.tiff", "a.tga", "a.webp", "a.dds"):
        assert bake.save(tmp_path / name) == [tmp_path / name] and (tmp_path / name).is_file()
    before = sorted(tmp_path.rglob("*"))
    for name, options in (("b.jpg", {}), ("b.png", {"format": "exr"}), ("b", {"format": "jpg"})):
        with pytest.raises(kiln.Error):
            bake.save(tmp_path / name, **options)
    assert sorted(tmp_path.rglob("*")) == before


def test_repr_png(high, low):
    assert kiln.bake(high, low, size=64)._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"


def test_two_clusters_and_mips(high, low):
    bake = kiln.bake(high, low, size=32, match="visibility", visibility_clusters=2)
    assert set(bake) == {"normal", "normal_1"}
    assert [level.shape for level in kiln.bake(high, low, size=8, mips=True).mips("normal")] == [
        (4, 4, 3),
        (2, 2, 3),
        (1, 1, 3),
    ]


def test_warnings_are_pythons(high):
    low = sheet(4, lambda x, y: 0 * x)
    torn = kiln.Mesh(low[0], np.concatenate([low[1], [[0, 0, 1]]]), low[2])
    with pytest.warns(kiln.KilnWarning) as caught:
        bake = kiln.bake(high, torn, size=32)
    assert {w.message.code for w in caught} == {w["code"] for w in bake.report.warnings}
    assert caught[0].filename == __file__


def test_low_polys_of_simplify_are_looked_for_as_far_as_they_stray():
    high = sheet(80, lambda x, y: 0.12 * np.sin(14 * x) * np.sin(14 * y))[:2]
    low = kiln.simplify(*high, target=40)
    assert low.report["search_distance"] > 0.05
    laid_out = kiln.unwrap(low, size=128)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bake = kiln.bake(high, laid_out, size=128)
        sets = kiln.bake_sets(high, laid_out, size=128)[""]
        found = kiln.match(high, laid_out, size=128)
    assert bake.report.max_distance > 0.05
    assert bake.report.missed < 0.02 * bake.report.samples
    assert (sets["normal"] == bake["normal"]).all()
    assert (kiln.bake(high, laid_out, size=128, match=found)["normal"] == bake["normal"]).all()
    # What is asked for goes first.
    with pytest.warns(kiln.KilnWarning):
        narrow = kiln.bake(high, laid_out, size=128, max_distance="2%")
    assert narrow.report.missed > 2 * bake.report.missed
