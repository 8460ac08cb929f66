#!/bin/bash
#SBATCH --job-name=biplane-tiles
#SBATCH --array=0-@LAST@
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --open-mode=append
# All tiles of a plan, then the model. On the login node: `sbatch FILE` or `bash FILE`; both submit both jobs. Tiles
# that are missing are run again by `sbatch --array=LIST FILE`; LIST is what `biplane tiles merge` prints.
biplane=@PROGRAM@
tiles=@TILES@
model=@MODEL@

# submit_merge JOB: the model is built when every tile of the job is finished, and given up when one fails.
submit_merge() {
    sbatch --job-name=biplane-merge --dependency="afterok:$1" --kill-on-invalid-dep=yes --requeue --open-mode=append \
        --wrap="$(printf '%q ' "$biplane" tiles merge "$tiles" -o "$model" --force)"
}

if [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then
    job="$(sbatch --parsable --export=ALL,BIPLANE_MERGE=submitted "$0")" && submit_merge "$job"
    exit
fi
# The first task of the array submits the merge, once.
# shellcheck disable=SC2153  # both names are Slurm's
if [ -z "${BIPLANE_MERGE:-}" ] && [ "$SLURM_ARRAY_TASK_ID" = "$SLURM_ARRAY_TASK_MIN" ] &&
    [ "${SLURM_RESTART_COUNT:-0}" = 0 ]; then
    submit_merge "$SLURM_ARRAY_JOB_ID"
fi
exec "$biplane" tiles run "$tiles" --index "$SLURM_ARRAY_TASK_ID" --threads "${SLURM_CPUS_PER_TASK:-1}"
