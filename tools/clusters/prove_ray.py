"""Runs examples/ray_label.py on two raylets, kills one of them in the middle, and compares: prove_ray.py OUT [PATH…]

The Python that runs this has `ray[data]`, `pyarrow` and the wheel of partprobe. The same inputs are labeled on an undisturbed
cluster, on one whose second raylet is killed while it labels a shard, and by a driver that is killed and started again. All
shards must have the same bytes, and each input its row. Without inputs, parts are generated: a folder with a damaged file and two
archives. OUT must not exist.
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
    """Generated parts: most in a folder, some in two archives, and one cut off."""
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
    """The processes below a process, by /proc."""
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
    return sorted(out.glob("part-*.parquet"))


class RayCluster:
    """Two raylets with one core each; the first one is the head."""

    def __init__(self):
        self.cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
        self.second = self.cluster.add_node(num_cpus=1)
        self.cluster.wait_for_nodes()

    def start(self, paths, out):
        """The driver, as a process of its own."""
        command = [sys.executable, SCRIPT, *paths, "--out", out, "--shard-size", SHARD_SIZE, "--address", self.cluster.address]
        command += ["--", "--unit", "solid"]
        environment = os.environ | {"RAY_DATA_DISABLE_PROGRESS_BARS": "1"}
        return subprocess.Popen([str(word) for word in command], env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)

    def kill_second_while_it_labels(self, out):
        """Waits until a shard is finished and the second raylet labels another one, and kills it with all that is below it."""
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
    output = driver.communicate(timeout=600)[0]
    if driver.returncode != 0:
        raise SystemExit(f"{what}: the driver ended with {driver.returncode}\n{output}")
    print(f"{what}: {output.splitlines()[-1]}", flush=True)


def compare(what, out, expected):
    found = {path.name: path.read_bytes() for path in finished(out)}
    if found != expected:
        different = sorted(name for name in found.keys() | expected.keys() if found.get(name) != expected.get(name))
        raise SystemExit(f"{what}: {different} differ from those of the undisturbed cluster")
    leftovers = [path.name for path in out.iterdir() if path.name.startswith(".part-")]
    if leftovers:
        raise SystemExit(f"{what}: {leftovers} are left")
    print(f"{what}: {len(found)} shards, the bytes of the undisturbed cluster", flush=True)


def prove_undisturbed(cluster, paths, out, n_inputs):
    """The shards by name, after a look at their rows."""
    wait(cluster.start(paths, out), "undisturbed")
    rows = [row for path in finished(out) for row in pq.read_table(path, columns=["source", "status", "n_parts"]).to_pylist()]
    sources = {row["source"] for row in rows}
    if n_inputs is not None and len(sources) != n_inputs:
        raise SystemExit(f"{len(sources)} inputs have rows, of {n_inputs}")
    if any((row["status"] == "ok") != bool(row["n_parts"]) for row in rows):
        raise SystemExit("a row with the status `ok` has no parts, or another one has some")
    if n_inputs is not None and [row["source"].split("/")[-1] for row in rows if row["status"] != "ok"] != ["cut.step"]:
        raise SystemExit("the damaged file is not the one row with another status")
    return {path.name: path.read_bytes() for path in finished(out)}


def prove_restart(cluster, paths, out, expected):
    """A driver is killed in the middle. The next one keeps its shards, and a third one makes none."""
    driver = cluster.start(paths, out)
    while not finished(out):
        time.sleep(0.005)
    driver.kill()
    driver.communicate()
    kept = {path: path.stat().st_mtime_ns for path in finished(out)}
    if len(kept) == len(expected):
        raise SystemExit("the driver was not killed in the middle; use more inputs")
    wait(cluster.start(paths, out), f"driver killed after {len(kept)} shards")
    compare("driver killed", out, expected)
    made = {path: path.stat().st_mtime_ns for path in finished(out)}
    wait(cluster.start(paths, out), "finished before")
    if made != {path: path.stat().st_mtime_ns for path in finished(out)} or not kept.items() <= made.items():
        raise SystemExit("a finished shard was written again")


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
