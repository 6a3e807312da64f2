"""Runs Pointcept's own code on files of partprobe, on the CPU.

    pointcept.py weights POINTCEPT PARTPROBE WORK   converts random weights of Pointcept's PTv3 both ways, and runs both networks
    pointcept.py loader POINTCEPT FOLDER            reads a folder of `export pointcept` with Pointcept's config reader and data set
    pointcept.py unpack CHECKPOINT FILE             writes a checkpoint (.pth) as a safetensors file, for `weights from-pointcept`
    pointcept.py pack FILE CHECKPOINT               writes a safetensors file of `weights to-pointcept` as a checkpoint

Input: POINTCEPT is a checkout of github.com/Pointcept/Pointcept. This repository contains no part of it.
Exit status: 1 if the networks differ by more than allowed, or if the loader finds a problem.
Needs torch, numpy, safetensors, spconv, addict and timm.
"""

import argparse
import copy
import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

# On several threads, the results of spconv's convolution on the CPU change from call to call.
os.environ["OMP_NUM_THREADS"] = "1"

import torch
from safetensors.torch import load_file, save_file

import pointcept_packages

#: The largest relative L2 norm of the difference that is allowed.
TOLERANCE = 1e-4
CURVES = ("z", "z-trans", "hilbert", "hilbert-trans")
PATCH = 1024
SETTINGS = [
    "net.backbone.preset=base",
    "net.backbone.norm=batch",
    f"net.backbone.patch={PATCH}",
    "net.backbone.xcpe_of_skip=true",
    "tokens.voxels=plain",
]
#: The number of tokens of the shape that both networks get. It is larger than PATCH, so that the finest levels have several patches.
TOKENS = 2600


def network():
    """Returns Pointcept's PTv3 as published, with random weights, norms and running statistics."""
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
    """Replaces the shuffle of the curves with the fixed order of partprobe, in which level l begins with the l-th curve."""
    calls = iter([[0, 1, 2, 3]] + [[1, 2, 3, 0]] * 4)
    torch.randperm = lambda _n: torch.tensor(next(calls))


def features(model, case, shape, training):
    """Returns the rows that Pointcept's network computes for the tokens of one shape."""
    rows, cells = case[f"shapes.{shape}.features"], case[f"shapes.{shape}.cells"].long()
    highest = int(cells.max())
    if (highest + 1).bit_length() != highest.bit_length():
        sys.exit(f"the highest cell is {highest}: Pointcept uses one more bit for it, so its Hilbert curves differ; change TOKENS")
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
    """Returns the L2 norm of the difference, relative to the norm of the expected tensor."""
    return (torch.linalg.vector_norm(found.double() - expected.double()) / torch.linalg.vector_norm(expected.double())).item()


def compare(model, weights, case, shape):
    """Returns the larger of the differences in training and at test time, after the head of partprobe."""
    head = lambda rows: rows @ weights["head.weight"] + weights["head.bias"]
    unit = torch.nn.functional.normalize(head(features(model, case, shape, False)), dim=1)
    at_test = relative(case[f"shapes.{shape}.embedding"], unit)
    # This pass changes the running statistics. It comes last, so that no other pass uses them.
    in_training = relative(case[f"shapes.{shape}.output"], head(features(model, case, shape, True)))
    n = len(case[f"shapes.{shape}.cells"])
    print(f"{n} tokens: difference {at_test:.1e} at test time, {in_training:.1e} in training")
    return max(at_test, in_training)


def check_weights(checkout, program, work):
    """Converts random weights both ways, and runs both networks. Returns the exit status."""
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


# --- An exported folder ----------------------------------------------------------------------------------------------

#: For each experiment, its evaluator, its tester, and the entries of a batch that they read.
EXPERIMENTS = {
    "insseg.py": ("InsSegEvaluator", "InsSegTester", {"coord", "grid_coord", "segment", "instance", "instance_centroid",
                  "bbox", "origin_coord", "origin_segment", "origin_instance", "offset", "origin_offset", "feat", "name"}),
    "semseg.py": ("SemSegEvaluator", "SemSegTester", {"coord", "grid_coord", "segment", "origin_segment", "inverse",
                  "offset", "feat"}),
}


