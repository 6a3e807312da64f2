"""Checks that the network of partprobe computes the same as `twin.py`: the outputs and every gradient, tensor by tensor.

    parity.py check CASE...            checks cases that `partprobe parity` wrote: whole networks on real tokens
    parity.py vectors FILE             writes small vectors, with which a Rust test compares without Python
    parity.py run PARTPROBE WORK       makes a case of every kind with the program, and checks it

Output: `check` and `run` print a Markdown table, with the largest relative difference of each case and its tensor.
Exit status: 1 if a tensor differs by more than 1e-3.
Needs torch, numpy and safetensors.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file
from torch import nn

import twin

#: The largest relative L2 norm of the difference that is allowed for each tensor of a whole network.
NETWORK_TOLERANCE = 1e-3
#: If the gradient of a bias is smaller than this, relative to that of its matrix, a batch norm cancels the bias.
IN_VAIN = 1e-5
#: The width of the blocks in the file of vectors, and the length of their patches.
WIDTH, PATCH = 16, 16


def relative(found, expected):
    """Returns the L2 norm of the difference, relative to the norm of the expected tensor."""
    size = torch.linalg.vector_norm(expected.double())
    return (torch.linalg.vector_norm(found.double() - expected.double()) / size.clamp_min(1e-30)).item()


def is_in_vain(module, name):
    """Returns whether a batch norm cancels the parameter, so that its gradient is 0 except for rounding."""
    owner, _, field = name.rpartition(".linear.")
    return field == "bias" and isinstance(getattr(module.get_submodule(owner), "norm", None), nn.BatchNorm1d)


def our_name(name):
    """Returns the name that partprobe gives to a parameter of the twin."""
    return name.replace(".conv.linear.", ".conv.").replace("conv.linear.weight", "conv.weight").replace(
        "conv.linear.bias", "conv.bias"
    ).replace("running_var", "running_variance")


def our_layout(tensor):
    """Returns a tensor in the layout of partprobe's files, in which matrices are [in, out]."""
    return tensor.t() if tensor.dim() == 2 else tensor


def load_weights(module, value_of):
    """Sets all parameters and running statistics of a module. `value_of` returns the tensor for a name and a shape of partprobe."""
    with torch.no_grad():
        for name, tensor in [*module.named_parameters(), *module.named_buffers()]:
            if not name.endswith("num_batches_tracked"):
                tensor.copy_(our_layout(value_of(our_name(name), our_layout(tensor).shape)))


# --- Cases of the program -----------------------------------------------------------------------------------------


def backbone_of(config):
    """Returns the twin of the backbone that `[net.backbone]` describes."""
    if config["type"] == "litept":
        return twin.litept(config["preset"], config["norm"])
    if config["type"] == "ptx":
        return twin.ptx(config["preset"], config["norm"])
    switches = {name: config[name] for name in ("norm", "xcpe", "attention")}
    switches["xcpe_of_skip"] = config.get("xcpe_of_skip", False)
    return twin.ptv3(twin.PRESETS[config["preset"]], **switches)


