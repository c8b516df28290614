"""Cameras and the space of normals."""

import aonet
import numpy as np
from conftest import cast, perspective

# Another machine's matrix may differ in its last bits; images differ by this at most. Measured: 3e-5.
CLOSE = 5e-4


def turn(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    m = np.eye(3)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    m[i, i], m[i, j], m[j, i], m[j, j] = c, -s, s, c
    return m


def infer(frame, normal=None, **options):
    return aonet.infer(frame.normal if normal is None else normal, frame.depth, **options)


def test_a_projection_matrix_is_a_field_of_view(frame):
    expected = infer(frame, **frame.camera)
    opengl = perspective(50.0, 96, 64)
    found = infer(frame, projection=opengl, radius=frame.camera["radius"])
    assert np.abs(found - expected).max() < CLOSE
    # Depth in [0, 1], reversed, without a far plane; and Vulkan's, whose y points down.
    reverse = opengl.copy()
    reverse[2] = [0, 0, 0, 0.1]
    down = reverse * [[1], [-1], [1], [1]]
    for matrix in (reverse, down, opengl.astype(np.float32), np.asfortranarray(opengl)):
        assert np.abs(infer(frame, projection=matrix, radius=0.6) - found).max() < CLOSE
    assert np.abs(infer(frame, projection=perspective(80.0, 96, 64), radius=0.6) - found).max() > 10 * CLOSE


def test_a_tile_has_an_off_centre_projection():
    """The left part of a picture, with the rest of it in the margin, in a frame that is not symmetric."""
    whole = cast(96, 64)
    tile = perspective(50.0, 96, 64)
    # Columns 0 to 64 of 96: the scale grows by 96 / 64, and the axis is at column 48 of 64.
    tile[0, 0] *= 96 / 64
    tile[0, 2] = 1 - 48 / 32
    found = aonet.infer(whole.normal[:, :64], whole.depth[:, :64], projection=tile, radius=0.6)
    expected = aonet.infer(whole.normal, whole.depth, **whole.camera)[:, :64]
    centred = aonet.infer(whole.normal[:, :64], whole.depth[:, :64], **whole.camera)
    right, wrong = np.abs(found - expected)[:, :40].mean(), np.abs(centred - expected)[:, :40].mean()
    assert right < 0.5 * wrong and right < 0.01, (right, wrong)


def test_an_orthographic_projection_is_read():
    depth = np.full((64, 96), 3.0, np.float32)
    depth[20:44, 30:60] = 2.5
    normal = np.zeros((64, 96, 3), np.float32)
    normal[..., 2] = 1
    matrix = np.diag([2 / 6, 2 / 4, -0.1, 1.0])
    found = aonet.classic("agtao:tuned", normal, depth, projection=matrix, radius=0.5)
    # The step's foot is dark, on all sides alike; the plane far from it is open.
    assert found[32, 28] < 0.9 and found[32, 5] > 0.98
    assert abs(found[32, 28] - found[32, 61]) < 0.05


def test_world_normals_need_the_view(frame):
    rotation = turn(1, 40) @ turn(0, -25) @ turn(2, 10)
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation, [4, -2, 7]
    world = frame.normal @ rotation
    expected = infer(frame, **frame.camera)
    for matrix in (view, rotation, rotation.astype(np.float32)):
        found = infer(frame, world, normals="world", view=matrix, **frame.camera)
        assert np.abs(found - expected).max() < CLOSE
    wrong = infer(frame, world, normals="world", view=rotation @ turn(1, 20), **frame.camera)
    assert np.abs(wrong - expected).max() > 10 * CLOSE


def test_a_session_takes_both_spaces_in_turn(frame):
    session = aonet.Session(96, 64)
    rotation = turn(1, 40)
    first = session.run(frame.normal, frame.depth, **frame.camera)
    world = session.run(frame.normal @ rotation, frame.depth, normals="world", view=rotation, **frame.camera)
    assert np.abs(world - first).max() < CLOSE
    assert np.array_equal(session.run(frame.normal, frame.depth, **frame.camera), first)
