"""Bakes meshes on a Dask cluster, a GLB each: python dask_jobs.py SCHEDULER OUT MESH...

SCHEDULER is an address such as tcp://host:8786. Start its workers with --nthreads 1: a bake has threads of its own, as
many as KILN_THREADS and POCL_MAX_PTHREAD_COUNT allow. A worker that dies in the middle of a bake leaves no part of a
file; Dask runs its job again on another one.
"""

import sys
from pathlib import Path

from dask.distributed import Client, as_completed


def bake(job):
    import kiln  # the worker's own

    result = kiln.run(job)
    return result.files, result.failure


scheduler, out, *meshes = sys.argv[1:]
jobs = [{"high": mesh, "out": str(Path(out) / f"{Path(mesh).stem}.glb"), "faces": 500, "size": 128} for mesh in meshes]
with Client(scheduler) as client:
    futures = client.map(bake, jobs, pure=False)
    for future in as_completed(futures):
        if future.exception() is not None:
            print("failed:", future.exception())
            continue
        files, failure = future.result()
        print(*files, failure)
    sys.exit(any(future.exception() is not None or future.result()[1] for future in futures))
