"""Turns STEP files into batches of points and labels, without a deep learning library.

    python examples/batches.py

The script generates four parts, labels them, and prints the shapes and types of the arrays of each batch. It needs numpy and the
Python package partprobe. With PyTorch, `torch.utils.data.DataLoader(partprobe.Dataset("dataset/"), batch_size=4, num_workers=2)`
makes such batches of a labeled data set.
"""

from collections.abc import Iterator

import numpy as np
import partprobe
from numpy.typing import NDArray


def batches(shapes: list[partprobe.Carrier], size: int) -> Iterator[tuple[NDArray[np.float32], NDArray[np.int64]]]:
    """Yields batches: points with normals (B, N, 6), and the part of each point (B, N)."""
    for first in range(0, len(shapes), size):
        samples = [shape.sample(1000, seed=0) for shape in shapes[first : first + size]]
        features = [np.concatenate([sample.points, sample.normals], axis=1) for sample in samples]
        yield np.stack(features), np.stack([sample.labels("step-parts") for sample in samples])


def main() -> None:
    shapes = [partprobe.label(partprobe.synth(seed=7, index=index), theta_deg=8.0) for index in range(4)]
    for features, labels in batches(shapes, size=2):
        print(features.shape, features.dtype, labels.shape, labels.dtype)


if __name__ == "__main__":
    main()