def check_case(path):
    """Prints the row of a case, and returns its largest relative difference."""
    tensors = load_file(path)
    with safe_open(path, "pt") as file:
        config = json.loads(file.metadata()["partprobe"])["content"]
    backbone = config["backbone"]
    network = twin.Network(backbone_of(backbone), config["embedding_dim"])
    load_weights(network, lambda name, _: tensors[f"weights.{name}"])
    shapes = []
    while f"shapes.{len(shapes)}.cells" in tensors:
        prefix = f"shapes.{len(shapes)}"
        shapes.append({key: tensors[f"{prefix}.{key}"] for key in ("features", "cells", "axes", "constant")})
    turns = twin.fixed_turns(len(network.backbone.encoder), backbone["orders"])
    batch = batch_of([(shape["features"], shape["cells"], shape["axes"]) for shape in shapes], backbone["patch"], turns)

    network.train()
    statistics = batch_statistics(network)
    output = network(*batch)
    (output * torch.cat([shape["constant"] for shape in shapes])).sum().backward()
    differences = {}
    sizes = [len(shape["features"]) for shape in shapes]
    for idx, rows in enumerate(output.split(sizes)):
        differences[f"shapes.{idx}.output"] = relative(rows, tensors[f"shapes.{idx}.output"])
    for name, parameter in network.named_parameters():
        found, expected = tensors[f"gradients.{our_name(name)}"], our_layout(parameter.grad)
        matrix = tensors.get(f"gradients.{our_name(name).removesuffix('.bias')}.weight")
        if backbone["norm"] == "batch" and name.endswith(".bias") and expected.norm() < IN_VAIN * matrix.norm():
            # A batch norm cancels such a bias. Its gradient is 0 except for rounding, and must be so in partprobe, too.
            differences[f"gradients.{our_name(name)}"] = (found.norm() / matrix.norm()).item()
        else:
            differences[f"gradients.{our_name(name)}"] = relative(found, expected)
    if statistics:
        differences["statistics"] = relative(torch.cat(statistics), tensors["statistics"].reshape(-1))
    # The pass above has changed the running statistics. The embeddings at test time are computed with those before it.
    load_weights(network, lambda name, _: tensors[f"weights.{name}"])
    network.eval()
    with torch.no_grad():
        unit = nn.functional.normalize(network(*batch), dim=1)
    for idx, rows in enumerate(unit.split(sizes)):
        differences[f"shapes.{idx}.embedding"] = relative(rows, tensors[f"shapes.{idx}.embedding"])
    worst = max(differences, key=differences.get)
    n_parameters = f"{sum(p.numel() for p in network.parameters()):,}".replace(",", " ")
    tokens = " + ".join(map(str, sizes))
    print(f"| `{Path(path).stem}` | {n_parameters} | {tokens} | {len(differences)} | {differences[worst]:.1e} | `{worst}` |", flush=True)
    return differences[worst]


def batch_of(shapes, patch, turns):
    """Returns the features, the neighbors for the stem, and the levels of several shapes, joined."""
    levels, stems, first = [], [], 0
    n_all = sum(len(features) for features, _, _ in shapes)
    for features, cells, axes in shapes:
        cells, axes = np.asarray(cells).astype(np.int64), np.asarray(axes).astype(np.int64).reshape(-1)
        levels.append(twin.levels_of(cells, axes, patch, turns))
        stem = twin.neighbor_table(cells, axes, 2)
        stems.append(np.where(stem < len(cells), stem + first, n_all))
        first += len(cells)
    features = torch.cat([torch.as_tensor(features) for features, _, _ in shapes])
    return features, torch.from_numpy(np.concatenate(stems)), twin.joined(levels)


def batch_statistics(network):
    """Returns a list that a training pass fills.

    It gets the mean and the unbiased variance of each batch norm, in the order in which the pass reaches them.
    """
    found = []

    def record(_module, inputs, _output):
        rows = inputs[0].detach()
        found.append(torch.cat([rows.mean(0), rows.var(0, unbiased=True)]))

    for module in network.modules():
        if isinstance(module, nn.BatchNorm1d):
            module.register_forward_hook(record)
    return found


CASES = {
    "micro": ["preset=micro"],
    "micro-batch-norm": ["preset=micro", "norm=batch"],
    "micro-two-orders": ["preset=micro", 'orders=["hilbert", "z-trans"]', "patch=48"],
    "micro-xcpe-of-skip": ["preset=micro", "norm=batch", "xcpe_of_skip=true"],
    "micro-no-xcpe": ["preset=micro", "xcpe=false"],
    "micro-no-attention": ["preset=micro", "attention=false"],
    "tiny": ["preset=tiny"],
    "mini-batch-norm": ["preset=mini", "norm=batch"],
    "base": ["preset=base"],
    "litept-micro": ["type=litept"],
    "litept-tiny-two-orders": ["type=litept", "preset=tiny", 'orders=["hilbert", "z-trans"]', "patch=48"],
    "litept-small-batch-norm": ["type=litept", "preset=small", "norm=batch"],
    "ptx-micro": ["type=ptx"],
    "ptx-tiny-patch-48": ["type=ptx", "preset=tiny", "patch=48"],
    "ptx-mini-batch-norm": ["type=ptx", "preset=mini", "norm=batch"],
    "ptx-base": ["type=ptx", "preset=base"],
}


