"""Makes 7z archives of STEP files, for a batch as large as a real corpus.

    pip install py7zr
    partprobe synth --out synth/ -n 2000 --seed 1
    python3 make_archives.py archives/ --n-archives 18 --n-files 10000 --max-kb 300 \
        --share 0.25=abc/ --share 0.45=mfcad/ --share 0.3=synth/

Input: folders of STEP files, each with its fraction of the files of an archive.
Output: `chunk_0000.7z` and so on. An archive that already exists is kept. One line per archive on stdout.

Each archive has the same number of files in one solid LZMA2 block. The files of a folder repeat under new names until its fraction is
reached, so every file has a unique name. Nothing is random, so a second call makes archives that differ only in their dates.
"""

import argparse
import pathlib

import py7zr

STEP = {".step", ".stp", ".p21"}
LZMA2_FAST = [{"id": py7zr.FILTER_LZMA2, "preset": 1}]


def step_files(folder, max_kb):
    """Returns the STEP files below a folder that are not larger than `max_kb`, sorted by path."""
    files = (path for path in pathlib.Path(folder).rglob("*") if path.suffix.lower() in STEP)
    return sorted(path for path in files if path.stat().st_size <= max_kb * 1024)


def members(shares, n_files, first):
    """Yields the name and the source file of each member of one archive. `first` is the number of files in the archives before it."""
    n_done = 0
    for share, files in shares:
        for idx in range(round(share * n_files)):
            if n_done < n_files:
                source = files[(round(share * first) + idx) % len(files)]
                yield f"{first + n_done:08d}/{source.stem[:60]}.step", source
                n_done += 1
    while n_done < n_files:
        yield f"{first + n_done:08d}/last.step", shares[-1][1][n_done % len(shares[-1][1])]
        n_done += 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--n-archives", type=int, default=18)
    parser.add_argument("--n-files", type=int, default=10_000)
    parser.add_argument("--max-kb", type=int, default=300)
    parser.add_argument("--share", action="append", required=True, metavar="SHARE=FOLDER")
    args = parser.parse_args()
    pairs = [share.split("=", 1) for share in args.share]
    shares = [(float(share), step_files(folder, args.max_kb)) for share, folder in pairs]
    for (share, folder), (_, files) in zip(pairs, shares):
        print(f"{share} of the files from {folder}: {len(files)} distinct files")
    args.out.mkdir(parents=True, exist_ok=True)
    for number in range(args.n_archives):
        path = args.out / f"chunk_{number:04d}.7z"
        if path.exists():
            continue
        unfinished = path.with_suffix(".unfinished")
        listed = list(members(shares, args.n_files, number * args.n_files))
        n_bytes = 0
        with py7zr.SevenZipFile(unfinished, "w", filters=LZMA2_FAST) as archive:
            for name, source in listed:
                archive.write(source, name)
                n_bytes += source.stat().st_size
        unfinished.rename(path)
        print(f"{path}: {len(listed)} files, {n_bytes} bytes, {path.stat().st_size} packed", flush=True)


if __name__ == "__main__":
    main()
