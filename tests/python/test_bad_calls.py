"""Wrong values in every call: a kiln.Error or a TypeError, and nothing else. Arrays that change meanwhile; leaks."""

import gc
import os
import resource
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import sheet, waves

import kiln

HIGH, LOW = kiln.Mesh(*sheet(8, waves)), kiln.Mesh(*sheet(2, lambda x, y: 0 * x))
VOXELS = np.random.default_rng(1).random((6, 6, 6))
PIXELS = np.zeros((4, 4, 3))


def small(value, most):
    """Whole numbers that would be right, but take long."""
    return min(value, most) if isinstance(value, int) else value


CALLS = {
    "bake.high": lambda b: kiln.bake(b, LOW, size=8),
    "bake.low": lambda b: kiln.bake(HIGH, b, size=8),
    "bake.size": lambda b: kiln.bake(HIGH, LOW, size=small(b, 99999)),
    "bake.maps": lambda b: kiln.bake(HIGH, LOW, size=8, maps=b),
    "bake.match": lambda b: kiln.bake(HIGH, LOW, size=8, match=b),
    "bake.max_error": lambda b: kiln.bake(HIGH, LOW, size=16, max_error=b),
    "bake.cage_mesh": lambda b: kiln.bake(HIGH, LOW, size=8, cage_mesh=b),
    "bake.ao_occluders": lambda b: kiln.bake(HIGH, LOW, size=8, maps="ao", ao_rays=1, ao_occluders=b),
    "bake.textures": lambda b: kiln.bake(HIGH, LOW, size=8, maps="color", textures=b),
    "bake.textures.color": lambda b: kiln.bake(HIGH, LOW, size=8, maps="color", textures={"color": b}),
    "bake.textures.kind": lambda b: kiln.bake(HIGH, LOW, size=8, maps="color", textures={"color": (PIXELS, b)}),
    "bake.device": lambda b: kiln.bake(HIGH, LOW, size=8, device=b),
    "bake.progress": lambda b: kiln.bake(HIGH, LOW, size=8, progress=b),
    "bake.samples": lambda b: kiln.bake(HIGH, LOW, size=8, samples=b),
    "bake.max_distance": lambda b: kiln.bake(HIGH, LOW, size=8, max_distance=b),
    "bake.flip_y": lambda b: kiln.bake(HIGH, LOW, size=8, flip_y=b),
    "bake.range": lambda b: kiln.bake(HIGH, LOW, size=8, maps="height", range=b),
    "bake_sets.sets": lambda b: kiln.bake_sets(HIGH, LOW, size=8, sets=b),
    "bake_sets.size": lambda b: kiln.bake_sets(HIGH, LOW, size={"": small(b, 99999)}),
    "match.low": lambda b: kiln.match(HIGH, b, size=8),
    "Source.high": kiln.Source,
    "Source.device": lambda b: kiln.Source(HIGH, device=b),
    "simplify.mesh": lambda b: kiln.simplify(b, target=4),
    "simplify.faces": lambda b: kiln.simplify(HIGH.vertices, [] if b is None else b, target=4),
    "simplify.target": lambda b: kiln.simplify(HIGH, target=b),
    "simplify.max_error": lambda b: kiln.simplify(HIGH, max_error=b),
    "unwrap.size": lambda b: kiln.unwrap(HIGH, size=b),
    "unwrap.method": lambda b: kiln.unwrap(HIGH, size=64, method=b),
    "unwrap.border": lambda b: kiln.unwrap(HIGH, size=64, border=b),
    "unwrap.detail_of": lambda b: kiln.unwrap(HIGH, size=64, detail_of=b),
    "clean.weld": lambda b: kiln.clean(HIGH, weld=b),
    "clean.drop_floaters": lambda b: kiln.clean(HIGH, drop_floaters=b),
    "plan.max_error": lambda b: kiln.plan(HIGH, max_error=b, size=16),
    "plan.screen": lambda b: kiln.plan(HIGH, max_error=20, size=16, screen=b),
    "contour.voxels": lambda b: kiln.contour(b, 0.5),
    "contour.iso": lambda b: kiln.contour(VOXELS, b),
    "contour.spacing": lambda b: kiln.contour(VOXELS, 0.5, spacing=b),
    "contour.origin": lambda b: kiln.contour(VOXELS, 0.5, origin=b),
    "volume.size": lambda b: kiln.volume(VOXELS, 0.5, size=b),
    "volume.error": lambda b: kiln.volume(VOXELS, 0.5, size=32, error=b),
    "height_field.heights": kiln.height_field,
    "height_field.height": lambda b: kiln.height_field(np.zeros((3, 3)), height=b),
    "height_field.extent": lambda b: kiln.height_field(np.zeros((3, 3)), extent=b),
    "measure.high": lambda b: kiln.measure(b, LOW, size=16, views=2),
    "measure.normal": lambda b: kiln.measure(HIGH, LOW, b, size=16, views=2),
    "measure.views": lambda b: kiln.measure(HIGH, LOW, size=16, views=b),
    "render.normal": lambda b: kiln.render(LOW, b, size=16),
    "render.size": lambda b: kiln.render(LOW, size=b),
    "render.azimuth": lambda b: kiln.render(LOW, size=16, azimuth=b),
    "pack_glb.low": lambda b: kiln.pack_glb(b, {}),
    "pack_glb.maps": lambda b: kiln.pack_glb(LOW, b),
    "pack_glb.color": lambda b: kiln.pack_glb(LOW, {"color": b}),
    "pack_glb.alpha": lambda b: kiln.pack_glb(LOW, {}, alpha=b),
    "to_glb.faces_target": lambda b: kiln.to_glb(HIGH, faces_target=b, texture_size=16, maps="normal"),
    "to_glb.sample": lambda b: kiln.to_glb(HIGH, faces_target=8, texture_size=16, maps="normal", sample=b),
    "to_glb.returned": lambda b: kiln.to_glb(HIGH, faces_target=8, texture_size=16, maps="normal", sample=lambda p: b),
    "to_glb.colors": lambda b: kiln.to_glb(
        HIGH.vertices, HIGH.faces, colors=b, faces_target=8, texture_size=16, maps="normal"
    ),
    "to_glb.maps": lambda b: kiln.to_glb(HIGH, faces_target=8, texture_size=16, maps=b),
    "load.path": kiln.load,
    "Mesh.name": lambda b: kiln.Mesh(HIGH.vertices, HIGH.faces, name=b),
    "Mesh.names": lambda b: kiln.Mesh(HIGH.vertices, HIGH.faces, materials=HIGH.faces[:, 0] * 0, material_names=b),
    "sampled.found": lambda b: kiln.sampled(b, lambda points: points),
}
VALUES = [
    *(
        None,
        -1,
        2**31,
        2**64,
        1.5,
        float("nan"),
        float("inf"),
        "",
        "x",
        b"x",
        [],
        {},
        (),
        ["a"],
        [None],
        object(),
        True,
    ),
    *(
        np.zeros(0),
        np.zeros((0, 3)),
        np.zeros((3, 3, 3, 3)),
        np.full((4, 4), np.nan),
        np.array([["a"]]),
        np.array(None),
    ),
    *(np.zeros((4, 4, 3), complex), np.zeros((4, 4)).T[::2], np.zeros(3, [("a", "f4")]), np.datetime64("2020-01-01")),
]


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_wrong_values_are_told(call):
    refused = 0
    for value in VALUES:
        try:
            CALLS[call](value)
        except (kiln.Error, TypeError) as error:
            assert str(error) and "bad_cast" not in str(error)
            refused += 1
    assert refused > len(VALUES) / 2