def run(program, work):
    """Generates two parts, makes a case of each kind from their tokens, and checks the cases. Returns the largest difference."""
    work.mkdir(parents=True, exist_ok=True)
    steps = work / "step"
    subprocess.run([program, "synth", "-n", "2", "--seed", "3", "--out", steps], check=True, stdout=subprocess.DEVNULL)
    files = sorted(steps.glob("*.step"))
    worst = 0.0
    for name, settings in CASES.items():
        case = work / f"{name}.safetensors"
        overrides = [f"--set=net.backbone.{setting}" for setting in settings]
        subprocess.run([program, "parity", *files, "--out", case, *overrides], check=True, stdout=subprocess.DEVNULL)
        worst = max(worst, check_case(case))
        case.unlink()
    return worst


# --- Vectors for the Rust test ---------------------------------------------------------------------------------------


def planted(name, shape):
    """Returns numbers between -1 and 1 that depend only on a name. They come from splitmix64, seeded with the FNV-1a hash of the name."""
    mask = (1 << 64) - 1
    seed = 0xCBF29CE484222325
    for byte in name.encode():
        seed = ((seed ^ byte) * 0x100000001B3) & mask
    with np.errstate(over="ignore"):
        z = np.uint64(seed) + (np.arange(int(np.prod(shape)), dtype=np.uint64) + np.uint64(1)) * np.uint64(
            0x9E3779B97F4A7C15
        )
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z ^= z >> np.uint64(31)
    values = (z >> np.uint64(40)).astype(np.float32) / np.float32(1 << 23) - np.float32(1)
    return torch.from_numpy(values.reshape(shape))


def plant(module, case):
    """Sets the weights of a module to planted numbers, and returns the module in training mode."""

    def value_of(name, shape):
        is_scale = name.endswith(("norm.weight", "running_variance"))
        size = np.sqrt(np.float32(1) / np.float32(shape[0])) if len(shape) == 2 else np.float32(0.5)
        return (1.0 if is_scale else 0.0) + torch.tensor(size) * planted(f"{case}/{name}", tuple(shape))

    load_weights(module, value_of)
    return module.train()


class Vectors:
    """Collects the tensors for the file of vectors."""

    def __init__(self):
        self.tensors = {}
        self.shapes = [self.tokens(0, 40), self.tokens(1, 11)]
        turns = twin.fixed_turns(2)
        # Each case plants its own features, so these are zero.
        blank = [(torch.zeros(len(cells), twin.N_FEATURES), cells, axes) for cells, axes in self.shapes]
        _, self.stem, self.levels = batch_of(blank, PATCH, turns)

    def tokens(self, idx, n):
        """Makes the tokens of one shape, stores them, and returns their cells and axes."""
        tokens = twin.random_tokens(n, seed=idx)
        self.tensors[f"tokens.{idx}.cells"] = torch.from_numpy(tokens.cells.astype(np.float32))
        self.tensors[f"tokens.{idx}.axes"] = torch.from_numpy(tokens.axes.astype(np.float32))
        return tokens.cells, tokens.axes

    def features(self, case):
        """Returns the planted features of all tokens for a case."""
        return torch.cat(
            [planted(f"{case}/features.{i}", (len(cells), twin.N_FEATURES)) for i, (cells, _) in enumerate(self.shapes)]
        )

    def add(self, case, module, n_rows, forward):
        """Runs a module forward and backward, and stores its output, its batch statistics and its gradients."""
        plant(module, case)
        statistics = batch_statistics(module)
        rows = [planted(f"{case}/rows.{idx}", (n, WIDTH)).requires_grad_() for idx, n in enumerate(n_rows)]
        output = forward(module, rows)
        (output * planted(f"{case}/constant", tuple(output.shape))).sum().backward()
        self.tensors[f"{case}/output"] = output.detach()
        if statistics:
            self.tensors[f"{case}/statistics"] = torch.cat(statistics)
        for idx, input_rows in enumerate(rows):
            self.tensors[f"{case}/rows.{idx}.gradient"] = input_rows.grad
        for name, parameter in module.named_parameters():
            if is_in_vain(module, name):
                continue
            self.tensors[f"{case}/{our_name(name)}.gradient"] = our_layout(parameter.grad).contiguous()


