"""The command for Windows beside Linux's: each case runs both with the same words, each in a folder of its own, and all
that they write must be the same bytes, their exit codes the same.

python command_test.py [--until TIME] KILN.EXE KILN KILN_SAMPLE FOLDER [NAME...]. kiln.exe runs under Wine, on the OpenCL of
this machine. FOLDER is emptied. NAME: cases of these names only. TIME, in seconds since 1970: no case starts after it.
"""

import argparse
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
            self.compare(out)
        return results

    def compare(self, out):
        of_linux, of_windows = self.linux.files(out), self.windows.files(out)
        expect(of_linux, "no file was written")
        expect(of_linux.keys() == of_windows.keys(), f"other files: {sorted(of_linux)} and {sorted(of_windows)}")
        other = [name for name in of_linux if of_linux[name] != of_windows[name]]
        expect(not other, f"other bytes: {other}")

    def run_as(self, linux, windows, out):
        """Runs each with words of its own, which must write the same files."""
        for runner, words in ((self.linux, linux), (self.windows, windows)):
            status, _, errors = runner.run(words)
            expect(status == 0, f"exit code {status}: {' '.join(map(str, words))}: {errors[-600:]}")
        self.compare(out)

    def write(self, name, text):
        for runner in (self.linux, self.windows):
            (runner.folder / name).parent.mkdir(parents=True, exist_ok=True)
            (runner.folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())

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
def low_polys_of_few_faces(both):
    # The packing of their charts branches on the last digit of functions of the C library.
    for high in ("high.ply", "rock.ply"):
        for size in (64, 128, 256, 512, 1024):
            both.run(["simplify", high, "--faces", "50", "--size", size, "--out", f"few/{high}-{size}.obj"], out="few")


@case
def clean_high_polys(both):
    # Two shells that meet in an edge, a hole, a face that is there twice, and one without area.
    both.write("dirty.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv 2 0 0\nv 2 1 0\n"
               "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 2 9 10 3\nf 2 9 10 3\nf 1 1 2\n")
    for clean in ("none", "weld", "all"):
        status, _, _ = both.linux.run(["simplify", "dirty.obj", "--faces", "8", "--clean", clean, "--out", f"clean/{clean}.obj"])
        both.run(["simplify", "dirty.obj", "--faces", "8", "--clean", clean, "--out", f"clean/{clean}.obj"], code=status)
    both.compare("clean")


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
def backslashes_and_drives(both):
    words = ["--size", "32", "--max-distance", "10%"]
    both.copy(both.linux.folder / "high.ply", "sub/high.ply")
    whole = "Z:" + str(both.windows.folder).replace("/", "\\")
    for high, out in (("sub\\high.ply", "slashes\\of\\it"), (".\\sub/high.ply", "slashes/of\\it\\"),
                      (whole + "\\sub\\high.ply", whole + "\\slashes\\of\\it"), (whole[2:] + "\\sub\\high.ply", whole[2:].replace("\\", "/") + "/slashes/of/it"),
                      ("\\\\?\\" + whole + "\\sub\\high.ply", "\\\\?\\" + whole + "\\slashes\\of\\it")):
        shutil.rmtree(both.windows.folder / "slashes", ignore_errors=True)
        both.run_as(["bake", "sub/high.ply", "low.obj", *words, "--out", "slashes/of/it"],
                    ["bake", high, "low.obj", *words, "--out", out], "slashes")


def wine_devices():
    return Path(os.environ.get("WINEPREFIX", Path.home() / ".wine")) / "dosdevices"


