"""Rates matches as table 1 of Tarini, Cignoni and Scopigno does, on five meshes at two low polys each.

    python tools/bench/tarini_table.py --kiln KILN --sample KILN_SAMPLE --data DIR --out DIR [--size 512]

DIR of --data has bunny_high.ply; without it, four meshes are left. The gyroid's handles hold on to 1,322 faces. Prints the table in
Markdown, and after it which orders of the paper hold on how many pairs. Reports stay in --out; a pair whose
report is there already is not rated again.
"""
import argparse
import json
import pathlib
import subprocess

FACE_COUNTS = [500, 2000]
MATCHES = ["closest", "ray", "visibility_face", "visibility_vertex", "visibility_texel", "hybrid_face",
        "hybrid_vertex", "hybrid_texel"]
MEASURES = [("object", "object space, %"), ("image", "image space, %"),
            ("normalised", "normalised image space"), ("uniformity", "uniformity, %"),
            ("normals", "rendered normals, °")]


def parse_arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--kiln", required=True)
    parser.add_argument("--sample", required=True)
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--size", default=512, type=int)
    return parser.parse_args()


def run(*command):
    subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True)


def make_high_polys(options):
    out, made = options.out, {}
    if options.data is not None and (options.data / "bunny_high.ply").exists():
        made["bunny"] = options.data / "bunny_high.ply"
    for name, faces in ("urn", 250000), ("rock", 400000):
        made[name] = out / f"{name}.ply"
        if not made[name].exists():
            run(options.sample, "--shape", name, "--faces", faces, "--out", made[name])
    for name in "gyroid", "boxes":
        volume = out / f"{name}.nrrd"
        if not volume.exists():
            run(options.sample, "--volume", name, "--size", 96, "--out", volume)
        made[name] = out / f"{name}_full.obj"
        if not made[name].exists():
            run(options.kiln, "volume", volume, "--iso", 0, "--outer", "--out", out / name, "--full", made[name])
    return made


def rate_matches(options, name, high, faces):
    report = options.out / f"{name}_{faces}.json"
    if not report.exists():
        low = options.out / f"{name}_{faces}.obj"
        run(options.kiln, "simplify", high, "--faces", faces, "--size", options.size, "--out", low, "--force")
        command = [options.kiln, "measure", high, low, "--size", options.size, "--json", report]
        for match in "closest", "ray", "visibility", "hybrid":
            command += ["--match", match]
        for place in "face", "vertex", "texel":
            command += ["--visibility-at", place]
        run(*command)
    loaded = json.loads(report.read_text())
    rows = {}
    for row in loaded["methods"]:
        rows[row["name"]] = read_measures(row)
    return rows, loaded


def read_measures(row):
    return {"object": 100 * row["object_space"]["mean_of_diagonal"],
            "image": 100 * row["image_space"]["mean_of_diagonal"],
            "normalised": row["normalised_image_space"]["mean"],
            "uniformity": row["uniformity"]["mean_percent"],
            "normals": row["rendered_normals"]["mean_angle_degrees"]}


RANKING_CLAIMS = [
    ("closest points are the most uneven", lambda v: all(v["closest"]["uniformity"] > v[w]["uniformity"]
                                                         for w in MATCHES[1:])),
    ("closest points are worse in normalised image space than rays and visibility per vertex",
     lambda v: v["closest"]["normalised"] >= max(v["ray"]["normalised"], v["visibility_vertex"]["normalised"])),
    ("closest points are best in image space", lambda v: all(v["closest"]["image"] <= v[w]["image"]
                                                             for w in MATCHES[1:])),
    ("rays are the most even", lambda v: all(v["ray"]["uniformity"] <= v[w]["uniformity"] for w in MATCHES)),
    ("visibility per texel beats per vertex in normalised image space",
     lambda v: v["visibility_texel"]["normalised"] <= v["visibility_vertex"]["normalised"]),
    ("per vertex beats per face in normalised image space",
     lambda v: v["visibility_vertex"]["normalised"] <= v["visibility_face"]["normalised"]),
    ("hybrid lies between ray and visibility per texel in object space, within 1%",
     lambda v: is_between(v["hybrid_texel"]["object"], v["ray"]["object"], v["visibility_texel"]["object"])),
    ("hybrid per texel is never the worst", lambda v: all(v["hybrid_texel"][m] < max(r[m] for r in v.values())
                                                          for m, _ in MEASURES)),
]


def is_between(value, a, b):
    return min(a, b) * 0.99 <= value <= max(a, b) * 1.01


def main():
    options = parse_arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    claim_holds = {text: [] for text, _ in RANKING_CLAIMS}
    pairs = 0
    print("| pair | match | " + " | ".join(title for _, title in MEASURES) + " |")
    print("| --- | --- |" + " --: |" * len(MEASURES))
    for name, high in make_high_polys(options).items():
        for faces in FACE_COUNTS:
            rows, _ = rate_matches(options, name, high, faces)
            pairs += 1
            for way in MATCHES:
                cells = []
                for key, _ in MEASURES:
                    best = min(r[key] for r in rows.values())
                    text = f"{rows[way][key]:.4g}"
                    cells.append(f"**{text}**" if rows[way][key] == best else text)
                print(f"| {name} → {faces} | {way.replace('_', ' at ')} | " + " | ".join(cells) + " |", flush=True)
            for text, holds in RANKING_CLAIMS:
                if holds(rows):
                    claim_holds[text].append(f"{name} {faces}")
    print()
    for text, where in claim_holds.items():
        print(f"- {text}: {len(where)} of {pairs} ({', '.join(where)})")


main()
