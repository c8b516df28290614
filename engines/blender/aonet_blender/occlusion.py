# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion of a scene as the camera sees it."""

from __future__ import annotations

import functools
import tempfile
from dataclasses import dataclass
from pathlib import Path

import aonet
import bpy
import numpy as np

from . import camera, passes

#: Name of the image that results are written to.
IMAGE = "Ambient Occlusion"

#: How far behind the first layer a second one begins, as a share of the AO radius.
SEPARATION = 0.1


@dataclass(frozen=True)
class Options:
    """How to compute ambient occlusion."""

    #: Length of the occlusion rays (Blender units).
    radius: float = 1.0
    #: A network (fast, balanced, high, paper, or a file), or a classic method such as agtao:tuned.
    method: str = "balanced"
    #: Guard band on each side, as a share of the picture's width and height.
    margin: float = 0.1
    #: Whether to render what lies behind the visible surfaces.
    second_layer: bool = False


def visibility(scene: bpy.types.Scene, options: Options = Options()) -> np.ndarray:
    """(height, width) float32: 1 open, 0 closed, top row first, of the scene's current frame.

    Raises:
        ValueError: the scene has no camera that aonet knows, or an option is out of range.
        RuntimeError: Blender cannot render.
    """
    if not 0 <= options.margin <= 1:
        raise ValueError(f"margin: expected a share in [0, 1], found {options.margin}")
    width, height = camera.picture_size(scene)
    margin = (round(width * options.margin), round(height * options.margin))
    with tempfile.TemporaryDirectory() as folder:
        frame = _frame(scene, options, margin, Path(folder))
    # The file's picture is guard band and all.
    crop = np.diag([(width + 2 * margin[0]) / width, (height + 2 * margin[1]) / height, 1.0, 1.0])
    if options.method.split(":")[0] in aonet.methods():
        run = functools.partial(aonet.classic, options.method)
    else:
        run = functools.partial(aonet.infer, model=options.method)
    return run(
        frame.normal,
        frame.depth,
        radius=options.radius,
        projection=crop @ frame.projection,
        margin=margin,
        second=frame.second,
    )


def _frame(scene: bpy.types.Scene, options: Options, margin: tuple[int, int], folder: Path) -> aonet.Frame:
    with passes.scratch_scene(scene, margin, options.radius) as scratch:
        first = passes.write(scratch, folder / "first.exr")
        frame = aonet.load_exr(first)
        if not options.second_layer:
            return frame
        with passes.behind(scratch, frame.depth, SEPARATION * options.radius):
            second = passes.write(scratch, folder / "second.exr")
        return aonet.load_exr(first, second=second)


def to_image(values: np.ndarray, name: str = IMAGE) -> bpy.types.Image:
    """The image datablock ``name`` with ``values`` ((height, width), top row first) as grey; made or resized as needed."""
    height, width = values.shape
    image = bpy.data.images.get(name)
    if image is None:
        image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=True)
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = values[::-1, :, None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image
