# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera as aonet's: what a render shows, in a text that fits into its note."""

from __future__ import annotations

import json
import math

import bpy
from mathutils import Matrix

#: Begins the note of a render that contains its camera.
PREFIX = "aonet:camera "

#: From glTF's world (+Y up), which aonet uses, to Blender's (+Z up).
_BLENDER_FROM_GLTF = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


def picture_size(scene: bpy.types.Scene) -> tuple[int, int]:
    """Width and height of the scene's renders (px)."""
    share = scene.render.resolution_percentage / 100
    return max(1, int(scene.render.resolution_x * share)), max(1, int(scene.render.resolution_y * share))


def _projection(scene: bpy.types.Scene, camera: bpy.types.Object, size: tuple[int, int]) -> Matrix:
    render = scene.render
    aspect = {"scale_x": render.pixel_aspect_x, "scale_y": render.pixel_aspect_y}
    graph = bpy.context.evaluated_depsgraph_get()
    return camera.calc_matrix_camera(graph, x=size[0], y=size[1], **aspect)


def description(scene: bpy.types.Scene, camera: bpy.types.Object, radius: float | None) -> str:
    """The camera of a render of ``scene`` as the text that ``aonet`` reads from the note of Blender's EXR files.

    ``radius`` is the AO radius in Blender units; None leaves it out.

    Raises:
        ValueError: the camera is neither perspective nor orthographic.
    """
    kind = camera.data.type
    if kind not in ("PERSP", "ORTHO"):
        raise ValueError(f"camera {camera.name}: expected a perspective or orthographic one, found {kind.lower()}")
    width, height = size = picture_size(scene)
    clip = _projection(scene, camera, size)
    perspective = kind == "PERSP"
    axis = (-clip[0][2], -clip[1][2]) if perspective else (clip[0][3], clip[1][3])
    view = camera.matrix_world.normalized().inverted() @ _BLENDER_FROM_GLTF
    fields = {
        "view_from_world": [_short(view[row][column]) for column in range(4) for row in range(3)],
        "fov_y": _short(2 * math.atan(1 / clip[1][1])) if perspective else None,
        "ortho_height": None if perspective else _short(2 / clip[1][1]),
        "near": _short(camera.data.clip_start),
        "focal_px": [_short(clip[0][0] * width / 2), _short(clip[1][1] * height / 2)],
        "centre_px": [_short((1 + axis[0]) * width / 2), _short((1 - axis[1]) * height / 2)],
        "radius": radius,
    }
    return PREFIX + json.dumps(fields, separators=(",", ":"))


def _short(value: float) -> float:
    """The value with as many digits as a 32-bit float has: notes are short."""
    return float(f"{value:.9g}")


def widen(camera: bpy.types.Camera, old: tuple[int, int], new: tuple[int, int], aspect: tuple[float, float]) -> None:
    """Makes a camera of pictures of size ``old`` see those of size ``new`` around the same centre, at the same scale.

    ``aspect`` are the render's pixel_aspect_x and pixel_aspect_y.
    """
    fit = camera.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if old[0] * aspect[0] >= old[1] * aspect[1] else "VERTICAL"
        # Automatic cameras use the sensor's width whichever side is longer.
        camera.sensor_height = camera.sensor_width
        camera.sensor_fit = fit
    side = 0 if fit == "HORIZONTAL" else 1
    scale = new[side] / old[side]
    if side == 0:
        camera.sensor_width *= scale
    else:
        camera.sensor_height *= scale
    camera.ortho_scale *= scale
    camera.shift_x /= scale
    camera.shift_y /= scale
