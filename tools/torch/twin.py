"""Computes the network of partprobe in PyTorch, with torch's own layers.

It was written from the paper of PTv3 and partprobe's documentation.

Input: tokens (features, grid cells, dominant normal axes), and weights in partprobe's layout.
Output: embeddings that are not normalized.

The serialization (curves, patches, neighbors, pooling) is computed here in numpy, only from the cells. Nothing except names and layouts
comes from the Rust code, so their agreement shows that both are right. `parity.py` compares them. A benchmark can use `Network`,
`tokens_of_file` and `training_step`.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
import torch.nn.functional as F
from safetensors.torch import load_file
from torch import nn

N_FEATURES = 6
HEAD_DIM = 16
MLP_RATIO = 4
CURVES = ("z", "z-trans", "hilbert", "hilbert-trans")


@dataclass(frozen=True)
class Stages:
    """The depths and widths of the encoder and the decoder, both from the finest stage to the coarsest."""

    encoder_depths: tuple
    encoder_widths: tuple
    decoder_depths: tuple
    decoder_widths: tuple


PRESETS = {
    "micro": Stages((1, 1, 1), (32, 48, 64), (1, 1), (48, 48)),
    "tiny": Stages((1, 1, 2, 1), (32, 64, 96, 128), (1, 1, 1), (64, 64, 96)),
    "mini": Stages((1, 1, 1, 2, 1), (32, 48, 96, 160, 192), (1, 1, 1, 1), (48, 48, 96, 160)),
    "base": Stages((2, 2, 2, 6, 2), (32, 64, 128, 256, 512), (2, 2, 2, 2), (64, 64, 128, 256)),
}
LITEPT_HEAD_DIM = 18
PTX_MLP_RATIO = 2
ROTARY_BASE = 100.0
LITEPT_PRESETS = {
    "micro": Stages((1, 1, 2), (36, 54, 72), (0, 0), (54, 54)),
    "tiny": Stages((1, 1, 2, 2), (36, 72, 108, 144), (0, 0, 0), (72, 72, 108)),
    "small": Stages((2, 2, 2, 6, 2), (36, 72, 144, 252, 504), (0, 0, 0, 0), (72, 72, 144, 252)),
}
#: The number of LitePT's finest stages that have convolutions.
LITEPT_CONVOLUTIONS = {"micro": 2, "tiny": 2, "small": 3}


# --- Serialization, in numpy --------------------------------------------------------------------------------------


def interleave(x, y, z, depth):
    """Returns Morton codes: the bits of x, y and z in turn, with x as the most significant bit of each triplet."""
    code = np.zeros(len(x), np.int64)
    for bit in range(depth):
        for place, axis in ((2, x), (1, y), (0, z)):
            code |= ((axis >> bit) & 1) << (3 * bit + place)
    return code


def hilbert(x, y, z, depth):
    """Returns codes along the Hilbert curve, by Skilling's transposition (AIP Conf. Proc. 707, 2004), most significant bit first."""
    axes = [x.copy(), y.copy(), z.copy()]
    for bit in range(depth - 1, 0, -1):
        low = (1 << bit) - 1
        for axis in range(3):
            is_set = (axes[axis] >> bit) & 1 == 1
            swap = np.where(is_set, 0, (axes[0] ^ axes[axis]) & low)
            axes[0] ^= np.where(is_set, low, swap)
            axes[axis] ^= swap
    axes[1] ^= axes[0]
    axes[2] ^= axes[1]
    flips = np.zeros_like(x)
    for bit in range(depth - 1, 0, -1):
        flips ^= np.where((axes[2] >> bit) & 1 == 1, (1 << bit) - 1, 0)
    return interleave(*(axis ^ flips for axis in axes), depth)


def curve_code(curve, cells, depth):
    """Returns the code of each cell along a curve. The `-trans` curves swap x and y."""
    x, y, z = cells.T.astype(np.int64)
    if curve.endswith("-trans"):
        x, y = y, x
    return (hilbert if curve.startswith("hilbert") else interleave)(x, y, z, depth)


