"""kiln.BakeSession and kiln.ViewSession: whatever changes, the bytes are those of a fresh bake."""

import base64
import gc
import hashlib
import json
import resource
import signal
import threading
import warnings

import numpy as np
import pytest
from conftest import sheet, waves

import kiln

VERTICES, FACES, UVS = sheet(32, waves)
INNER = np.flatnonzero((np.abs(VERTICES[:, :2] - 0.5) < 0.3).all(1))  # they move below the crests: the box stays
LOW = kiln.Mesh(*sheet(4, lambda x, y: 0 * x), name="flat")
MAPS = ["normal", "ao", "curvature", "height", "position", "mask", "bent_normal", "thickness", "id", "shadow"]


def high_of(vertices, **more):
    return kiln.Mesh(vertices, FACES, UVS, name="waves", **more)


def hashes(bake):
    return {name: hashlib.sha256(np.ascontiguousarray(bake[name])).hexdigest() for name in bake} | {
        "coverage": hashlib.sha256(bake.coverage).hexdigest()
    }


def moved(seed, rows=INNER, by=0.004):
    vertices = VERTICES.copy()
    vertices[rows, 2] = 0.5 * vertices[rows, 2] + np.random.default_rng(seed).uniform(-by, by, len(rows))
    return vertices


def refused(call, code, parameter):
    with pytest.raises(kiln.Error) as caught:
        call()
    assert (caught.value.code, caught.value.parameter) == (code, parameter), str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("match", ["uv", "ray", "closest", "views", "visibility"])
def test_bytes_are_those_of_a_fresh_bake(match):
    options = {"size": (48, 40), "maps": MAPS, "samples": 2, "ao_rays": 4, "match": match}
    with kiln.BakeSession(high_of(VERTICES), LOW, **options) as session:
        assert hashes(session.bake()) == hashes(kiln.bake(high_of(VERTICES), LOW, **options))
        before = VERTICES
        for step in range(3):
            vertices = moved(step, INNER[step::3])
            if step == 1:  # a part of the rows, those in between as they are
                first, end = INNER[1], INNER[-1] + 1
                vertices[:first], vertices[end:] = before[:first], before[end:]
                session.set_positions(vertices[first:end].astype(np.float32), first=int(first))
            else:
                session.set_positions(vertices)
            fresh = kiln.bake(high_of(vertices), LOW, **options)
            assert hashes(session.bake()) == hashes(fresh), step
            assert hashes(fresh) != hashes(kiln.bake(high_of(before), LOW, **options)), "nothing would be tested"
            before = vertices


def test_with_bounds_the_mesh_may_grow():
    vertices = VERTICES * [1.3, 1, 4]
    options = {"size": 32, "maps": ["normal", "height", "ao"], "ao_rays": 4, "max_distance": "9%"}
    bounds = [[-0.5, -0.5, -0.5], [1.5, 1.5, 1]]
    with kiln.BakeSession(high_of(VERTICES), LOW, bounds=bounds, **options) as session:
        assert np.array(session.bounds).tolist() == bounds
        session.bake()
        session.set_positions(vertices)
        grown = session.bake()
        for high in (high_of(vertices), session.mesh):
            with kiln.Source(high, bounds=session.bounds) as source:
                assert hashes(source.bake(LOW, **options)) == hashes(grown)
        # A share of the box's diagonal.
        assert grown.report.max_distance == pytest.approx(0.09 * np.linalg.norm([2, 2, 1.5]))


