"""Checks that partprobe reads the HDF5 files that h5py writes.

    compare.py PROGRAM FOLDER

Input: the program, and FOLDER, which must not exist.
Output: one line on stdout. An AssertionError names the first file that fails.
Needs h5py and numpy.

The script generates two parts and samples points of them. It writes the labels of the points in two layouts: that of ParSeNet, with one
shape per row, and that of HPNet, with one file per shape. It does so with each kind of storage of h5py (contiguous, chunked, compressed
with gzip, shuffled, with checksums), in the oldest version of the format and in that of HDF5 1.14. `partprobe check labels` must join all
of them.
"""

import itertools
import json
import pathlib
import subprocess
import sys

import h5py
import numpy

STORAGES = {
    "contiguous": {},
    "chunks": {"chunks": True},
    "gzip": {"compression": "gzip", "chunks": True},
    "shuffled": {"compression": "gzip", "shuffle": True, "fletcher32": True, "chunks": True},
}
# "latest" is left out, because it depends on the version of the library: hdf5-pure 0.47 does not read filtered chunks of HDF5 2.0.
VERSIONS = ("earliest", "v114")
NUMBERS = (("f4", "i4"), ("f8", "i8"), (">f4", "u1"))
N_POINTS = 3000


def partprobe(program, folder, *arguments):
    """Runs the program in a folder, and returns its standard output."""
    command = [program, *arguments]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def write(path, arrays, storage, version):
    """Writes arrays to an HDF5 file."""
    with h5py.File(path, "w", libver=version) as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values, **storage)


def check(program, folder, path, *settings):
    """Returns the number of labels of each shape. Fails if a shape has no labels."""
    assignments = itertools.chain.from_iterable(("--set", setting) for setting in settings)
    text = partprobe(program, folder, "check", "labels", path, "--data", "data", "--type", "points", "--json", *assignments)
    shapes = json.loads(text)[0]["shapes"]
    assert shapes and all(shape["status"] in ("whole", "partly") for shape in shapes), text
    return [shape["join"]["n_labels"] for shape in shapes]


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    folder = pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True)
    partprobe(program, folder, "synth", "--out", "parts", "-n", "2")
    partprobe(program, folder, "label", "parts", "--out", "data")
    partprobe(program, folder, "sample", "data", "--out", "points", "--format", "npz", "--n-points", str(N_POINTS))
    samples = sorted((folder / "points").glob("*.npz"))
    clouds = [numpy.load(sample) for sample in samples]
    labels_of = lambda cloud: next(cloud[name] for name in cloud.files if name.startswith("label"))
    (folder / "ids.txt").write_text("".join(f"{sample.stem}\n" for sample in samples))

    n_checked = 0
    expected = None
    for (name, storage), version, (number, integer) in itertools.product(STORAGES.items(), VERSIONS, NUMBERS):
        arrays = [
            {
                "points": cloud["points"].astype(number),
                "normals": cloud["normals"].astype(number),
                "labels": labels_of(cloud).astype(integer),
            }
            for cloud in clouds
        ]
        rows = {key: numpy.stack([array[key] for array in arrays]) for key in arrays[0]}
        write(folder / "all.h5", rows, storage, version)
        found = [check(program, folder, "all.h5", "ids=ids.txt")]

        files = folder / f"{name}-{version}-{number.strip('>')}-{integer}"
        files.mkdir()
        for sample, array in zip(samples, arrays):
            write(files / f"{sample.stem}.h5", array, storage, version)
        found.append(check(program, folder, files.name))
        expected = expected or found[0]
        assert all(counts == expected for counts in found), (name, version, found, expected)
        n_checked += 2
    print(f"h5py {h5py.__version__}: {n_checked} files and folders of 2 shapes are joined, with {expected} labels")


if __name__ == "__main__":
    main()
