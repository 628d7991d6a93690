#!/usr/bin/env python3
"""The gallery: defective generated and scanned meshes, reduced to 10,000 faces with 2048² maps, by Kiln and by other libraries.

    gallery.py DIR [--only NAME,...] [--faces N] [--size N] [--json FILE]

Kiln: kiln.to_glb() with normals, occlusion and colours, cleaning included. The glue: fast_simplification, xatlas, rays
by Embree and nearest vertices where they miss, trimesh for the GLB; all of PyPI; it bakes no occlusion. Writes GLBs,
DIR/gallery.md and a sheet of pictures (high poly, Kiln, the glue), DIR/gallery.webp, with errors of what a viewer sees
from all around, against the mesh with its vertices welded and its windings made to agree: mean angle between rendered
normals over 30 views, where both meshes are seen; share of the pixels that one of them alone covers; mean difference of
colours over 20 views by Embree, of 255. Seconds are the processor's, of all threads, each chain by itself.

Read the page with this in mind: the glue repairs nothing and has its parts' default settings, with rays of 2% of the
diagonal; where fast_simplification stops early, its low poly has more faces, which the table says. The reference's
welding and windings are kiln.clean()'s, as Kiln's chain has them. Holes and floaters stay in it: to fill or to leave
them out counts as error.
"""

import argparse
import json
import os
import random
import time
import warnings

import broken_meshes
import numpy as np

import kiln

MESH_MAKERS = [make for make in broken_meshes.MESH_MAKERS if make.__name__ != "make_pieces"]


def make_colors(points):
    """Returns colours of waves of two lengths, encoded as sRGB."""
    waves = np.sin(4 * points) * 0.25 + np.sin(17 * points[:, [1, 2, 0]]) * 0.15
    return 0.5 + waves


def list_texels(faces, uvs, size):
    """Lists the row, column, face and barycentric weights of each covered texel; row 0 is at the top."""
    corner = uvs[faces] * [size, size] - 0.5
    corner[..., 1] = size - 1 - corner[..., 1]
    rows, columns, owners, weights = [], [], [], []
    for t, ((ax, ay), (bx, by), (cx, cy)) in enumerate(corner):
        x = np.arange(max(0, int(np.ceil(min(ax, bx, cx)))), min(size - 1, int(max(ax, bx, cx))) + 1)
        y = np.arange(max(0, int(np.ceil(min(ay, by, cy)))), min(size - 1, int(max(ay, by, cy))) + 1)
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0 or not len(x) or not len(y):
            continue
        x, y = (grid.ravel() for grid in np.meshgrid(x, y))
        v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
        w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
        inside = (v >= 0) & (w >= 0) & (v + w <= 1)
        rows.append(y[inside])
        columns.append(x[inside])
        owners.append(np.full(inside.sum(), t))
        weights.append(np.stack([1 - v - w, v, w], axis=1)[inside])
    return (np.concatenate(part) for part in (rows, columns, owners, weights))


def run_glue_pipeline(vertices, faces, colors, target, size, path):
    """Makes a low poly with maps by other libraries. \\returns the low poly, object-space normals in [0, 1] and colours"""
    import fast_simplification
    import trimesh
    import xatlas
    from PIL import Image
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import cKDTree

    points, triangles = fast_simplification.simplify(
        vertices.astype(np.float32), faces.astype(np.int32), target_count=target
    )
    kept, triangles, uvs = xatlas.parametrize(points, triangles)
    low = trimesh.Trimesh(points[kept], triangles, process=False)
    welded = trimesh.Trimesh(points[kept], triangles, process=True, merge_tex=True, merge_norm=True)
    _, nearest = cKDTree(welded.vertices).query(low.vertices)
    normals = welded.vertex_normals[nearest]
    high = trimesh.Trimesh(vertices, faces, process=True)
    row, column, owner, weight = list_texels(triangles, uvs, size)

    def interpolate(values, of, by):
        return np.einsum("nk,nkc->nc", by, values[of])

    place = interpolate(low.vertices[triangles], owner, weight)
    toward = interpolate(normals[triangles], owner, weight)
    toward /= np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), 1e-12)
    reach = 0.02 * high.scale
    hit_face, hit_place = np.full(len(place), -1), np.zeros_like(place)
    distance = np.full(len(place), reach)
    for way in (1, -1):  # the nearer of the hits in both directions is used
        face, ray, spot = high.ray.intersects_id(
            place - 1e-6 * way * toward, way * toward, multiple_hits=False, return_locations=True
        )
        away = np.linalg.norm(spot - place[ray], axis=1)
        nearer = away < distance[ray]
        hit_face[ray[nearer]], hit_place[ray[nearer]] = face[nearer], spot[nearer]
        distance[ray[nearer]] = away[nearer]
    hit_ray = np.flatnonzero(hit_face >= 0)
    hit_face, hit_place = hit_face[hit_ray], hit_place[hit_ray]
    normal, color = np.empty((len(place), 3)), np.empty((len(place), 3))
    bary = trimesh.triangles.points_to_barycentric(high.triangles[hit_face], hit_place)
    near_color = make_colors(high.vertices)
    normal[hit_ray] = interpolate(high.vertex_normals[high.faces], hit_face, bary)
    color[hit_ray] = interpolate(near_color[high.faces], hit_face, bary)
    missed = np.setdiff1d(np.arange(len(place)), hit_ray)
    if len(missed):
        _, nearest = cKDTree(high.vertices).query(place[missed], workers=-1)
        normal[missed], color[missed] = high.vertex_normals[nearest], near_color[nearest]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    covered = np.zeros((size, size), bool)
    covered[row, column] = True
    maps = []
    fill = distance_transform_edt(~covered, return_distances=False, return_indices=True)
    for values in (0.5 + 0.5 * normal, np.clip(color, 0, 1)):
        draw_strip = np.zeros((size, size, 3), np.float32)
        draw_strip[row, column] = values
        maps.append(draw_strip[fill[0], fill[1]])
    draw_strip = Image.fromarray(np.rint(255 * maps[1]).astype(np.uint8))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=draw_strip)
    low.visual = trimesh.visual.TextureVisuals(uv=uvs, material=material)
    low.export(path)
    return kiln.Mesh(low.vertices, triangles, uvs, normals=normals), maps[0], maps[1]


