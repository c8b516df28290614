"""Arrays in and out: shapes, strides, types, margin, second layer."""

import tracemalloc

import aonet
import numpy as np
import pytest
from conftest import cast

BAND = (14, 10)


def test_the_result_is_visibility(frame):
    found = aonet.infer(frame.normal, frame.depth, **frame.camera)
    assert found.shape == frame.shape and found.dtype == np.float32 and found.flags.c_contiguous
    assert found.min() >= 0 and found.max() <= 1
    assert found.min() < 0.7 < 0.9 < found.max()


def test_the_background_is_open(frame):
    depth = frame.depth.copy()
    depth[:20, :30] = np.inf
    normal = frame.normal.copy()
    normal[:20, :30] = np.nan
    found = aonet.infer(normal, depth, **frame.camera)
    assert np.all(found[:20, :30] == 1) and not np.all(found == 1)


def strided(array):
    """The same pixels in other places of memory."""
    apart = np.zeros((2 * array.shape[0], 3 * array.shape[1], *array.shape[2:]), array.dtype)
    apart[::2, ::3] = array
    transposed = np.asfortranarray(array)
    backwards = np.ascontiguousarray(array[::-1, ::-1])[::-1, ::-1]
    wider = np.pad(array, [(3, 2), (5, 1)] + [(0, 0)] * (array.ndim - 2))[3:-2, 5:-1]
    unaligned = np.frombuffer(b"\0" + array.tobytes(), np.uint8)[1:].view(array.dtype).reshape(array.shape)
    swapped = array.astype(array.dtype.newbyteorder(">"))
    return {"apart": apart[::2, ::3], "Fortran": transposed, "backwards": backwards, "slice": wider,
            "unaligned": unaligned, "big-endian": swapped}


@pytest.mark.parametrize("name", strided(np.zeros((2, 2), np.float32)))
def test_strides_do_not_matter(frame, name):
    expected = aonet.infer(frame.normal, frame.depth, **frame.camera)
    normal, depth = strided(frame.normal)[name], strided(frame.depth)[name]
    assert name == "big-endian" or not (depth.flags.c_contiguous and depth.flags.aligned)
    assert np.array_equal(aonet.infer(normal, depth, **frame.camera), expected)
    second = strided(frame.depth + np.float32(1))[name]
    plain = aonet.infer(frame.normal, frame.depth, second=frame.depth + np.float32(1), model="high", **frame.camera)
    assert np.array_equal(aonet.infer(normal, depth, second=second, model="high", **frame.camera), plain)


def test_channels_of_one_image(frame):
    image = np.dstack([frame.normal, frame.depth])
    found = aonet.infer(image[..., :3], image[..., 3], **frame.camera)
    assert np.array_equal(found, aonet.infer(frame.normal, frame.depth, **frame.camera))


def test_floats_are_converted(frame):
    expected = aonet.infer(frame.normal, frame.depth, **frame.camera)
    wide = frame.normal.astype(np.float64), frame.depth.astype(np.float64)
    assert np.array_equal(aonet.infer(*wide, **frame.camera), expected)
    assert np.array_equal(aonet.infer(frame.normal.tolist(), frame.depth.tolist(), **frame.camera), expected)
    halves = frame.normal.astype(np.float16), frame.depth.astype(np.float16)
    found = aonet.infer(*halves, **frame.camera)
    assert not np.array_equal(found, expected) and np.abs(found - expected).mean() < 0.02


def test_inputs_are_not_changed(frame):
    normal, depth = frame.normal * np.float32(1.01), frame.depth.copy()
    before = normal.copy(), depth.copy()
    for array in (normal, depth):
        array.flags.writeable = False
    aonet.infer(normal, depth, second=depth, model="high", **frame.camera)
    assert np.array_equal(normal, before[0]) and np.array_equal(depth, before[1])