def test_outside_the_dirty_rectangle_nothing_changes():
    with kiln.BakeSession(high_of(VERTICES), LOW, size=(128, 96), match="uv", gutter=0) as session:
        assert session.last_update == (0, 0, False, (0, 0, 0, 0), 0)
        before = session.bake()["normal"]
        assert session.last_update.dirty == (0, 0, 128, 96) and session.last_update.matched
        session.bake()
        assert session.last_update.dirty == (0, 0, 0, 0) and session.last_update.texels == 0
        # A vertex at u = 1/4, v = 3/4: a quarter from the left, and from the top.
        row = int(np.flatnonzero((UVS == [0.25, 0.75]).all(1))[0])
        session.set_positions(VERTICES[row : row + 1] + [0, 0, 0.005], first=row)
        after = session.bake()["normal"]
        x, y, width, height = session.last_update.dirty
        changed = np.argwhere((before != after).any(2))
        assert (changed.min(0) >= [y, x]).all() and (changed.max(0) < [y + height, x + width]).all()
        # Normals of the vertices around it change, and with them the triangles two edges of 1/32 away.
        assert abs(x + width / 2 - 32) < 2 and abs(y + height / 2 - 24) < 2
        assert width <= 4 / 32 * 128 + 2 and height <= 4 / 32 * 96 + 2
        assert session.last_update.triangles == 24 and not session.last_update.matched
        assert 0 < session.last_update.texels <= width * height and session.last_update.seconds > 0


def test_rows_are_the_callers_whatever_the_mesh():
    """Doubled and unused vertices, doubled triangles and some without area: nothing is welded or cleaned."""
    corners = VERTICES[FACES].reshape(-1, 3)  # a soup: each corner has a vertex of its own
    order = np.random.default_rng(3).permutation(len(corners) + 2)
    place = np.argsort(order)
    uvs = np.concatenate([UVS[FACES].reshape(-1, 2), [[0, 0], [1, 1]]])
    faces = np.concatenate([place[: len(corners)].reshape(-1, 3), [place[:3]], [place[[0, 0, 1]]]])

    def soup(vertices):
        rows = np.concatenate([vertices[FACES].reshape(-1, 3), [[0.5, 0.5, 0], [0.2, 0.1, 0]]])
        return kiln.Mesh(rows[order], faces, uvs[order])

    with warnings.catch_warnings(), kiln.BakeSession(soup(VERTICES), LOW, size=32, maps=["normal", "id"]) as session:
        warnings.simplefilter("ignore")
        np.testing.assert_array_equal(session.mesh.faces, faces)
        session.bake()
        session.set_positions(soup(moved(1)).vertices)
        assert hashes(session.bake()) == hashes(kiln.bake(soup(moved(1)), LOW, size=32, maps=["normal", "id"]))
        # As many rows as a welded mesh has are not all.
        refused(lambda: session.set_positions(VERTICES), "array-shape", "positions")


def test_rows_of_a_file_are_those_that_load_gives(tmp_path):
    data = bytearray(80) + len(FACES).to_bytes(4, "little")
    for face in FACES:
        data += np.zeros(3, "<f4").tobytes() + VERTICES[face].astype("<f4").tobytes() + b"\0\0"
    (tmp_path / "soup.stl").write_bytes(data)
    rows = kiln.load(tmp_path / "soup.stl").vertices
    with kiln.BakeSession(tmp_path / "soup.stl", LOW, size=32) as session:
        np.testing.assert_array_equal(session.mesh.vertices, rows)
        higher = rows * np.float32([1, 1, 0.5])
        session.set_positions(higher)
        with kiln.Source(session.mesh, bounds=session.bounds) as source:
            assert hashes(source.bake(LOW, size=32)) == hashes(session.bake())
        np.testing.assert_array_equal(session.mesh.vertices, higher)