@case
def network_shares(both):
    share = wine_devices() / "unc/studio/scans"
    disk = both.windows.folder / "share"
    disk.mkdir(exist_ok=True)
    share.parent.mkdir(parents=True, exist_ok=True)
    share.unlink(missing_ok=True)
    share.symlink_to(disk)
    try:
        both.copy(both.linux.folder / "high.ply", "share/in/high.ply")
        words = ["--faces", "100", "--size", "32"]
        both.run_as(["bake", "share/in/high.ply", *words, "--out", "share/new/maps"],
                    ["bake", "\\\\studio\\scans\\in\\high.ply", *words, "--out", "\\\\studio\\scans\\new\\maps"], "share")
        both.run_as(["bake", "share/in/high.ply", *words, "--out", "share/new/asset.gltf"],
                    ["bake", "//studio/scans/in/high.ply", *words, "--out", "//studio/scans/new/asset.gltf"], "share")
        job = "[defaults]\nsize = 32\nfaces = 100\n[[bake]]\nhigh = 'HIGH{name}.ply'\nout = 'OUT{name}.glb'\n"
        (both.linux.folder / "share.toml").write_text(job.replace("HIGH", "share/in/").replace("OUT", "share/jobs/"))
        (both.windows.folder / "share.toml").write_text(job.replace("HIGH", "\\\\studio\\scans\\in\\").replace("OUT", "//studio/scans/jobs/"))
        both.run_as(["run", "share.toml"], ["run", "share.toml", "--allow-outside"], "share/jobs")
        # A job file on the share, and its folder's own paths.
        both.write("share/job.toml", job.replace("HIGH", "in/").replace("OUT", "own/"))
        both.run_as(["run", "share/job.toml"], ["run", "\\\\studio\\scans\\job.toml"], "share/own")
        status, output, errors = both.windows.run(["run", "//studio/scans/job.toml", "--plan"])
        expect("1 unchanged" in output.decode() + errors, f"baked anew: {output!r} {errors}")
        expect(not (wine_devices() / "c:/studio").exists(), "a folder was created for the server")
    finally:
        share.unlink()


@case
def another_drive(both):
    drive = wine_devices() / "y:"
    disk = both.windows.folder / "disk"
    disk.mkdir(exist_ok=True)
    drive.unlink(missing_ok=True)
    drive.symlink_to(disk)
    try:
        both.run(["bake", "high.ply", "--faces", "300", "--size", "64", "--out", "disk/scan/asset.gltf"], out="disk")
        words = ["--faces", "100", "--size", "32"]
        both.run_as(["bake", "disk/scan/asset.gltf", *words, "--out", "drive/asset.glb"],
                    ["bake", "Y:\\scan\\asset.gltf", *words, "--out", "drive\\asset.glb"], "drive")
        both.run_as(["bake", "disk/scan/asset.gltf", *words, "--out", "disk/baked"], ["bake", "y:/scan/asset.gltf", *words, "--out", "Y:\\baked"], "disk")
        # Of a drive's own folder, and below its root.
        job = '[defaults]\nsize = 32\nfaces = 100\n[[bake]]\nhigh = "HIGH"\nout = "of-drive/{name}.glb"\n'
        for pattern in ("Y:/scan/{name}.gltf", "y:\\scan\\{name}.gltf"):
            (both.linux.folder / "drive.toml").write_text(job.replace("HIGH", "disk/scan/{name}.gltf"))
            (both.windows.folder / "drive.toml").write_text(job.replace('"HIGH"', f"'{pattern}'"))
            both.run_as(["run", "drive.toml"], ["run", "drive.toml"], "of-drive")
        shutil.copy(both.windows.folder / "high.ply", disk / "root.ply")
        (both.windows.folder / "drive.toml").write_text(job.replace("HIGH", "Y:/{name}.ply"))
        status, _, errors = both.windows.run(["run", "drive.toml"])
        expect(status == 0 and (both.windows.folder / "of-drive/root.glb").exists(), f"root of a drive: {errors[-600:]}")
    finally:
        drive.unlink()


