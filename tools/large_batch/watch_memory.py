"""Runs a command, and records the memory of its process and of all processes below it in a CSV file.

    python3 watch_memory.py memory.csv -- partprobe label archives/ --out dataset/ --resume

Output: a row every few seconds. The columns are the seconds since the start; the resident memory in MiB of all processes together, of the
first process, and of its largest child; and the number of processes. At the end, a line on stderr gives the time, the CPU seconds,
and the largest values.
Exit status: that of the command.
"""

import argparse
import csv
import os
import pathlib
import resource
import subprocess
import sys
import time

PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


def parents():
    """Returns the parent of every process, by process id."""
    table = {}
    for folder in pathlib.Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                # The name of the program is in parentheses, and may itself contain parentheses and spaces.
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            table[int(folder.name)] = int(fields[1])
    return table


def tree(root):
    """Returns the ids of a process and of all processes below it."""
    table = parents()
    found = {root}
    while True:
        more = {pid for pid, parent in table.items() if parent in found} - found
        if not more:
            return found
        found |= more


def resident_mib(pid):
    """Returns the resident memory of a process in MiB, or 0 if the process has ended."""
    try:
        return int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_MIB
    except OSError:
        return 0.0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", type=pathlib.Path)
    parser.add_argument("--every", type=float, default=5.0, metavar="SECONDS")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    args = parser.parse_args()
    command = args.command[1:] if args.command[:1] == ["--"] else args.command
    started = time.monotonic()
    child = subprocess.Popen(command)
    largest = [0.0, 0.0, 0.0]
    with args.csv.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["seconds", "tree_mib", "root_mib", "largest_child_mib", "processes"])
        while child.poll() is None:
            sizes = {pid: resident_mib(pid) for pid in tree(child.pid)}
            others = [size for pid, size in sizes.items() if pid != child.pid]
            row = [sum(sizes.values()), sizes.get(child.pid, 0.0), max(others, default=0.0)]
            largest = [max(pair) for pair in zip(largest, row)]
            table.writerow([f"{time.monotonic() - started:.1f}", *(f"{value:.1f}" for value in row), len(sizes)])
            file.flush()
            time.sleep(args.every)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{time.monotonic() - started:.0f} s, {used.ru_utime + used.ru_stime:.0f} CPU seconds, largest: "
        f"tree {largest[0]:.0f} MiB, root {largest[1]:.0f} MiB, one child {largest[2]:.0f} MiB",
        file=sys.stderr,
    )
    sys.exit(child.returncode)


if __name__ == "__main__":
    main()
