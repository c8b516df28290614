# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension inside of Blender's module `bpy`."""

import json
import math
import subprocess

import aonet
import bpy
import numpy as np
import pytest
import scenes

import aonet_blender
from aonet_blender import camera, nodes, occlusion, passes


@pytest.fixture(scope="module", autouse=True)
def extension():
    aonet_blender.register()
    yield
    aonet_blender.unregister()


def frame_of(scene, margin=(0, 0), folder=None, separation=None):
    """What the passes of a scene hold, as aonet reads it."""
    with passes.scratch_scene(scene, margin, 1.0) as scratch:
        path = passes.write(scratch, folder / "first.exr")
        frame = aonet.load_exr(path)
        if separation is None:
            return frame
        with passes.behind(scratch, frame.depth, separation):
            return aonet.load_exr(path, second=passes.write(scratch, folder / "second.exr"))


def rays(frame):
    """View-space directions through the middles of pixels, with z = -1, by the frame's projection."""
    height, width = frame.depth.shape
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = 1 - (np.arange(height) + 0.5) / height * 2
    p = frame.projection
    return (x + p[0, 2]) / p[0, 0], (y + p[1, 2]) / p[1, 1]


def test_depth_and_normals_are_those_of_the_scene(tmp_path):
    frame = frame_of(scenes.plate_before_wall(), folder=tmp_path)
    x, y = (4 * a for a in rays(frame))
    on_plate = (np.abs(x)[None, :] < 0.49) & (np.abs(y)[:, None] < 0.49)
    beside = (np.abs(x)[None, :] > 0.51) | (np.abs(y)[:, None] > 0.51)
    assert on_plate.sum() > 500
    np.testing.assert_allclose(frame.depth[on_plate], 4, rtol=1e-5)
    np.testing.assert_allclose(frame.depth[beside], 5, rtol=1e-5)
    np.testing.assert_allclose(frame.normal, np.broadcast_to([0, 0, 1], frame.normal.shape), atol=1e-3)


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("size", [(120, 60), (60, 120)])
def test_overscan_shows_the_same_picture_in_its_middle(tmp_path, fit, kind, size):
    scene = scenes.plate_before_wall()
    scene.render.resolution_x, scene.render.resolution_y = size
    lens = scene.camera.data
    lens.type, lens.sensor_fit, lens.ortho_scale = kind, fit, 3.0
    lens.shift_x, lens.shift_y = 0.1, -0.05
    scene.camera.location, scene.camera.rotation_euler = (0.2, 0.1, 0.3), (0.1, -0.05, 0.2)
    bpy.context.view_layer.update()
    plain = frame_of(scene, folder=tmp_path)
    wide = frame_of(scene, (12, 10), folder=tmp_path)
    middle = wide.depth[10:-10, 12:-12]
    assert middle.shape == plain.depth.shape == size[::-1]
    same = np.isclose(middle, plain.depth, rtol=1e-4)
    assert same.mean() > 0.99, same.mean()


def test_the_second_layer_is_what_the_plate_hides(tmp_path):
    frame = frame_of(scenes.plate_before_wall(), folder=tmp_path, separation=0.1)
    plate = frame.depth < 4.5
    np.testing.assert_allclose(frame.second[plate], 5, rtol=1e-4)
    assert np.isinf(frame.second[~plate]).all()
    # The wall is 1 behind the plate.
    nothing = frame_of(scenes.plate_before_wall(), folder=tmp_path, separation=1.1)
    assert np.isinf(nothing.second).all()


def test_visibility_is_that_of_the_program_on_its_file(tmp_path, program):
    scene = scenes.shelf()
    scene.render.resolution_percentage = 25
    found = occlusion.visibility(scene, occlusion.Options(radius=0.8, margin=0))
    assert found.shape == (90, 160) and found.min() < 0.5 < found.max()
    with passes.scratch_scene(scene, (0, 0), 0.8) as scratch:
        file = passes.write(scratch, tmp_path / "frame.exr")
    # The camera is in the file: no option names it. The program has lower precisions where the machine has them.
    command = [program, "infer", file, "-o", tmp_path / "ao.exr", "--precision", "f32"]
    subprocess.run(command, check=True, capture_output=True)
    np.testing.assert_allclose(aonet.load_ao(tmp_path / "ao.exr"), found, atol=1e-6)


def test_files_of_a_render_of_ones_own_hold_the_camera(tmp_path, program):
    scene = scenes.shelf()
    scene.render.resolution_percentage = 25
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.view_layers[0].use_pass_z = scene.view_layers[0].use_pass_normal = True
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.filepath = str(tmp_path / "render.exr")
    bpy.ops.render.render(write_still=True)
    command = [program, "infer", tmp_path / "render.exr", "-o", tmp_path / "ao.png"]
    assert b"a view" in subprocess.run(command, capture_output=True).stderr
    scene.aonet.note, scene.aonet.radius = True, 0.8
    bpy.ops.render.render(write_still=True)
    subprocess.run(command, check=True, capture_output=True)
    assert abs(aonet.load_exr(tmp_path / "render.exr").radius - 0.8) < 1e-6


