"""Normals of high polys that have none."""

import numpy as np
import pytest

import kiln

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([[q[0], q[1], q[2]] for q in QUADS] + [[q[0], q[2], q[3]] for q in QUADS])


def face_normals(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def off_faces(mesh):
    """Degrees, the most of any corner."""
    cosines = (mesh.normals[mesh.normal_faces] * face_normals(mesh)[:, None]).sum(axis=2)
    return np.degrees(np.arccos(np.clip(cosines, -1, 1))).max()


@pytest.mark.no_device
def test_smooth_angle():
    assert kiln.Mesh(CORNERS, FACES).normals is None
    assert off_faces(kiln.Mesh(CORNERS, FACES, smooth_angle=90)) < 0.05  # of an arc cosine of floats
    assert off_faces(kiln.Mesh(CORNERS, FACES, smooth_angle=91)) > 50
    for wrong in (0, -5, 181, float("nan"), "30", [30]):
        with pytest.raises(kiln.Error) as failure:
            kiln.Mesh(CORNERS, FACES, smooth_angle=wrong)
        assert failure.value.code == "option-range", wrong
    with pytest.raises(kiln.Error) as failure:
        kiln.Mesh(CORNERS, FACES, normals=np.ones((8, 3)), smooth_angle=30)
    assert failure.value.code == "option-contradiction"


def test_source_has_the_normals_of_a_hard_surface():
    for given in ((CORNERS, FACES), (CORNERS[FACES].reshape(-1, 3), np.arange(36).reshape(-1, 3))):
        assert off_faces(kiln.Source(given).mesh) < 0.05
    with pytest.warns(kiln.KilnWarning, match="smooth shading"):
        assert kiln.Source((CORNERS, FACES), high_normals="smooth").mesh.normals is None
    assert off_faces(kiln.Source((CORNERS, FACES), high_normals=100).mesh) > 50
    with pytest.raises(kiln.Error):
        kiln.Source((CORNERS, FACES), high_normals="soft")


def test_bake_takes_them():
    low = kiln.unwrap(kiln.Mesh(CORNERS, FACES, smooth_angle=90), size=64)
    flat = kiln.bake((CORNERS, FACES), low, size=64)["normal"]
    tilts = np.abs(flat - [0.5, 0.5, 1]).max()
    assert tilts < 1e-6
    with pytest.warns(kiln.KilnWarning, match="smooth shading"):
        bent = kiln.bake((CORNERS, FACES), low, size=64, high_normals="smooth")["normal"]
    assert np.abs(bent - [0.5, 0.5, 1]).max() > 0.2
    with kiln.Source((CORNERS, FACES)) as source, pytest.raises(kiln.Error):
        kiln.bake(source, low, size=64, high_normals="smooth")
