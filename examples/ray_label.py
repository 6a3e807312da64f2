"""Labels STEP files on a Ray cluster, and writes Parquet shards.

    pip install 'ray[data]' pyarrow partprobe-*.whl
    python ray_label.py PATH… --out DIR [--address ADDRESS] [-- OPTIONS OF partprobe label]
    python ray_label.py /shared/abc --out /shared/labels --address auto -- --unit solid

Input: STEP files, folders, and archives (.zip, .tar, .tar.gz; .7z after `pip install py7zr`). They are on a disk that every node of
the cluster sees at the same path.
Output: `part-00000.parquet` and so on. Each shape has a row. A file without a shape has a row that gives its status and the reason,
as in `index.jsonl` of `partprobe label`. `partprobe label` reads the files in worker processes, so a file that crashes or takes too
long costs one row only.
Exit status: 0 if all shards are finished, 1 if not.

Ray distributes only the *names* of the files. Each task opens its files itself, so a retry by Ray cannot lose or repeat a row. The
script sorts the inputs and divides them into shards of `--shard-size` names. A shard has the same bytes on every node. It is written
to a temporary name and then renamed, and it records its inputs. To resume, run the same command again. It keeps the shards whose
record is right, and makes the others.
"""

import argparse
import hashlib
import json
import os
import pathlib
import resource
import shutil
import socket
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import partprobe
import pyarrow as pa
import pyarrow.parquet as pq

STEP_ENDINGS = tuple(
    f".{step}{packed}" for step in ("step", "stp", "p21", "ste") for packed in ("", ".gz", ".zst", ".xz")
) + (".stpz",)
TAR_ENDINGS = (".tar", ".tar.gz", ".tgz")
ARCHIVE_ENDINGS = (".zip", ".7z", *TAR_ENDINGS)
INPUTS_KEY = b"partprobe.inputs_sha256"

_INTEGERS, _TEXTS, _NUMBERS = pa.list_(pa.int32()), pa.list_(pa.string()), pa.list_(pa.float64())
# The columns of `partprobe export parquet`, with the status and the reason of the index.
SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("id", "source", "source_sha256", "status", "reason", "unit")]
    + [("solid_step_id", pa.uint64())]
    + [(name, pa.string()) for name in ("product", "kind", "settings_sha256")]
    + [("theta_deg", pa.float64()), ("tau_min", pa.uint64())]
    + [(name, pa.uint64()) for name in ("n_faces", "n_edges", "n_parts", "n_labels", "n_triangles")]
    + [("face_step_id", pa.list_(pa.uint64())), ("face_instance", _INTEGERS)]
    + [("face_type", _TEXTS), ("face_canonical_type", _TEXTS), ("face_part", _INTEGERS), ("face_label", _INTEGERS)]
    + [("face_area_mm2", _NUMBERS), ("edge_face_a", _INTEGERS), ("edge_face_b", _INTEGERS)]
    + [("edge_phi_deg", _NUMBERS), ("edge_length_mm", _NUMBERS)]
)


class Input(NamedTuple):
    """A STEP file, or a member of an archive: the name for its rows, its path, and its size."""

    source: str
    path: str
    member: str | None
    n_bytes: int


class Job(NamedTuple):
    """What every task gets: the folder for the shards, and the further arguments of `partprobe label`."""

    out: str
    options: list[str]


def is_step(name: str) -> bool:
    return name.lower().endswith(STEP_ENDINGS)


def members(archive: pathlib.Path) -> Iterator[tuple[str, int]]:
    """Yields the name and the size in bytes of each STEP file in an archive."""
    name = archive.name.lower()
    if name.endswith(".zip"):
        with zipfile.ZipFile(archive) as opened:
            yield from ((entry.filename, entry.file_size) for entry in opened.infolist() if is_step(entry.filename))
    elif name.endswith(".7z"):
        import py7zr

        with py7zr.SevenZipFile(archive) as opened:
            yield from ((entry.filename, entry.uncompressed) for entry in opened.list() if is_step(entry.filename))
    else:
        with tarfile.open(archive) as opened:
            yield from ((entry.name, entry.size) for entry in opened if entry.isfile() and is_step(entry.name))