def test_classic_methods_are_those_of_the_library():
    scene = scenes.shelf()
    scene.render.resolution_percentage = 25
    network, search, deep = (
        occlusion.visibility(scene, occlusion.Options(0.8, method, 0.0, second))
        for method, second in (("fast", False), ("agtao:tuned", False), ("arcs:deep", True))
    )
    for found in (search, deep):
        assert 0.001 < np.abs(found - network).mean() < 0.1, np.abs(found - network).mean()


def test_guard_band_and_layer_change_the_result_little_and_darken():
    scene = scenes.shelf()
    scene.render.resolution_percentage = 25
    plain, deep = (
        occlusion.visibility(scene, occlusion.Options(0.8, "balanced", margin, second))
        for margin, second in ((0.0, False), (0.15, True))
    )
    difference = deep - plain
    assert 0.001 < np.abs(difference).mean() < 0.06, np.abs(difference).mean()
    assert difference.mean() < 0


def test_nothing_of_the_scene_changes():
    scene = scenes.shelf()
    scene.render.resolution_percentage = 10
    scene.render.filepath = "//keep"
    kinds = ("scenes", "objects", "cameras", "materials", "images")
    # Every render leaves an image of the type RENDER_RESULT.
    counts = lambda: {k: sum(getattr(x, "type", "") != "RENDER_RESULT" for x in getattr(bpy.data, k)) for k in kinds}
    before = counts()
    occlusion.visibility(scene, occlusion.Options(second_layer=True))
    assert counts() == before
    assert (scene.render.filepath, scene.render.resolution_x, bpy.context.scene) == ("//keep", 640, scene)
    scene.camera.data.type = "PANO"
    with pytest.raises(ValueError, match="perspective or orthographic"):
        occlusion.visibility(scene)
    assert counts() == before


def test_operator_leaves_image_and_group():
    scene = scenes.shelf()
    scene.render.resolution_percentage = 10
    scene.aonet.radius = 0.8
    assert bpy.ops.aonet.render() == {"FINISHED"}
    image = bpy.data.images[occlusion.IMAGE]
    assert tuple(image.size) == (64, 36)
    expected = occlusion.visibility(scene, scene.aonet.options())
    pixels = np.array(image.pixels).reshape(36, 64, 4)
    np.testing.assert_allclose(pixels[::-1, :, 0], expected, atol=1e-6)
    # Another size: the same image, the same group.
    scene.render.resolution_percentage = 15
    assert bpy.ops.aonet.render() == {"FINISHED"}
    assert tuple(image.size) == (96, 54) and len([g for g in bpy.data.node_groups if g.name.startswith(nodes.GROUP)]) == 1
    scene.camera = None
    with pytest.raises(RuntimeError, match="expected a camera, found none"):
        bpy.ops.aonet.render()


def test_animation_writes_a_file_for_each_frame(tmp_path):
    scene = scenes.shelf()
    scene.render.resolution_percentage = 10
    scene.frame_start, scene.frame_end = 3, 4
    ball = bpy.data.objects["Torus"]
    for frame, x in ((3, 1.2), (4, -1.0)):
        ball.location.x = x
        ball.keyframe_insert("location", frame=frame)
    scene.aonet.folder = str(tmp_path / "new" / "folder")
    scene.frame_set(1)
    assert bpy.ops.aonet.render_animation() == {"FINISHED"}
    files = sorted((tmp_path / "new" / "folder").iterdir())
    assert [file.name for file in files] == ["0003.png", "0004.png"] and scene.frame_current == 1
    first, second = (aonet.load_ao(file) for file in files)
    assert np.abs(first - second).max() > 0.1


def test_the_group_multiplies(tmp_path):
    scene = scenes.empty(8, 4)
    values = np.linspace(0, 1, 32, dtype=np.float32).reshape(4, 8)
    group = nodes.group(occlusion.to_image(values))
    if hasattr(scene, "compositing_node_group"):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        end = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        end = tree.nodes.new("CompositorNodeComposite")
    colour, used = tree.nodes.new("CompositorNodeRGB"), tree.nodes.new("CompositorNodeGroup")
    colour.outputs[0].default_value = (0.5, 1.0, 0.25, 1.0)
    used.node_tree = group
    tree.links.new(colour.outputs[0], used.inputs["Image"])
    tree.links.new(used.outputs["Image"], end.inputs["Image"])
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(tmp_path / "out.exr")
    bpy.ops.render.render(write_still=True)
    out = bpy.data.images.load(str(tmp_path / "out.exr"))
    pixels = np.array(out.pixels).reshape(4, 8, 4)[::-1]
    np.testing.assert_allclose(pixels[..., :3], values[..., None] * [0.5, 1.0, 0.25], atol=1e-3)


def test_notes_are_short_and_exact():
    scene = scenes.shelf()
    text = camera.description(scene, scene.camera, 0.123456789)
    # Blender's limit.
    assert len(text) < 768
    fields = json.loads(text.removeprefix(camera.PREFIX))
    assert fields["radius"] == 0.123456789
    assert math.isclose(fields["focal_px"][0], 640 * 50 / 36, rel_tol=1e-6)
    assert fields["centre_px"] == [320, 180]