@pytest.mark.filterwarnings("ignore")
def test_arrays_that_change_meanwhile_are_copied_or_refused():
    vertices, faces, uvs = sheet(40, waves)
    # Of the very types that Kiln keeps, so that nothing is converted before.
    faces, right = faces.astype(np.uint32), kiln.Mesh(vertices, faces, uvs)
    stop = threading.Event()

    def disturb():
        kept = faces.copy()
        while not stop.is_set():
            faces[7] = 2**31
            vertices[3] = 1e30
            faces[:] = kept
            vertices[3] = right.vertices[3]

    thread = threading.Thread(target=disturb)
    thread.start()
    made = 0
    try:
        for _ in range(300):
            try:
                mesh = kiln.Mesh(vertices, faces, uvs)
            except kiln.Error as error:
                assert error.code in ("mesh-index", "mesh-range") or "index" in str(error)
                continue
            assert mesh.faces.max() < len(vertices)
            made += 1
        low = kiln.bake(right, kiln.Mesh(right.vertices, right.faces, uvs), size=16)
    finally:
        stop.set()
        thread.join()
    assert made and low.report.missed == 0


def test_after_close(low):
    with kiln.Source(HIGH) as source:
        bake = source.bake(LOW, size=16)
    source.close()
    assert source.closed and len(source.mesh.faces) == len(HIGH.faces)
    for use in (
        lambda: source.bake(LOW, size=16),
        lambda: source.match(LOW, size=16),
        lambda: kiln.plan(source, max_error=5, size=16),
        lambda: source.diagonal,
        lambda: source.device_bytes,
        lambda: source.__enter__().bake(LOW, size=16),
    ):
        with pytest.raises(kiln.Error) as caught:
            use()
        assert caught.value.code == "closed"
    np.testing.assert_array_equal(bake["normal"], kiln.bake(HIGH, LOW, size=16)["normal"])