def test_positions_are_in_world_units(tmp_path):
    """Under a node that scales, turns and moves, and far from 0, where floats are too coarse."""
    data = VERTICES.astype("<f4").tobytes() + FACES.astype("<u4").tobytes()
    place = {"scale": [2, 2, 2], "rotation": [0, 0, 0.70710678, 0.70710678], "translation": [3, 0, 0]}
    bounds = {"min": VERTICES.min(0).tolist(), "max": VERTICES.max(0).tolist()}
    gltf = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **place}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(VERTICES), "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": 5125, "count": FACES.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": VERTICES.size * 4},
            {"buffer": 0, "byteOffset": VERTICES.size * 4, "byteLength": FACES.size * 4},
        ],
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    }
    (tmp_path / "turned.gltf").write_text(json.dumps(gltf))
    turned = LOW.vertices @ np.array([[0, 2, 0], [-2, 0, 0], [0, 0, 2]], np.float32) + np.float32([3, 0, 0])
    far = np.array([1e7, -2e7, 3e6])
    low, faces, uvs = LOW.vertices, LOW.faces, LOW.uvs
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for high, low_at, step in (
            (kiln.load(tmp_path / "turned.gltf"), turned, 1 / 64),
            (high_of(VERTICES + far), low + far, 1 / 128),
        ):
            flat = kiln.Mesh(low_at, faces, uvs)
            with kiln.BakeSession(high, flat, size=32, maps=["height", "position"]) as session:
                before = session.bake()
                session.set_positions(high.vertices + [0, 0, step])
                after = session.bake()
                assert after.report.missed == 0
                np.testing.assert_allclose(after["height"] - before["height"], step, atol=1e-6)
                assert session.mesh.vertices.dtype == high.vertices.dtype
                with kiln.Source(session.mesh, bounds=session.bounds) as source:
                    assert hashes(source.bake(flat, size=32, maps=["height", "position"])) == hashes(after)


def test_normals_that_the_mesh_has_stay_and_it_is_said():
    slope = np.gradient(waves(VERTICES[:, 0], 0).reshape(33, 33), 1 / 32, axis=1).ravel()
    normals = np.stack([-slope, 0 * slope, 0 * slope + 1], axis=1)
    high = high_of(VERTICES, normals=normals)
    options = {"size": 32, "match": "uv"}
    with kiln.BakeSession(high, LOW, **options) as session:
        session.bake()
        session.set_positions(moved(5))
        with pytest.warns(kiln.KilnWarning, match="did not change when .* of its vertices moved") as told:
            bake = session.bake()
        assert {(w.message.code, w.message.count) for w in told} == {("normals-stayed", len(INNER))}
        assert "normals-stayed" in [w["code"] for w in bake.report.warnings]
        assert hashes(bake) == hashes(kiln.bake(high_of(moved(5), normals=normals), LOW, **options))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", message=".*flat faces with smooth shading")  # tilted on purpose
            session.bake()
            tilted = normals + [0, 0.5, 0]
            session.set_positions(VERTICES)
            session.set_normals(tilted[7:100], first=7)
            mixed = np.concatenate([normals[:7], tilted[7:100], normals[100:]])
            assert hashes(session.bake()) == hashes(kiln.bake(high_of(VERTICES, normals=mixed), LOW, **options))
            assert session.last_update.dirty[3] < 32  # of the first rows of vertices alone
            session.set_normals(10 * tilted)  # of any length
            assert hashes(session.bake()) == hashes(kiln.bake(high_of(VERTICES, normals=tilted), LOW, **options))
        session.set_normals(-normals)
        with pytest.warns(kiln.KilnWarning, match="oppose its faces") as told:
            session.bake()
        assert {w.message.code for w in told} == {"normals-oppose"}
    with kiln.BakeSession(high_of(VERTICES), LOW, **options) as session:
        refused(lambda: session.set_normals(normals), "option-contradiction", "normals")


def test_normals_that_opposed_their_faces_at_first_are_turned_as_bake_does():
    high = high_of(VERTICES, normals=np.tile([0.1, 0, -1.0], (len(VERTICES), 1)))
    with pytest.warns(kiln.KilnWarning, match="point against their faces"):
        session = kiln.BakeSession(high, LOW, size=16)
    with session, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert hashes(session.bake()) == hashes(kiln.bake(high, LOW, size=16))
        # Rows of turned normals were added: the caller's alone are not all.
        assert len(session.mesh.normals) > len(VERTICES)
        refused(lambda: session.set_normals(high.normals), "array-shape", "normals")


