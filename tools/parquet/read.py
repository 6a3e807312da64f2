"""Reads the Parquet and WebDataset files of partprobe with other libraries, and compares the values.

    read.py PROGRAM FOLDER

Input: the program, and FOLDER, which must not exist.
Output: one line per library on stdout. An AssertionError names the library and the shape that differ.
Needs numpy, pandas, pyarrow, polars, duckdb, datasets and webdataset (`.ci/parquet` installs them).

The script generates twelve parts, labels, exports and releases them. It reads the tables with pandas (pyarrow), polars, DuckDB and Hugging
Face `datasets`, and the tar files with tarfile and `webdataset`. Each library must return the ids, labels and angles of the carriers, which
NumPy reads.
"""

import io
import json
import pathlib
import subprocess
import sys
import tarfile

import duckdb
import numpy
import pandas
import polars
import pyarrow.parquet
import webdataset

N_PARTS = 12
SHARD_SIZE = 5
# The columns of the tables, and the arrays of the carriers with the same numbers.
ARRAYS = {
    "face_step_id": "face_step_id",
    "face_instance": "face_instance",
    "face_part": "face_part",
    "face_label": "face_label",
    "face_label_smooth-12": "face_label_smooth-12",
    "face_area_mm2": "face_area",
    "edge_phi_deg": "edge_phi",
    "edge_length_mm": "edge_length",
}


def partprobe(program, folder, *arguments):
    """Runs the program in a folder."""
    subprocess.run([program, *arguments], cwd=folder, check=True, capture_output=True, text=True)


def numbers(values):
    """Returns a list of a table as an array. A missing angle becomes NaN."""
    return numpy.array([numpy.nan if value is None else value for value in values])


def check_rows(reader, rows, carriers, columns):
    """Checks that the rows of a table equal the carriers. `rows` are dictionaries with the columns and the id."""
    rows = list(rows)
    assert [row["id"] for row in rows] == list(carriers), f"{reader}: the ids differ"
    for row in rows:
        carrier = carriers[row["id"]]
        for column, array in columns.items():
            found, expected = numbers(row[column]), carrier[array]
            assert numpy.array_equal(found, expected, equal_nan=found.dtype.kind == "f"), f"{reader}: {row['id']}, {column}"
        pairs = numpy.stack([row["edge_face_a"], row["edge_face_b"]], axis=1).reshape(-1, 2)
        assert numpy.array_equal(pairs, carrier["edge_faces"]), f"{reader}: {row['id']}, edges"
    print(f"{reader}: {len(rows)} shapes equal the carriers")


def read_tables(folder, carriers, columns):
    """Reads all Parquet files of a folder with each library."""
    files = sorted(str(path) for path in folder.glob("*.parquet"))
    assert len(files) == -(-N_PARTS // SHARD_SIZE)

    frame = pandas.concat([pandas.read_parquet(file, engine="pyarrow") for file in files], ignore_index=True)
    check_rows("pandas", frame.to_dict("records"), carriers, columns)
    check_rows("polars", polars.read_parquet(files).iter_rows(named=True), carriers, columns)

    table = duckdb.sql(f"SELECT * FROM read_parquet({files})")
    named = [dict(zip(table.columns, row)) for row in table.fetchall()]
    check_rows("DuckDB", named, carriers, columns)
    query = f"SELECT sum(len(face_label)) FROM read_parquet({files}) WHERE list_contains(face_type, 'plane')"
    n_faces = sum(len(carrier["face_label"]) for carrier in carriers.values() if 0 in carrier["face_type"])
    assert duckdb.sql(query).fetchall() == [(n_faces,)]

    import datasets

    datasets.disable_progress_bars()
    loaded = datasets.load_dataset("parquet", data_files=files, split="train", cache_dir=str(folder / "cache"))
    check_rows("datasets", loaded, carriers, columns)


def read_metadata(file, schema):
    """Checks that the metadata of a file names its schema."""
    metadata = pyarrow.parquet.read_metadata(file).metadata
    assert metadata[b"partprobe.schema"] == schema, metadata
    assert metadata[b"partprobe.schema_version"] == b"1", metadata


def read_tars(folder, carriers):
    """Reads the samples with tarfile and with webdataset."""
    files = sorted(folder.glob("*.tar"))
    assert len(files) == -(-N_PARTS // SHARD_SIZE)
    found = {}
    for file in files:
        with tarfile.open(file) as tar:
            for member in tar:
                assert member.mtime == 0 and member.uid == 0 and member.gid == 0
                found[member.name] = tar.extractfile(member).read()
    assert list(found) == [f"{key}.{ending}" for key in sorted(carriers) for ending in ("npz", "json")]
    for key, carrier in carriers.items():
        facts = json.loads(found[f"{key}.json"])
        assert facts["id"] == key and facts["n_faces"] == len(carrier["face_label"])
        arrays = numpy.load(io.BytesIO(found[f"{key}.npz"]))
        different = [name for name in carrier.files if arrays[name].tobytes() != carrier[name].tobytes()]
        assert not different, f"tarfile: {key}, {different}"
    print(f"tarfile: {len(carriers)} samples equal the carriers")

    samples = webdataset.WebDataset([str(file) for file in files], shardshuffle=False).decode()
    n_samples = 0
    for sample in samples:
        carrier = carriers[sample["__key__"]]
        assert numpy.array_equal(sample["npz"]["triangles"], carrier["triangles"])
        n_samples += 1
    assert n_samples == len(carriers)
    print(f"webdataset: {n_samples} samples equal the carriers")


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    folder = pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True)
    size = ("--shard-size", str(SHARD_SIZE))
    partprobe(program, folder, "synth", "--out", "parts", "-n", str(N_PARTS))
    partprobe(program, folder, "label", "parts", "--out", "data", "--layers", "smooth-12")
    partprobe(program, folder, "export", "parquet", "data", "--out", "tables", *size)
    partprobe(program, folder, "export", "webdataset", "data", "--out", "tars", *size)
    partprobe(program, folder, "release", "data", "--out", "package", *size)
    partprobe(program, folder, "registry", "package", "--out", "joined.parquet")

    index = [json.loads(line) for line in (folder / "data/index.jsonl").read_text().splitlines()]
    carriers = {line["id"]: numpy.load(folder / "data" / line["file"]) for line in index}
    read_metadata(folder / "tables/part-00000.parquet", b"shapes")
    read_tables(folder / "tables", carriers, ARRAYS)

    # A package has neither areas nor lengths.
    without_geometry = {column: array for column, array in ARRAYS.items() if not column.endswith(("_mm", "_mm2"))}
    columns = pyarrow.parquet.read_schema(folder / "package/labels-00000.parquet").names
    assert not [column for column in columns if column.endswith(("_mm", "_mm2"))]
    read_metadata(folder / "package/labels-00000.parquet", b"released-labels")
    read_tables(folder / "package", carriers, without_geometry)

    joined = pandas.read_parquet(folder / "joined.parquet")
    assert len(joined) == N_PARTS and set(joined["n_packages"]) == {1}
    read_tars(folder / "tars", carriers)


if __name__ == "__main__":
    main()
