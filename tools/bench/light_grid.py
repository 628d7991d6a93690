"""Compares `kiln bake HIGH --max-error normal=E` with a brute-force grid over faces and map sizes.

    python3 tools/bench/light_grid.py KILN OUT_DIR HIGH:DEGREES [HIGH:DEGREES ...] [--step 0.95] [--repeat 3]
        [--times]

For each high poly: the plan; then, for every size of maps, low polys from as many faces as the plan's bytes
and 5% more allow, down in steps of 5%, until two in a row miss the error. All go the same way: `kiln bake --faces
--size` with the plan's samples and bits, then `kiln render --json`, whose 30 views around measure all of them.
The error to reach is the one that was asked for, as these pictures measure it: times the plan's error by pictures
over the plan's own. Prints one JSON line a mesh:

    plan, best    faces, size, bytes, degrees by pictures
    excess        bytes of the plan over those of the lightest that was found: 1 where that is the plan
    grid          bakes that the grid took
    ratio         processor seconds of the plan, over those of one bake of its result: least of --repeat runs each
    with_picture  the same where Python draws the plan's picture, too

With --times, there is no grid, but the seconds alone. Bytes are those of kiln/light_plan.h: 24 a vertex (16 without a map), 2 an index, 1 a texel and its mip-maps.
"""
import argparse
import json
import os
import resource
import subprocess


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(program, *words, path=None):
    before = processor_seconds()
    environment = {**os.environ, "PATH": path} if path else None
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, env=environment)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(map(str, words))}\n{done.stderr}")
    return processor_seconds() - before


def split_vertices(path):
    pairs, positions, faces = set(), 0, 0
    with open(path) as file:
        for line in file:
            words = line.split()
            if words and words[0] == "v":
                positions += 1
            elif words and words[0] == "f":
                faces += 1
                pairs.update(tuple(word.split("/")[:2]) for word in words[1:4])
    return positions, len(pairs), faces


def light_bytes(vertices, faces, size, bits):
    # As light_bytes() of one normal map: two channels.
    index = 4 if vertices > 65536 else 2
    texel = 4 if bits > 8 else 1
    return vertices * (24 if size else 16) + 3 * faces * index + (size * size * texel * 4 + 2) // 3


def pictures(program, low, normal, high, folder):
    report = os.path.join(folder, "render.json")
    run(program, "render", low, "--normal", normal, "--reference", high, "--out", os.path.join(folder, "view.png"),
        "--size", 64, "--samples", 1, "--ambient-rays", 0, "--frames", 1, "--json", report, "--quiet")
    with open(report) as file:
        around = json.load(file)["rendered_normals"]["around"]
    return around["with_map"]["mean_angle_degrees"], around["without_map"]["mean_angle_degrees"]


class Grid:
    def __init__(self, program, high, folder, chosen):
        self.program, self.high, self.folder, self.chosen, self.count = program, high, folder, chosen, 0

    def bake(self, faces, size):
        # Where there is no map, any will do to render the mesh with.
        run(self.program, "bake", self.high, "--faces", faces, "--size", size or 64, "--samples", self.samples(size),
            "--match", self.chosen["match"], "--format", "png8" if self.chosen["bits"] == 8 else "png16",
            "--recall", 0, "--out", self.folder, "--force", "--quiet")

    def samples(self, size):
        return max(1, min(4, 1024 // (size or 64)))

    def point(self, faces, size):
        self.count += 1
        self.bake(faces, size)
        stem = os.path.join(self.folder, os.path.splitext(os.path.basename(self.high))[0] + "_low")
        positions, vertices, count = split_vertices(stem + ".obj")
        degrees = pictures(self.program, stem + ".obj", stem + "_normal.png", self.high, self.folder)
        return {"faces": count, "size": size,
                "bytes": light_bytes(vertices if size else positions, count, size, self.chosen["bits"]),
                "degrees": round(degrees[0] if size else degrees[1], 4)}

    def best_of(self, size, wanted, most_bytes, step):
        room = most_bytes - light_bytes(0, 0, size, self.chosen["bits"])
        faces, misses, best = room / (24 * 0.65 + 6 if size else 16 * 0.5 + 6), 0, None
        while faces >= 12 and misses < 2:
            point = self.point(int(faces), size)
            if point["degrees"] <= wanted:
                best, misses = point, 0
            else:
                misses += 1
            faces *= step
        return best


def compare(options, high, degrees):
    folder = os.path.join(options.out, os.path.splitext(os.path.basename(high))[0])
    os.makedirs(folder, exist_ok=True)
    report = os.path.join(folder, "plan.json")
    words = ["bake", high, "--max-error", f"normal={degrees}", "--out", folder, "--json", report, "--force", "--quiet"]
    with_picture = min(run(options.kiln, *words) for _ in range(options.repeat))
    # Where no folder has Python, nothing is drawn.
    plan_seconds = min(run(options.kiln, *words, path=folder) for _ in range(options.repeat))
    with open(report) as file:
        plan = json.load(file)["plan"]
    chosen = plan["chosen"]
    stem = os.path.join(folder, os.path.splitext(os.path.basename(high))[0] + "_low")
    grid = Grid(options.kiln, high, folder, chosen)
    row = {"mesh": os.path.basename(high), "wanted": degrees, "reached": plan["reached"],
           "measured": round(chosen["measured_degrees"], 4), "trials": len(plan["trials"])}
    fixed = min(run(options.kiln, "bake", high, "--faces", chosen["faces"], "--size", chosen["size"] or 64,
                    "--samples", chosen["samples"], "--match", chosen["match"], "--out", folder, "--force",
                    "--quiet") for _ in range(options.repeat))
    row["ratio"] = round(plan_seconds / fixed, 2)
    row["with_picture"] = round(with_picture / fixed, 2)
    if options.times:
        print(json.dumps(row), flush=True)
        return
    at_plan = grid.point(chosen["faces"], chosen["size"])
    wanted = at_plan["degrees"] * degrees / chosen["measured_degrees"]
    row["plan"] = {**at_plan, "bytes": chosen["bytes"]["total"]}
    found = [grid.best_of(size, wanted, row["plan"]["bytes"] * 1.05, options.step)
             for size in [0, 16, 32, 64, 128, 256, 512, 1024]
             if light_bytes(0, 0, size, chosen["bits"]) < 0.95 * row["plan"]["bytes"]]
    found = [point for point in found if point] + [row["plan"]]
    row["best"] = min(found, key=lambda point: point["bytes"])
    row["excess"] = round(row["plan"]["bytes"] / row["best"]["bytes"], 3)
    row["grid"] = grid.count
    print(json.dumps(row), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kiln")
    parser.add_argument("out")
    parser.add_argument("meshes", nargs="+", metavar="HIGH:DEGREES")
    parser.add_argument("--step", type=float, default=0.95)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--times", action="store_true")
    options = parser.parse_args()
    for mesh in options.meshes:
        high, degrees = mesh.rsplit(":", 1)
        compare(options, high, float(degrees))


if __name__ == "__main__":
    main()
