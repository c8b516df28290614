"""What programs with types write. `mypy --strict` checks it: a comment `type: ignore` that is not needed is an error, too."""

import pathlib

import aonet
import numpy as np
from numpy.typing import NDArray

normal: NDArray[np.float64] = np.zeros((16, 16, 3))
depth: NDArray[np.float32] = np.ones((16, 16), np.float32)

visibility: NDArray[np.float32] = aonet.infer(normal, depth, radius=0.5, fov_y=60.0, margin=(2, 2), precision="bf16")
aonet.classic("agtao", normal, depth, radius=1, projection=np.eye(4), parameters={"slices": 3}, out=visibility)
session: aonet.Session = aonet.Session(16, 16, model=pathlib.Path("mine.safetensors"), threads=2)
session.run(normal.tolist(), depth, radius=0.5, fov_y=60.0, normals="world", view=np.eye(3), second=None)
frame: aonet.Frame = aonet.load_exr("frame.exr", normals="blender", view="view.json")
scores: aonet.Scores | None = aonet.compare(frame.infer(model="high"), visibility, frame.foreground).foreground
least: float = aonet.parameters("gtao")[0].low

aonet.infer(normal, depth, fov_y=60.0)  # type: ignore[call-arg]
aonet.infer(normal, depth, radius="0.5", fov_y=60.0)  # type: ignore[arg-type]
aonet.infer(normal, depth, radius=0.5, fov_y=60.0, precision="f16")  # type: ignore[arg-type]
aonet.infer(normal, depth, radius=0.5, fov_y=60.0, out=normal)  # type: ignore[arg-type]
session.run(normal, depth, 0.5, 60.0)  # type: ignore[call-arg]
aonet.Session(16, 16, margin=0.15)  # type: ignore[arg-type]
frame.radius + 1  # type: ignore[operator]
frame.width = 3  # type: ignore[misc]