def neighbor_table(cells, axes, radius):
    """Returns the neighbors of each token, `[token, (2r+1)^3]`, with z as the fastest axis.

    An entry is the token in the neighbor cell with the same axis. If there is none, it is the lowest token in that cell, and n if the cell
    is empty.
    """
    n, side = len(cells), 2 * radius + 1
    shifted = cells.astype(np.int64) + radius
    extent = int(shifted.max(initial=0)) + radius + 1

    def key(cell):
        return (cell[:, 0] * extent + cell[:, 1]) * extent + cell[:, 2]

    by_cell = np.lexsort((np.arange(n), key(shifted)))
    cell_keys = key(shifted)[by_cell]
    by_voxel = np.lexsort((axes, key(shifted)))
    voxel_keys = (key(shifted) * 6 + axes)[by_voxel]
    table = np.full((n, side**3), n, np.int64)
    steps = range(-radius, radius + 1)
    for slot, offset in enumerate((dx, dy, dz) for dx in steps for dy in steps for dz in steps):
        wanted = key(shifted + np.array(offset))
        first = np.minimum(np.searchsorted(cell_keys, wanted), n - 1)
        table[:, slot] = np.where(cell_keys[first] == wanted, by_cell[first], n)
        own = np.minimum(np.searchsorted(voxel_keys, wanted * 6 + axes), n - 1)
        table[:, slot] = np.where(voxel_keys[own] == wanted * 6 + axes, by_voxel[own], table[:, slot])
    return table


@dataclass
class Patches:
    """The tokens patch by patch (`order`), the position of each token in this list (`place`), and the length of a patch (`size`)."""

    order: torch.Tensor
    place: torch.Tensor
    size: int


@dataclass
class Level:
    """The tokens of one grid size, of one shape or of several shapes one after the other."""

    n: int
    #: `[token, 3]`, as floating-point numbers.
    cells: torch.Tensor
    neighbors: torch.Tensor
    #: One list per shape, with one `Patches` per turn.
    patches: list
    cluster: torch.Tensor = None
    members: torch.Tensor = None


def patches_along(order, patch):
    """Returns the patches along a curve, by PTv3's rule.

    The last patch is filled up with the tokens at the same positions of the patch before it. If there are few tokens, they form one patch.
    """
    n = len(order)
    size = max(1, min(patch, n))
    n_padded = math.ceil(n / size) * size
    places = np.arange(n_padded)
    padded = order[np.where(places < n, places, places - size)]
    place = np.empty(n, np.int64)
    place[order] = np.arange(n)
    return Patches(torch.from_numpy(padded), torch.from_numpy(place), size)


def fixed_turns(n_levels, orders=CURVES):
    """Returns the order of the curves on each level at test time: level l starts with the l-th curve."""
    return [[orders[(level + i) % len(orders)] for i in range(len(orders))] for level in range(n_levels)]


def levels_of(cells, axes, patch, turns):
    """Returns the levels of one shape. The code of a coarser cell is that of a finer cell without its last bits."""
    cells, axes = np.asarray(cells, np.int64), np.asarray(axes, np.int64)
    depth = max(1, int(cells.max(initial=0)).bit_length())
    codes = {curve: curve_code(curve, cells, depth) for curve in CURVES}
    levels = []
    for idx, turn in enumerate(turns):
        orders = [np.lexsort((axes, codes[curve])) for curve in turn]
        neighbors = torch.from_numpy(neighbor_table(cells, axes, 1))
        positions = torch.from_numpy(cells.astype(np.float32))
        level = Level(len(cells), positions, neighbors, [[patches_along(order, patch) for order in orders]])
        if idx + 1 < len(turns):
            keys = (codes["z"] >> 3) * 6 + axes
            _, first, cluster = np.unique(keys, return_index=True, return_inverse=True)
            level.cluster = torch.from_numpy(cluster.reshape(-1))
            level.members = torch.from_numpy(members_of(cluster.reshape(-1), len(first)))
            cells, axes = cells[first] >> 1, axes[first]
            codes = {curve: code[first] >> 3 for curve, code in codes.items()}
        levels.append(level)
    return levels