def list_inputs(paths: Iterable[pathlib.Path]) -> list[Input]:
    """Returns all STEP files at the paths, sorted by name.

    The name of a file starts with the name of the argument that leads to it. Its rows get this name.
    """
    found: dict[str, Input] = {}
    for given in paths:
        if not given.exists():
            raise SystemExit(f"{given} does not exist")
        root = given.resolve()
        for path in sorted(p for p in root.rglob("*") if p.is_file()) if root.is_dir() else [root]:
            source = path.relative_to(root.parent).as_posix()
            if path.name.lower().endswith(ARCHIVE_ENDINGS):
                try:
                    inputs = [Input(f"{source}/{name}", str(path), name, size) for name, size in members(path)]
                except (OSError, EOFError, ValueError, tarfile.TarError, zipfile.BadZipFile) as error:
                    raise SystemExit(f"{path} cannot be listed ({error}); repair or remove it") from error
            elif is_step(path.name):
                inputs = [Input(source, str(path), None, path.stat().st_size)]
            else:
                continue
            for entry in inputs:
                if found.setdefault(entry.source, entry) != entry:
                    raise SystemExit(f"two inputs have the name {entry.source}; pass the folder that contains both")
    return [found[source] for source in sorted(found)]


def shard_name(number: int) -> str:
    return f"part-{number:05}.parquet"


def digest(inputs: list[Input], options: list[str]) -> str:
    """Returns a hash of the inputs, the options of `label`, and the versions that affect the bytes. A finished shard records it."""
    named = [[entry.source, entry.n_bytes] for entry in inputs]
    text = json.dumps([named, options, partprobe.__version__, pa.__version__])
    return hashlib.sha256(text.encode()).hexdigest()


def is_finished(out: str, number: int, expected: str) -> bool:
    """Returns whether the shard exists, can be read, and was made from these inputs."""
    try:
        metadata = pq.read_metadata(pathlib.Path(out) / shard_name(number)).metadata or {}
    except (OSError, pa.ArrowInvalid):
        return False
    return metadata.get(INPUTS_KEY) == expected.encode()


def lay_out(inputs: list[Input], folder: pathlib.Path) -> dict[int, str]:
    """Puts the inputs into a folder under their numbers: links to files, and extracted members of archives.

    Returns the reason for each input that is missing there.
    """
    missing: dict[int, str] = {}
    by_archive: dict[str, dict[str, int]] = {}
    for number, entry in enumerate(inputs):
        if entry.member is None:
            (folder / numbered(number, entry.path)).symlink_to(entry.path)
        else:
            by_archive.setdefault(entry.path, {})[entry.member] = number
    for archive, wanted in by_archive.items():
        try:
            unpack(pathlib.Path(archive), wanted, folder)
            reason = "the archive has no such member"
        except (OSError, EOFError, tarfile.TarError, zipfile.BadZipFile, ValueError) as error:
            reason = f"{archive}: {error}"
        for member, number in wanted.items():
            if not (folder / numbered(number, member)).exists():
                missing[number] = reason
    return missing


def numbered(number: int, name: str) -> str:
    """Returns a file name: the number with the ending of `name`. partprobe recognizes compressed files by their ending."""
    ending = next(ending for ending in sorted(STEP_ENDINGS, key=len, reverse=True) if name.lower().endswith(ending))
    return f"{number:06}{ending}"


def unpack(archive: pathlib.Path, wanted: dict[str, int], folder: pathlib.Path) -> None:
    """Extracts members of an archive into a folder, under their numbers."""
    name = archive.name.lower()
    if name.endswith(".7z"):
        import py7zr

        with tempfile.TemporaryDirectory(dir=folder.parent) as scratch, py7zr.SevenZipFile(archive) as opened:
            opened.extract(path=scratch, targets=list(wanted))
            for member, number in wanted.items():
                (pathlib.Path(scratch) / member).rename(folder / numbered(number, member))
    elif name.endswith(".zip"):
        with zipfile.ZipFile(archive) as zipped:
            for member, number in wanted.items():
                with zipped.open(member) as source:
                    write(source, folder / numbered(number, member))
    else:
        with tarfile.open(archive) as tarred:
            for entry in tarred:
                if entry.name in wanted and entry.isfile():
                    write(tarred.extractfile(entry), folder / numbered(wanted[entry.name], entry.name))


