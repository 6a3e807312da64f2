#!/usr/bin/env bash
# Labels one share of STEP files in each task of a Slurm array:
#
#     mkdir -p labels
#     job=$(sbatch --parsable slurm_array.sh /shared/abc labels --unit solid)
#     sbatch --dependency=afterok:"$job" --wrap "partprobe merge labels/share-* --out labels/dataset"
#
# The inputs may be a folder, an archive or a list, at the same path on every node. Further arguments are those of `partprobe
# label`. A task that was killed, or requeued, continues; a task that runs twice changes nothing. To repeat some tasks, use for
# example `sbatch --array=5,9 slurm_array.sh …`: the number of shares stays the same.
#SBATCH --job-name=partprobe
#SBATCH --array=0-63
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail

# As many as the array has tasks. Shares of one batch must agree on it.
shares=${SHARES:-64}
inputs=${1:?the first argument is what to label}
out=${2:?the second argument is a folder that all nodes see}
task=${SLURM_ARRAY_TASK_ID:?submit this with sbatch}
if [ "$task" -ge "$shares" ]; then
    echo "error: task $task of $shares shares; set SHARES to the number of tasks" >&2
    exit 2
fi

exec partprobe label "$inputs" --out "$out/share-$(printf '%05d' "$task")" --shard "$((task + 1))/$shares" \
    --jobs "${SLURM_CPUS_PER_TASK:-1}" --resume --quiet "${@:3}"