@pytest.mark.parametrize(
    "array, first, code, parameter",
    [
        (VERTICES[:, :2], None, "array-shape", "positions"),
        (VERTICES.ravel(), None, "array-shape", "positions"),
        (VERTICES[:0], 0, "array-empty", "positions"),
        (VERTICES[:5], None, "array-shape", "positions"),
        (VERTICES.astype(complex), None, "array-type", "positions"),
        (VERTICES.astype(str), None, "array-type", "positions"),
        (None, None, "array-type", "positions"),
        (np.where(VERTICES == VERTICES[700], np.nan, VERTICES), None, "array-range", "positions"),
        ([[0, 0, 0.5], [0, 0, np.inf]], 3, "array-range", "positions"),
        ([[0, 0, 0.5], [0, 0, 1e300]], 3, "session-bounds", "positions"),
        ([[0, 0, 0.5], [0, 0, 9]], 3, "session-bounds", "positions"),
        (VERTICES[:2], len(VERTICES) - 1, "array-range", "positions"),
        (VERTICES[:1], len(VERTICES), "array-range", "positions"),
        (VERTICES[:1], 2**32 - 1, "array-range", "positions"),
        (VERTICES[:1], -1, "option-range", "first"),
        (VERTICES[:1], 2**32, "option-range", "first"),
        (VERTICES[:1], 1.5, "option-range", "first"),
    ],
)
def test_wrong_positions_change_nothing(array, first, code, parameter):
    with kiln.BakeSession(high_of(VERTICES), LOW, size=16, match="uv") as session:
        before = hashes(session.bake())
        refused(lambda: session.set_positions(array, first), code, parameter)
        assert hashes(session.bake()) == before and session.last_update.triangles == 0


@pytest.mark.parametrize(
    "array, code",
    [([[0, 0, 1], [0, 0, 0]], "usage"), ([[0, 0, 1], [0, np.nan, 1]], "usage"), ([[0, 0]], "array-shape")],
)
def test_wrong_normals_change_nothing(array, code):
    high = high_of(VERTICES, normals=np.tile([0, 0.1, 1], (len(VERTICES), 1)))
    with kiln.BakeSession(high, LOW, size=16, match="uv") as session:
        before = hashes(session.bake())
        refused(lambda: session.set_normals(array, first=2), code, "normals")
        assert hashes(session.bake()) == before and session.last_update.triangles == 0


def test_what_a_session_cannot_do_is_refused(source):
    def make(**options):
        return lambda: kiln.BakeSession(high_of(VERTICES), LOW, size=16, **options)

    refused(make(match="auto"), "option-enum", "match")
    refused(make(report_error=True), "option-contradiction", "report_error")
    refused(make(recall=100), "option-contradiction", "recall")
    refused(make(cage="auto"), "option-contradiction", "cage")
    refused(make(match="visibility", visibility_clusters=2), "usage", None)
    refused(make(samples=17), "usage", "samples")
    refused(make(bounds=[[0, 0, 0]]), "array-shape", "bounds")
    refused(make(bounds=[[0, 0, 0], [1, np.nan, 1]]), "array-range", "bounds")
    refused(make(bounds=[[1, 1, 1], [0, 0, 0]]), "array-range", "bounds")
    refused(make(bounds=[[1, 1, 1], [1, 1, 1]]), "array-range", "bounds")
    refused(make(bounds=[[5, 5, 5], [6, 6, 6]]), "session-bounds", "bounds")
    refused(lambda: kiln.Source(high_of(VERTICES), bounds=[[5, 5, 5], [6, 6, 6]]), "session-bounds", "bounds")
    with pytest.raises(TypeError, match="did you mean samples"):
        make(smaples=2)()
    with pytest.raises(TypeError, match="ao_rays"):
        kiln.ViewSession(source, LOW, ao_rays=2)
    holed = VERTICES.copy()
    holed[5] = np.nan
    refused(lambda: kiln.BakeSession(high_of(holed), LOW, size=16), "input", None)
    with kiln.BakeSession(high_of(VERTICES), LOW, size=16) as session:
        # Errors are measured when they are asked for; then the mesh may be another.
        refused(lambda: session.bake().report.errors["normal"], "option-contradiction", "report")


