"""Writes small ONNX models for tests of the label source `onnx`. They look like models that users export from their own networks.

    make_model.py OUT [MODEL…]

Input: the names of models in `MODELS`. Without names, all models are written.
Output: one file per model in the folder OUT, and its path on stdout.
Needs `onnx` and `numpy`.

The sound models compute the same features, with the same random weights (the seed is fixed). For a point or triangle with the position p
and the normal n, they compute (n, n·p), which is constant on a plane. A perceptron turns these four numbers into 16 features. The models
differ in the layout of their tensors. Each faulty model has one fault that a user's model may have.
"""

import argparse
import pathlib

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

SEED = 7
N_HIDDEN = 32
N_FEATURES = 16
OPSET = 17


def weights():
    """Returns the weights and biases of the perceptron: 4 to 32 to 16 numbers."""
    random = np.random.default_rng(SEED)
    sizes = [4, N_HIDDEN, N_FEATURES]
    layers = []
    for n_in, n_out in zip(sizes, sizes[1:]):
        weight = random.normal(0.0, np.sqrt(2.0 / n_in), (n_in, n_out)).astype(np.float32)
        bias = random.normal(0.0, 0.1, n_out).astype(np.float32)
        layers.append((weight, bias))
    return layers


def tensor(name, *shape, kind=TensorProto.FLOAT):
    """Returns the description of an input or output of a model."""
    return helper.make_tensor_value_info(name, kind, shape)


class Graph:
    """The nodes and constants of a model, in the order in which they are added."""

    def __init__(self):
        self.nodes = []
        self.constants = []

    def constant(self, name, values):
        """Adds a constant and returns its name."""
        self.constants.append(numpy_helper.from_array(np.asarray(values), name))
        return name

    def node(self, operator, inputs, output, **attributes):
        """Adds a node and returns the name of its output."""
        self.nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def save(self, path, inputs, outputs):
        """Writes the model to a file. ONNX checks it first, unless it has an operator of another domain."""
        graph = helper.make_graph(self.nodes, path.stem, inputs, outputs, self.constants)
        opsets = [helper.make_opsetid("", OPSET)]
        if any(node.domain for node in self.nodes):
            opsets.append(helper.make_opsetid("com.example", 1))
        model = helper.make_model(graph, opset_imports=opsets, ir_version=8)
        if not any(node.domain for node in self.nodes):
            onnx.checker.check_model(model, full_check=True)
        path.write_bytes(model.SerializeToString(deterministic=True))

    def features(self, positions, normals, output):
        """Adds the perceptron on (n, n·p). The last axis of both inputs has the three coordinates."""
        axis = self.constant("last_axis", np.array([-1], dtype=np.int64))
        products = self.node("Mul", [positions, normals], "products")
        offset = self.node("ReduceSum", [products, axis], "plane_offset", keepdims=1)
        values = self.node("Concat", [normals, offset], "plane", axis=-1)
        layers = weights()
        for number, (weight, bias) in enumerate(layers):
            name = f"layer{number}"
            weight = self.constant(f"{name}.weight", weight)
            bias = self.constant(f"{name}.bias", bias)
            product = self.node("MatMul", [values, weight], f"{name}.product")
            is_last = number + 1 == len(layers)
            values = self.node("Add", [product, bias], output if is_last else f"{name}.sum")
            if not is_last:
                values = self.node("Relu", [values], f"{name}.relu")
        return values

    def split(self, points):
        """Splits a tensor whose last axis has six channels into positions and normals."""
        for name, start, end in (("positions", 0, 3), ("normals", 3, 6)):
            bounds = {"start": start, "end": end, "axis": -1}
            names = [self.constant(f"{name}.{key}", np.array([value], dtype=np.int64)) for key, value in bounds.items()]
            self.node("Slice", [points, *names], name)
        return "positions", "normals"


