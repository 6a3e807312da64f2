#!/usr/bin/env bash
# Builds the wheel of Python: the module and the program. It needs Python with venv and pip.
# The wheel is written to wheels/ in the target folder, and its path is printed.
set -euo pipefail
cd "$(dirname "$0")/../.."
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
tools="$CARGO_TARGET_DIR/wheel-tools"
scripts=crates/python/partprobe.data/scripts

test -x "$tools/bin/python" || python3 -m venv "$tools"
"$tools/bin/python" -m pip install --quiet --disable-pip-version-check maturin==1.16.0

# With `--workspace` the libraries have the features that they have everywhere: maturin finds them compiled.
cargo build --release --locked --workspace --bin partprobe
rm -rf "$scripts"
mkdir -p "$scripts"
install -m 755 "$CARGO_TARGET_DIR/release/partprobe" "$scripts/partprobe"
strip "$scripts/partprobe"

# The tag of the wheel says which C library it needs at least. maturin looks at the module only, and the program may need a newer one.
newest=$(objdump -T "$scripts/partprobe" "$CARGO_TARGET_DIR/release/libpartprobe_python.so" |
    grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
tag="manylinux_${newest#GLIBC_}"
rm -f "$CARGO_TARGET_DIR"/wheels/partprobe-*.whl
"$tools/bin/maturin" build --quiet --release --locked --compatibility "${tag//./_}" \
    --manifest-path crates/python/Cargo.toml --out "$CARGO_TARGET_DIR/wheels"
ls "$CARGO_TARGET_DIR"/wheels/partprobe-*.whl
