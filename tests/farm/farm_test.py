"""The recipes of tools/examples/farm on one machine: a Slurm of two nodes and a Dask of two workers, with a task and a
worker killed in the middle. Every map must equal that of a run without a farm.

python farm_test.py KILN FOLDER (with kiln's Python module on the path). FOLDER is emptied, and must be absolute.
"""

import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

ASSETS, PARTS = 40, 8
RECIPES = Path(__file__).resolve().parents[2] / "tools/examples/farm"


def write_grid(path, n, height, with_uvs):
    """A square of n x n quads with waves."""
    lines = []
    for j in range(n + 1):
        lines += [f"v {i / n} {j / n} {height(i / n, j / n):.6f}" for i in range(n + 1)]
    if with_uvs:
        lines += [f"vt {i / n} {j / n}" for j in range(n + 1) for i in range(n + 1)]
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i + 1
            corners = (a, a + 1, a + n + 2, a + n + 1)
            lines.append("f " + " ".join(f"{k}/{k}" if with_uvs else str(k) for k in corners))
    path.write_text("\n".join(lines) + "\n")


def write_assets(folder):
    (folder / "assets").mkdir(parents=True)
    for a in range(ASSETS):
        x_waves, y_waves = 1 + a % 5, 1 + a // 5
        wave = lambda x, y: 0.02 * math.sin(6 * x * x_waves) * math.sin(6 * y * y_waves)  # noqa: E731
        write_grid(folder / f"assets/a{a:02}_high.obj", 40 + a, wave, False)
        write_grid(folder / f"assets/a{a:02}_low.obj", 4, lambda x, y: 0, True)
    (folder / "job.toml").write_text(
        '[defaults]\nsize = 256\nmaps = ["normal", "height", "ao"]\nout = "out/{name}"\n'
        '[[bake]]\nlow = "assets/{name}_low.obj"\nhigh = "assets/{name}_high.obj"\n'
    )


def wait_for(what, seconds, is_there):
    end = time.monotonic() + seconds
    while not (found := is_there()):
        if time.monotonic() > end:
            sys.exit(f"no {what} after {seconds} s")
        time.sleep(0.1)
    return found


