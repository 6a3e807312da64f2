#!/usr/bin/env bash
# Labels STEP files in an array of HyperQueue tasks, waits for the tasks, and merges their shares:
#
#     hq server start &
#     hq alloc add slurm --time-limit 4h -- --partition=cpu     # or `hq worker start` on each node
#     SHARES=64 CPUS=4 ./hyperqueue.sh /shared/abc labels --unit solid
#
# The first argument is a folder, an archive or a list. Every node must see it at the same path. The second argument is the output
# folder. Further arguments go to `partprobe label`. If HyperQueue loses a worker, it starts the task again, and the task resumes.
set -euo pipefail

shares=${SHARES:-64}
cpus=${CPUS:-1}
inputs=${1:?pass the STEP files as the first argument: a folder, an archive or a list}
out=${2:?pass the output folder as the second argument; all nodes must see it}

if [ -z "${HQ_TASK_ID:-}" ]; then
    mkdir -p "$out"
    job=$(hq --output-mode quiet submit --wait --name partprobe --array "0-$((shares - 1))" --cpus "$cpus" \
        --env "SHARES=$shares" --env "CPUS=$cpus" -- "$(realpath "$0")" "$@")
    # The wait of HyperQueue succeeds even if tasks failed. In that case, this script must not merge shares of an earlier call.
    if ! hq --output-mode quiet job list --filter finished | grep -x "$job FINISHED" > /dev/null; then
        hq job cat "$job" stderr >&2
        echo "error: tasks of job $job failed; run the same command again to resume" >&2
        exit 1
    fi
    exec partprobe merge "$out"/share-* --out "$out/dataset"
fi

# HyperQueue sends a signal to the tasks of a lost worker. `exec` makes sure that partprobe receives it.
exec partprobe label "$inputs" --out "$out/share-$(printf '%05d' "$HQ_TASK_ID")" --shard "$((HQ_TASK_ID + 1))/$shares" \
    --jobs "$cpus" --resume --quiet "${@:3}"
