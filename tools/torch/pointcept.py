"""Pointcept's own code on partprobe's files, on the CPU.

    pointcept.py weights POINTCEPT PARTPROBE WORK   random weights of its PTv3, converted both ways and run on the same tokens
    pointcept.py unpack CHECKPOINT FILE             a checkpoint (.pth) as a safetensors file, for `weights from-pointcept`
    pointcept.py pack FILE CHECKPOINT               the safetensors file of `weights to-pointcept` as a checkpoint

POINTCEPT is a checkout of github.com/Pointcept/Pointcept, of which nothing is part of this repository. Needs torch, numpy,
safetensors, spconv, addict and timm. Exit code 1 if the networks differ by more than allowed.
"""

import argparse
import importlib
import os
import subprocess
import sys
from pathlib import Path

# On several threads, spconv's convolution on the CPU gives other numbers at each call.
os.environ["OMP_NUM_THREADS"] = "1"

import torch
from safetensors.torch import load_file, save_file

import pointcept_packages

#: Relative L2 norm of the difference that features may have.
TOLERANCE = 1e-4
CURVES = ("z", "z-trans", "hilbert", "hilbert-trans")
PATCH = 1024
SETTINGS = ["net.backbone.preset=base", "net.backbone.norm=batch", f"net.backbone.patch={PATCH}", "net.backbone.xcpe_of_skip=true", "tokens.voxels=plain"]
#: Tokens of the shapes that both networks see; with more than PATCH, the finest levels have several patches.
TOKENS = 2600


def network():
    """Pointcept's PTv3 as published, with random weights, norms and running statistics."""
    torch.manual_seed(7)
    importlib.import_module("pointcept.models")
    models = importlib.import_module("pointcept.models.builder").MODELS
    patches = {"enc_patch_size": (PATCH,) * 5, "dec_patch_size": (PATCH,) * 4}
    model = models.build(
        dict(type="PT-v3m1", in_channels=6, order=CURVES, enable_flash=False, drop_path=0.0, shuffle_orders=True, **patches)
    )
    with torch.no_grad():
        for module in model.modules():
            if isinstance(module, (torch.nn.BatchNorm1d, torch.nn.LayerNorm)):
                module.weight.uniform_(0.5, 1.5)
                module.bias.uniform_(-0.5, 0.5)
            if isinstance(module, torch.nn.BatchNorm1d):
                module.running_mean.uniform_(-0.5, 0.5)
                module.running_var.uniform_(0.5, 1.5)
    return model


def turned_curves():
    """Replaces the shuffle of the curves by partprobe's fixed order: level l begins with the l-th curve."""
    calls = iter([[0, 1, 2, 3]] + [[1, 2, 3, 0]] * 4)
    torch.randperm = lambda _n: torch.tensor(next(calls))


def features(model, case, shape, training):
    """The rows of Pointcept's network for the tokens of one shape."""
    rows, cells = case[f"shapes.{shape}.features"], case[f"shapes.{shape}.cells"].long()
    highest = int(cells.max())
    if (highest + 1).bit_length() != highest.bit_length():
        sys.exit(f"the highest cell is {highest}: Pointcept takes one bit more for it, and Hilbert curves differ; change TOKENS")
    model.train(training)
    for module in model.modules():
        # Without a GPU, spconv adds a bias in training mode only. A convolution computes the same in both modes.
        if type(module).__name__ == "SubMConv3d":
            module.train()
    shuffle = torch.randperm
    turned_curves()
    data = dict(coord=rows[:, :3], grid_coord=cells, feat=rows, offset=torch.tensor([len(rows)]))
    with torch.no_grad():
        found = model(data).feat
    torch.randperm = shuffle
    return found


def relative(found, expected):
    return (torch.linalg.vector_norm(found.double() - expected.double()) / torch.linalg.vector_norm(expected.double())).item()


def compare(model, weights, case, shape):
    """The difference in training and at test time, behind partprobe's head."""
    head = lambda rows: rows @ weights["head.weight"] + weights["head.bias"]
    unit = torch.nn.functional.normalize(head(features(model, case, shape, False)), dim=1)
    at_test = relative(case[f"shapes.{shape}.embedding"], unit)
    # This pass moves the running statistics, which nobody reads afterward.
    in_training = relative(case[f"shapes.{shape}.output"], head(features(model, case, shape, True)))
    n = len(case[f"shapes.{shape}.cells"])
    print(f"{n} tokens: difference {at_test:.1e} at test time, {in_training:.1e} in training")
    return max(at_test, in_training)


def check_weights(checkout, program, work):
    """Converts random weights both ways, and runs both networks."""
    pointcept_packages.checkout(checkout)
    work.mkdir(parents=True, exist_ok=True)
    model = network()
    theirs, ours, again, case = (work / f"{name}.safetensors" for name in ("theirs", "ours", "again", "case"))
    state = {name: tensor.contiguous() for name, tensor in model.state_dict().items()}
    save_file(state, theirs)

    def call(*arguments):
        subprocess.run([program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)

    call("weights", "from-pointcept", theirs, "--backbone", "base", "-o", ours)
    call("weights", "to-pointcept", ours, "-o", again)
    back = load_file(again)
    missing = [name for name in state if f"backbone.{name}" not in back]
    changed = [name for name in state if name not in missing and not torch.equal(state[name], back[f"backbone.{name}"])]
    extra = sorted(set(back) - {f"backbone.{name}" for name in state})
    n_parameters = sum(parameter.numel() for parameter in model.parameters())
    print(f"{n_parameters} parameters, {len(state)} tensors; missing {missing}, changed {changed}, extra {extra}")

    steps = work / "step"
    call("synth", "-n", "1", "--seed", "3", "--out", steps)
    overrides = [f"--set={setting}" for setting in (*SETTINGS, f"tokens.test_tokens={TOKENS}")]
    call("parity", *sorted(steps.glob("*.step")), "--weights", ours, "--out", case, *overrides)
    worst = compare(model, load_file(ours), load_file(case), 0)
    print(f"largest difference {worst:.1e}, allowed {TOLERANCE:.0e}")
    return int(worst > TOLERANCE or bool(missing or changed))


def unpack(checkpoint, file):
    """Reads tensors only: other objects in the checkpoint are refused by torch."""
    state = torch.load(checkpoint, map_location="cpu", weights_only=True)
    state = state.get("state_dict", state)
    save_file({name: tensor.float().contiguous() if tensor.is_floating_point() else tensor for name, tensor in state.items()}, file)
    print(file)
    return 0


def pack(file, checkpoint):
    """The form that Pointcept's CheckpointLoader reads."""
    torch.save({"state_dict": load_file(file), "epoch": 0}, checkpoint)
    print(checkpoint)
    return 0


VERBS = {
    "weights": (check_weights, ("pointcept", "partprobe", "work")),
    "unpack": (unpack, ("checkpoint", "file")),
    "pack": (pack, ("file", "checkpoint")),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    for verb, (_, names) in VERBS.items():
        own = verbs.add_parser(verb)
        for name in names:
            own.add_argument(name, type=Path)
    args = parser.parse_args()
    call, names = VERBS[args.verb]
    return call(*(getattr(args, name) for name in names))


if __name__ == "__main__":
    # `import pointcept` means the checkout, which comes first on the path, and not this file.
    sys.path = [path for path in sys.path if Path(path or ".").resolve() != Path(__file__).resolve().parent]
    sys.exit(main())