class Mine(Exception):
    pass


def fail(*told):
    raise Mine


@pytest.mark.parametrize(
    "call",
    [
        lambda: kiln.Source(kiln.Mesh(*sheet(300, waves)), progress=fail),
        lambda: kiln.bake(HIGH, LOW, size=16, progress=fail),
        lambda: kiln.bake_sets(HIGH, LOW, size=16, progress=fail),
        lambda: kiln.match(HIGH, LOW, size=16, progress=fail),
        lambda: kiln.plan(HIGH, max_error=5, size=16, progress=fail),
        lambda: kiln.simplify(kiln.Mesh(*sheet(300, waves)), target=8, progress=fail),
        lambda: kiln.to_glb(HIGH, faces_target=8, texture_size=16, progress=fail),
        lambda: kiln.to_glb(HIGH, faces_target=8, texture_size=16, sample=fail),
    ],
)
def test_what_callbacks_raise_comes_out_of_every_call(call):
    with pytest.raises(Mine):
        call()
    assert kiln.bake(HIGH, LOW, size=8)["normal"].shape == (8, 8, 3)


def test_a_sampled_function_may_call_kiln():
    def sample(points):
        inner = kiln.bake(HIGH, LOW, size=8)["normal"]
        return np.full_like(points, inner.mean())

    glb = kiln.to_glb(HIGH, faces_target=8, texture_size=16, maps="normal", sample=sample)
    assert glb.maps["color"].shape == (16, 16, 3)


TWO_LOADERS = """
import sys
sys.path.insert(0, {tests!r})
from conftest import sheet, waves
import hashlib, numpy
def theirs():
    import pyopencl
    context = pyopencl.Context(dev_type=pyopencl.device_type.ALL)
    return context, pyopencl.array.zeros(pyopencl.CommandQueue(context), 64, numpy.float32) + 1
if {first}:
    import pyopencl.array
    kept = theirs()
import kiln
def mine():
    bake = kiln.bake(kiln.Mesh(*sheet(8, waves)), kiln.Mesh(*sheet(2, lambda x, y: 0 * x)), size=64)
    return hashlib.sha256(bake["normal"].tobytes()).hexdigest()
before = mine()
import pyopencl.array
kept = theirs()
assert mine() == before and (kept[1].get() == 1).all()
print(before)
"""


def test_two_opencl_loaders_in_one_process():
    pytest.importorskip("pyopencl", reason="pyopencl, which brings a loader of its own, is not installed.")
    said = set()
    for first in (True, False):
        program = TWO_LOADERS.format(tests=os.path.dirname(__file__), first=first)
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        said.add(done.stdout)
    assert len(said) == 1


def test_sources_and_meshes_do_not_leak():
    vertices, faces, _ = sheet(40, waves)

    def bakes(count):
        for _ in range(count):
            kiln.bake((vertices, faces), LOW, size=16)
        gc.collect()
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    before = bakes(300)
    # The dense mesh alone is 58 KiB: kept by each of 700, they would be 41 MB.
    assert bakes(700) - before < 8 << 20