def test_options_reach_the_session():
    checks = (np.indices((64, 64)).sum(0) % 2 * 255).astype(np.uint8)
    roof = kiln.Mesh([[0, 0, 0.2], [0, 1, 0.2], [1, 1, 0.2], [1, 0, 0.2]], [[0, 1, 2], [0, 2, 3]])
    options = {
        "size": 32,
        "maps": ["color", "ao", "normal"],
        "ao_rays": 4,
        "textures": {"color": np.stack([checks] * 3, 2), "rough": checks},
        "ao_occluders": ["high", roof],
        "cage_mesh": kiln.Mesh(LOW.vertices + np.float32([0, 0, 0.05]), LOW.faces),
        "flip_y": True,
    }
    session = kiln.BakeSession(high_of(VERTICES), LOW, **options)
    with session:
        wanted = hashes(kiln.bake(high_of(moved(2)), LOW, **options))
        del roof, options
        gc.collect()
        session.set_positions(moved(2))
        assert hashes(session.bake()) == wanted
    high, low = kiln.height_field(np.random.default_rng(1).random((40, 40), np.float32), height=0.1)
    with kiln.BakeSession(high, low, size=32) as session:  # by UVs, as bake() does
        assert hashes(session.bake()) == hashes(kiln.bake(high, low, size=32))
        assert session.bake().report.by_uv > 0


def test_low_polys_that_stray_are_looked_for_as_far():
    rough = kiln.unwrap(kiln.simplify(high_of(VERTICES * [1, 1, 20]), target=12), size=64)
    with kiln.BakeSession(high_of(VERTICES * [1, 1, 20]), rough, size=64) as session:
        bake = session.bake()
        assert hashes(bake) == hashes(kiln.bake(high_of(VERTICES * [1, 1, 20]), rough, size=64))
        assert bake.report.max_distance > 0.02 * np.linalg.norm(np.ptp(session.bounds, axis=0))


def test_results_stay_and_closed_sessions_say_so(source):
    high = high_of(VERTICES)
    session, views = kiln.BakeSession(high, LOW, size=32), kiln.ViewSession(source, LOW, size=32)
    del high
    gc.collect()
    bake, mesh = session.bake(), session.mesh
    normal, before = bake["normal"], bake["normal"].copy()
    session.set_positions(moved(4))
    assert (session.bake()["normal"] != before).any()
    np.testing.assert_array_equal(normal, before)
    views.add((0, 0, 1))
    match = views.match()
    decided = match.face.copy()
    views.add((1, 0, 1))
    session.close()
    views.close()
    session.close()
    assert session.closed and views.closed
    uses = (session.bake, lambda: session.set_positions(VERTICES), lambda: session.set_normals(VERTICES))
    uses += (lambda: session.mesh, lambda: session.bounds, lambda: session.last_update, session.__enter__().bake)
    for use in uses + (views.match, lambda: views.add((0, 0, 1))):
        refused(use, "closed", None)
    del session, views, bake, uses, use
    gc.collect()
    np.testing.assert_array_equal(normal, before)
    np.testing.assert_array_equal(mesh.vertices, VERTICES.astype(np.float32))
    np.testing.assert_array_equal(match.face, decided)


def test_a_session_is_for_one_thread_at_a_time():
    right = hashes(kiln.bake(high_of(VERTICES), LOW, size=64, maps=["normal", "ao"], ao_rays=16))
    session = kiln.BakeSession(high_of(VERTICES), LOW, size=64, maps=["normal", "ao"], ao_rays=16)
    said = []

    def work():
        for _ in range(20):
            try:
                session.set_positions(VERTICES)
                said.append(hashes(session.bake()) == right)
            except kiln.Error as error:
                said.append(error.code)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert True in said and set(said) <= {True, "busy"}
    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    session.close()
    for thread in threads:
        thread.join(120)
    assert not any(thread.is_alive() for thread in threads) and set(said) <= {True, "busy", "closed"}


class Stop(Exception):
    pass


def during(call, do):
    """Calls, and has a signal's handler do something meanwhile; as often as it takes."""
    seen = []

    def handle(*signal_and_frame):
        signal.setitimer(signal.ITIMER_REAL, 0)
        seen.append(1)
        do()

    before = signal.signal(signal.SIGALRM, handle)
    try:
        for _ in range(100):
            signal.setitimer(signal.ITIMER_REAL, 0.02)
            call()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert seen