def write(source: Any, path: pathlib.Path) -> None:
    """Copies an open file to a path. If the file ends early, nothing exists at the path."""
    unfinished = path.with_suffix(".unfinished")
    with open(unfinished, "wb") as target:
        shutil.copyfileobj(source, target)
    unfinished.rename(path)


def run_program(*arguments: str) -> "subprocess.CompletedProcess[str]":
    """Runs `partprobe` from the environment of this Python, and returns the finished process with its output."""
    program = pathlib.Path(sys.executable).with_name("partprobe")
    return subprocess.run([str(program), *arguments], capture_output=True, text=True)


def label(scratch: pathlib.Path, names: list[str], options: list[str]) -> list[dict[str, Any]]:
    """Returns the rows of the files in `scratch/in`, without their sources.

    If partprobe itself crashes, this function labels the files one by one to find the cause.
    """
    if not names:
        return []
    dataset, tables = scratch / "dataset", scratch / "tables"
    for folder in (dataset, tables):
        shutil.rmtree(folder, ignore_errors=True)
    (scratch / "list.txt").write_text("".join(f"in/{name}\n" for name in names))
    done = run_program(
        "label", "--list", str(scratch / "list.txt"), "--out", str(dataset), "--jobs", "1", "--quiet", *options
    )
    if done.returncode < 0:
        if len(names) > 1:
            return [row for name in names for row in label(scratch, [name], options)]
        return [{"number": number_of(names[0]), "status": "crashed", "reason": f"partprobe ended by signal {-done.returncode}"}]
    if not (dataset / "index.jsonl").exists():
        raise RuntimeError(f"partprobe label: exit status {done.returncode}: {done.stderr[-2000:]}")
    index = [json.loads(line) for line in (dataset / "index.jsonl").read_text().splitlines()]
    rows = {}
    if any(line["status"] == "ok" for line in index):
        exported = run_program("export", "parquet", str(dataset), "--out", str(tables), "--jobs", "1", "--quiet")
        if exported.returncode != 0:
            raise RuntimeError(f"partprobe export parquet: {exported.stderr[-2000:]}")
        for file in sorted(tables.glob("part-*.parquet")):
            rows.update({row["id"]: row for row in pq.read_table(file).to_pylist()})
    return [
        rows.get(line["id"], {"solid_step_id": line["solid_step_id"], "product": line["product"]})
        | {"number": number_of(line["source"]), "status": line["status"], "reason": line["reason"]}
        | {"source_sha256": line["sha256"] if "sha256" in line else None}
        for line in index
    ]


def number_of(source: str) -> int:
    """Returns the number of an input from the name of its file in the folder."""
    return int(pathlib.PurePath(source).name.split(".")[0])


def label_shard(number: int, inputs: list[Input], job: Job) -> dict[str, Any]:
    """Labels the inputs of one shard and writes its file, unless it is finished. Returns its number, an error, and CPU seconds."""
    expected = digest(inputs, job.options)
    if is_finished(job.out, number, expected):
        return {"shard": number, "error": "", "cpu_s": 0.0}
    before = cpu_seconds()
    with tempfile.TemporaryDirectory(prefix="partprobe-shard-") as folder:
        scratch = pathlib.Path(folder)
        (scratch / "in").mkdir()
        missing = lay_out(inputs, scratch / "in")
        there = [numbered(i, entry.member or entry.path) for i, entry in enumerate(inputs) if i not in missing]
        rows = label(scratch, there, job.options)
    rows += [{"number": i, "status": "failed", "reason": reason} for i, reason in missing.items()]
    for row in rows:
        row["source"] = inputs[row["number"]].source
        row["id"] = row["source"] if row.get("solid_step_id") is None else f"{row['source']}#{row['solid_step_id']}"
    # A second attempt at the same shard may still be running on a node that was thought to be dead.
    unfinished = pathlib.Path(job.out) / f".{shard_name(number)}.{socket.gethostname()}-{os.getpid()}"
    rows.sort(key=lambda row: (row["number"], row.get("solid_step_id") or 0))
    columns = {name: [row.get(name) for row in rows] for name in SCHEMA.names}
    metadata = {b"partprobe.schema": b"shapes-with-status", INPUTS_KEY: expected.encode()}
    table = pa.Table.from_pydict(columns, schema=SCHEMA.with_metadata(metadata))
    pq.write_table(table, unfinished, compression="zstd")
    unfinished.replace(pathlib.Path(job.out) / shard_name(number))
    return {"shard": number, "error": "", "cpu_s": cpu_seconds() - before}


