#!/usr/bin/env bash
# Proves that the expectations of a config detect faults of the training: inject_faults.sh PROGRAM [CONFIG]
# It runs the config without a fault, and once with each fault. The run without a fault must meet its expectations (exit code 0).
# Each other run must miss an expectation (exit code 3). It exits with 1 if a run ends otherwise.
set -euo pipefail
program=$1
config=${2:-smoke}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0

run() {
    local name=$1 expected=$2 code=0
    shift 2
    "$program" run "$config" --out "$folder/$name" "$@" >"$folder/$name.txt" 2>&1 || code=$?
    printf '%s: exit code %s in %s s\n' "$name" "$code" "$SECONDS"
    grep '^expectation' "$folder/$name.txt" || true
    [ "$code" -eq "$expected" ] || { echo "$name: expected exit code $expected" >&2 && status=1; }
    SECONDS=0
}

SECONDS=0
run sound 0
run learning-rate-0 3 --set optim.learning_rate=0
for fault in flip-loss shuffle-labels freeze-encoder zero-block-gradient; do
    run "$fault" 3 --inject-fault "$fault"
done
exit "$status"
