"""The command for Windows beside Linux's: each case runs both with the same words, each in a folder of its own, and all
that they write must be the same bytes, their exit codes the same.

python command_test.py KILN.EXE KILN KILN_SAMPLE FOLDER [NAME...]. kiln.exe runs under Wine, on the OpenCL of this
machine. FOLDER is emptied. NAME: cases of these names only.
"""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

DATA = Path(__file__).resolve().parents[1] / "data"
SECONDS = 900  # of one run: the machine may be busy
UMLAUTS, CHINESE = "Größe äöü", "雕像"
LONG = "/".join(["a-folder-of-fifty-letters-which-makes-a-long-path-" + str(i) for i in range(6)])  # 300 letters


class Failed(Exception):
    pass


def expect(holds, text):
    if not holds:
        raise Failed(text)


def processor_seconds(word):
    """Of the processes that have `word` in their command lines. Wine's are among Linux's."""
    ticks = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if word.encode() in (folder / "cmdline").read_bytes():
                ticks += sum(map(int, (folder / "stat").read_text().rpartition(")")[2].split()[11:13]))
        except OSError:
            pass  # it has ended
    return ticks / os.sysconf("SC_CLK_TCK")


def wait_until_busy(process, word, seconds=3):
    """Waits until a run has used so many processor seconds: it has started, and bakes."""
    end = time.monotonic() + SECONDS
    while processor_seconds(word) < seconds:
        expect(process.poll() is None, f"ended early, exit code {process.returncode}")
        expect(time.monotonic() < end, f"not begun after {SECONDS} s")
        time.sleep(0.05)


class Runner:
    """One of the two commands, with its folder."""

    def __init__(self, program, folder, before=()):
        self.program, self.folder, self.before = program, folder, list(before)

    def start(self, words, **options):
        environment = dict(os.environ, WINEDEBUG="-all", **options.pop("environment", {}))
        return subprocess.Popen(
            self.before + [str(self.program)] + [str(word) for word in words],
            cwd=self.folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def run(self, words, **options):
        process = self.start(words, **options)
        try:
            output, errors = process.communicate(timeout=SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            raise Failed(f"no end after {SECONDS} s: {' '.join(map(str, words))}") from None
        return process.returncode, output, errors.decode(errors="replace")

    def files(self, folder):
        """Hashes of all files below a folder. Reports have times."""
        root = self.folder / folder
        return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest()
                for path in sorted(root.rglob("*")) if path.is_file() and path.suffix != ".json"}


class Both:
    def __init__(self, linux, windows):
        self.linux, self.windows = linux, windows

    def run(self, words, code=0, out=None, says=None):
        """Runs both. \\param out  the folder that must be the same, with a file in it  \\param says  a part of what Windows'
        prints"""
        results = [runner.run(words) for runner in (self.linux, self.windows)]
        for name, (status, output, errors) in zip(("Linux", "Windows"), results):
            expect(status == code, f"{name}: exit code {status} instead of {code}: {errors[-600:]}")
        text = results[1][1].decode(errors="replace") + results[1][2]
        if says is not None:
            expect(says in text, f"'{says}' is not in: {text[-600:]}")
        if out is not None:
            of_linux, of_windows = self.linux.files(out), self.windows.files(out)
            expect(of_linux, "no file was written")
            expect(of_linux.keys() == of_windows.keys(), f"other files: {sorted(of_linux)} and {sorted(of_windows)}")
            other = [name for name in of_linux if of_linux[name] != of_windows[name]]
            expect(not other, f"other bytes: {other}")
        return results

    def copy(self, source, target):
        for runner in (self.linux, self.windows):
            (runner.folder / target).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, runner.folder / target)


CASES = {}


def case(function):
    CASES[function.__name__] = function
    return function


BAKE = ["bake", "high.ply", "low.obj", "--size", "64", "--max-distance", "10%"]
LONG_BAKE = ["bake", "high.ply", "low.obj", "--size", "2048", "--maps", "ao", "--ao-rays", "4096", "--out", "interrupted", "--quiet"]


@case
def version(both):
    linux, windows = both.run(["--version"])
    expect(linux[1].split(b"\n")[0] == windows[1].split(b"\n")[0], "another version")
    expect(b"\r" not in windows[1], "lines end in CR")


@case
def help_of_bake(both):
    both.run(["bake", "--help"], says="--max-distance")


@case
def unknown_command(both):
    both.run(["bkae"], code=2, says="did you mean kiln bake?")