@case
def files_with_lines_of_windows(both):
    def crlf(text):
        return text.replace("\n", "\r\n").encode()

    both.write("crlf/wood.png", (both.linux.folder / "wood.png").read_bytes())
    both.write("crlf/low.mtl", crlf("newmtl wood\nKd 1 0.5 0.25\nmap_Kd textures\\..\\wood.png\n"))
    both.write("crlf/low.obj", crlf("mtllib low.mtl\nusemtl wood\n" + (both.linux.folder / "low.obj").read_text()))
    job = '# A job.\n[defaults]\nsize = 32\nmaps = [\n  "normal",\n  "color",\n]\nmax_distance = "10%"\nout = "crlf/out"\n\n[[bake]]\nhigh = \'crlf\\low.obj\'\nlow = "low.obj"\n'
    both.write("crlf.toml", b"\xef\xbb\xbf" + crlf(job))  # as Notepad saves it
    both.run(["run", "crlf.toml"], out="crlf")
    both.write("parts.txt", crlf("low\nhigh\n"))
    # A pattern in quotation marks loses its backslashes to TOML.
    both.write("quotes.toml", crlf(job).replace(b"'crlf\\low.obj'", b'"crlf\\new\\*.obj"'))
    both.run(["run", "quotes.toml"], code=2, says="/")


@case
def names_that_differ_in_case(both):
    job = ('[defaults]\nsize = 32\nfaces = 100\n[[bake]]\nhigh = "high.ply"\nout = "case/A.glb"\n'
           '[[bake]]\nhigh = "rock.ply"\nout = "case/a.glb"\n')
    both.write("case.toml", job)
    status, _, errors = both.windows.run(["run", "case.toml"])
    expect(status == 2 and "would both write" in errors, f"exit code {status}: {errors}")
    expect(not (both.windows.folder / "case").exists(), "something was written")
    # Linux tells them apart.
    status, _, errors = both.linux.run(["run", "case.toml"])
    expect(status == 0 and len(both.linux.files("case")) == 2, errors)
    # An input by another case is the same file.
    status, _, errors = both.windows.run(["bake", "HIGH.PLY", "--faces", "100", "--size", "32", "--out", "High.ply"])
    expect(status == 2, f"exit code {status}: {errors}")


@case
def names_of_devices(both):
    for out in ("con.glb", "devices/AUX.gltf", "Com1.obj"):
        status, output, errors = both.windows.run(["bake", "high.ply", "--faces", "100", "--size", "32", "--out", out])
        expect(status == 5 and "reserves" in errors and not output, f"{out}: exit code {status}: {errors} {output!r}")
    status, _, errors = both.windows.run(BAKE + ["--out", "nul", "--json", "con.json"])
    expect(status == 5, f"exit code {status}: {errors}")
    # What goes to NUL is written nowhere, as to /dev/null.
    both.run_as(BAKE + ["--out", "sink", "--json", "/dev/null"], BAKE + ["--out", "sink", "--json", "NUL"], "sink")
    expect(not (both.windows.folder / "NUL").exists(), "NUL is a file")


@case
def a_long_command_line(both):
    # 30,000 of the 32,767 letters that Windows takes.
    folder = "a-folder-with-a-long-name-" + "x" * 100
    both.copy(both.linux.folder / "high.ply", f"{folder}/high.ply")
    words = []
    while sum(len(word) + 1 for word in words) < 29000:
        words += ["--maps", "normal"]
    status, _, _ = both.linux.run(["bake", f"{folder}/high.ply", "low.obj", "--size", "32", *words, "--out", "long"])
    both.run(["bake", f"{folder}/high.ply", "low.obj", "--size", "32", *words, "--out", "long"], code=status)


@case
def words_with_spaces_and_quotation_marks(both):
    name = "a b'c & (d) 100%"
    both.copy(both.linux.folder / "high.ply", f"{name}.ply")
    both.run(["bake", f"{name}.ply", "low.obj", "--size", "32", "--out", f"{name}/x y"], out=name)


@case
def a_path_of_300_letters(both):
    both.copy(both.linux.folder / "high.ply", f"{LONG}/high.ply")
    for kind in ("png16", "exr"):
        both.run(["bake", f"{LONG}/high.ply", "low.obj", "--size", "32", "--format", kind, "--out", f"{LONG}/out"], out=f"{LONG}/out")
    both.run(["bake", f"{LONG}/high.ply", "--faces", "300", "--size", "128", "--out", f"{LONG}/out/new.gltf"], out=f"{LONG}/out")


