#!/usr/bin/env bash
# Labels STEP files in an array of HyperQueue tasks, waits for them, and joins their shares:
#
#     hq server start &
#     hq alloc add slurm --time-limit 4h -- --partition=cpu     # or `hq worker start` on each node
#     SHARES=64 CPUS=4 ./hyperqueue.sh /shared/abc labels --unit solid
#
# The inputs may be a folder, an archive or a list, at the same path on every node. Further arguments are those of `partprobe
# label`. HyperQueue starts a task again if its worker is lost; the task then continues.
set -euo pipefail

shares=${SHARES:-64}
cpus=${CPUS:-1}
inputs=${1:?the first argument is what to label}
out=${2:?the second argument is a folder that all nodes see}

if [ -z "${HQ_TASK_ID:-}" ]; then
    mkdir -p "$out"
    job=$(hq --output-mode quiet submit --wait --name partprobe --array "0-$((shares - 1))" --cpus "$cpus" \
        --env "SHARES=$shares" --env "CPUS=$cpus" -- "$(realpath "$0")" "$@")
    # HyperQueue calls the wait a success if tasks failed, too. Shares of an earlier call must not be joined then.
    if ! hq --output-mode quiet job list --filter finished | grep -x "$job FINISHED" > /dev/null; then
        hq job cat "$job" stderr >&2
        echo "error: tasks of job $job failed; the same command continues" >&2
        exit 1
    fi
    exec partprobe merge "$out"/share-* --out "$out/dataset"
fi

# `exec`, so that the signal that HyperQueue sends to tasks of a lost worker reaches the program.
exec partprobe label "$inputs" --out "$out/share-$(printf '%05d' "$HQ_TASK_ID")" --shard "$((HQ_TASK_ID + 1))/$shares" \
    --jobs "$cpus" --resume --quiet "${@:3}"
