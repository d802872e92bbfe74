#!/bin/bash
# Tiles of a plan as a Slurm array. Plan first, then submit as many tasks as there are tiles, then merge when all of them are done:
#
#   tsumu tiles plan SITE --out PLAN --memory 4GB
#   n=$(tsumu --json tiles status PLAN | python3 -c 'import json,sys; print(max(json.loads(l)["value"]["tiles"] for l in sys.stdin))')
#   job=$(sbatch --parsable --array=0-$((n - 1)) examples/tiles/slurm.sh PLAN)
#   sbatch --dependency=afterok:$job --wrap "tsumu tiles merge PLAN --out SITE/run"
#
#SBATCH --cpus-per-task=2
#SBATCH --mem=5G
#SBATCH --time=01:00:00
#SBATCH --requeue
# The number of the task is the number of the tile (SLURM_ARRAY_TASK_ID).
tsumu tiles run "$1" --threads "${SLURM_CPUS_PER_TASK:-1}"
status=$?
# 75: another try is worth it, three at most.
if [ $status -eq 75 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; then
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
fi
exit $status
