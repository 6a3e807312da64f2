"""Runs the scripts for Slurm and HyperQueue, and compares their labels with those of one call of `partprobe label`.

    prove_array.py PROGRAM OUT [STEP…] [--hyperqueue] [--hq HQ]

Input: the program, and STEP files or folders. Without them, the script generates parts. OUT must not exist.
Output: one line per comparison on stdout.
Exit status: 1 if a data set differs or a task fails.

- A small scheduler runs examples/slurm_array.sh as Slurm does, two tasks at a time. It runs one task twice. It kills another task while
  that task works, and then runs it again.
- With `--hyperqueue`, a real HyperQueue server with two workers runs the tasks of examples/hyperqueue.sh (`pip install hyperqueue`).
- With `--hq`, examples/hyperqueue.sh submits its tasks itself, with the program `hq`, to a server and a worker with two cores.

The merged shares must have the same bytes as the data set of one call. Python alone is enough without the two options.
"""

import argparse
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
N_PARTS = 400
N_SHARES = 4
TWICE, KILLED = 1, 2
OPTIONS = ("--unit", "solid")


def contents(dataset):
    """Returns the bytes of each file of a data set by its path. The file of times is left out, because it differs in each run."""
    files = (path for path in sorted(dataset.rglob("*")) if path.is_file() and path.name != "timing.jsonl")
    return {path.relative_to(dataset).as_posix(): path.read_bytes() for path in files}


def compare(what, found, expected):
    """Ends the script if two data sets differ, and otherwise prints a line."""
    found, expected = contents(found), contents(expected)
    different = sorted(name for name in found.keys() | expected.keys() if found.get(name) != expected.get(name))
    if different:
        raise SystemExit(f"{what}: {len(different)} of {len(expected)} files differ, first {different[0]}")
    print(f"{what}: {len(expected)} files have the same bytes as those of one call", flush=True)


class FakeSlurm:
    """Runs the tasks of an array as Slurm does: it starts the same script each time, and variables tell the script which task it is."""

    def __init__(self, environment, script, *arguments):
        self.environment = environment
        self.command = ["bash", str(script), *map(str, arguments)]

    def start(self, task):
        """Starts a task and returns its process."""
        numbers = {"SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_COUNT": N_SHARES, "SLURM_CPUS_PER_TASK": 1, "SHARES": N_SHARES}
        environment = self.environment | {name: str(number) for name, number in numbers.items()}
        # The task gets its own process group, so that a kill ends all its processes, as a kill by Slurm does.
        return subprocess.Popen(self.command, env=environment, start_new_session=True, stdout=subprocess.DEVNULL)

    def run(self, tasks):
        """Runs tasks, two at a time. Ends the script if one fails."""
        waiting, running = list(tasks), []
        while waiting or running:
            while waiting and len(running) < 2:
                running.append((waiting[0], self.start(waiting.pop(0))))
            task, process = running.pop(0)
            if process.wait() != 0:
                raise SystemExit(f"task {task} ended with {process.returncode}")

    def kill_in_the_middle(self, task, share):
        """Starts a task, and kills it after its first file and before its last. Returns the number of files that were finished."""
        for _ in range(20):
            shutil.rmtree(share, ignore_errors=True)
            process = self.start(task)
            journal = share / ".unfinished.jsonl"
            while process.poll() is None and not (journal.exists() and journal.stat().st_size > 0):
                time.sleep(0.001)
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            # The index is written last. If it exists, the task was finished before the kill.
            if not (share / "index.jsonl").exists():
                return len(journal.read_text().splitlines())
        raise SystemExit(f"task {task} was always finished before the kill; use more files")