class Small(nn.Module):
    """A backbone of two stages, and a head. With batch norms it has no block, so that the file stays small."""

    def __init__(self, norm):
        super().__init__()
        depths = (0, 0) if norm == "batch" else (0, 1)
        self.backbone = twin.ptv3(twin.Stages(depths, (WIDTH, WIDTH), (0,), (WIDTH,)), norm)
        self.head = nn.Linear(WIDTH, 8)

    def forward(self, *batch):
        return self.head(self.backbone(*batch))


def write_vectors(path):
    """Writes the file of vectors."""
    vectors = Vectors()
    fine, coarse = vectors.levels
    vectors.add("xcpe", twin.Xcpe(WIDTH, "gather"), [fine.n], lambda m, rows: m(rows[0], fine))
    for level, turn in [(0, 0), (0, 3), (1, 2)]:
        at = vectors.levels[level]
        attention = twin.Attention(WIDTH, turn, "sdpa")
        vectors.add(f"attention.{level}.{turn}", attention, [at.n], lambda m, rows, at=at: m(rows[0], at))
    vectors.add("mlp", twin.Mlp(WIDTH), [fine.n], lambda m, rows: m(rows[0]))
    for norm in ("layer", "batch"):
        case = f"stem.{norm}"
        features = vectors.features(case)
        vectors.add(case, twin.Stem(2, norm), [], lambda m, _, features=features: m(features, vectors.stem))
        pool = twin.EncoderStage(WIDTH, WIDTH, 0, norm, None)
        vectors.add(f"pool.{norm}", pool, [fine.n], lambda m, rows: m.pool(rows[0], fine.members))
        unpool = twin.DecoderStage(WIDTH, WIDTH, WIDTH, 0, norm, None)
        vectors.add(
            f"unpool.{norm}",
            unpool,
            [coarse.n, fine.n],
            lambda m, rows: m.child(rows[0]).index_select(0, fine.cluster) + m.skip(rows[1]),
        )
        case = f"network.{norm}"
        features = vectors.features(case)
        vectors.add(case, Small(norm), [], lambda m, _, f=features: m(f, vectors.stem, vectors.levels))
    with torch.no_grad():
        network = plant(Small("batch"), "network.batch").eval()
        features = vectors.features("network.batch")
        vectors.tensors["network.batch/test_output"] = network(features, vectors.stem, vectors.levels)
        norm = plant(twin.norm_of("batch", 3), "norm").eval()
        vectors.tensors["norm/test_output"] = norm(planted("norm/rows", (5, 3)))
    save_file(vectors.tensors, path)
    print(f"{path}: {len(vectors.tensors)} tensors, {Path(path).stat().st_size} bytes, torch {torch.__version__}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("check").add_argument("cases", nargs="+", type=Path)
    verbs.add_parser("vectors").add_argument("file", type=Path)
    runner = verbs.add_parser("run")
    runner.add_argument("program", type=Path)
    runner.add_argument("work", type=Path)
    args = parser.parse_args()
    if args.verb == "vectors":
        write_vectors(args.file)
        return 0
    print("| case | parameters | tokens | tensors | difference | of |\n|---|---:|---:|---:|---:|---|", flush=True)
    worst = run(args.program, args.work) if args.verb == "run" else max(map(check_case, args.cases))
    return int(worst > NETWORK_TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
