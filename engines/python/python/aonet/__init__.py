"""Ambient occlusion learned from traced rays, in screen space, from a frame's normals and depth.

>>> import aonet
>>> visibility = aonet.infer(normal, depth, radius=0.5, fov_y=60.0)  # doctest: +SKIP

Images are numpy arrays, row 0 at the top. View space is right-handed: +X right, +Y up, +Z towards the viewer.

* ``normal``: (H, W, 3), unit vectors, by default in view space; ignored on the background.
* ``depth``: (H, W), distance along the viewing axis (world units), > 0, infinite on the background.
* the result: (H, W) ``float32`` visibility in [0, 1]: 1 open, 0 closed; 1 on the background.
"""

from ._aonet import __version__
from ._files import Frame, infer_exr, load_ao, load_exr, save_ao
from ._metrics import Comparison, Scores, compare
from ._names import Parameter, methods, models, parameters, precisions
from ._session import ClassicSession, Session, classic, infer

__all__ = [
    "ClassicSession",
    "Comparison",
    "Frame",
    "Parameter",
    "Scores",
    "Session",
    "__version__",
    "classic",
    "compare",
    "infer",
    "infer_exr",
    "load_ao",
    "load_exr",
    "methods",
    "models",
    "parameters",
    "precisions",
    "save_ao",
]