def test_out_is_written_and_returned(frame):
    expected = aonet.infer(frame.normal, frame.depth, **frame.camera)
    outs = strided(np.zeros(frame.shape, np.float32))
    outs = [np.zeros(frame.shape, np.float32), outs["apart"], outs["Fortran"], outs["backwards"], outs["slice"]]
    for out in outs:
        assert aonet.infer(frame.normal, frame.depth, out=out, **frame.camera) is out
        assert np.array_equal(out, expected)


def test_out_may_be_an_input(frame):
    expected = aonet.infer(frame.normal, frame.depth, **frame.camera)
    depth = frame.depth.copy()
    aonet.infer(frame.normal, depth, out=depth, **frame.camera)
    assert np.array_equal(depth, expected)
    normal = frame.normal.copy()
    aonet.infer(normal, frame.depth, out=normal[..., 1], **frame.camera)
    assert np.array_equal(normal[..., 1], expected)


def test_a_session_allocates_no_image(frame):
    session = aonet.Session(96, 64, threads=1)
    out = np.zeros(frame.shape, np.float32)

    def peak(**options):
        tracemalloc.start()
        session.run(frame.normal, frame.depth, **frame.camera, **options)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    session.run(frame.normal, frame.depth, **frame.camera)
    assert peak(out=out) < frame.depth.nbytes // 2
    # numpy reports its memory to tracemalloc: a result of its own is seen.
    assert peak() >= frame.depth.nbytes


def test_the_margin_is_read_but_not_returned():
    wide, narrow = cast(margin=BAND), cast()
    assert wide.shape == (64 + 20, 96 + 28)
    assert np.allclose(wide.depth[10:-10, 14:-14], narrow.depth)
    found = aonet.infer(wide.normal, wide.depth, margin=BAND, **wide.camera)
    without = aonet.infer(narrow.normal, narrow.depth, **narrow.camera)
    assert found.shape == narrow.shape
    # The same picture but for what the margin shows.
    assert 0.9 < aonet.compare(without, found).full.ssim < 0.999
    # One number is for both directions.
    even = cast(margin=(8, 8))
    both = aonet.infer(even.normal, even.depth, margin=(8, 8), **even.camera)
    assert np.array_equal(aonet.infer(even.normal, even.depth, margin=8, **even.camera), both)


def test_the_field_of_view_is_that_of_the_picture():
    wide = cast(margin=BAND)
    camera = {**wide.camera, "fov_y": 2 * np.degrees(np.arctan(np.tan(np.radians(25)) * 84 / 64))}
    whole = aonet.infer(wide.normal, wide.depth, **camera)
    assert whole.shape == wide.shape
    cropped = aonet.infer(wide.normal, wide.depth, margin=BAND, **wide.camera)
    assert np.abs(whole[10:-10, 14:-14] - cropped).max() < 1e-4


@pytest.mark.parametrize("run", [
    lambda *layers, **options: aonet.infer(*layers, model="balanced", **options),
    lambda *layers, **options: aonet.infer(*layers, model="high", **options),
    lambda *layers, **options: aonet.classic("arcs:deep", *layers, **options),
    lambda *layers, **options: aonet.classic("vbao", *layers, **options),
])
def test_the_second_layer_is_read(frame, run):
    behind = cast(spheres=[])
    second = np.maximum(behind.depth, frame.depth)
    without = run(frame.normal, frame.depth, **frame.camera)
    found = run(frame.normal, frame.depth, second=second, **frame.camera)
    assert np.abs(found - without).max() > 0.02
    nothing = run(frame.normal, frame.depth, second=np.full_like(frame.depth, np.inf), **frame.camera)
    assert not np.array_equal(found, nothing)


def test_fast_ignores_the_second_layer(frame):
    expected = aonet.infer(frame.normal, frame.depth, model="fast", **frame.camera)
    found = aonet.infer(frame.normal, frame.depth, second=frame.depth, model="fast", **frame.camera)
    assert np.array_equal(found, expected)
