#!/usr/bin/env bash
# Runs the program of an archive in a root that contains only the C library of this machine: tools/dist/check.sh ARCHIVE [PROGRAM]
# With PROGRAM, both programs must label generated parts with the same bytes.
# It needs unshare and chroot, and only the rights of a user. The root has no Rust, no Python and no shell.
# An archive for aarch64 needs qemu-aarch64, the C library of arm64, and an entry for the emulator in binfmt_misc, with which the kernel
# starts the label workers. Without this entry, the emulated program ends with status 0 as soon as it starts a worker.
set -euo pipefail
archive=$(realpath "${1:?pass an archive as the first argument}")
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mkdir "$root/tmp" "$root/proc"
tar -C "$root" --strip-components=1 -xf "$archive"
test -f "$root/LICENSE-MIT" -a -f "$root/README.md" -a -f "$root/completions/partprobe.bash" || {
    echo "error: the archive lacks a license, the README or a completion" >&2
    exit 1
}

# Copies the loader and the libraries that the program names. A static program names none.
interpreter=$(readelf -l "$root/partprobe" | sed -n 's/.*interpreter: \(.*\)\]/\1/p')
sysroot=
case "$archive" in *aarch64*) sysroot=/usr/aarch64-linux-gnu ;; esac
if [ -n "$interpreter" ]; then
    install -D "$sysroot$interpreter" "$root$interpreter"
    folder=$(dirname "$(realpath "$sysroot$interpreter")")
    for library in $(readelf -d "$root/partprobe" | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p'); do
        test -e "$root/lib/$library" || install -D "$folder/$library" "$root/lib/$library"
    done
fi

inside() {
    if [ -n "$sysroot" ]; then
        # The emulator is not in the root. It runs outside, and the program gets the libraries of the root.
        (cd "$root" && QEMU_LD_PREFIX="$root" qemu-aarch64 "$root/partprobe" "$@")
    else
        # The program finds its own path in `/proc` when it starts a worker. Containers have `/proc`, too.
        unshare --map-root-user --mount --pid --fork --mount-proc="$root/proc" chroot "$root" /partprobe "$@"
    fi
}
if [ -n "$sysroot" ] && [ ! -e /proc/sys/fs/binfmt_misc/qemu-aarch64 ]; then
    echo "error: the kernel has no entry qemu-aarch64 in /proc/sys/fs/binfmt_misc; mount binfmt_misc and register the emulator" >&2
    exit 1
fi
inside --version
inside synth --out tmp/parts -n 20 --seed 3 --quiet
inside label tmp/parts --out tmp/dataset --quiet
# The program that was built here must write the same bytes, if it is given.
if [ -n "${2:-}" ]; then
    "$2" label "$root/tmp/parts" --out "$root/tmp/here" --quiet > "$root/tmp/log"
    diff --recursive --exclude timing.jsonl "$root/tmp/dataset" "$root/tmp/here"
    echo "the data set has the same bytes as that of $2"
fi
