#!/usr/bin/env python3
"""Checks 40 commands under --memory-limit: each stays within 105% of it (peak RSS of the process), or is rejected early.

memory_limit.py KILN SAMPLE [--only WORD] [--shares 0.5,0.9]
                  KILN and SAMPLE are the programs `kiln` and `kiln_sample`

Each command runs without a limit first; then under shares of the peak that it had, but 128 MiB at least. A refusal
has exit code 1 or 3, names --memory-limit, leaves no file, and comes within 2 processor seconds, or a quarter of the
whole run's.
"""
import argparse
import os
import resource
import subprocess
import sys
import tempfile

MIB = 1 << 20
BAKE_COMMAND = "bake high.ply low.obj --quiet"
COMMANDS = [
    f"{BAKE_COMMAND} --size 1024", f"{BAKE_COMMAND} --size 2048", f"{BAKE_COMMAND} --size 4096", f"{BAKE_COMMAND} --size 4096 --format png8",
    f"{BAKE_COMMAND} --size 2048 --samples 2", f"{BAKE_COMMAND} --size 1024 --samples 4", f"{BAKE_COMMAND} --size 2048 --samples 4",
    f"{BAKE_COMMAND} --size 2048 --match closest", f"{BAKE_COMMAND} --size 2048 --fallback closest",
    f"{BAKE_COMMAND} --size 1024 --match views --views 12", f"{BAKE_COMMAND} --size 1024 --match visibility --directions 24",
    f"{BAKE_COMMAND} --size 2048 --maps vertex_color,id", f"{BAKE_COMMAND} --size 1024 --maps normal,ao --ao-rays 8",
    f"{BAKE_COMMAND} --size 2048 --maps normal,height,mask,position", f"{BAKE_COMMAND} --size 1024 --maps curvature",
    f"{BAKE_COMMAND} --size 1024 --maps displacement,slope,provenance,distance,wireframe,thickness --ao-rays 4",
    f"{BAKE_COMMAND} --size 2048 --format exr", f"{BAKE_COMMAND} --size 2048 --format exr32 --mips",
    f"{BAKE_COMMAND} --size 2048 --mips", f"{BAKE_COMMAND} --size 2048 --format exr --layers --maps normal,height,id",
    f"{BAKE_COMMAND} --size 1024 --maps normal,ao,color --ao-rays 4 --pack orm=ao,0.5,color.r",
    f"{BAKE_COMMAND} --size 2048 --save-match OUT/match.exr", f"{BAKE_COMMAND} --size 2048 --gutter inf",
    f"{BAKE_COMMAND} --size 1024 --report-error", f"{BAKE_COMMAND} --size 512 --cage auto", f"{BAKE_COMMAND} --size 2048 --cage 2%",
    "bake high.ply --faces 2000 --size 1024 --quiet", "bake high.ply --faces 500 --size 2048 --quiet --unwrap=charts",
    "bake high.ply --faces 500 --size 1024 --quiet --glb", "bake heights.png --faces 500 --size 1024 --quiet",
    "simplify high.ply --faces 2000 --quiet --into low.obj", "simplify high.ply --max-error 0.5% --quiet --into low.obj",
    "simplify high.ply --faces 5000 --unwrap=charts --quiet --into low.obj",
    "render high.ply --size 1024 --quiet --into a.png", "render high.ply --size 4096 --quiet --into a.png",
    "render high.ply --size 2048 --samples 3 --quiet --into a.png",
    "render low.obj --reference high.ply --size 1024 --quiet --into a.png",
    "volume ring.nrrd --iso 0 --faces 500 --size 2048 --quiet", "volume ring.nrrd --iso 0 --faces 2000 --unwrap=charts --quiet",
    "diff a.png b.png --into d.png", "measure high.ply low.obj --match ray --size 512 --quiet",
    "gallery high.ply low.obj --match ray --size 512 --quiet",
]


