"""Runs examples/ray_label.py on two raylets, kills one of them during the work, and compares the shards.

    prove_ray.py OUT [PATH…]

Input: STEP files, folders and archives. Without them, the script generates parts: a folder with a damaged file and two archives. OUT must
not exist.
Output: one line per comparison on stdout.
Exit status: 1 if a shard differs or an input has no row.

The same inputs are labeled in three ways: on an undisturbed cluster, on a cluster whose second raylet is killed while it labels a shard,
and by a driver that is killed and started again. All shards must have the same bytes, and each input must have a row.
The Python that runs this script needs `ray[data]`, `pyarrow` and the wheel of partprobe.
"""

import argparse
import os
import pathlib
import signal
import subprocess
import sys
import tarfile
import time
import zipfile

import pyarrow.parquet as pq
from ray.cluster_utils import Cluster

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "examples/ray_label.py"
PROGRAM = pathlib.Path(sys.executable).with_name("partprobe")
N_PARTS = 320
SHARD_SIZE = 40


def make_inputs(folder):
    """Generates parts: most in a folder, some in two archives, and one that is truncated. Returns the number of inputs."""
    subprocess.run([PROGRAM, "synth", "--out", folder, "-n", str(N_PARTS), "--seed", "11", "--quiet"], check=True, stdout=subprocess.DEVNULL)
    steps = sorted(folder.glob("*.step"))
    with zipfile.ZipFile(folder / "some.zip", "w") as zipped:
        for step in steps[:30]:
            zipped.write(step, f"inside/{step.name}")
    with tarfile.open(folder / "more.tar.gz", "w:gz") as tarred:
        for step in steps[30:60]:
            tarred.add(step, f"inside/{step.name}")
    for step in steps[:60]:
        step.unlink()
    (folder / "cut.step").write_bytes(steps[100].read_bytes()[:2000])
    return N_PARTS + 1


def children(parent):
    """Returns the names of all processes below a process, by process id. It reads /proc."""
    parents = {}
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            name, fields = stat.read_text().rsplit(")", 1)
        except OSError:
            continue
        parents[int(stat.parent.name)] = (int(fields.split()[1]), name.split("(", 1)[1])
    below, found = {parent}, {}
    while fresh := {pid for pid, (above, _) in parents.items() if above in below and pid not in below}:
        below |= fresh
        found |= {pid: parents[pid][1] for pid in fresh}
    return found


def finished(out):
    """Returns the paths of the finished shards."""
    return sorted(out.glob("part-*.parquet"))


class RayCluster:
    """Two raylets with one core each. The first one is the head."""

    def __init__(self):
        self.cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
        self.second = self.cluster.add_node(num_cpus=1)
        self.cluster.wait_for_nodes()

    def start(self, paths, out):
        """Starts examples/ray_label.py, which is the driver, and returns its process."""
        command = [sys.executable, SCRIPT, *paths, "--out", out, "--shard-size", SHARD_SIZE, "--address", self.cluster.address]
        command += ["--", "--unit", "solid"]
        environment = os.environ | {"RAY_DATA_DISABLE_PROGRESS_BARS": "1"}
        return subprocess.Popen([str(word) for word in command], env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)

    def kill_second_while_it_labels(self, out):
        """Kills the second raylet and all processes below it, and returns the number of finished shards.

        It waits first, until a shard is finished and the second raylet labels another one.
        """
        raylet = self.second.all_processes["raylet"][0].process.pid
        while True:
            below = children(raylet)
            if finished(out) and "partprobe" in below.values():
                break
            time.sleep(0.005)
        n_finished = len(finished(out))
        self.cluster.remove_node(self.second, allow_graceful=False)
        for pid in below:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        return n_finished

    def stop(self):
        self.cluster.shutdown()


def wait(driver, what):
    """Waits for a driver, and prints the last line of its output. Ends the script if the driver failed."""
    output = driver.communicate(timeout=600)[0]
    if driver.returncode != 0:
        raise SystemExit(f"{what}: the driver ended with {driver.returncode}\n{output}")
    print(f"{what}: {output.splitlines()[-1]}", flush=True)


def compare(what, out, expected):
    """Ends the script if the shards differ from the expected ones, or if unfinished files are left."""
    found = {path.name: path.read_bytes() for path in finished(out)}
    if found != expected:
        different = sorted(name for name in found.keys() | expected.keys() if found.get(name) != expected.get(name))
        raise SystemExit(f"{what}: {different} differ from the shards of the undisturbed cluster")
    leftovers = [path.name for path in out.iterdir() if path.name.startswith(".part-")]
    if leftovers:
        raise SystemExit(f"{what}: unfinished files are left: {leftovers}")
    print(f"{what}: {len(found)} shards have the same bytes as on the undisturbed cluster", flush=True)


def prove_undisturbed(cluster, paths, out, n_inputs):
    """Labels on the undisturbed cluster, checks the rows, and returns the bytes of each shard by name."""
    wait(cluster.start(paths, out), "undisturbed")
    rows = [row for path in finished(out) for row in pq.read_table(path, columns=["source", "status", "n_parts"]).to_pylist()]
    sources = {row["source"] for row in rows}
    if n_inputs is not None and len(sources) != n_inputs:
        raise SystemExit(f"only {len(sources)} of {n_inputs} inputs have rows")
    if any((row["status"] == "ok") != bool(row["n_parts"]) for row in rows):
        raise SystemExit("a row with the status `ok` has no parts, or a row with another status has parts")
    if n_inputs is not None and [row["source"].split("/")[-1] for row in rows if row["status"] != "ok"] != ["cut.step"]:
        raise SystemExit("the damaged file must be the only row with a status other than `ok`")
    return {path.name: path.read_bytes() for path in finished(out)}


def prove_restart(cluster, paths, out, expected):
    """Kills a driver during its work. The second driver must keep the finished shards, and a third one must not write any."""
    driver = cluster.start(paths, out)
    while not finished(out):
        time.sleep(0.005)
    driver.kill()
    driver.communicate()
    kept = {path: path.stat().st_mtime_ns for path in finished(out)}
    if len(kept) == len(expected):
        raise SystemExit("the driver had finished before it was killed; use more inputs")
    wait(cluster.start(paths, out), f"driver killed after {len(kept)} shards")
    compare("driver killed", out, expected)
    made = {path: path.stat().st_mtime_ns for path in finished(out)}
    wait(cluster.start(paths, out), "driver without unfinished shards")
    if made != {path: path.stat().st_mtime_ns for path in finished(out)} or not kept.items() <= made.items():
        raise SystemExit("a finished shard was written a second time")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("paths", nargs="*", type=pathlib.Path)
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True)
    paths, n_inputs = [path.resolve() for path in arguments.paths], None
    if not paths:
        paths, n_inputs = [out / "inputs"], make_inputs(out / "inputs")

    cluster = RayCluster()
    expected = prove_undisturbed(cluster, paths, out / "undisturbed", n_inputs)
    prove_restart(cluster, paths, out / "restarted", expected)
    driver = cluster.start(paths, out / "killed")
    n_finished = cluster.kill_second_while_it_labels(out / "killed")
    wait(driver, f"one raylet of two killed after {n_finished} of {len(expected)} shards")
    compare("one raylet killed", out / "killed", expected)
    cluster.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main())