def members_of(cluster, n_clusters):
    """Returns up to eight tokens per cluster, `[cluster, 8]`. If there are fewer, the first one is repeated."""
    by_cluster = np.argsort(cluster, kind="stable")
    starts = np.searchsorted(cluster[by_cluster], np.arange(n_clusters + 1))
    slots = starts[:-1, None] + np.arange(8)
    return by_cluster[np.where(slots < starts[1:, None], slots, starts[:-1, None])]


def joined(shapes):
    """Returns the levels of several shapes as one. The tokens follow each other, and each shape keeps its own patches."""
    result = []
    for levels in zip(*shapes):
        n = sum(level.n for level in levels)
        parts, first, first_cluster = [], 0, 0
        for level in levels:
            shifted = torch.where(level.neighbors < level.n, level.neighbors + first, n)
            patches = [[Patches(p.order + first, p.place, p.size) for p in turn] for turn in level.patches]
            cluster, members = level.cluster, level.members
            if cluster is not None:
                cluster, members = cluster + first_cluster, members + first
                first_cluster += len(members)
            parts.append(Level(level.n, level.cells, shifted, patches, cluster, members))
            first += level.n
        last = parts[0].cluster is None
        result.append(
            Level(
                n,
                torch.cat([part.cells for part in parts]),
                torch.cat([part.neighbors for part in parts]),
                [patches for part in parts for patches in part.patches],
                None if last else torch.cat([part.cluster for part in parts]),
                None if last else torch.cat([part.members for part in parts]),
            )
        )
    return result


# --- The network, from torch's own layers ---------------------------------------------------------------------------


class Convolution(nn.Module):
    """A submanifold convolution, with one matrix for each cell of the neighborhood. Its weight is `[cell * in, out]`.

    `formulation` is "gather" (one gather, one product) or "offsets" (one product for each cell, over the tokens whose cell is occupied).
    """

    def __init__(self, volume, dim_in, dim_out, bias, formulation="gather"):
        super().__init__()
        self.volume, self.formulation = volume, formulation
        self.linear = nn.Linear(volume * dim_in, dim_out, bias=bias)

    def forward(self, rows, neighbors):
        n, dim = rows.shape
        if self.formulation == "gather":
            padded = torch.cat([rows, rows.new_zeros(1, dim)])
            return self.linear(padded.index_select(0, neighbors.reshape(-1)).view(n, self.volume * dim))
        weight = self.linear.weight.t().reshape(self.volume, dim, -1)
        out = rows.new_zeros(n, weight.shape[2])
        for cell in range(self.volume):
            to = torch.nonzero(neighbors[:, cell] < n).reshape(-1)
            out = out.index_add(0, to, rows.index_select(0, neighbors[to, cell]) @ weight[cell])
        return out if self.linear.bias is None else out + self.linear.bias


def norm_of(kind, width):
    """Returns a batch norm or a layer norm."""
    return nn.BatchNorm1d(width, eps=1e-3, momentum=0.01) if kind == "batch" else nn.LayerNorm(width)


def patch_attention(qkv, patches, formulation="sdpa", head_dim=HEAD_DIM):
    """Returns the attention within each patch. `patches` has one entry per shape, in the order of the rows."""
    width = qkv.shape[1] // 3
    heads = width // head_dim
    mixed = []
    for own in patches:
        by_patch = qkv.index_select(0, own.order).view(-1, own.size, 3, heads, head_dim).permute(2, 0, 3, 1, 4)
        query, key, value = by_patch.unbind(0)
        if formulation == "sdpa":
            out = F.scaled_dot_product_attention(query, key, value)
        else:
            out = torch.softmax((query * head_dim**-0.5) @ key.transpose(-1, -2), -1) @ value
        mixed.append(out.transpose(1, 2).reshape(-1, width).index_select(0, own.place))
    return mixed[0] if len(mixed) == 1 else torch.cat(mixed)


