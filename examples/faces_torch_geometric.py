"""Trains a graph network of PyTorch Geometric to predict which edges of a B-Rep lie inside a part, and which edges separate two parts.

    faces_torch_geometric.py DATASET [EPOCHS]

Input: DATASET, a folder that `partprobe label` wrote. The default number of epochs is 5.
Output: the loss and the accuracy of each epoch, on stdout. Both are measured on the training shapes: the script only shows how the data
goes from one library to the other. A real experiment measures on shapes that were not trained on.
Needs partprobe, torch and torch_geometric.
"""

import sys

import partprobe
import torch
from torch_geometric.data import Data
from torch_geometric.loader import DataLoader
from torch_geometric.nn import GCNConv


def main() -> None:
    dataset = partprobe.Dataset(sys.argv[1])
    n_epochs = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    graphs = [
        Data(**{name: torch.from_numpy(array) for name, array in dataset.graph(index).items()}) for index in range(len(dataset))
    ]
    n_features, n_edge_features = graphs[0].num_node_features, graphs[0].num_edge_features

    torch.manual_seed(0)
    first, second = GCNConv(n_features, 32), GCNConv(32, 32)
    head = torch.nn.Linear(2 * 32 + n_edge_features, 1)
    optimizer = torch.optim.Adam([*first.parameters(), *second.parameters(), *head.parameters()], lr=0.01)
    for epoch in range(n_epochs):
        loss_sum, n_right, n_edges = 0.0, 0, 0
        for batch in DataLoader(graphs, batch_size=8, shuffle=True):
            faces = second(first(batch.x, batch.edge_index).relu(), batch.edge_index)
            begin, end = batch.edge_index
            scores = head(torch.cat([faces[begin], faces[end], batch.edge_attr], dim=1)).squeeze(1)
            is_inside = (batch.y[begin] == batch.y[end]).float()
            loss = torch.nn.functional.binary_cross_entropy_with_logits(scores, is_inside)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            loss_sum += float(loss) * len(is_inside)
            n_right += int(((scores > 0) == (is_inside > 0)).sum())
            n_edges += len(is_inside)
        print(f"epoch {epoch}: loss {loss_sum / n_edges:.3f}, accuracy {n_right / n_edges:.3f}")


if __name__ == "__main__":
    main()