def make_view_rays(high, views=20, pixels=400):
    """Makes parallel rays towards a mesh from many sides: origins and directions, (views, pixels^2, 3)."""
    low, most = high.vertices.min(0), high.vertices.max(0)
    middle, radius = (low + most) / 2, np.linalg.norm(most - low) / 2
    i = np.arange(views) + 0.5
    z, turn = 1 - 2 * i / views, np.pi * (1 + 5**0.5) * i
    toward = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], 1)
    right = np.cross(toward, [0, 0, 1])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(right, toward)
    step = radius * ((np.arange(pixels) + 0.5) / pixels * 2 - 1)
    x, y = (grid.ravel()[None, :, None] for grid in np.meshgrid(step, step))
    origins = middle + 2 * radius * toward[:, None] + x * right[:, None] + y * up[:, None]
    return origins, -toward


def look_up_values(vertices, faces, values, origins, directions):
    """Interpolates corner values (faces, 3, K) at the rays' first hits; NaN for misses."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    result = np.full((*origins.shape[:2], values.shape[2]), np.nan, np.float32)
    for view, direction in enumerate(directions):
        face, ray, spot = mesh.ray.intersects_id(
            origins[view], np.tile(direction, (len(origins[view]), 1)), multiple_hits=False, return_locations=True
        )
        if len(face):
            weights = trimesh.triangles.points_to_barycentric(mesh.triangles[face], spot)
            result[view, ray] = np.einsum("nk,nkc->nc", weights, values[face])
    return result


def color_error(high, low, color):
    """Mean difference, 0 to 255, between the high poly's colours and the texture's colours as a viewer sees them."""
    rays = make_view_rays(high)
    wanted = look_up_values(high.vertices, high.faces, np.clip(make_colors(high.vertices), 0, 1)[high.faces], *rays)
    uv = look_up_values(low.vertices, low.faces, low.uvs[low.uv_faces], *rays)
    both = np.isfinite(wanted[..., 0]) & np.isfinite(uv[..., 0])
    at = uv[both] * [color.shape[1], color.shape[0]] - 0.5
    at[:, 1] = color.shape[0] - 1 - at[:, 1]
    first = np.clip(np.floor(at).astype(int), 0, [color.shape[1] - 2, color.shape[0] - 2])
    (x, y), (right, down) = first.T, np.clip(at - first, 0, 1).T[..., None]
    above = (1 - right) * color[y, x] + right * color[y, x + 1]
    below = (1 - right) * color[y + 1, x] + right * color[y + 1, x + 1]
    return 255 * float(np.abs((1 - down) * above + down * below - wanted[both]).mean())


def measure_errors(high, low, normal, color, space):
    """Returns the mean angle of rendered normals in degrees, the percentage of pixels that only one mesh covers, and the mean difference of colours, 0 to 255."""
    normals = kiln.measure(high, low, normal, space=space)
    return {
        "degrees": round(normals.degrees, 3),
        "outline": round(100 * normals.one_sided_share, 2),
        "color": round(color_error(high, low, color), 2),
    }


def time_call(call):
    clock, processor = time.perf_counter(), time.process_time()
    result = call()
    return result, time.perf_counter() - clock, time.process_time() - processor


def draw_strip(high, low, normal, space):
    views = [kiln.render(high, size=160)]
    views.append(kiln.render(low, normal, size=160, space=space, frame=high))
    return views


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--only", help="meshes, separated by commas")
    parser.add_argument("--faces", type=int, default=10_000)
    parser.add_argument("--size", type=int, default=2048)
    parser.add_argument("--json", help="file for the figures")
    arguments = parser.parse_args()
    os.makedirs(arguments.folder, exist_ok=True)
    warnings.simplefilter("ignore")
    kiln.to_glb(
        *(getattr(kiln.height_field(np.random.rand(9, 9)).mesh, part) for part in ("vertices", "faces")),
        texture_size=64,
    )
    rows, strips = [], []
    for make in MESH_MAKERS:
        name = make.__name__.removeprefix("make_")
        if arguments.only and name not in arguments.only.split(","):
            continue
        made = make(random.Random(broken_meshes.MESH_MAKERS.index(make)))
        vertices, faces = np.array(made.points), np.array(made.faces)
        colors = np.clip(make_colors(vertices), 0, 1)
        # The reference is the intended shape: welded and consistently oriented, but with floaters and inner parts.
        high = kiln.clean(
            kiln.Mesh(vertices, faces, colors=colors), fill_holes=False, drop_floaters=False, drop_hidden=False
        )
        glb, clock, processor = time_call(
            lambda: kiln.to_glb(
                vertices,
                faces,
                colors=colors,
                faces_target=arguments.faces,
                texture_size=arguments.size,
                maps=["normal", "ao", "color"],
                path=os.path.join(arguments.folder, name + "_kiln.glb"),
            )
        )
        row = {"mesh": name, "faces": len(faces), "clock_s": round(clock, 2), "processor_s": round(processor, 2)}
        row["low_faces"] = len(glb.mesh.faces)
        row.update(measure_errors(high, glb.mesh, glb.maps["normal"], glb.maps["color"], "tangent"))
        views = draw_strip(high, glb.mesh, glb.maps["normal"], "tangent")
        try:
            result, clock, processor = time_call(
                lambda: run_glue_pipeline(
                    vertices,
                    faces,
                    colors,
                    arguments.faces,
                    arguments.size,
                    os.path.join(arguments.folder, name + "_glue.glb"),
                )
            )
            row.update({"glue_" + name: error for name, error in measure_errors(high, *result, "object").items()})
            row.update(
                glue_clock_s=round(clock, 2),
                glue_processor_s=round(processor, 2),
                glue_low_faces=len(result[0].faces),
            )
            views.append(draw_strip(high, result[0], result[1], "object")[1])
        except Exception as error:
            row["glue_failed"] = f"{type(error).__name__}: {error}"[:120]
            views.append(np.ones_like(views[0]))
        strips.append((name, np.concatenate(views, axis=1)))
        print(json.dumps(row), flush=True)
        rows.append(row)
        write_page(arguments, rows)
        write_sheet(arguments, strips)
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(rows, file, indent=1)


def write_sheet(arguments, strips):
    """Writes all strips of pictures in two columns."""
    from PIL import Image, ImageDraw

    height, width, _ = strips[0][1].shape
    sheet = Image.new("RGB", (2 * width, -(-len(strips) // 2) * height), "white")
    draw = ImageDraw.Draw(sheet)
    for i, (name, strip) in enumerate(strips):
        place = (i % 2 * width, i // 2 * height)
        sheet.paste(Image.fromarray(np.rint(255 * strip).astype(np.uint8)), place)
        draw.text((place[0] + 5, place[1] + 3), name, fill="black")
    sheet.save(os.path.join(arguments.folder, "gallery.webp"), quality=80, method=6)


def write_page(arguments, rows):
    with open(os.path.join(arguments.folder, "gallery.md"), "w", encoding="utf-8") as page:
        page.write(
            f"# Gallery\n\nWritten by `gallery.py` in one run: to {arguments.faces:,} faces with maps of {arguments.size}². "
            "In each cell Kiln, then a glue of fast_simplification, xatlas, Embree and trimesh, which makes no occlusion map: "
            "Kiln's seconds are with one. `gallery.py --help` says what is measured, and what the comparison leaves out.\n\n"
            "| mesh | faces | low poly's | rendered normals, ° | outlines, % | seen colours, of 255 | processor, s |\n"
            "| --- | --: | --: | --: | --: | --: | --: |\n"
        )
        for row in rows:
            pair = (
                f"{row[name]:{form}}, {row['glue_' + name]:{form}}"
                if "glue_" + name in row
                else f"{row[name]:{form}}, -"
                for name, form in (
                    ("low_faces", ","),
                    ("degrees", ".2f"),
                    ("outline", ".2f"),
                    ("color", ".2f"),
                    ("processor_s", ".1f"),
                )
            )
            page.write(f"| {row['mesh']} | {row['faces']:,} | {' | '.join(pair)} |\n")
        more = [row["mesh"] for row in rows if row.get("glue_low_faces", 0) > 1.1 * arguments.faces]
        if more:
            page.write(
                f"\nfast_simplification stops early on {', '.join(more)}: the glue has its errors with that many more faces.\n"
            )
        for row in rows:
            if "glue_failed" in row:
                page.write(f"\nThe glue failed on {row['mesh']}: {row['glue_failed']}.\n")
        page.write("\n![Of each mesh: the high poly, Kiln's low poly with its normal map, and the low poly of the other libraries](gallery.webp)\n")


if __name__ == "__main__":
    main()