class Xcpe(nn.Module):
    """The first branch of a block: a 3³ submanifold convolution, a linear map and a norm."""

    def __init__(self, width, formulation):
        super().__init__()
        self.conv = Convolution(27, width, width, True, formulation)
        self.out = nn.Linear(width, width)
        self.norm = nn.LayerNorm(width)

    def forward(self, rows, level):
        return self.norm(self.out(self.conv(rows, level.neighbors)))


class Attention(nn.Module):
    """The second branch of a block: attention within the patches of its curve."""

    def __init__(self, width, turn, formulation):
        super().__init__()
        self.turn, self.formulation = turn, formulation
        self.norm = nn.LayerNorm(width)
        self.qkv = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)

    def forward(self, rows, level):
        own = [patches[self.turn % len(patches)] for patches in level.patches]
        return self.out(patch_attention(self.qkv(self.norm(rows)), own, self.formulation))


class Mlp(nn.Module):
    """The last branch of a block: a perceptron with one hidden layer."""

    def __init__(self, width):
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.hidden = nn.Linear(width, MLP_RATIO * width)
        self.out = nn.Linear(MLP_RATIO * width, width)

    def forward(self, rows):
        return self.out(F.gelu(self.hidden(self.norm(rows))))


class Block(nn.Module):
    """xCPE, patch attention and perceptron. The output of each is added to its input."""

    def __init__(self, width, turn, xcpe=True, attention=True, xcpe_of_skip=False, conv="gather", mix="sdpa"):
        super().__init__()
        self.xcpe_of_skip = xcpe_of_skip
        self.xcpe = Xcpe(width, conv) if xcpe else None
        self.attention = Attention(width, turn, mix) if attention else None
        self.mlp = Mlp(width)

    def forward(self, rows, level, skip=None):
        if self.xcpe is not None:
            rows = rows + self.xcpe(rows if skip is None or not self.xcpe_of_skip else skip, level)
        if self.attention is not None:
            rows = rows + self.attention(rows, level)
        return rows + self.mlp(rows)


class Stem(nn.Module):
    """A 5³ submanifold convolution without bias, a norm and GELU."""

    def __init__(self, width, norm, conv="gather"):
        super().__init__()
        self.conv = Convolution(125, N_FEATURES, width, False, conv)
        self.norm = norm_of(norm, width)

    def forward(self, features, neighbors):
        return F.gelu(self.norm(self.conv(features, neighbors)))


class Projection(nn.Module):
    """A linear map, a norm and GELU. With `members`, the maximum over each cluster is taken after the linear map."""

    def __init__(self, dim_in, dim_out, norm):
        super().__init__()
        self.linear = nn.Linear(dim_in, dim_out)
        self.norm = norm_of(norm, dim_out)

    def forward(self, rows, members=None):
        rows = self.linear(rows)
        if members is not None:
            rows = rows.index_select(0, members.reshape(-1)).view(*members.shape, -1).max(1).values
        return F.gelu(self.norm(rows))


class EncoderStage(nn.Module):
    """A pooling, unless it is the first stage, and blocks. `block` makes a block of a width and a turn."""

    def __init__(self, below, width, depth, norm, block):
        super().__init__()
        self.pool = None if below is None else Projection(below, width, norm)
        self.blocks = nn.ModuleList(block(width, turn) for turn in range(depth))


class DecoderStage(nn.Module):
    """The projections of an unpooling, and blocks. `block` makes a block of a width and a turn."""

    def __init__(self, below, skip, width, depth, norm, block):
        super().__init__()
        self.child = Projection(below, width, norm)
        self.skip = Projection(skip, width, norm)
        self.blocks = nn.ModuleList(block(width, turn) for turn in range(depth))


class Identity(nn.Module):
    """The coordinates of the tokens along the axes of the grid, the same for each head."""

    def forward(self, cells, heads):
        return cells[:, None].expand(-1, heads, -1)