def prove_slurm(program, environment, steps, out, expected):
    """Proves examples/slurm_array.sh, with a task that runs twice and a task that is killed."""
    shares = out / "slurm"
    scheduler = FakeSlurm(environment, EXAMPLES / "slurm_array.sh", steps, shares, *OPTIONS)
    done = scheduler.kill_in_the_middle(KILLED, shares / f"share-{KILLED:05}")
    print(f"task {KILLED} was killed after {done} files", flush=True)
    scheduler.run([*range(N_SHARES), TWICE])
    if scheduler.start(N_SHARES).wait() != 2:
        raise SystemExit("slurm_array.sh did not refuse a task that has no share")
    run(program, "merge", *sorted(shares.glob("share-*")), "--out", out / "slurm-dataset")
    compare("sbatch --array", out / "slurm-dataset", expected)


def prove_hyperqueue(program, environment, steps, out, expected):
    """Proves the tasks of examples/hyperqueue.sh on a HyperQueue server with two workers."""
    from hyperqueue import Job, LocalCluster
    from hyperqueue.cluster import WorkerConfig

    shares = out / "hyperqueue"
    shares.mkdir()
    with LocalCluster() as cluster:
        for _ in range(2):
            cluster.start_worker(WorkerConfig(cores=1))
        client, job = cluster.client(), Job()
        for task in range(N_SHARES):
            command = [str(EXAMPLES / "hyperqueue.sh"), str(steps), str(shares), *OPTIONS]
            job.program(command, env={"PATH": environment["PATH"], "SHARES": str(N_SHARES)}, cwd=str(out), name=f"share-{task}")
        client.wait_for_jobs([client.submit(job)])
    run(program, "merge", *sorted(shares.glob("share-*")), "--out", out / "hyperqueue-dataset")
    compare("HyperQueue", out / "hyperqueue-dataset", expected)


def prove_hq(hq, environment, steps, out, expected):
    """Proves examples/hyperqueue.sh as a user calls it, with the program `hq` on the path."""
    shares = out / "hq"
    variables = {"HQ_SERVER_DIR": out / "hq-server", "PATH": f"{hq.parent}{os.pathsep}{environment['PATH']}", "SHARES": N_SHARES}
    settings = {"env": environment | {name: str(value) for name, value in variables.items()}, "cwd": out, "stdout": subprocess.DEVNULL}
    with subprocess.Popen([hq, "server", "start"], **settings) as server:
        try:
            subprocess.run([hq, "server", "wait", "--timeout", "1m"], **settings, check=True)
            # The worker ends when its server ends.
            subprocess.Popen([hq, "worker", "start", "--cpus", "2"], **settings)
            subprocess.run([EXAMPLES / "hyperqueue.sh", steps, shares, *OPTIONS], **settings, check=True)
        finally:
            server.terminate()
    compare("hq submit", shares / "dataset", expected)


def run(program, *arguments):
    subprocess.run([program, *map(str, arguments), "--quiet"], check=True, stdout=subprocess.DEVNULL)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("steps", nargs="*", type=pathlib.Path, help="STEP files or folders (default: generated parts)")
    parser.add_argument("--hyperqueue", action="store_true")
    parser.add_argument("--hq", type=pathlib.Path, help="the program `hq` of HyperQueue")
    arguments = parser.parse_args()
    program, out = arguments.program.resolve(), arguments.out.resolve()
    out.mkdir(parents=True)
    steps = out / "steps.txt"
    if not arguments.steps:
        run(program, "synth", "--out", out / "parts", "-n", N_PARTS, "--seed", 5)
        (out / "parts" / "cut.step").write_bytes(next((out / "parts").glob("*.step")).read_bytes()[:2000])
    steps.write_text("".join(f"{path.resolve()}\n" for path in arguments.steps or [out / "parts"]))

    environment = dict(os.environ)
    environment["PATH"] = os.pathsep.join([str(program.parent), environment["PATH"]])
    run(program, "label", steps, "--out", out / "one", *OPTIONS)
    prove_slurm(program, environment, steps, out, out / "one")
    if arguments.hyperqueue:
        prove_hyperqueue(program, environment, steps, out, out / "one")
    if arguments.hq:
        prove_hq(arguments.hq.resolve(), environment, steps, out, out / "one")
    return 0


if __name__ == "__main__":
    sys.exit(main())
