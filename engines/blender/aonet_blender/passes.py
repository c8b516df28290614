# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth and normals of a scene, with a guard band and a second layer, by Cycles with one sample a pixel."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from . import camera as cameras

#: Least width of Cycles' pixel filter (px): the sample lies in the middle of its pixel.
_FILTER_WIDTH = 0.01
#: What Cycles writes where nothing is.
_FAR = 1e10
#: Surfaces that a ray may pass on its way to the second layer.
_MOST_SURFACES = 128


@contextlib.contextmanager
def scratch_scene(scene: bpy.types.Scene, margin: tuple[int, int], radius: float) -> Iterator[bpy.types.Scene]:
    """A copy of ``scene`` that renders only depth and normals, ``margin`` (columns, rows) wider on each side.

    Objects are shared, the camera is a copy. Everything is removed at the end.

    Raises:
        ValueError: the scene has no camera, or one that aonet does not know.
    """
    if scene.camera is None:
        raise ValueError(f"scene {scene.name}: expected a camera, found none")
    size = cameras.picture_size(scene)
    copy = scene.copy()
    lens = scene.camera.data.copy()
    # Without parent, constraints and animation.
    camera = bpy.data.objects.new("aonet", lens)
    camera.matrix_world = scene.camera.matrix_world
    try:
        copy.collection.objects.link(camera)
        copy.camera = camera
        lens.dof.use_dof = False
        _set_render(copy, (size[0] + 2 * margin[0], size[1] + 2 * margin[1]))
        aspect = (copy.render.pixel_aspect_x, copy.render.pixel_aspect_y)
        cameras.widen(lens, size, cameras.picture_size(copy), aspect)
        copy.render.use_stamp_note = True
        copy.render.stamp_note_text = cameras.description(copy, camera, radius)
        yield copy
    finally:
        bpy.data.scenes.remove(copy)
        bpy.data.cameras.remove(lens)


def _set_render(scene: bpy.types.Scene, size: tuple[int, int]) -> None:
    """Everything that a pass of depth and normals needs, and nothing else."""
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    for option in ("use_border", "use_motion_blur", "use_compositing", "use_sequencer", "use_file_extension"):
        setattr(render, option, False)
    render.metadata_input = "SCENE"
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces = 1, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.filter_width = _FILTER_WIDTH
    cycles.transparent_max_bounces = _MOST_SURFACES
    image = render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"
    chosen = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    for layer in scene.view_layers:
        layer.use = layer == chosen
    chosen.use = chosen.use_pass_z = chosen.use_pass_normal = True


def write(scene: bpy.types.Scene, path: Path) -> Path:
    """Renders a scratch scene into a multi-layer EXR file.

    Raises:
        RuntimeError: Blender cannot render or write it.
    """
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    if not path.exists():
        raise RuntimeError(f"{path}: expected a render, found no file")
    return path


@contextlib.contextmanager
def behind(scene: bpy.types.Scene, depth: np.ndarray, separation: float) -> Iterator[None]:
    """While it lasts, ``scene`` shows what lies at least ``separation`` behind ``depth`` ((H, W), Blender units, top row first).

    A material of all surfaces is transparent in front of that, and Cycles' depth and normals are those of the first surface that is not.
    """
    height, width = depth.shape
    image = bpy.data.images.new("aonet depth", width, height, float_buffer=True, is_data=True)
    material = bpy.data.materials.new("aonet second layer")
    layer = next(layer for layer in scene.view_layers if layer.use)
    before = layer.material_override
    try:
        pixels = np.ones((height, width, 4), np.float32)
        pixels[..., :3] = np.minimum(depth, _FAR)[::-1, :, None]
        image.pixels.foreach_set(pixels.ravel())
        image.update()
        _show_behind(material, image, separation)
        layer.material_override = material
        yield
    finally:
        layer.material_override = before
        bpy.data.materials.remove(material)
        bpy.data.images.remove(image)


def _show_behind(material: bpy.types.Material, image: bpy.types.Image, separation: float) -> None:
    """Nodes: transparent where the distance along the axis is below the image's plus ``separation``."""
    if not material.node_tree:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    first = tree.nodes.new("ShaderNodeTexImage")
    first.image, first.interpolation, first.extension = image, "Closest", "EXTEND"
    nearest, is_nearer = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeMath")
    nearest.operation, is_nearer.operation = "ADD", "LESS_THAN"
    nearest.inputs[1].default_value = separation
    mix = tree.nodes.new("ShaderNodeMixShader")
    for source, target in (
        (tree.nodes.new("ShaderNodeTexCoord").outputs["Window"], first.inputs["Vector"]),
        (first.outputs["Color"], nearest.inputs[0]),
        (tree.nodes.new("ShaderNodeCameraData").outputs["View Z Depth"], is_nearer.inputs[0]),
        (nearest.outputs[0], is_nearer.inputs[1]),
        (is_nearer.outputs[0], mix.inputs[0]),
        (tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], mix.inputs[1]),
        (tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2]),
        (mix.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]),
    ):
        tree.links.new(source, target)
