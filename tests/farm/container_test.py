"""The container file of tools/examples/farm, built without a container engine: images are folders that debootstrap fills,
steps run in them by chroot. Then bakes run in the last image as any user would run them there: without HOME, as another
user, without /sys, on a read-only root with a /tmp.

python container_test.py FOLDER [PACKAGE]. Needs root, and Debian's archive. FOLDER is emptied. PACKAGE is a package for
Linux that tools/package made; with it the stage that builds one is left out.

It prints the sizes and times that it measured, and fails if a bake does, or compiles a kernel that the image should have.
"""

import json
import os
import re
import resource
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[2]
CONTAINER_FILE = SOURCES / "tools/examples/farm/Containerfile"
ARCHIVE = os.environ.get("KILN_DEBIAN", "http://deb.debian.org/debian")
OTHER_USER = 65534


def call(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, **options)


def size_of(folder):
    """Mebibytes that the files of a folder take, a hard link once."""
    sizes = {}
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink():
            stat = path.stat()
            sizes[stat.st_ino] = stat.st_blocks * 512
    return sum(sizes.values()) / 2**20


class Image:
    """A stage of the file: a folder, and the variables and work folder of its steps."""

    def __init__(self, root):
        self.root = root
        self.variables = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"}
        self.work = "/"

    def run(self, command, user=0, read_only=False, check=True):
        """Runs a command of a shell in the image, with /proc and a /tmp, without /sys and HOME."""
        words = [f"{name}={value}" for name, value in self.variables.items()]
        shell = f"cd {shlex.quote(self.work)} && {command}"
        steps = f"mount --bind {self.root} {self.root}\n"
        steps += f"mount -t proc proc {self.root}/proc && mount --bind /dev {self.root}/dev\n"
        steps += f"mount -t tmpfs -o exec,mode=1777 tmpfs {self.root}/tmp\n" if read_only else ""
        steps += f"mount -o remount,ro,bind {self.root}\n" if read_only else ""
        steps += f"exec chroot --userspec={user}:{user} {self.root} /usr/bin/env -i {shlex.join(words)} "
        steps += f"/bin/sh -c {shlex.quote(shell)}\n"
        return subprocess.run(
            ["unshare", "--mount", "sh", "-e", "-c", steps], check=check, text=True, capture_output=user != 0
        )


def instructions():
    """Words of the file: instruction and arguments, with continued lines joined."""
    text = re.sub(r"^#.*\n", "", CONTAINER_FILE.read_text(), flags=re.M).replace("\\\n", " ")
    return [line.split(maxsplit=1) for line in text.splitlines() if line.strip()]


def make_root(root, base):
    """A Debian that has what debian:12-slim has: no more than the packages that every system needs."""
    if not base.exists():
        part = base.with_suffix(".part")
        shutil.rmtree(part, ignore_errors=True)
        try:
            call("debootstrap", "--variant=minbase", "bookworm", part, ARCHIVE, stdout=subprocess.DEVNULL)
        except subprocess.CalledProcessError:
            print("Debian's archive is out of reach")
            sys.exit(75)
        for unneeded in ("usr/share/man", "usr/share/locale", "var/lib/apt/lists", "var/cache/apt"):
            shutil.rmtree(part / unneeded, ignore_errors=True)
            (part / unneeded).mkdir(parents=True)
        for path in (part / "usr/share/doc").rglob("*"):
            if path.name != "copyright" and not path.is_dir():
                path.unlink()
        part.rename(base)
    call("cp", "-a", base, root)
    shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")


