#!/bin/bash
# Bakes a job file as a Slurm array, a part of the assets in each task:
#   sbatch --array=1-8 slurm.sh JOB.toml [FLAG OF kiln run...]
#SBATCH --job-name=kiln
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail
job=$1
folder=$(dirname -- "$job")
mkdir -p -- "$folder/farm"
# PoCL and Kiln take all processors that they see: here those of the task alone.
export KILN_THREADS=$SLURM_CPUS_PER_TASK
export POCL_MAX_PTHREAD_COUNT=$SLURM_CPUS_PER_TASK POCL_CPU_MAX_CU_COUNT=$SLURM_CPUS_PER_TASK
exec kiln run "$job" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --cache "$folder/farm/cache" --at-once 1 \
  --hashes "$folder/farm/hashes.$SLURM_ARRAY_TASK_ID" --json "$folder/farm/report.$SLURM_ARRAY_TASK_ID.json" "${@:2}"