@case
def unknown_flag(both):
    both.run(BAKE + ["--out", "o", "--frobnicate"], code=2, says="--frobnicate")


@case
def missing_file(both):
    both.run(["bake", "nothing.ply", "low.obj", "--out", "o"], code=3, says="nothing.ply")


@case
def output_below_a_file(both):
    both.run(BAKE + ["--out", "high.ply/out"], code=5, says="high.ply")


@case
def devices(both):
    both.run(["devices"], says="Portable Computing Language")


@case
def simplify_charts(both):
    both.run(["simplify", "high.ply", "--faces", "300", "--size", "256", "--out", "simplify/charts.obj"], out="simplify")


@case
def simplify_pairs(both):
    both.run(["simplify", "high.ply", "--faces", "300", "--unwrap", "pairs", "--out", "pairs/pairs.obj"], out="pairs")


@case
def simplify_by_error(both):
    both.run(["simplify", "high.ply", "--max-error", "1%", "--out", "close/close.obj"], out="close")


@case
def simplify_hull(both):
    both.run(["simplify", "high.ply", "--faces", "200", "--hull", "--out", "hull/hull.obj"], out="hull")


@case
def unwrap_a_given_low_poly(both):
    both.run(BAKE + ["--unwrap", "charts", "--out", "unwrapped"], out="unwrapped")


@case
def bake_by_rays(both):
    maps = "normal,ao,bent_normal,thickness,curvature,convexity,position,height,displacement,distance,id,slope,mask,wireframe,color"
    both.run(BAKE + ["--maps", maps, "--ao-rays", "8", "--out", "rays"], out="rays")


@case
def bake_by_views(both):
    both.run(BAKE + ["--match", "views", "--format", "exr", "--out", "views"], out="views")


@case
def bake_by_visibility(both):
    both.run(BAKE + ["--match", "visibility", "--directions", "12", "--format", "exr", "--out", "visibility"], out="visibility")


@case
def bake_nearest_point(both):
    both.run(BAKE + ["--match", "closest", "--format", "exr32", "--out", "closest"], out="closest")


@case
def bake_with_a_cage(both):
    both.run(["bake", "high.ply", "low.obj", "--size", "64", "--cage", "auto", "--fallback", "closest", "--out", "cage"], out="cage")


@case
def bake_files_of_each_format(both):
    for kind in ("png8", "exr", "tga", "webp", "tiff16", "tiff32", "ktx2", "dds"):
        both.run(BAKE + ["--mips"] * (kind in ("ktx2", "dds", "exr")) + ["--format", kind, "--out", "formats/" + kind], out="formats/" + kind)


@case
def glb_out(both):
    both.run(["bake", "high.ply", "--faces", "300", "--size", "128", "--out", "glb/asset.glb"], out="glb")


@case
def gltf_of_jpeg_out(both):
    both.run(["bake", "high.ply", "--faces", "300", "--size", "128", "--format", "jpeg", "--out", "gltf/asset.gltf"], out="gltf")


@case
def glb_of_webp_and_meshopt_out(both):
    both.run(["bake", "high.ply", "--faces", "300", "--size", "128", "--format", "webp", "--mesh-compression", "meshopt",
              "--out", "small/asset.glb"], out="small")


@case
def glb_packed_by_draco(both):
    both.run(["bake", "high.ply", "--faces", "300", "--size", "64", "--mesh-compression", "draco", "--out", "draco/asset.glb"], out="draco")
    both.run(["bake", "draco/asset.glb", "--faces", "100", "--size", "64", "--out", "draco/again.glb"], out="draco")


@case
def glb_in(both):
    glb_out(both)
    both.run(["bake", "glb/asset.glb", "--faces", "100", "--size", "64", "--out", "again/again.glb"], out="again")
    both.run(["bake", "high.ply", "glb/asset.glb", "--size", "64", "--maps", "normal,ao", "--ao-rays", "8", "--out", "onto"], out="onto")


@case
def render(both):
    both.run(["render", "low.obj", "--reference", "high.ply", "--size", "128", "--out", "render/look.png"], out="render")


@case
def diff_within_and_beyond(both):
    both.run(BAKE + ["--match", "closest", "--out", "diff"], out="diff")
    both.run(["diff", "diff/low_normal.png", "diff/low_normal.png"])
    both.run(BAKE + ["--out", "diff2"], out="diff2")
    both.run(["diff", "diff/low_normal.png", "diff2/low_normal.png", "--max-mean-angle", "0.0001"], code=1)


