"""kiln.measure(), kiln.contour() and kiln.volume()."""

import warnings

import numpy as np
import pytest
from conftest import sheet, waves

import kiln


def ball_field(n, dtype=np.float32):
    """Distances into a ball of radius 0.35 n around the middle of n^3 voxels; its axes differ so that order shows."""
    i, j, k = np.indices((n, n + 4, n + 8))
    return (0.35 * n - np.sqrt((i - n / 2) ** 2 + (j - n / 2 - 2) ** 2 + (k - n / 2 - 4) ** 2)).astype(dtype)


def test_a_bake_of_another_low_poly_is_told():
    rng = np.random.default_rng(3)
    turn, along = np.meshgrid(np.linspace(0, 2 * np.pi, 97)[:-1], np.linspace(0.05, np.pi - 0.05, 48))
    radius = 1 + 0.1 * np.sin(5 * turn) * np.sin(along)
    ball = np.stack([np.sin(along) * np.cos(turn), np.sin(along) * np.sin(turn), np.cos(along)], axis=-1)
    i = (np.arange(47)[:, None] * 96 + np.arange(96)).ravel()
    j = (np.arange(47)[:, None] * 96 + (np.arange(96) + 1) % 96).ravel()
    faces = np.concatenate([np.stack([i, i + 96, j], axis=1), np.stack([j, i + 96, j + 96], axis=1)])
    high = kiln.Mesh((ball * radius[..., None]).reshape(-1, 3) + 1e-4 * rng.normal(size=(48 * 96, 3)), faces)
    one, other = (kiln.unwrap(kiln.simplify(high, target=count), size=256) for count in (600, 250))
    baked = kiln.bake(high, one, size=256)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kiln.measure(high, one, baked, views=4, size=64)
        kiln.render(one, baked, size=64)
    for call in (lambda: kiln.measure(high, other, baked, views=4, size=64), lambda: kiln.render(other, baked, size=64)):
        with pytest.warns(kiln.KilnWarning, match="another low poly") as told:
            call()
        assert told[0].message.code == "other-layout"


def test_a_map_brings_normals_nearer(high, low):
    without = kiln.measure(high, low, views=12, size=128)
    baked = kiln.bake(high, low, size=256)
    with_map = kiln.measure(high, low, baked, views=12, size=128)
    # The waves' slope is 0.188 cos: its mean angle is 0.188 * 2 / pi, 6.9 degrees.
    assert 5 < without < 8 and with_map.degrees < 0.2 * without
    flipped = kiln.bake(high, low, size=256, flip_y=True)
    for given in (kiln.measure(high, low, flipped, views=12, size=128), kiln.measure(high, low, flipped["normal"], views=12, size=128, flip_y=True)):
        assert given == pytest.approx(with_map, abs=0.01)
    for space in ("object", "face"):
        other = kiln.measure(high, low, kiln.bake(high, low, size=256, space=space), views=12, size=128)
        assert other == pytest.approx(with_map, abs=0.05)
    with pytest.raises(kiln.Error):
        kiln.measure(high, low, kiln.bake(high, low, size=16, two_component=True))
    assert kiln.measure(high, high, views=4, size=64) == 0
    for wrong in ({"views": 0}, {"size": 0}, {"space": "world"}):
        with pytest.raises(kiln.Error) as caught:
            kiln.measure(high, low, baked, **wrong)
        assert caught.value.parameter == next(iter(wrong))


def test_pictures(high, low):
    front = {"azimuth": 0, "elevation": 0, "size": 65}
    normals = kiln.render(low, show_normals=True, **front)
    assert normals.shape == (65, 65, 3) and normals.dtype == np.float32
    np.testing.assert_allclose(normals[32, 32], [0.5, 0.5, 1], atol=1e-6)
    assert (normals[0, 0] == 0).all()
    bake = kiln.bake(high, low, size=128)
    bumpy = kiln.render(low, bake, show_normals=True, frame=high, **front)
    right = kiln.render(high, show_normals=True, frame=high, **front)
    assert np.abs(bumpy - right)[8:-8, 8:-8].mean() < 0.01 < np.abs(normals - right)[8:-8, 8:-8].mean()
    with pytest.raises(kiln.Error):
        kiln.render(low, size=0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.float16, np.int8, np.int16, np.int32])
def test_contour_lies_where_the_array_says(dtype):
    mesh = kiln.contour(ball_field(32, dtype), 0.5, spacing=(1, 2, 0.5), origin=(10, 20, 30))
    at = (mesh.vertices - [10, 20, 30]) / [1, 2, 0.5] - [16, 18, 20]
    radius = np.linalg.norm(at, axis=1)
    # Whole numbers round the field by half a voxel or cut it by one.
    assert abs(radius - 0.35 * 32).max() < (0.6 if np.dtype(dtype).kind == "f" else 2)
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    # Closed and facing out: its volume is the ball's, and above 0.
    volume = np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 10.7**3 * 1, rel=0.15)


def test_a_spacing_may_be_numpys_number():
    half = kiln.contour(ball_field(8), 0, spacing=np.float32(0.5))
    np.testing.assert_array_equal(half.vertices, kiln.contour(ball_field(8), 0, spacing=0.5).vertices)


def test_volume_gives_a_low_poly_and_a_map():
    mesh, normal = kiln.volume(ball_field(32), 0, faces=200, size=128)
    assert len(mesh.faces) <= 200 and normal.shape == (128, 128, 3) and normal.dtype == np.float32
    assert mesh.uvs is not None and mesh.report["size"] == 128


@pytest.mark.parametrize(
    "voxels, code",
    [
        (np.zeros((4, 4)), "array-shape"),
        (np.zeros((1, 4, 4)), "array-shape"),
        (np.zeros((4, 4, 4), complex), "array-type"),
        (np.zeros((4, 4, 4), np.int64), "array-type"),
    ],
)
def test_what_is_no_volume(voxels, code):
    with pytest.raises(kiln.Error) as caught:
        kiln.contour(voxels, 0)
    assert (caught.value.code, caught.value.parameter) == (code, "voxels")
    with pytest.raises(kiln.Error):
        kiln.contour(np.zeros((4, 4, 4), np.float32), 1)
    with pytest.raises(kiln.Error) as caught:
        kiln.contour(ball_field(8), 0, spacing=0)
    assert caught.value.parameter == "spacing"
