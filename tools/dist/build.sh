#!/usr/bin/env bash
# Builds archives of the program for machines without Rust and Python: tools/dist/build.sh [--label-only] [NAME…]
# Input: the names of archives (see the table below; the default is all that use glibc), and the sources of this checkout.
# Output: dist/partprobe-VERSION-NAME.tar.gz in the target folder for each name, and dist/SHA256SUMS.
# It needs cargo with rustup, and Python with venv and pip. pip installs zig, which is the linker. Nothing is published.
set -euo pipefail
cd "$(dirname "$0")/../.."
build="${CARGO_TARGET_DIR:-$PWD/target}"
dist="$build/dist"
tools="$build/dist-tools"

# Each line has the name of an archive, the Rust target with the oldest C library on which the program runs, and the processor.
targets() {
    cat <<'TABLE'
x86_64-unknown-linux-gnu x86_64-unknown-linux-gnu.2.17 x86-64
x86_64_v3-unknown-linux-gnu x86_64-unknown-linux-gnu.2.17 x86-64-v3
aarch64-unknown-linux-gnu aarch64-unknown-linux-gnu.2.17 generic
x86_64-unknown-linux-musl x86_64-unknown-linux-musl x86-64
TABLE
}

features=()
if [ "${1:-}" = --label-only ]; then
    features=(--no-default-features --features label)
    shift
fi
# The first program must run on this machine, because it writes the manual pages and the completions of all archives.
names=("${@:-}")
test -n "${names[0]}" || mapfile -t names < <(targets | awk '$1 ~ /gnu$/ { print $1 }')

version=$(sed -n '/^\[workspace.package\]/,/^version/s/^version = "\(.*\)"/\1/p' Cargo.toml)
commit=$(git rev-parse HEAD)
test -z "$(git status --porcelain)" || commit="$commit, changed"
# The archives must not depend on the machine. So the time is that of the commit, and the paths of the sources are replaced below.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH PARTPROBE_COMMIT="$commit" CARGO_PROFILE_RELEASE_STRIP=symbols CARGO_TARGET_DIR="$build/dist-build"
cargo_home="${CARGO_HOME:-$HOME/.cargo}"

test -x "$tools/bin/python" || python3 -m venv "$tools"
"$tools/bin/python" -m pip install --quiet --disable-pip-version-check cargo-zigbuild==0.24.1 ziglang==0.17.1
export PATH="$tools/bin:$PATH"

# Compiles the program for one line of the table, and prints its path.
compile() {
    local target=$1 cpu=$2 triple=${1%.2.17}
    rustup target add "$triple" >&2
    RUSTFLAGS="-C target-cpu=$cpu --remap-path-prefix=$PWD=/partprobe --remap-path-prefix=$cargo_home=/cargo" \
        cargo zigbuild --release --locked -p partprobe --bin partprobe "${features[@]}" --target "$target" \
        --jobs "${PARTPROBE_BUILD_JOBS:-$(nproc)}" >&2
    echo "$CARGO_TARGET_DIR/$triple/release/partprobe"
}

# Fills the folder of an archive with the program, its licenses, its manual pages and its completions.
fill() {
    local folder=$1 program=$2 runs_here=$3 shell
    mkdir -p "$folder/completions"
    install -m 755 "$program" "$folder/partprobe"
    install -m 644 README.md LICENSE-MIT LICENSE-APACHE CHANGELOG.md "$folder"
    "$runs_here" man --out "$folder/man" >&2
    for shell in bash zsh fish; do
        "$runs_here" completions "$shell" > "$folder/completions/partprobe.$shell"
    done
}

runs_here=
mkdir -p "$dist"
for name in "${names[@]}"; do
    read -r target cpu < <(targets | awk -v name="$name" '$1 == name { print $2, $3 }') || {
        echo "error: $name is not one of: $(targets | awk '{ print $1 }' | paste -sd ' ')" >&2
        exit 2
    }
    program=$(compile "$target" "$cpu")
    archive="partprobe-$version-$name"
    rm -rf "${dist:?}/$archive" "$dist/$archive.tar.gz"
    : "${runs_here:=$program}"
    fill "$dist/$archive" "$program" "$runs_here"
    # The next program for the same target overwrites this one, so the copy in the archive is used from now on.
    test "$runs_here" != "$program" || runs_here="$dist/$archive/partprobe"
    tar -C "$dist" --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=go=rX,u+rw,a-s \
        -cf - "$archive" | gzip -9n > "$dist/$archive.tar.gz"
done
(cd "$dist" && sha256sum partprobe-*.tar.gz > SHA256SUMS && cat SHA256SUMS)