def cpu_seconds() -> float:
    """Returns the CPU seconds of this process and of the programs that it ran."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def run_on_ray(todo: dict[int, list[Input]], job: Job) -> list[dict[str, Any]]:
    """Runs one task per shard, and returns their results. An error is part of a result, so it does not stop the other tasks."""
    import ray.data

    def task(row: dict[str, Any]) -> dict[str, Any]:
        try:
            return label_shard(row["shard"], [Input(*entry) for entry in json.loads(row["inputs"])], job)
        except Exception as error:
            return {"shard": row["shard"], "error": f"{type(error).__name__}: {error}", "cpu_s": 0.0}

    rows = [{"shard": number, "inputs": json.dumps(inputs)} for number, inputs in todo.items()]
    dataset = ray.data.from_items(rows, override_num_blocks=len(rows))
    return dataset.map(task, num_cpus=1).take_all()


def check_record(out: pathlib.Path, record: dict[str, Any]) -> None:
    """Refuses a folder with the shards of another batch, before a shard is replaced. Otherwise it writes the record of this batch."""
    path = out / "inputs.json"
    if path.exists() and json.loads(path.read_text()) != record:
        raise SystemExit(f"{out} was made from other inputs, options or versions (see {path}); choose another folder")
    unfinished = out / f".inputs.json.{os.getpid()}"
    unfinished.write_text(json.dumps(record, indent=1) + "\n")
    unfinished.replace(path)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--shard-size", type=int, default=1000, help="number of inputs in a shard (default: %(default)s)")
    parser.add_argument("--address", help="address of a running cluster, for example `auto`; without it, Ray starts one on this machine")
    parser.add_argument("--attempts", type=int, default=3, help="number of attempts for each shard (default: %(default)s)")
    arguments = sys.argv[1:]
    cut = arguments.index("--") if "--" in arguments else len(arguments)
    parsed = parser.parse_args(arguments[:cut])
    # The arguments after `--` go to `partprobe label`.
    parsed.options = arguments[cut + 1 :]
    return parsed


def main() -> int:
    arguments = parse_arguments()
    inputs = list_inputs(arguments.paths)
    if not inputs:
        raise SystemExit("there is no STEP file at these paths")
    arguments.out.mkdir(parents=True, exist_ok=True)
    job = Job(str(arguments.out.resolve()), arguments.options)
    size = arguments.shard_size
    shards = {first // size: inputs[first : first + size] for first in range(0, len(inputs), size)}
    record = {"inputs": len(inputs), "shard_size": size, "options": job.options, "sha256": digest(inputs, job.options)}
    check_record(arguments.out, record)

    def unfinished() -> dict[int, list[Input]]:
        return {n: shard for n, shard in shards.items() if not is_finished(job.out, n, digest(shard, job.options))}

    import ray

    errors: dict[int, str] = {}
    cpu_s, todo = 0.0, unfinished()
    print(f"{len(inputs)} inputs in {len(shards)} shards, {len(shards) - len(todo)} of them finished", flush=True)
    for _ in range(arguments.attempts):
        if not todo:
            break
        ray.init(address=arguments.address, ignore_reinit_error=True)
        for row in run_on_ray(todo, job):
            errors[row["shard"]] = row["error"]
            cpu_s += row["cpu_s"]
        # Only a shard on the disk is finished, whatever Ray reports.
        todo = unfinished()
    for number in todo:
        print(f"error: {shard_name(number)}: {errors.get(number) or 'no task finished it'}", file=sys.stderr)
    if todo:
        return 1
    for leftover in arguments.out.glob(".part-*"):
        leftover.unlink(missing_ok=True)
    statuses = pa.concat_arrays(
        [chunk for n in shards for chunk in pq.read_table(f"{job.out}/{shard_name(n)}", columns=["status"])["status"].chunks]
    )
    counts = {count["values"]: count["counts"] for count in statuses.value_counts().to_pylist()}
    print(f"rows: {', '.join(f'{counts[status]} {status}' for status in sorted(counts))}; {cpu_s:.1f} CPU seconds")
    return 0


if __name__ == "__main__":
    sys.exit(main())