def run_command(words, folder, limit=None):
    """Runs a command. Returns its exit code, peak RSS in bytes, processor seconds and standard error."""
    words = list(words) + (["--memory-limit", str(int(limit))] if limit else [])
    with tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=errors)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        text = errors.read().decode(errors="replace")
    return child.returncode, usage.ru_maxrss * 1024, usage.ru_utime + usage.ru_stime, text


def make_inputs(sample, kiln, folder):
    for words in ([sample, "--out", "high.ply", "--faces", "300000", "--colors", "stone"],
                  [sample, "--out", "heights.png", "--terrain", "512"],
                  [sample, "--out", "ring.nrrd", "--volume", "torus", "--size", "128"],
                  [kiln, "simplify", "high.ply", "--faces", "2000", "--out", "low.obj", "--quiet"],
                  [kiln, "bake", "high.ply", "low.obj", "--size", "4096", "--out", ".", "--quiet"]):
        subprocess.run(words, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    os.replace(f"{folder}/low_normal.png", f"{folder}/a.png")
    os.link(f"{folder}/a.png", f"{folder}/b.png")


def arguments_of(kiln, text, out):
    words = [kiln]
    for word in text.replace("OUT", out).split():
        if word == "--glb":
            out += "/a.glb"
        elif word == "--into":
            words.append("--out")
        else:
            words.append(f"{out}/{word}" if words[-1] == "--out" else word)
    return words if "--out" in words else [*words, "--out", out]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kiln", type=os.path.abspath)
    parser.add_argument("sample", type=os.path.abspath)
    parser.add_argument("--only", default="")
    parser.add_argument("--shares", default="0.5,0.75,0.9,0.97")
    selected_commands = parser.parse_args()
    shares = [float(share) for share in selected_commands.shares.split(",")]
    failure_count = 0
    print("| command | alone, MiB | s |" + "".join(f" {share:g} |" for share in shares))
    print("| --- | --: | --: |" + " --: |" * len(shares))
    with tempfile.TemporaryDirectory() as folder:
        make_inputs(selected_commands.sample, selected_commands.kiln, folder)
        for text in COMMANDS:
            if selected_commands.only not in text:
                continue
            words = arguments_of(selected_commands.kiln, text, "warm")
            run_command(words, folder)  # fills the cache of kernels
            code, peak, unlimited_seconds, errors = run_command(arguments_of(selected_commands.kiln, text, "alone"), folder)
            if code != 0:
                print(errors, file=sys.stderr)
            row = f"| `{text.replace(BAKE_COMMAND, 'bake')}` | {peak / MIB:.0f} | {unlimited_seconds:.1f} |"
            failure_count += code != 0
            for at, share in enumerate(shares):
                limit = max(share * peak, 128 * MIB)
                out = f"out{at}"
                code, peak_bytes, seconds, errors = run_command(arguments_of(selected_commands.kiln, text, out), folder, limit)
                kept = peak_bytes <= 1.05 * limit
                left = os.path.isdir(f"{folder}/{out}") and os.listdir(f"{folder}/{out}")
                early = code in (1, 3) and "--memory-limit" in errors and not left and seconds <= max(2, unlimited_seconds / 4)
                is_within_limit = kept and (code == 0 or early)
                failure_count += not is_within_limit
                cell = f"{peak_bytes / limit:.2f}" + ("" if code == 0 else f" refused {seconds:.1f} s")
                if code not in (0, 1, 3) or (code != 0 and "--memory-limit" not in errors):
                    cell += f" exit {code}: {errors[-100:].strip()}"
                row += f" {cell if is_within_limit else f'**{cell}**'} |"
                subprocess.run(["rm", "-rf", out], cwd=folder, check=True)
            print(row, flush=True)
            subprocess.run(["rm", "-rf", "warm", "alone"], cwd=folder, check=True)
    print(f"{failure_count} commands exceeded 105% of the limit, and were not refused early")
    return failure_count != 0


if __name__ == "__main__":
    sys.exit(main())