class Slurm:
    """A controller and two nodes of one processor each, with keys and state of their own."""

    def __init__(self, folder):
        self.folder, self.host = folder, os.uname().nodename.split(".")[0]
        for name in ("state", "spool-n1", "spool-n2", "munge"):
            (folder / name).mkdir(parents=True)
        (folder / "munge").chmod(0o700)
        (folder / "munge/key").write_bytes(os.urandom(1024))
        (folder / "munge/key").chmod(0o400)
        (folder / "slurm.conf").write_text(
            f"""ClusterName=kiln
SlurmctldHost={self.host}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
SlurmUser={os.environ.get("USER", "root")}
SlurmdUser={os.environ.get("USER", "root")}
SlurmctldPort=17000
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
NodeName=n1 NodeHostname={self.host} NodeAddr=127.0.0.1 Port=17001 CPUs=1
NodeName=n2 NodeHostname={self.host} NodeAddr=127.0.0.1 Port=17002 CPUs=1
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""
        )
        os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
        munge = folder / "munge"
        self.call("munged", f"--key-file={munge}/key", f"--socket={munge}/socket", f"--pid-file={munge}/pid",
                  f"--log-file={munge}/log", f"--seed-file={munge}/seed", "--force")  # fmt: skip
        self.call("slurmctld")
        for node in ("n1", "n2"):
            self.call("slurmd", "-N", node)
        wait_for("idle nodes", 60, lambda: self.call("sinfo", "-h", "-t", "idle", "-o", "%D").strip() == "2")

    @staticmethod
    def call(*words):
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{' '.join(words)}: {done.stdout}{done.stderr}")
        return done.stdout

    def stop(self):
        for pid in [*self.folder.glob("*.pid"), self.folder / "munge/pid"]:
            if pid.exists():
                os.kill(int(pid.read_text()), signal.SIGTERM)


def hashes_by_slurm(kiln, folder):
    """Hashes of the maps that an array baked, of which one task was killed and one requeued by the scheduler."""
    slurm = Slurm(folder / "slurm")
    try:
        job = folder / "farm/job.toml"
        os.environ["PATH"] = f"{Path(kiln).parent}:{os.environ['PATH']}"
        said = slurm.call("sbatch", f"--array=1-{PARTS}", f"--output={folder}/slurm/%a.log", str(RECIPES / "slurm.sh"), str(job))
        array = said.split()[-1]

        def part_of(pid):
            """N of "kiln run --shard N/8" of a process; empty for others."""
            try:
                words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
            except OSError:
                return ""
            is_ours = len(words) > 2 and words[1] == "run" and words[2] == str(job)
            return words[words.index("--shard") + 1].split("/")[0] if is_ours else ""

        def running():
            return {part: int(pid) for pid in os.listdir("/proc") if pid.isdigit() and (part := part_of(pid))}

        two = wait_for("two running tasks", 60, lambda: len(found := running()) >= 2 and found)
        wait_for("a map of the farm", 60, lambda: list((folder / "farm/out").glob("*/*.png")))
        killed, requeued = list(two)[:2]
        os.kill(two[killed], signal.SIGKILL)
        slurm.call("scontrol", "requeue", f"{array}_{requeued}")
        wait_for("failed task", 60, lambda: not slurm.call("squeue", "-h", "-t", "R,CG", "-j", f"{array}_{killed}", "-o", "%i").strip())
        slurm.call("scontrol", "requeue", f"{array}_{killed}")

        def done():
            # A requeued task waits for two minutes, unless it is told to start.
            for task in slurm.call("squeue", "-h", "-t", "PD", "-r", "-o", "%i %r").splitlines():
                if task.split()[1] in ("BeginTime", "JobHeldUser"):
                    subprocess.run(["scontrol", "update", f"jobid={task.split()[0]}", "starttime=now"], check=False)
            return not slurm.call("squeue", "-h", "-o", "%i").strip()

        wait_for("end of the array", 600, done)
        parts = [folder / f"farm/farm/hashes.{part}" for part in range(1, PARTS + 1)]
        missing = [part.name for part in parts if not part.exists()]
        if missing:
            sys.exit(f"the array left out {missing}")
        return sorted(line for part in parts for line in part.read_text().splitlines())
    finally:
        slurm.stop()


def run_dask(kiln, folder):
    """A GLB of each of twelve meshes by two workers, one of which is killed: the bytes of the command's."""
    from dask.distributed import LocalCluster

    out, meshes = folder / "dask", [str(folder / f"farm/assets/a{a:02}_high.obj") for a in range(12)]
    out.mkdir()
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        recipe = subprocess.Popen([sys.executable, str(RECIPES / "dask_jobs.py"), cluster.scheduler_address, str(out), *meshes], stdout=sys.stderr)
        wait_for("a GLB of Dask", 120, lambda: list(out.glob("*.glb")))
        os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
        if recipe.wait(timeout=600) != 0:
            sys.exit("dask_jobs.py failed")
    left = [name for name in os.listdir(out) if not name.endswith(".glb")]
    if left or len(list(out.glob("*.glb"))) != len(meshes):
        sys.exit(f"Dask left {sorted(os.listdir(out))}")
    for mesh in meshes[::4]:
        made = out / f"{Path(mesh).stem}.glb"
        alone = folder / "alone" / made.name
        subprocess.run([kiln, "bake", mesh, "--out", alone, "--faces", "500", "--size", "128", "--quiet"], check=True)
        if made.read_bytes() != alone.read_bytes():
            sys.exit(f"{made}: other bytes than the command's")
    return len(meshes)


def main():
    kiln, folder = os.path.abspath(sys.argv[1]), Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    write_assets(folder / "farm")
    shutil.copytree(folder / "farm", folder / "single")
    subprocess.run([kiln, "run", "job.toml", "--hashes", "hashes", "--quiet"], cwd=folder / "single", check=True)
    single = sorted((folder / "single/hashes").read_text().splitlines())
    by_slurm = hashes_by_slurm(kiln, folder)
    if len(single) != 3 * ASSETS or by_slurm != single:
        sys.exit(f"Slurm's {len(by_slurm)} maps differ from the single run's {len(single)}")
    files = run_dask(kiln, folder)
    print(f"{len(single)} maps by a Slurm array of {PARTS}, {files} GLBs by Dask: the bytes of a single run")


if __name__ == "__main__":
    main()
