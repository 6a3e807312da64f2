#!/usr/bin/env bash
# Builds the Python wheel, which contains the module and the program: tools/wheel/build.sh [TARGET]
# Output: the wheel in wheels/ of the target folder, and its path as the last line on stdout. It needs Python with venv and pip.
# TARGET, such as aarch64-unknown-linux-gnu or x86_64-unknown-linux-gnu, builds a wheel that can be published: it runs with the C library
# of 2012 and contains no paths of this machine. This needs rustup. pip installs zig, which is the linker.
set -euo pipefail
cd "$(dirname "$0")/../.."
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
tools="$CARGO_TARGET_DIR/wheel-tools"
scripts=crates/python/partprobe.data/scripts
target=${1:-}
# The C library of 2012. Every Linux system with glibc that can install wheels from PyPI today has it or a newer one.
oldest=2.17

test -x "$tools/bin/python" || python3 -m venv "$tools"
"$tools/bin/python" -m pip install --quiet --disable-pip-version-check maturin==1.16.0
built="$CARGO_TARGET_DIR/release"
# A wheel to publish names its commit in `partprobe --version` and in the records of runs. Without a target, the variable would make
# cargo compile again what the tests have compiled.
if [ -n "$target" ] && commit=$(git rev-parse HEAD 2>/dev/null); then
    export PARTPROBE_COMMIT="${PARTPROBE_COMMIT:-$commit}"
fi
# The module's library is also built here, because the tag of the wheel depends on it.
what=(--bins --lib)
for_target=()
if [ -n "$target" ]; then
    "$tools/bin/python" -m pip install --quiet --disable-pip-version-check cargo-zigbuild==0.24.1 ziglang==0.17.1
    rustup target add "$target" >&2
    export PATH="$tools/bin:$PATH"
    built="$CARGO_TARGET_DIR/$target/release"
    what=(--bin partprobe)
    for_target=(--target "$target")
    # Both builds use this linker. With the different linkers of cargo-zigbuild and maturin, cargo would compile everything twice.
    linker="$tools/bin/link-$target"
    printf '#!/bin/sh\nexec "%s" zig cc -- -target %s "$@"\n' "$tools/bin/cargo-zigbuild" "${target/-unknown/}.$oldest" > "$linker"
    chmod +x "$linker"
    variable="CARGO_TARGET_${target^^}_LINKER"
    export "${variable//-/_}=$linker"
    # cargo strips the program, because `strip` of this machine does not know the other processor.
    export CARGO_PROFILE_RELEASE_STRIP=symbols
    # These flags are set only for a target. Otherwise, cargo would compile again what the tests have compiled.
    export RUSTFLAGS="--remap-path-prefix=$PWD=/partprobe --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=/cargo"
fi

# With `--workspace`, the libraries have the same features as in other builds, so maturin finds them compiled.
cargo build --release --locked --workspace "${what[@]}" "${for_target[@]}"
rm -rf "$scripts"
mkdir -p "$scripts"
install -m 755 "$built/partprobe" "$scripts/partprobe"
if [ -z "$target" ]; then strip "$scripts/partprobe"; fi

# The tag of the wheel says which C library it needs at least. It is computed here, because maturin looks only at the module, and the
# program may need a newer C library.
if [ -z "$target" ]; then
    newest=$(objdump -T "$scripts/partprobe" "$built/libpartprobe_python.so" |
        grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
    tag="manylinux_${newest#GLIBC_}"
else
    tag="manylinux_$oldest"
fi
wheels="partprobe-*_${target%%-*}.whl"
test -n "$target" || wheels="partprobe-*_$(uname -m).whl"
find "$CARGO_TARGET_DIR/wheels" -name "$wheels" -delete 2> /dev/null || true
"$tools/bin/maturin" build --quiet --release --locked --compatibility "${tag//./_}" "${for_target[@]}" \
    --manifest-path crates/python/Cargo.toml --out "$CARGO_TARGET_DIR/wheels"
find "$CARGO_TARGET_DIR/wheels" -name "$wheels"
