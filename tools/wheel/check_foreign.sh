#!/usr/bin/env bash
# Installs the wheel for aarch64 in a Debian of that processor, and runs its tests there: tools/wheel/check_foreign.sh [PROGRAM]
# With PROGRAM, a program of this machine, generated parts must have the same bytes from both. It needs root, debootstrap, pip, and
# qemu-aarch64-static with an entry in binfmt_misc that has the flag F (Debian's qemu-user-static): the kernel then runs programs of
# that processor in a root that does not contain the emulator. The root is kept in foreign/ of the target folder.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$(realpath "${CARGO_TARGET_DIR:-target}")
root="$build/foreign/bookworm-arm64"
# The Python of that Debian.
version=3.11
grep -qs '^flags:.*F' /proc/sys/fs/binfmt_misc/qemu-aarch64* || {
    echo "error: /proc/sys/fs/binfmt_misc has no entry qemu-aarch64 with the flag F; mount it, and register qemu-aarch64-static" >&2
    exit 1
}
wheel=$(echo "$build"/wheels/partprobe-*_aarch64.whl)
test -f "$wheel" || { echo "error: no wheel for aarch64; see tools/wheel/build.sh" >&2; exit 1; }

if [ ! -e "$root/complete" ]; then
    rm -rf "$root"
    debootstrap --foreign --variant=minbase --arch=arm64 --include=python3-venv bookworm "$root" > /dev/null
    # Python works without the scripts of the packages, so that their second stage, slow in the emulator, is not needed.
    for package in "$root"/var/cache/apt/archives/*.deb; do dpkg-deb --extract "$package" "$root"; done
    touch "$root/complete"
fi

# This machine's pip brings what the wheel needs: the root has no network.
rm -rf "$root/wheels" "$root/environment" "$root/tmp/check"
python3 -m pip download --quiet --disable-pip-version-check --dest "$root/wheels" --only-binary :all: \
    --python-version "$version" --platform manylinux_2_28_aarch64 --platform manylinux2014_aarch64 --platform manylinux_2_17_aarch64 \
    "$wheel"

# Runs a program in the root, with the sources at /sources. The mounts end with it.
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
    echo "the same bytes as $1"
fi
