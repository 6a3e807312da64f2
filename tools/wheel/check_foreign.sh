#!/usr/bin/env bash
# Installs the aarch64 wheel in an emulated Debian for aarch64, and runs its tests there: tools/wheel/check_foreign.sh [PROGRAM]
# With PROGRAM, a program of this machine, both programs must label generated parts with the same bytes.
# It needs root, debootstrap, pip, and qemu-aarch64-static with an entry in binfmt_misc that has the flag F (Debian's qemu-user-static).
# With this flag, the kernel runs aarch64 programs in a root that does not contain the emulator. The Debian root is kept in foreign/ of
# the target folder.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(realpath "${CARGO_TARGET_DIR:-target}")
root="$build/foreign/bookworm-arm64"
# The version of Python in that Debian.
version=3.11
grep -qs '^flags:.*F' /proc/sys/fs/binfmt_misc/qemu-aarch64* || {
    echo "error: /proc/sys/fs/binfmt_misc has no entry qemu-aarch64 with the flag F; mount binfmt_misc and register qemu-aarch64-static" >&2
    exit 1
}
wheel=$(echo "$build"/wheels/partprobe-*_aarch64.whl)
test -f "$wheel" || { echo "error: there is no wheel for aarch64; build it with tools/wheel/build.sh aarch64-unknown-linux-gnu" >&2; exit 1; }

if [ ! -e "$root/complete" ]; then
    rm -rf "$root"
    debootstrap --foreign --variant=minbase --arch=arm64 --include=python3-venv bookworm "$root" > /dev/null
    # Python works without the install scripts of the packages. So the second stage of debootstrap, which is slow in the emulator, is
    # not run.
    for package in "$root"/var/cache/apt/archives/*.deb; do dpkg-deb --extract "$package" "$root"; done
    touch "$root/complete"
fi

# pip of this machine downloads the dependencies of the wheel, because the root has no network.
rm -rf "$root/wheels" "$root/environment" "$root/tmp/check"
python3 -m pip download --quiet --disable-pip-version-check --dest "$root/wheels" --only-binary :all: \
    --python-version "$version" --platform manylinux_2_28_aarch64 --platform manylinux2014_aarch64 --platform manylinux_2_17_aarch64 \
    "$wheel"

# Runs a program in the root, with the sources at /sources. The mounts disappear when the program ends.
inside() {
    # shellcheck disable=SC2016
    root="$root" unshare --mount --pid --fork --mount-proc="$root/proc" bash -euc '
        mkdir -p "$root/sources"
        mount --rbind /dev "$root/dev"
        mount --bind . "$root/sources"
        exec chroot "$root" /usr/bin/env --chdir=/sources PYTHONDONTWRITEBYTECODE=1 "$@"' - "$@"
}
inside python3 -m venv /environment
inside /environment/bin/python -m pip install --quiet --disable-pip-version-check --no-index --find-links /wheels partprobe
inside /environment/bin/python -c 'import platform, partprobe; print(platform.machine(), partprobe.__version__)'
inside /environment/bin/python -m unittest discover --start-directory crates/python/tests
inside /environment/bin/partprobe --version
inside /environment/bin/partprobe synth --out /tmp/check/parts -n 20 --seed 3 --quiet
inside /environment/bin/partprobe label /tmp/check/parts --out /tmp/check/dataset --quiet
if [ -n "${1:-}" ]; then
    "$1" label "$root/tmp/check/parts" --out "$root/tmp/check/here" --quiet > /dev/null
    diff --recursive --exclude timing.jsonl "$root/tmp/check/dataset" "$root/tmp/check/here"
    echo "the data set has the same bytes as that of $1"
fi
