"""Makes a checkout of Pointcept importable on a CPU: `checkout(PATH)` puts it on Python's path.

Pointcept imports packages that only build with CUDA, or that only other models need. This module replaces `torch_scatter`, which
reduces rows, with operations of torch. The other packages get placeholders, which can be imported but not used. No code of Pointcept is
copied.
"""

import importlib.abc
import importlib.machinery
import importlib.util
import sys
import types
from pathlib import Path

import torch

#: The top-level packages that get a placeholder if they are not installed.
PLACEHOLDERS = (
    "clip camtools cv2 dwconv einops MinkowskiEngine mmcv nuscenes open3d peft pointgroup_ops pointops "
    "pointops2 pointrope pointseg plyfile sklearn SharedArray tensorboardX torch_cluster torch_geometric torch_points3d "
    "torchsparse tqdm transformers trimesh termcolor vggt wandb yapf pandas matplotlib h5py"
).split()


class Placeholder(types.ModuleType):
    """A module in which every name is a class that cannot be instantiated."""

    __path__ = []

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)

        def refuse(*_args, **_kwargs):
            raise RuntimeError(f"{self.__name__}.{name} is not installed")

        return type(name, (torch.nn.Module,), {"__init__": refuse, "__module__": self.__name__})


class PlaceholderFinder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds the placeholders. Python asks it last, so an installed package is preferred."""

    def find_spec(self, name, _path=None, _target=None):
        is_known = name.split(".")[0] in PLACEHOLDERS
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if is_known else None

    def create_module(self, spec):
        return Placeholder(spec.name)

    def exec_module(self, _module):
        pass


def segment_csr(src, indptr, reduce="sum"):
    """Returns the reduced rows of each segment between one pointer and the next."""
    return torch.segment_reduce(src, reduce, offsets=indptr, axis=0)


def scatter(src, index, dim=0, dim_size=None, reduce="sum"):
    """Returns, for each index, the reduced rows with this index."""
    assert dim == 0
    n = int(index.max()) + 1 if dim_size is None else dim_size
    index = index.view(-1, *[1] * (src.dim() - 1)).expand_as(src)
    name = {"sum": "sum", "mean": "mean", "max": "amax", "min": "amin"}[reduce]
    return src.new_zeros(n, *src.shape[1:]).scatter_reduce(0, index, src, name, include_self=False)


def checkout(path):
    """Puts the checkout on Python's path."""
    path = Path(path).resolve()
    if not (path / "pointcept" / "models").is_dir():
        sys.exit(f"{path} is not a checkout of Pointcept: it has no folder pointcept/models")
    sys.path.insert(0, str(path))
    sys.meta_path.append(PlaceholderFinder())
    if importlib.util.find_spec("torch_scatter") is None:
        module = Placeholder("torch_scatter")
        module.segment_csr, module.scatter = segment_csr, scatter
        for kind in ("sum", "mean", "max", "min"):
            setattr(module, f"scatter_{kind}", lambda src, index, dim=0, kind=kind: scatter(src, index, dim, None, kind))
        sys.modules["torch_scatter"] = module
