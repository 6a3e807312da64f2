#!/usr/bin/env bash
# Labels one share of STEP files in each task of a Slurm array:
#
#     mkdir -p labels
#     job=$(sbatch --parsable slurm_array.sh /shared/abc labels --unit solid)
#     sbatch --dependency=afterok:"$job" --wrap "partprobe merge labels/share-* --out labels/dataset"
#
# The first argument is a folder, an archive or a list. Every node must see it at the same path. The second argument is the output
# folder. Further arguments go to `partprobe label`. A task that was killed or requeued resumes. A second run of a finished task
# changes nothing. To repeat some tasks, use for example `sbatch --array=5,9 slurm_array.sh …`. The number of shares stays the same.
#SBATCH --job-name=partprobe
#SBATCH --array=0-63
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail

# The number of tasks of the array. It must be the same for all shares of a batch.
shares=${SHARES:-64}
inputs=${1:?pass the STEP files as the first argument: a folder, an archive or a list}
out=${2:?pass the output folder as the second argument; all nodes must see it}
task=${SLURM_ARRAY_TASK_ID:?submit this with sbatch}
if [ "$task" -ge "$shares" ]; then
    echo "error: task $task has no share, since there are $shares shares; set SHARES to the number of tasks" >&2
    exit 2
fi

exec partprobe label "$inputs" --out "$out/share-$(printf '%05d' "$task")" --shard "$((task + 1))/$shares" \
    --jobs "${SLURM_CPUS_PER_TASK:-1}" --resume --quiet "${@:3}"
