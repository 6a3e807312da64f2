"""Labels the parts of STEP files, as NumPy arrays.

`label` turns a file into a `Carrier`: a mesh with the face and the part of each triangle. `Carrier.sample` draws points,
`Dataset` reads a folder that the program `partprobe label` wrote, `Model` embeds points, and `score` scores predictions. The
wheel also contains the program `partprobe`.

>>> import partprobe
>>> step = partprobe.synth(seed=7)          # or the path of a STEP file
>>> carrier = partprobe.label(step, id="bracket")
>>> sample = carrier.sample(2000, seed=0)
>>> sample.points.shape, sample.labels("step-parts").shape
((2000, 3), (2000,))
"""

from partprobe._errors import DamagedFileError, PartprobeError, StepError, UsageError
from partprobe._partprobe import (
    Carrier,
    Dataset,
    Model,
    Sample,
    __version__,
    label,
    label_all,
    label_options,
    metrics,
    score,
    sources,
    synth,
)

FACE_TYPES = (
    "plane",
    "cylinder",
    "cone",
    "sphere",
    "torus",
    "bezier",
    "bspline",
    "revolution",
    "extrusion",
    "offset",
    "other",
)
"""The names of the primitive types, in the order of the codes in `Carrier.face_type`."""

__all__ = [
    "FACE_TYPES",
    "Carrier",
    "DamagedFileError",
    "Dataset",
    "Model",
    "PartprobeError",
    "Sample",
    "StepError",
    "UsageError",
    "__version__",
    "label",
    "label_all",
    "label_options",
    "metrics",
    "score",
    "sources",
    "synth",
]
