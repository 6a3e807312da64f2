"""Compares a training step and a forward pass of partprobe with PyTorch.

    bench_step.py [--partprobe PROGRAM] [--tokens N...] [--patch N] [--preset NAME]        or: just bench-torch [--tokens N...]

Input: the program, numbers of tokens per shape, the length of a patch, and a preset of the network.
Output: on stdout, for each number of tokens: the medians of the times, the peak memory, and the ratios partprobe/PyTorch.
Needs torch, numpy and safetensors.

Both programs use the same network, the same number of tokens and the same number of threads. partprobe writes the tokens, and both start
with prepared index tables. They run in turns, in several rounds with one process each, so that other work of the machine slows both. The
best round of each program counts.

PyTorch is measured with two formulations of the convolution (one gather and one product, or one product for each occupied cell) and two
of the attention (the fused operation, or softmax of a product). The fastest combination is compared.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CONVOLUTIONS = ("gather", "offsets")
ATTENTIONS = ("sdpa", "softmax")


def torch_figures(arguments):
    """Returns the times and the peak memory of PyTorch.

    It runs in its own process, so that the peak memory is that of one formulation.
    """
    import torch
    from twin import PRESETS, Network, batch_of, ptv3, tokens_of_file, training_step

    torch.set_num_threads(arguments.threads)
    torch.manual_seed(0)
    stages = PRESETS[arguments.preset]
    tokens = tokens_of_file(arguments.tokens_file)
    batch = batch_of(tokens, arguments.patch, stages)
    network = Network(ptv3(stages, conv=arguments.conv, mix=arguments.mix))
    optimizer = torch.optim.AdamW(network.parameters(), lr=1e-3, weight_decay=0.02)
    for _ in range(2):
        training_step(network, optimizer, batch, tokens.labels)
    steps, cpu = [], time.process_time()
    for _ in range(arguments.steps):
        begun = time.perf_counter()
        training_step(network, optimizer, batch, tokens.labels)
        steps.append(time.perf_counter() - begun)
    cpu = (time.process_time() - cpu) / arguments.steps
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    forward = []
    network.eval()
    with torch.no_grad():
        for _ in range(arguments.steps):
            begun = time.perf_counter()
            network(*batch)
            forward.append(time.perf_counter() - begun)
    return {
        "tokens": len(tokens.labels),
        "step_ms": 1e3 * statistics.median(steps),
        "step_cpu_ms": 1e3 * cpu,
        "forward_ms": 1e3 * statistics.median(forward),
        "peak_memory_mib": peak,
    }


def run(command):
    """Runs a command, and returns the object that it prints as JSON."""
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def partprobe_run(arguments, n_tokens, tokens_file):
    """Returns the times and the peak memory of partprobe, and writes its tokens to a file."""
    settings = [f"net.backbone.patch={arguments.patch}", f"net.backbone.preset={arguments.preset}"]
    command = [arguments.partprobe, "bench", "step", "--json", "--tokens", n_tokens, "--steps", arguments.steps]
    command += ["--jobs", arguments.threads, "--tokens-out", tokens_file]
    for setting in settings:
        command += ["--set", setting]
    return run([str(word) for word in command])


def torch_run(arguments, tokens_file, conv, mix):
    """Returns the times and the peak memory of one formulation in PyTorch."""
    command = [sys.executable, __file__, "--worker", "--conv", conv, "--mix", mix, "--preset", arguments.preset]
    command += ["--patch", arguments.patch, "--steps", arguments.steps, "--threads", arguments.threads]
    return run([str(word) for word in command + ["--tokens-file", tokens_file]])


def best(rounds):
    """Returns the lowest value of each figure over the rounds. Other work of the machine can only increase a figure."""
    return {key: min(figures[key] for figures in rounds) for key in rounds[0] if key != "tokens"}


def compare(arguments, n_tokens, tokens_file):
    """Measures both programs with a number of tokens, and prints the results."""
    ours, theirs = [], {}
    for _ in range(arguments.rounds):
        ours.append(partprobe_run(arguments, n_tokens, tokens_file))
        for conv in CONVOLUTIONS:
            for mix in ATTENTIONS:
                theirs.setdefault((conv, mix), []).append(torch_run(arguments, tokens_file, conv, mix))
    ours = best([{key: run[key] for key in run if key.endswith(("_ms", "_mib"))} for run in ours])
    theirs = {name: best(rounds) for name, rounds in theirs.items()}
    for name, figures in theirs.items():
        print(f"  torch {name[0]}/{name[1]}: {line(figures)}")
    print(f"  partprobe: {line(ours)}")
    # partprobe is compared with the formulation that has the fastest step, in all columns, the memory included.
    name = min(theirs, key=lambda name: theirs[name]["step_ms"])
    ratios = ", ".join(f"{key} {ours[key] / theirs[name][key]:.2f}" for key in ours if key in theirs[name])
    print(f"  ratios to {name[0]}/{name[1]}: {ratios}", flush=True)


def line(figures):
    """Returns the figures as text."""
    return ", ".join(f"{key} {value:.0f}" for key, value in figures.items() if key != "shapes_per_minute")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--partprobe", default="target/release/partprobe")
    parser.add_argument("--tokens", type=int, nargs="+", default=[4096, 20000])
    parser.add_argument("--preset", default="micro")
    parser.add_argument("--patch", type=int, default=128)
    parser.add_argument("--steps", type=int, default=7)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--tokens-file", help=argparse.SUPPRESS)
    parser.add_argument("--conv", choices=CONVOLUTIONS, default="gather", help=argparse.SUPPRESS)
    parser.add_argument("--mix", choices=ATTENTIONS, default="sdpa", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        print(json.dumps(torch_figures(arguments)))
        return
    for n_tokens in arguments.tokens:
        print(f"{n_tokens} tokens, patch {arguments.patch}, {arguments.preset}, {arguments.threads} thread(s)")
        with tempfile.TemporaryDirectory() as folder:
            compare(arguments, n_tokens, Path(folder) / "tokens.safetensors")


if __name__ == "__main__":
    main()
