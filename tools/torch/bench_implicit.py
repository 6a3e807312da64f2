"""Compares the time of an update of the implicit probe in partprobe and in PyTorch.

    bench_implicit.py [--trunk NAME] [--points N N N] [--updates N] [--threads N]        or: just bench-implicit [--trunk NAME]

Input: the built example `update_time` of crates/implicit, a trunk, and the numbers of points of an update: on the surface, near it, and
in the box.
Output: a Markdown table on stdout, with the times per update and the ratio partprobe/PyTorch.
Needs torch.

Both programs use the same network, the same losses, the same number of points and the same number of threads. They run in turns, in
several rounds with one process each, so that other work of the machine slows both. The time of an update is the difference between a long
and a short run, divided by the difference of their updates. The lowest round of each program counts. PyTorch computes the gradient by the
position with `autograd.grad(create_graph=True)`.
"""

import argparse
import os
import resource
import subprocess
import sys
import time

WIDTHS = {"siren-256x4": 256, "siren-128x4": 128, "siren-64x4": 64}


def torch_updates(arguments, updates):
    """Runs the updates of PyTorch, in its own process. The points are random, because their positions do not affect the time."""
    import torch

    torch.set_num_threads(arguments.threads)
    torch.manual_seed(0)
    width = WIDTHS[arguments.trunk]

    class Net(torch.nn.Module):
        def __init__(self):
            super().__init__()
            sizes = [3] + [width] * 5
            self.layers = torch.nn.ModuleList(torch.nn.Linear(a, b) for a, b in zip(sizes, sizes[1:]))
            self.out = torch.nn.Linear(width, 1)
            self.head = torch.nn.Sequential(torch.nn.Linear(width, 64), torch.nn.ReLU(), torch.nn.Linear(64, arguments.labels))
            for index, layer in enumerate(self.layers):
                bound = 1 / 3 if index == 0 else (6 / width) ** 0.5 / 30
                torch.nn.init.uniform_(layer.weight, -bound, bound)

        def forward(self, x):
            for layer in self.layers:
                x = torch.sin(30 * layer(x))
            return self.out(x).squeeze(-1), x

    net = Net()
    adam = torch.optim.Adam(net.parameters(), lr=5e-4)
    surface, near, uniform = arguments.points
    positions = torch.rand(arguments.pool, 3) * 2 - 1
    normals = torch.nn.functional.normalize(torch.rand(arguments.pool, 3) - 0.5, dim=1)
    distances = torch.rand(arguments.pool) * 0.1 - 0.05
    labels = torch.randint(0, arguments.labels, (arguments.pool,))
    weights = torch.ones(arguments.labels)

    def loss_of(on, off, box, normal, d_off, d_box, label):
        on.requires_grad_(True)
        box.requires_grad_(True)
        both = torch.cat([on, box])
        f, hidden = net(both)
        (gradient,) = torch.autograd.grad(f.sum(), both, create_graph=True)
        f_off, _ = net(off)
        length = gradient.norm(dim=1)
        f_on, f_box = f[:surface], f[surface:]
        loss = 50 * (0.5 * f_on.abs()).mean()
        apart = torch.cat([0.5 * f_off - d_off, 0.5 * f_box - d_box]).abs()
        loss = loss + 20 * apart.mean() + 0.1 * (length - 1).abs().mean()
        loss = loss + (1 - (gradient[:surface] * normal).sum(1) / length[:surface]).mean()
        return loss + 0.5 * torch.nn.functional.cross_entropy(net.head(hidden[:surface]), label, weights)

    for _ in range(updates):
        a, b, c = (torch.randint(0, arguments.pool, (n,)) for n in (surface, near, uniform))
        loss = loss_of(positions[a], positions[b], positions[c], normals[a], distances[b], distances[c], labels[a])
        adam.zero_grad()
        loss.backward()
        adam.step()


def cpu_seconds(command):
    """Runs a command, and returns its CPU seconds and its wall seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def ours(arguments, updates):
    """Returns the command that runs updates in partprobe."""
    points = [str(n) for n in arguments.points]
    return [arguments.program, arguments.trunk, "oracle-sdf", str(updates), str(arguments.threads), *points, str(arguments.labels)]


def theirs(arguments, updates):
    """Returns the command that runs updates in PyTorch."""
    points = [str(n) for n in arguments.points]
    shared = ["--trunk", arguments.trunk, "--threads", str(arguments.threads), "--labels", str(arguments.labels)]
    return [sys.executable, __file__, "--worker", str(updates), *shared, "--points", *points]


def milliseconds_per_update(command, arguments):
    """Returns the CPU and wall time of one update, from the difference between many and few updates."""
    few, many = arguments.updates // 4, arguments.updates
    (cpu_few, wall_few), (cpu_many, wall_many) = (cpu_seconds(command(arguments, n)) for n in (few, many))
    return [1e3 * (b - a) / (many - few) for a, b in ((cpu_few, cpu_many), (wall_few, wall_many))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/examples/update_time")
    parser.add_argument("--trunk", choices=WIDTHS, default="siren-128x4")
    parser.add_argument("--points", type=int, nargs=3, default=[1536, 1536, 768])
    parser.add_argument("--labels", type=int, default=8)
    parser.add_argument("--updates", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--pool", type=int, default=20_000, help=argparse.SUPPRESS)
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker is not None:
        return torch_updates(arguments, arguments.worker)
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    for command in (ours, theirs):
        # The first start reads the libraries from the disk. It is not counted, because this time does not belong to the updates.
        cpu_seconds(command(arguments, 1))
    rounds = [[milliseconds_per_update(command, arguments) for command in (ours, theirs)] for _ in range(arguments.rounds)]
    print("| | CPU ms per update | wall ms per update |\n|---|---|---|")
    best = [[min(found[who][what] for found in rounds) for what in range(2)] for who in range(2)]
    for name, (cpu, wall) in zip(("partprobe", "PyTorch"), best):
        print(f"| {name} | {cpu:.1f} | {wall:.1f} |")
    print(f"| ratio | {best[0][0] / best[1][0]:.2f} | {best[0][1] / best[1][1]:.2f} |")


if __name__ == "__main__":
    main()