@case
def fbx_in(both):
    both.run(["bake", "none.fbx", "low.obj", "--out", "o"], code=3)
    for name in ("high.fbx", "high_z.fbx", "low.glb", "clay.png", "glaze.png"):
        both.copy(DATA / "twins" / name, f"fbx {UMLAUTS}/{name}")
    for name in ("packed_7500.fbx", "skin.fbx", "smoothing_groups.fbx"):
        both.copy(DATA / "fuzz/fbx" / name, f"fbx {UMLAUTS}/{name}")
    words = ["--size", "64", "--maps", "normal,color,id", "--max-distance", "10%"]
    for name in ("high", "high_z"):
        both.run(["bake", f"fbx {UMLAUTS}/{name}.fbx", f"fbx {UMLAUTS}/low.glb", *words, "--out", f"of-fbx/{name}"], out="of-fbx")
    for name in ("high", "packed_7500", "skin", "smoothing_groups"):
        both.run(["bake", f"fbx {UMLAUTS}/{name}.fbx", "--faces", "24", "--size", "64", "--out", f"of-fbx/{name}.glb"], out="of-fbx")


@case
def packed_files_in(both):
    for kind in ("webp", "jpeg"):
        for packing in ("meshopt", "draco"):
            name = f"packed/{kind}-{packing}"
            both.run(["bake", "high.ply", "--faces", "300", "--size", "128", "--format", kind, "--mesh-compression", packing,
                      "--out", f"{name}.glb"], out="packed")
            both.run(["bake", f"{name}.glb", "--faces", "100", "--size", "64", "--maps", "normal,color", "--out", f"{name}-again"], out=f"{name}-again")
    both.copy(DATA / "twins/high_draco.glb", "twins/high_draco.glb")
    both.copy(DATA / "twins/low.glb", "twins/low.glb")
    both.run(["bake", "twins/high_draco.glb", "twins/low.glb", "--size", "64", "--maps", "normal,color,id", "--out", "of-draco"], out="of-draco")


@case
def pictures_in(both):
    # Colours of each format that Kiln writes, by an MTL in a folder of other letters.
    both.run(BAKE + ["--maps", "normal,color", "--format", "png8", "--out", "colors"], out="colors")
    for kind, ending in (("png16", "png"), ("exr", "exr"), ("exr32", "exr"), ("tga", "tga"), ("webp", "webp"), ("tiff16", "tif"), ("tiff32", "tif"),
                         ("ktx2", "ktx2"), ("dds", "dds")):
        folder = f"{CHINESE} {kind}"
        both.run(BAKE + ["--maps", "color", "--format", kind, "--out", folder], out=folder)
        both.write(f"{folder}/high.mtl", f"newmtl m\nmap_Kd low_color.{ending}\n")
        both.write(f"{folder}/high.obj", "mtllib high.mtl\nusemtl m\n" + (both.linux.folder / "low.obj").read_text())
        expect((both.linux.folder / folder / f"low_color.{ending}").exists(), f"no {kind}: {sorted(both.linux.files(folder))}")
        both.run(["bake", f"{folder}/high.obj", "low.obj", "--size", "64", "--maps", "color", "--max-distance", "1%", "--out", f"{folder}/again"],
                 out=f"{folder}/again")
        both.run(["diff", f"{folder}/again/low_color.png", "colors/low_color.png"], code=both.linux.run(
            ["diff", f"{folder}/again/low_color.png", "colors/low_color.png"])[0])


@case
def height_fields_in(both):
    both.run(["bake", "wood.png", "--height", "1", "--extent", "10", "--faces", "100", "--size", "64", "--out", "terrain"], out="terrain")
    for kind in ("exr32", "tiff32"):
        both.run(["bake", "wood.png", "--height", "1", "--extent", "10", "--faces", "100", "--size", "64", "--format", kind, "--maps", "position,height",
                  "--out", f"terrain-{kind}"], out=f"terrain-{kind}")
        ending = "exr" if kind == "exr32" else "tif"
        both.run(["bake", f"terrain-{kind}/wood_low_height.{ending}", "--height", "1", "--extent", "10", "--faces", "50", "--size", "32", "--out", f"again-{kind}"],
                 out=f"again-{kind}")