@case
def run_a_job_file(both):
    job = ('[defaults]\nsize = 64\nmaps = ["normal", "height"]\nmax_distance = "10%"\nout = "out/{name}"\n'
           '[[bake]]\nlow = "scans/**/{name}_low.obj"\nhigh = "scans/**/{name}.ply"\n')
    for runner in (both.linux, both.windows):
        for name in ("a", "b/b", "b/" + CHINESE):
            (runner.folder / "job/scans" / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(runner.folder / "high.ply", runner.folder / f"job/scans/{name}.ply")
            shutil.copy(runner.folder / "low.obj", runner.folder / f"job/scans/{name}_low.obj")
        (runner.folder / "job/job.toml").write_text(job)
    both.run(["run", "job/job.toml"], out="job/out", says=CHINESE)
    both.run(["run", "job/job.toml", "--plan"], says="0 to bake, 0 from the cache, 3 unchanged")
    for runner in (both.linux, both.windows):
        shutil.rmtree(runner.folder / "job/out")
    both.run(["run", "job/job.toml", "--plan"], says="0 to bake, 3 from the cache, 0 unchanged")
    both.run(["run", "job/job.toml"], out="job/out")


@case
def names_of_umlauts(both):
    both.copy(both.linux.folder / "high.ply", f"{UMLAUTS}/{UMLAUTS}.ply")
    both.run(["bake", f"{UMLAUTS}/{UMLAUTS}.ply", "low.obj", "--size", "32", "--out", f"{UMLAUTS}/Übung ß"], out=f"{UMLAUTS}/Übung ß", says="Übung ß")


@case
def names_of_chinese_letters(both):
    both.copy(both.linux.folder / "high.ply", f"{CHINESE}.ply")
    both.run(["bake", f"{CHINESE}.ply", "--faces", "100", "--size", "32", "--out", f"{CHINESE}/{CHINESE}.gltf"], out=CHINESE)
    both.run(["bake", f"{CHINESE}/{CHINESE}.gltf", "--faces", "50", "--size", "32", "--format", "exr", "--out", f"{CHINESE}2"], out=f"{CHINESE}2")
    both.run(["bake", f"{CHINESE}没有.ply", "--faces", "50", "--out", "o"], code=3, says=f"{CHINESE}没有.ply")


@case
def a_path_of_300_letters(both):
    both.copy(both.linux.folder / "high.ply", f"{LONG}/high.ply")
    for kind in ("png16", "exr"):
        both.run(["bake", f"{LONG}/high.ply", "low.obj", "--size", "32", "--format", kind, "--out", f"{LONG}/out"], out=f"{LONG}/out")
    both.run(["bake", f"{LONG}/high.ply", "--faces", "300", "--size", "128", "--out", f"{LONG}/out/new.gltf"], out=f"{LONG}/out")


@case
def fbx_in(both):
    both.run(["bake", "none.fbx", "low.obj", "--out", "o"], code=3)  # with ufbx or without it, a missing file is the fault


@case
def reports_on_standard_output(both):
    results = both.run(BAKE + ["--out", "report", "--json", "-"])
    reports = [json.loads(output) for _, output, _ in results]
    expect(reports[0]["texels"] == reports[1]["texels"] if "texels" in reports[0] else reports[0].keys() == reports[1].keys(),
           "other reports")
    expect(b"\r" not in results[1][1], "lines end in CR")


@case
def what_is_left_out_says_so(both):
    status, _, errors = both.windows.run(["chart", "high.ply", "low.obj", "--out", "chart"])
    expect(status == 1 and "kiln-lab" in errors and "on Linux" in errors, errors)
    (both.windows.folder / "a.dae").write_text("<COLLADA/>")
    status, _, errors = both.windows.run(["bake", "a.dae", "low.obj", "--out", "o"])
    expect(status == 3 and "Assimp" in errors, errors)


@case
def plans_come_without_a_plot(both):
    words = ["bake", "high.ply", "--max-error", "normal=8", "--size", "64", "--out", "plan"]
    status, _, errors = both.windows.run(words)
    expect(status in (0, 1) and "draws no plots on this system" in errors, errors)


@case
def ctrl_c_ends_with_130_and_leaves_nothing(both):
    process = both.windows.start(LONG_BAKE)
    wait_until_busy(process, LONG_BAKE[-2])
    process.send_signal(signal.SIGINT)  # Wine makes CTRL_C_EVENT of it, as of Ctrl-C in its terminal
    output, errors = process.communicate(timeout=SECONDS)
    expect(process.returncode == 130, f"exit code {process.returncode}: {output!r} {errors!r}")
    expect(b"Cancelled." in errors, f"not said: {errors!r}")
    left = [path.name for path in (both.windows.folder / LONG_BAKE[-2]).rglob("*")]
    expect(not left and not (both.windows.folder / LONG_BAKE[-2]).exists(), f"left: {left}")


@case
def a_killed_run_leaves_old_or_new(both):
    folder = both.windows.folder / "killed"
    status, _, errors = both.windows.run(BAKE + ["--out", "killed"])
    expect(status == 0, errors)
    before = both.windows.files("killed")
    process = both.windows.start(["bake", "high.ply", "low.obj", "--size", "2048", "--max-distance", "10%", "--ao-rays", "64",
                                  "--maps", "normal,ao", "--out", "killed"])
    wait_until_busy(process, "normal,ao")
    process.kill()
    process.wait()
    after = {name: hash for name, hash in both.windows.files("killed").items() if not name.startswith(".kiln-")}
    expect(after == before or set(after) == {"low_normal.png", "low_ao.png"}, f"neither old nor new: {sorted(after)}")
    status, _, errors = both.windows.run(BAKE + ["--out", "killed"])  # removes what is left
    expect(status == 0, errors)
    left = [path.name for path in folder.iterdir() if path.name.startswith(".kiln")]
    expect(not left, f"left: {left}")


@case
def two_runs_place_files_in_one_folder(both):
    both.run(BAKE + ["--maps", "normal,ao,height", "--out", "shared"], out="shared")
    processes = [both.windows.start(BAKE + ["--maps", "normal,ao,height", "--out", "shared"]) for _ in range(3)]
    for process in processes:
        _, errors = process.communicate(timeout=SECONDS)
        expect(process.returncode == 0, errors.decode(errors="replace"))
    expect(both.linux.files("shared") == both.windows.files("shared"), "other files")


@case
def a_full_disk(both):
    disk = both.windows.folder / "full"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=48k", "tmpfs", str(disk)], capture_output=True).returncode != 0:
        return "no file system can be mounted"
    try:
        status, _, errors = both.windows.run(["bake", "high.ply", "low.obj", "--size", "512", "--format", "exr", "--out", "full/out"])
        # Windows says that there is no space; Wine 8 that an argument is invalid.
        expect(status == 5 and "low_normal.exr" in errors, f"exit code {status}: {errors}")
        left = [str(path) for path in disk.rglob("*")]
        expect(not left, f"left: {left}")
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@case
def a_write_protected_file(both):
    both.run(BAKE + ["--out", "protected"], out="protected")
    for runner in (both.linux, both.windows):
        os.chmod(runner.folder / "protected/low_normal.png", 0o444)
    status, _, errors = both.windows.run(BAKE + ["--match", "closest", "--out", "protected"])
    expect(status == 5 and "low_normal.png" in errors, f"exit code {status}: {errors}")
    expect(both.linux.files("protected") == both.windows.files("protected"), "the file was replaced")


def main():
    kiln_exe, kiln, sample, work = map(Path, sys.argv[1:5])
    work = work.absolute()
    shutil.rmtree(work, ignore_errors=True)
    both = Both(Runner(kiln.absolute(), work / "linux"), Runner(kiln_exe.absolute(), work / "windows", ["wine"]))
    for runner in (both.linux, both.windows):
        runner.folder.mkdir(parents=True)
    for words in (["--out", work / "high.ply", "--faces", "4000", "--colors", "stone"],):
        subprocess.run([str(sample.absolute())] + [str(word) for word in words], check=True, stdout=subprocess.DEVNULL)
    both.copy(work / "high.ply", "high.ply")
    subprocess.run([str(kiln.absolute()), "simplify", "high.ply", "--faces", "200", "--out", "low.obj", "--quiet"],
                   cwd=both.linux.folder, check=True)
    both.copy(both.linux.folder / "low.obj", "../low.obj")
    shutil.copy(both.linux.folder / "low.obj", both.windows.folder / "low.obj")
    subprocess.run(["wineserver", "-p120"], check=False)  # a start of Wine costs more than a bake: it stays between runs
    count = failed = 0
    for name in sys.argv[5:] or CASES:
        start = time.monotonic()
        try:
            skipped = CASES[name](both)
            print(f"{'skipped' if skipped else 'ok':8}{name} ({skipped or f'{time.monotonic() - start:.1f} s'})", flush=True)
        except Failed as failure:
            failed += 1
            print(f"FAILED  {name}: {failure}", flush=True)
        count += 1
    print(f"{count} cases of the command, {failed} failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