class HeadAxes(nn.Module):
    """The coordinates of the tokens along three perpendicular axes for each head.

    The axes come from two learned vectors by the method of Gram and Schmidt. Head h begins with axis h mod 3.
    """

    def __init__(self, heads):
        super().__init__()
        # The vectors are transposed, because torch stores every matrix transposed compared with partprobe.
        self.along = nn.Parameter(torch.zeros(3, heads))
        self.beside = nn.Parameter(torch.zeros(3, heads))

    def forward(self, cells, heads):
        def unit(vectors):
            return vectors / (vectors.norm(dim=1, keepdim=True) + 1e-6)

        first, beside = unit(self.along.t()), self.beside.t()
        second = unit(beside - first * (beside * first).sum(1, keepdim=True))
        axes = torch.stack([first, second, torch.linalg.cross(first, second)], 1)
        axes = torch.stack([axes[head].roll(-(head % 3), 0) for head in range(heads)])
        return torch.einsum("nc,hac->nha", cells, axes)


def rotated(rows, angles, n_pairs):
    """Returns rows whose channel pairs, as complex numbers, are rotated by angles.

    `rows` is `[n, heads, head_dim]`, and `angles` has one tensor for each axis.
    """
    parts, start = [], 0
    for angle, n in zip(angles, n_pairs):
        own = torch.complex(rows[..., start : start + n], rows[..., start + n : start + 2 * n])
        turned = own * torch.polar(torch.ones_like(angle), angle)
        parts += [turned.real, turned.imag]
        start += 2 * n
    return torch.cat([*parts, rows[..., start:]], -1)