def build(folder, package):
    """Follows the file. Returns its last image."""
    images, image = {}, None
    for instruction, rest in instructions():
        words = shlex.split(rest)
        if instruction == "FROM":
            name = words[2] if len(words) > 1 else "last"
            if words[0] != "debian:12-slim":
                sys.exit(f"container: unknown base {words[0]}")
            image = images[name] = Image(folder / name)
            is_replaced = package is not None and name == "build"
            if is_replaced:
                (image.root / "opt/kiln").mkdir(parents=True)
                call("tar", "-xzf", package, "-C", image.root / "opt/kiln", "--strip-components=1")
            else:
                make_root(image.root, folder / "debian")
        elif is_replaced:
            continue
        elif instruction == "COPY" and words[0].startswith("--from="):
            source = images[words[0].removeprefix("--from=")].root / words[1].lstrip("/")
            call("cp", "-a", source, image.root / words[2].lstrip("/"))
        elif instruction == "COPY":
            files = call("git", "-C", SOURCES, "ls-files", "-z", stdout=subprocess.PIPE).stdout
            target = image.root / words[1].lstrip("/")
            target.mkdir(parents=True)
            call("tar", "-C", SOURCES, "--null", "-T", "-", "-cf", folder / "sources.tar", input=files)
            call("tar", "-C", target, "-xf", folder / "sources.tar")
        elif instruction == "WORKDIR":
            image.work = words[0]
        elif instruction == "ENV":
            for word in words:
                name, value = word.split("=", 1)
                image.variables[name] = value.replace("$PATH", image.variables["PATH"])
        elif instruction == "RUN":
            start = time.monotonic()
            image.run(rest)
            print(f"{time.monotonic() - start:.0f} s: RUN {rest[:60]}", file=sys.stderr)
        elif instruction != "ENTRYPOINT":
            sys.exit(f"container: unknown instruction {instruction}")
    return image


def processor_seconds():
    """Of all steps that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def write_grid(path, n, height, has_uvs):
    lines = [f"v {i / n} {j / n} {height * ((i + j) % 3)}" for j in range(n + 1) for i in range(n + 1)]
    if has_uvs:
        lines += [f"vt {i / n} {j / n}" for j in range(n + 1) for i in range(n + 1)]
    for a in (j * (n + 1) + i + 1 for j in range(n) for i in range(n)):
        corners = (a, a + 1, a + n + 2, a + n + 1)
        lines.append("f " + " ".join(f"{k}/{k}" if has_uvs else str(k) for k in corners))
    path.write_text("\n".join(lines) + "\n")


def main():
    folder = Path(sys.argv[1]).resolve()
    package = Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else None
    keep = folder / "debian"
    for path in folder.glob("*") if folder.exists() else ():
        if path != keep:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    folder.mkdir(parents=True, exist_ok=True)
    image = build(folder, package)
    kernels = list((image.root / "opt/kiln/kernels").rglob("*.so"))
    if not kernels:
        sys.exit("container: the image has no kernels")
    print(f"image {size_of(image.root):.0f} MiB, of which Debian {size_of(folder / 'debian'):.0f}, ", end="")
    print(f"Kiln {size_of(image.root / 'opt/kiln'):.0f}, its kernels {size_of(image.root / 'opt/kiln/kernels'):.1f}")

    (image.root / "assets").mkdir()
    write_grid(image.root / "assets/high.obj", 40, 0.02, False)
    write_grid(image.root / "assets/low.obj", 2, 0, True)
    bake = "kiln bake /assets/high.obj /assets/low.obj --size 256 --maps normal,ao,curvature,id --out /tmp/out --json /tmp/r"
    # What the image should have compiled is in the user's copy, and nothing else.
    count = "find /tmp/kiln-* -name '*.so' | wc -l && cat /tmp/r"
    for user in (OTHER_USER, 12345):
        before = processor_seconds()
        result = image.run(f"{bake} >/dev/null && {count}", user, read_only=True, check=False)
        if result.returncode != 0:
            sys.exit(f"container: a bake as user {user} failed: {result.stderr}")
        compiled, report = result.stdout.split("\n", 1)
        if int(compiled) != len(kernels):
            sys.exit(f"container: {int(compiled) - len(kernels)} kernels were compiled again")
        seconds = json.loads(report)["seconds"]["total"]
        print(f"user {user}: first bake {processor_seconds() - before:.1f} s of processor, by the clock {seconds:.1f} s")
    # An empty name of the cache is as none: all kernels are compiled.
    before = processor_seconds()
    result = image.run(f"POCL_CACHE_DIR= {bake}", OTHER_USER, read_only=True, check=False)
    if result.returncode != 0:
        sys.exit(f"container: a bake without a cache failed: {result.stderr}")
    print(f"without the image's kernels: {processor_seconds() - before:.1f} s of processor")
    print(f"{len(kernels)} kernels of the image served two users")


main()