def check_loader(checkout, folder):
    """Reads both experiments with Pointcept's config reader, loads all shapes, and takes a training step. Returns the exit status."""
    pointcept_packages.checkout(checkout)
    importlib.import_module("pointcept.models")
    importlib.import_module("pointcept.datasets")
    config_of = importlib.import_module("pointcept.utils.config").Config.fromfile
    build_dataset = importlib.import_module("pointcept.datasets.builder").build_dataset
    collate = importlib.import_module("pointcept.datasets.utils").point_collate_fn
    testers = importlib.import_module("pointcept.engines.test").TESTERS
    hooks = importlib.import_module("pointcept.engines.hooks.builder").HOOKS
    split = json.loads((folder / "split.json").read_text())
    problems = []
    for file, (evaluator, tester, needed) in EXPERIMENTS.items():
        config = config_of(str(folder / file))
        names = [hook.type for hook in config.hooks]
        problems += [f"{file}: no hook {name}" for name in names if hooks.get(name) is None]
        if config.test.type != tester or testers.get(tester) is None or evaluator not in names:
            problems.append(f"{file}: evaluator or tester does not fit: {names}, {config.test.type}")
        counts = {}
        for side in ("train", "val", "test"):
            dataset = build_dataset(config.data[side])
            counts[side] = len(dataset)
            if len(dataset) != len(split[side]):
                problems.append(f"{file}: {len(dataset)} shapes in {side}, and split.json names {len(split[side])}")
            for idx in range(len(dataset)):
                problems += [f"{file}, {side}: {problem}" for problem in sample_problems(dataset[idx], config)]
        batch = collate([build_dataset(config.data.val)[0]], mix_prob=0)
        problems += [f"{file}: the evaluator needs {key}" for key in sorted(needed - set(batch))]
        print(f"{file}: {counts}, {config.model.type}, {evaluator}, {tester}, {training_step(config, build_dataset, collate)}")
    print("\n".join(problems) or "no problems")
    return int(bool(problems))


def sample_problems(sample, config):
    """Returns what is wrong with one shape after the transforms."""
    if "fragment_list" in sample:
        n = sum(len(fragment["index"]) for fragment in sample["fragment_list"])
        is_whole = n >= len(sample["segment"])
        return [] if is_whole else [f"fragments hold {n} of {len(sample['segment'])} points"]
    found = []
    n = len(sample["coord"])
    if sample["feat"].shape != (n, config.model.backbone.in_channels):
        found.append(f"features {tuple(sample['feat'].shape)}")
    if not (-1 <= int(sample["segment"].min()) and int(sample["segment"].max()) < config.data.num_classes):
        found.append("a class that the config does not have")
    if "instance" in sample and int(sample["instance"].max()) + 1 != len(sample["bbox"]):
        found.append("instances and boxes differ in number")
    return found


def training_step(config, build_dataset, collate):
    """Runs two updates of the config's model on two shapes, and returns the losses as text. The backbone is smaller, for the CPU."""
    models = importlib.import_module("pointcept.models.builder").MODELS
    model_config = copy.deepcopy(config.model)
    small = dict(enc_depths=(1,) * 5, dec_depths=(1,) * 4, enc_patch_size=(256,) * 5, dec_patch_size=(256,) * 4)
    model_config.backbone.update(small)
    torch.manual_seed(0)
    model = models.build(model_config).train()
    dataset = build_dataset(config.data.train)
    batch = collate([dataset[idx % len(dataset)] for idx in range(2)], mix_prob=0)
    # Even without a GPU, the backward pass of spconv asks for a CUDA stream, which it does not use.
    importlib.import_module("spconv.pytorch.ops").get_current_stream = lambda: 0
    optimizer = torch.optim.AdamW(model.parameters(), lr=1e-3)
    losses = []
    for _ in range(2):
        loss = model(dict(batch))["loss"]
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    return f"losses of two updates {losses[0]:.3f} and {losses[1]:.3f}"


# --- Checkpoints ------------------------------------------------------------------------------------------------------


def unpack(checkpoint, file):
    """Writes the tensors of a checkpoint to a safetensors file. torch refuses a checkpoint with other objects."""
    state = torch.load(checkpoint, map_location="cpu", weights_only=True)
    state = state.get("state_dict", state)
    save_file({name: tensor.float().contiguous() if tensor.is_floating_point() else tensor for name, tensor in state.items()}, file)
    print(file)
    return 0


def pack(file, checkpoint):
    """Writes tensors as a checkpoint that Pointcept's CheckpointLoader can read."""
    torch.save({"state_dict": load_file(file), "epoch": 0}, checkpoint)
    print(checkpoint)
    return 0


VERBS = {
    "weights": (check_weights, ("pointcept", "partprobe", "work")),
    "loader": (check_loader, ("pointcept", "folder")),
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
    # The folder of this file is removed from the path. Otherwise, `import pointcept` would import this file and not the checkout.
    sys.path = [path for path in sys.path if Path(path or ".").resolve() != Path(__file__).resolve().parent]
    sys.exit(main())