class RotaryAttention(nn.Module):
    """Attention within patches. Queries and keys are rotated by the positions of their tokens."""

    def __init__(self, width, turn, head_dim, learned, formulation):
        super().__init__()
        self.turn, self.formulation = turn, formulation
        self.heads = max(1, width // head_dim)
        self.head_dim = width // self.heads
        self.norm = nn.LayerNorm(width)
        self.qkv = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)
        self.axes = HeadAxes(self.heads) if learned else Identity()

    def forward(self, rows, level):
        query, key, value = self.qkv(self.norm(rows)).view(len(rows), 3, self.heads, self.head_dim).unbind(1)
        n = self.head_dim // 2
        n_pairs = [n // 3 + (axis < n % 3) for axis in range(3)]
        coordinates = self.axes(level.cells, self.heads)
        angles = [
            coordinates[..., axis, None] * ROTARY_BASE ** (-torch.arange(count) / count)
            for axis, count in enumerate(n_pairs)
        ]
        query, key = rotated(query, angles, n_pairs), rotated(key, angles, n_pairs)
        qkv = torch.stack([query, key, value], 1).reshape(len(rows), -1)
        own = [patches[self.turn % len(patches)] for patches in level.patches]
        return self.out(patch_attention(qkv, own, self.formulation, self.head_dim))


class LiteptAttention(nn.Module):
    """The block of LitePT's coarse stages: a norm, attention and a perceptron."""

    def __init__(self, width, turn, mix):
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.attention = RotaryAttention(width, turn, LITEPT_HEAD_DIM, False, mix)
        self.mlp = Mlp(width)

    def forward(self, rows, level):
        rows = self.norm(rows)
        rows = rows + self.attention(rows, level)
        return rows + self.mlp(rows)


class LiteptBlock(nn.Module):
    """A block of LitePT: on fine stages a convolution that is added; on coarse stages a norm, attention and a perceptron."""

    def __init__(self, width, turn, stage, n_convolutions, conv="gather", mix="sdpa"):
        super().__init__()
        self.xcpe = Xcpe(width, conv) if stage < n_convolutions else None
        self.attention = None if stage < n_convolutions else LiteptAttention(width, turn, mix)

    def forward(self, rows, level, _skip=None):
        return rows + self.xcpe(rows, level) if self.attention is None else self.attention(rows, level)


class SquaredMlp(nn.Module):
    """A perceptron whose activation is the square of ReLU."""

    def __init__(self, width):
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.hidden = nn.Linear(width, PTX_MLP_RATIO * width)
        self.out = nn.Linear(PTX_MLP_RATIO * width, width)

    def forward(self, rows):
        return self.out(F.relu(self.hidden(self.norm(rows))) ** 2)


class PtxBlock(nn.Module):
    """Attention along learned axes, and a perceptron. The output of each is added to its input."""

    def __init__(self, width, turn, mix="sdpa"):
        super().__init__()
        self.attention = RotaryAttention(width, turn, HEAD_DIM, True, mix)
        self.mlp = SquaredMlp(width)

    def forward(self, rows, level, _skip=None):
        rows = rows + self.attention(rows, level)
        return rows + self.mlp(rows)


class LinearStem(nn.Module):
    """A linear map of each token, a norm and GELU."""

    def __init__(self, width, norm):
        super().__init__()
        self.linear = nn.Linear(N_FEATURES, width)
        self.norm = norm_of(norm, width)

    def forward(self, features, _neighbors):
        return F.gelu(self.norm(self.linear(features)))


class UNet(nn.Module):
    """A backbone. `decoder` begins with the coarsest stage, as the pass does. `block` makes a block of stage, width and turn."""

    def __init__(self, stages, stem, norm, block):
        super().__init__()
        widths = stages.encoder_widths
        self.stem = stem
        below = (None, *widths)
        self.encoder = nn.ModuleList(
            EncoderStage(below[s], width, stages.encoder_depths[s], norm, partial(block, s))
            for s, width in enumerate(widths)
        )
        self.decoder = nn.ModuleList()
        under = widths[-1]
        for s in reversed(range(len(stages.decoder_widths))):
            width = stages.decoder_widths[s]
            depth = stages.decoder_depths[s]
            self.decoder.append(DecoderStage(under, widths[s], width, depth, norm, partial(block, s)))
            under = width
        self.width = under

    def forward(self, features, stem_neighbors, levels):
        rows = self.stem(features, stem_neighbors)
        skips = []
        for idx, (stage, level) in enumerate(zip(self.encoder, levels)):
            if stage.pool is not None:
                rows = stage.pool(rows, levels[idx - 1].members)
            for block in stage.blocks:
                rows = block(rows, level)
            skips.append(rows)
        for stage, skip, level in zip(self.decoder, skips[-2::-1], levels[-2::-1]):
            # The child comes first, as in partprobe, because batch statistics are compared in the order of the pass.
            child = stage.child(rows)
            skip = stage.skip(skip)
            rows = child.index_select(0, level.cluster) + skip
            for idx, block in enumerate(stage.blocks):
                rows = block(rows, level, skip if idx == 0 else None)
        return rows


def ptv3(stages, norm="layer", conv="gather", **options):
    """Returns the backbone PTv3."""

    def block(_stage, width, turn):
        return Block(width, turn, conv=conv, **options)

    return UNet(stages, Stem(stages.encoder_widths[0], norm, conv), norm, block)


def litept(preset, norm="layer"):
    """Returns the backbone LitePT."""
    stages = LITEPT_PRESETS[preset]

    def block(stage, width, turn):
        return LiteptBlock(width, turn, stage, LITEPT_CONVOLUTIONS[preset])

    return UNet(stages, Stem(stages.encoder_widths[0], norm), norm, block)


def ptx(preset, norm="layer"):
    """Returns the backbone PointTransformerX."""
    stages = PRESETS[preset]

    def block(_stage, width, turn):
        return PtxBlock(width, turn)

    return UNet(stages, LinearStem(stages.encoder_widths[0], norm), norm, block)


class Network(nn.Module):
    """A backbone and a linear head. The output is not normalized."""

    def __init__(self, backbone, embedding_dim=128):
        super().__init__()
        self.backbone = backbone
        self.head = nn.Linear(self.backbone.width, embedding_dim)

    def forward(self, features, stem_neighbors, levels):
        return self.head(self.backbone(features, stem_neighbors, levels))


# --- Inputs and a training step for a benchmark -----------------------------------------------------------------------


@dataclass
class Tokens:
    """The voxels of one shape in Morton order."""

    features: torch.Tensor
    cells: np.ndarray
    axes: np.ndarray
    labels: torch.Tensor


def random_tokens(n_tokens, seed=0):
    """Returns `n_tokens` voxels on the surface of a box, keyed by cell and dominant normal axis.

    The labels are the six sides of the box.
    """
    rng = np.random.default_rng(seed)
    extent = np.array([1.0, 0.7, 0.4])
    areas = np.repeat([extent[1] * extent[2], extent[0] * extent[2], extent[0] * extent[1]], 2)
    side = rng.choice(6, 40 * n_tokens, p=areas / areas.sum())
    points = rng.random((len(side), 3)) * extent
    rows = np.arange(len(side))
    points[rows, side // 2] = np.where(side % 2 == 0, extent[side // 2], 0.0)
    normals = np.zeros_like(points)
    normals[rows, side // 2] = np.where(side % 2 == 0, 1.0, -1.0)
    coarse, fine = 1.0, 1e-4
    for _ in range(40):
        edge = math.sqrt(coarse * fine)
        cells = np.floor(points / edge).astype(np.int64)
        n_found = len(np.unique(voxel_keys(cells, side)))
        coarse, fine = (edge, fine) if n_found < n_tokens else (coarse, edge)
    cells = np.floor(points / fine).astype(np.int64)
    _, first, voxel = np.unique(voxel_keys(cells, side), return_index=True, return_inverse=True)
    first, voxel = first[:n_tokens], voxel.reshape(-1)
    kept = voxel < n_tokens
    count = np.bincount(voxel[kept], minlength=n_tokens)[:, None]
    mean = np.stack([np.bincount(voxel[kept], points[kept, axis], n_tokens) for axis in range(3)], 1) / count
    centered = mean - extent / 2
    features = np.concatenate([centered / np.linalg.norm(centered, axis=1).max(), normals[first]], 1)
    return Tokens(
        torch.from_numpy(features.astype(np.float32)), cells[first], side[first], torch.from_numpy(side[first].copy())
    )


def tokens_of_file(path):
    """Returns the tokens that `partprobe bench step --tokens-out` wrote."""
    tensors = load_file(path)
    cells = tensors["cells"].numpy().astype(np.int64)
    axes = tensors["axes"].reshape(-1).numpy().astype(np.int64)
    return Tokens(tensors["features"], cells, axes, tensors["labels"].reshape(-1).long())


def voxel_keys(cells, axes):
    """Returns a key for each point that is the same for points with the same cell and dominant axis."""
    return interleave(*cells.T, max(1, int(cells.max()).bit_length())) * 6 + axes


def batch_of(tokens, patch, stages):
    """Returns the arguments of `Network.forward` for one shape, with the fixed turns."""
    turns = fixed_turns(len(stages.encoder_widths))
    stem = torch.from_numpy(neighbor_table(tokens.cells, tokens.axes, 2))
    return tokens.features, stem, levels_of(tokens.cells, tokens.axes, patch, turns)


def cosdisc(rows, labels, pull_weight=2.0, pull_margin=0.0, push_margin=0.3, temperature=0.1):
    """Returns the loss: pull, push and prototype cross-entropy, averaged over parts.

    The default weights and margins are those of partprobe's configs/base.toml.
    """
    unit = F.normalize(rows, dim=1)
    _, part, count = torch.unique(labels, return_inverse=True, return_counts=True)
    n_parts = len(count)
    sums = unit.new_zeros(n_parts, unit.shape[1]).index_add(0, part, unit)
    centers = F.normalize(sums, dim=1)
    share = (1.0 / (n_parts * count.to(unit.dtype)))[part]
    cosines = unit @ centers.t()
    own = cosines.gather(1, part[:, None]).squeeze(1)
    pull = (share * F.relu(1 - pull_margin - own)).sum()
    between = (centers @ centers.t()).triu(1)
    push = 2 * (F.relu(between - push_margin).triu(1)).sum() / (n_parts * (n_parts - 1))
    ce = (share * F.cross_entropy(cosines / temperature, part, reduction="none")).sum()
    return pull_weight * pull + push + ce


def training_step(network, optimizer, batch, labels):
    """Runs the forward pass, the loss, the backward pass and an AdamW update on one shape. Returns the loss."""
    optimizer.zero_grad(set_to_none=True)
    loss = cosdisc(network(*batch), labels)
    loss.backward()
    optimizer.step()
    return loss.item()