def test_what_stops_a_bake_leaves_the_session_whole():
    options = {"size": 256, "maps": ["normal", "ao"], "ao_rays": 64, "match": "uv"}
    with kiln.BakeSession(high_of(VERTICES), LOW, **options) as session:
        session.bake()
        seed = 0

        def change_and_bake():
            nonlocal seed
            seed += 1
            session.set_positions(moved(seed))
            session.bake()

        def stop():
            # A handler that comes during bake() may not use the session; after it, it may.
            try:
                session.set_positions(VERTICES[:1], first=0)
            except kiln.Error as error:
                assert error.code == "busy"
                raise Stop from None

        with pytest.raises(Stop):
            during(change_and_bake, stop)
        assert hashes(session.bake()) == hashes(kiln.bake(high_of(moved(seed)), LOW, **options))


def test_arrays_are_copied():
    rows = moved(6).astype(np.float64)
    with kiln.BakeSession(high_of(VERTICES), LOW, size=16) as session:
        session.set_positions(rows)
        rows[:] = 0
        assert hashes(session.bake()) == hashes(kiln.bake(high_of(moved(6)), LOW, size=16))
        session.set_positions(np.asfortranarray(moved(7))[:, ::-1][:, ::-1])
        assert hashes(session.bake()) == hashes(kiln.bake(high_of(moved(7)), LOW, size=16))


@pytest.mark.parametrize("options", [{}, {"view_size": 64, "samples": 2, "max_distance": 0.03, "view_criterion": "depth"}])
def test_views_one_by_one_are_the_match_of_all(source, high, low, options):
    directions = [(0, 0, 1), (1, 0, 2), (-1, 0.5, 3)]
    with kiln.ViewSession(source, low, size=32, **options) as session:
        assert (session.match().face == -1).all()
        steps = [session.add(direction) for direction in directions]
        samples = (32 * options.get("samples", 1)) ** 2
        assert [step.samples for step in steps] == [samples] * 3
        assert 0 < steps[0].changed == steps[0].decided <= steps[1].decided <= steps[2].decided <= samples
        assert session.add(directions[1]).changed == 0  # none is seen better by what was there
        found = session.match()
    wanted = kiln.match(source, low, size=32, match="views", views=0, view=directions, **options)
    for part in ("face", "barycentrics", "distance", "status"):
        np.testing.assert_array_equal(getattr(found, part), getattr(wanted, part))
    assert found.report["viewed"] == steps[2].decided and found.report["views"] == 4
    assert found.report["missed"] == samples - steps[2].decided
    same = {key: options[key] for key in ("samples",) if key in options}
    baked = kiln.bake(source, low, size=32, match=found, **same)
    assert hashes(baked) == hashes(kiln.bake(source, low, size=32, match=wanted, **same))


def test_a_view_session_outlives_its_source_and_refuses_wrong_directions(high, low):
    with kiln.Source(high) as source:
        session = kiln.ViewSession(source, low, size=16)
    refused(lambda: kiln.ViewSession(source, low, size=16), "closed", None)
    del source
    gc.collect()
    for wrong, code in (((0, 0, 0), "usage"), ((0, np.nan, 1), "usage"), ((0, 1), "array-shape"), ("up", "array-type")):
        refused(lambda: session.add(wrong), code, "direction")
    assert session.match().report["views"] == 0
    assert session.add(np.array([0, 0, 1])).decided == 256
    with kiln.ViewSession(high, low, size=16) as other:  # of a mesh
        other.add((0, 0, 1))
        np.testing.assert_array_equal(other.match().face, session.match().face)


def test_sessions_do_not_leak():
    def sessions(count):
        for seed in range(count):
            with kiln.BakeSession(high_of(VERTICES), LOW, size=64, match="uv") as session:
                session.bake()
                session.set_positions(moved(seed))
                session.bake()
        gc.collect()
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    before = sessions(60)
    # A map alone has 48 KiB, a session's samples 360 KiB: kept by each of 120, they would be 43 MB.
    assert sessions(120) - before < 8 << 20