def batch_rows(path, n="N"):
    """Writes a model from `points` (1, N, 6) to `features` (1, N, 16)."""
    graph = Graph()
    graph.features(*graph.split("points"), "features")
    graph.save(path, [tensor("points", 1, n, 6)], [tensor("features", 1, n, N_FEATURES)])


def batch_channels(path):
    """Writes a model from `points` (1, 6, N) to `features` (1, 16, N), which is the layout of PointNet."""
    graph = Graph()
    graph.node("Transpose", ["points"], "rows", perm=[0, 2, 1])
    graph.features(*graph.split("rows"), "feature_rows")
    graph.node("Transpose", ["feature_rows"], "features", perm=[0, 2, 1])
    graph.save(path, [tensor("points", 1, 6, "N")], [tensor("features", 1, N_FEATURES, "N")])


def two_inputs(path):
    """Writes a model with three inputs and two outputs.

    It computes `embedding` (N, 16) from `xyz` (N, 3) and `normal` (N, 3), and `count` (1) from `offset` (1), the number of rows.
    """
    graph = Graph()
    graph.features("xyz", "normal", "embedding")
    graph.node("Cast", ["offset"], "count", to=TensorProto.FLOAT)
    inputs = [tensor("xyz", "N", 3), tensor("normal", "N", 3), tensor("offset", 1, kind=TensorProto.INT64)]
    graph.save(path, inputs, [tensor("embedding", "N", N_FEATURES), tensor("count", 1)])


def fixed_count(path):
    """Writes a model from `points` (1, 1024, 6), as if it were exported for exactly 1024 points."""
    batch_rows(path, n=1024)


def not_a_number(path):
    """Writes a model whose features are NaN, because it divides 0 by 0."""
    graph = Graph()
    positions, normals = graph.split("points")
    zero = graph.constant("zero", np.array(0.0, dtype=np.float32))
    nothing = graph.node("Mul", [positions, zero], "nothing")
    graph.node("Div", [nothing, nothing], "not_a_number")
    graph.features("not_a_number", normals, "features")
    graph.save(path, [tensor("points", 1, "N", 6)], [tensor("features", 1, "N", N_FEATURES)])


def one_feature_vector(path):
    """Writes a model with one row for the whole shape, `features` (1, 6), as a classifier has."""
    graph = Graph()
    graph.node("ReduceMean", ["points"], "features", axes=[1], keepdims=0)
    graph.save(path, [tensor("points", 1, "N", 6)], [tensor("features", 1, 6)])


def unknown_operator(path):
    """Writes a model with an operator of another domain, which no runtime knows."""
    graph = Graph()
    graph.nodes.append(helper.make_node("Embed", ["points"], ["features"], domain="com.example"))
    graph.save(path, [tensor("points", 1, "N", 6)], [tensor("features", 1, "N", N_FEATURES)])


def double_input(path):
    """Writes a model whose `points` are 64-bit numbers."""
    graph = Graph()
    graph.node("Cast", ["points"], "features", to=TensorProto.FLOAT)
    graph.save(path, [tensor("points", 1, "N", 6, kind=TensorProto.DOUBLE)], [tensor("features", 1, "N", 6)])


def damaged(path):
    """Writes the first half of a model file."""
    batch_rows(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


MODELS = {
    "batch-rows": batch_rows,
    "batch-channels": batch_channels,
    "two-inputs": two_inputs,
    "fixed-count": fixed_count,
    "not-a-number": not_a_number,
    "one-feature-vector": one_feature_vector,
    "unknown-operator": unknown_operator,
    "double-input": double_input,
    "damaged": damaged,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="the folder to write to")
    parser.add_argument("names", nargs="*", metavar="MODEL", help=f"models to write (default: all): {', '.join(MODELS)}")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in MODELS]
    if unknown:
        parser.error(f"no model is named {', '.join(unknown)}; the models are {', '.join(MODELS)}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.names or MODELS:
        path = arguments.out / f"{name}.onnx"
        MODELS[name](path)
        print(path)


if __name__ == "__main__":
    main()
