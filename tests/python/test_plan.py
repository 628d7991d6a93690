"""kiln.plan(), and to_glb() by error."""

import warnings

import pytest
from test_glb import ball, colors_of

import kiln


def test_the_error_is_reached_with_few_faces():
    high = kiln.as_mesh(ball(32))
    made = kiln.plan(high, max_error="normal=2deg", size=512)
    assert made.chosen["reached"] and made.chosen["degrees"] <= 2 == made.chosen["wanted"]
    assert len(made.mesh.faces) == made.chosen["faces"] < len(high.faces) / 4
    assert (made.bake is None) == (made.chosen["size"] == 0)
    # From directions of our own it is about as good.
    assert kiln.measure(high, made.mesh, made.bake, size=256) < 2.5


def test_to_glb_by_error():
    vertices, faces = ball(24)
    glb = kiln.to_glb(vertices, faces, colors=colors_of(vertices), max_error=3, texture_size=256, maps=["normal", "color"])
    assert set(glb.maps) == {"normal", "color"} and len(glb.faces) < len(faces)
    sampled = kiln.to_glb(vertices, faces, sample=colors_of, max_error="normal=3deg", texture_size=128, maps=["normal"])
    assert "color" in sampled.maps


def test_the_function_is_asked_for_all_texels():
    # A low poly without a map strays far, and is looked for from as far.
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        kiln.to_glb(*ball(24), sample=colors_of, max_error="normal=3deg", texture_size=128, maps=["normal"])
    assert [w.message.code for w in caught if isinstance(w.message, kiln.KilnWarning)] == ["outlines"]


def test_to_glb_that_needs_no_map():
    glb = kiln.to_glb(*ball(16), max_error=30, texture_size=128, maps=["normal"])
    assert glb.bake is None and not glb.maps and len(glb.faces) > 0 and glb.uvs.shape == (len(glb.vertices), 2)


@pytest.mark.parametrize("bound", ["3deg", "height=1", "normal=0", True, "normal=x", None])
def test_wrong_bounds(bound):
    with pytest.raises(kiln.Error) as caught:
        kiln.plan(kiln.as_mesh(ball(4)), max_error=bound, size=128)
    assert caught.value.parameter == "max_error"


def test_tqdm():
    tqdm = pytest.importorskip("tqdm")
    with tqdm.tqdm(total=1, disable=False, file=open("/dev/null", "w")) as bar:
        kiln.to_glb(*ball(16), faces_target=200, texture_size=256, progress=bar)
        assert 0.5 < bar.n <= 1.0001


@pytest.mark.no_device
@pytest.mark.parametrize("degrees, words", [(2.5, "deviate by 2.5 degrees, but 2 "), (2, "A map exceeds"), (1, "A map exceeds")])
def test_a_bound_that_is_missed_is_named(degrees, words):
    """Normals within their bound are no reason: then it is another map's bound."""
    from kiln._bake import warn_about_missed_bound

    with pytest.warns(kiln.KilnWarning, match=words) as caught:
        warn_about_missed_bound({"degrees": degrees, "wanted": 2})
    assert [warning.message.code for warning in caught] == ["error-not-reached"]