@case
def volumes_in(both):
    for name in ("ramp_gzip.nrrd", "ramp_raw_be_crlf.nrrd", "ramp.nii.gz", "ramp_compressed.mha"):
        both.copy(DATA / "volume" / name, f"volumes/{name}")
        both.run(["volume", f"volumes/{name}", "--iso", "15.5", "--error", "0.5", "--size", "32", "--out", f"of-volumes/{name}"], out="of-volumes")


@case
def a_job_file_with_backslashes(both):
    for name in ("rock", UMLAUTS):
        both.copy(both.linux.folder / "rock.ply", f"jobs {CHINESE}/scans/{name}.ply")
    job = "[defaults]\nsize = 32\nfaces = 100\nmaps = ['normal', 'ao', 'id']\nao_rays = 8\n[[bake]]\nhigh = 'scans\\{name}.ply'\nout = 'out\\{name}.glb'\n"
    both.write(f"jobs {CHINESE}/job.toml", job)
    both.run_as(["run", f"jobs {CHINESE}/job.toml", "--hashes", f"jobs {CHINESE}/out/hashes.txt"],
                ["run", f"jobs {CHINESE}\\job.toml", "--hashes", f"jobs {CHINESE}\\out\\hashes.txt"], f"jobs {CHINESE}/out")


@case
def pages_of_view(both):
    both.run(["bake", "high.ply", "--faces", "100", "--size", "32", "--out", "page/asset.glb"], out="page")
    both.run(["view", "page/asset.glb", "--reference", "high.ply", "--out", f"page/{UMLAUTS}.html"], out="page")


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
    parser = argparse.ArgumentParser()
    parser.add_argument("--until", type=float, default=float("inf"))
    parser.add_argument("paths", nargs=4, type=Path)
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    kiln_exe, kiln, sample, work = arguments.paths
    work = work.absolute()
    shutil.rmtree(work, ignore_errors=True)
    both = Both(Runner(kiln.absolute(), work / "linux"), Runner(kiln_exe.absolute(), work / "windows", ["wine"]))
    for runner in (both.linux, both.windows):
        runner.folder.mkdir(parents=True)
    for words in (["--out", work / "high.ply", "--faces", "4000", "--colors", "stone"],):
        subprocess.run([str(sample.absolute())] + [str(word) for word in words], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([str(sample.absolute()), "--out", work / "rock.ply", "--shape", "rock", "--faces", "3000"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([str(sample.absolute()), "--out", work / "wood.png", "--terrain", "16"], check=True, stdout=subprocess.DEVNULL)
    for name in ("high.ply", "rock.ply", "wood.png"):
        both.copy(work / name, name)
    subprocess.run([str(kiln.absolute()), "simplify", "high.ply", "--faces", "200", "--out", "low.obj", "--quiet"],
                   cwd=both.linux.folder, check=True)
    both.copy(both.linux.folder / "low.obj", "../low.obj")
    shutil.copy(both.linux.folder / "low.obj", both.windows.folder / "low.obj")
    subprocess.run(["wineserver", "-p120"], check=False)  # a start of Wine costs more than a bake: it stays between runs
    # The first program starts Wine's services, which keep its streams open.
    subprocess.run(["wine", str(kiln_exe.absolute()), "--version"], env=dict(os.environ, WINEDEBUG="-all"), check=True,
                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    names = arguments.names or list(CASES)
    count = failed = 0
    for name in names:
        if time.time() > arguments.until:
            break
        start = time.monotonic()
        try:
            skipped = CASES[name](both)
            print(f"{'skipped' if skipped else 'ok':8}{name} ({skipped or f'{time.monotonic() - start:.1f} s'})", flush=True)
        except Failed as failure:
            failed += 1
            print(f"FAILED  {name}: {failure}", flush=True)
        count += 1
    left = f", no time for {len(names) - count}" if count < len(names) else ""
    print(f"{count} cases of the command, {failed} failed{left}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
