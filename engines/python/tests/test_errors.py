"""Wrong arguments: the exception names the argument, what was expected and what was found."""

import pathlib

import aonet
import numpy as np
import pytest
from conftest import perspective


def changed(array, at, value):
    array = array.copy()
    array[at] = value
    return array


def case(name, error, words, **changes):
    return pytest.param(changes, error, words, id=name)


CASES = [
    case("no radius", TypeError, ["radius", "found None"], radius=None),
    case("radius of zero", ValueError, ["radius", "> 0", "found 0"], radius=0.0),
    case("radius NaN", ValueError, ["radius", "NaN"], radius=np.nan),
    case("radius text", TypeError, ["radius", "length", "str '1'"], radius="1"),
    case("no camera", TypeError, ["fov_y", "projection", "found neither"], fov_y=None),
    case("two cameras", TypeError, ["fov_y", "projection", "both"], projection=np.eye(4)),
    case("half a turn", ValueError, ["fov_y", "(0, 180) degrees", "found 180"], fov_y=180.0),
    case("angle NaN", ValueError, ["fov_y", "found NaN"], fov_y=float("nan")),
    case("angle list", TypeError, ["fov_y", "found list"], fov_y=[60.0]),
    case("3x3 projection", ValueError, ["projection", "4x4", "(3, 3)"], fov_y=None, projection=np.eye(3)),
    case("transposed projection", ValueError, ["projection", "last row"], fov_y=None, projection=perspective(50, 96, 64).T),
    case("left-handed", ValueError, ["projection", "third column"], fov_y=None,
         projection=perspective(50, 96, 64) @ np.diag([1.0, 1, -1, 1])),
    case("infinite projection", ValueError, ["projection", "finite"], fov_y=None, projection=np.full((4, 4), np.inf)),
    case("text projection", TypeError, ["projection", "numbers", "<U1"], fov_y=None, projection=[["a"] * 4] * 4),
    case("depth int", TypeError, ["depth", "floating-point", "int64"], depth=lambda f: f.depth.astype(np.int64)),
    case("depth bool", TypeError, ["depth", "floating-point", "bool"], depth=lambda f: f.depth > 0),
    case("depth complex", TypeError, ["depth", "complex64"], depth=lambda f: f.depth.astype(np.complex64)),
    case("depth None", TypeError, ["depth", "object"], depth=lambda f: None),
    case("normal bytes", TypeError, ["normal", "uint8"], normal=lambda f: (127 * f.normal + 128).astype(np.uint8)),
    case("normal RGBA", ValueError, ["normal", "(height, width, 3)", "(64, 96, 4)"],
         normal=lambda f: np.concatenate([f.normal, f.normal[..., :1]], -1)),
    case("normal planes", ValueError, ["normal", "(3, 64, 96)"], normal=lambda f: np.moveaxis(f.normal, 2, 0)),
    case("normal of another size", ValueError, ["normal", "(64, 96, 3)", "(63, 96, 3)"], normal=lambda f: f.normal[1:]),
    case("depth with an axis", ValueError, ["depth", "(height, width)", "(64, 96, 1)"], depth=lambda f: f.depth[..., None]),
    case("no pixels", ValueError, ["depth", "(0, 96)"], depth=lambda f: f.depth[:0]),
    case("depth NaN", ValueError, ["depth at (7, 5)", "NaN"], depth=lambda f: changed(f.depth, (5, 7), np.nan)),
    case("depth zero", ValueError, ["depth at (0, 0)", "> 0"], depth=lambda f: changed(f.depth, (0, 0), 0)),
    case("depth behind", ValueError, ["depth at (95, 63)", "-1"], depth=lambda f: changed(f.depth, (63, 95), -1)),
    case("normal NaN", ValueError, ["normal at (7, 5)", "unit"], normal=lambda f: changed(f.normal, (5, 7, 1), np.nan)),
    case("normal long", ValueError, ["normal at (7, 5)", "unit"], normal=lambda f: changed(f.normal, (5, 7), [0, 0, 2])),
    case("world normals", ValueError, ["normals", "view space"], normal=lambda f: -f.normal),
    case("second in front", ValueError, ["second depth at (0, 0)", "first"], second=lambda f: 0.5 * f.depth),
    case("second NaN", ValueError, ["second depth at (2, 1)"], second=lambda f: changed(f.depth, (1, 2), np.nan)),
    case("second of another size", ValueError, ["second", "(64, 96)", "(64, 95)"], second=lambda f: f.depth[:, 1:]),
    case("second int", TypeError, ["second", "int32"], second=lambda f: f.depth.astype(np.int32)),
    case("unknown space", ValueError, ["normals", "'world'", "'tangent'"], normals="tangent"),
    case("no view", TypeError, ["view", "world", "None"], normals="world"),
    case("a view too many", TypeError, ["view", "normals='view'"], view=np.eye(3)),
    case("2x2 view", ValueError, ["view", "3x3 or 4x4", "(2, 2)"], normals="world", view=np.eye(2)),
    case("mirroring view", ValueError, ["view", "rigid"], normals="world", view=np.diag([1.0, 1, -1])),
    case("scaling view", ValueError, ["view", "rigid"], normals="world", view=2 * np.eye(3)),
    case("view with a projection", ValueError, ["view", "last row"], normals="world", view=perspective(50, 96, 64)),
    case("margin too large", ValueError, ["margin", "96x64", "(48, 0)"], margin=(48, 0)),
    case("negative margin", ValueError, ["margin", ">= 0", "-1"], margin=-1),
    case("share as margin", TypeError, ["margin", "pixels", "float 0.15"], margin=0.15),
    case("three margins", ValueError, ["margin", "3 values"], margin=(1, 2, 3)),
    case("unknown model", ValueError, ["model", "fast, balanced, high, paper", "'best'"], model="best"),
    case("model of another type", TypeError, ["model", "path", "int"], model=3),
    case("no model", TypeError, ["model", "NoneType"], model=None),
    case("unknown precision", ValueError, ["precision", "bf16", "f16"], precision="f16"),
    case("precision of another type", TypeError, ["precision", "dtype"], precision=np.dtype(np.float32)),
    case("no threads", ValueError, ["threads", "1..=1024", "found 0"], threads=0),
    case("many threads", ValueError, ["threads", "1..=1024", "100000"], threads=100_000),
    case("half a thread", TypeError, ["threads", "whole", "0.5"], threads=0.5),
    case("bool threads", TypeError, ["threads", "True"], threads=True),
    case("out of another size", ValueError, ["out", "(64, 96)", "(96, 64)"], out=np.zeros((96, 64), np.float32)),
    case("out of float64", TypeError, ["out", "float32", "float64"], out=np.zeros((64, 96))),
    case("out a list", TypeError, ["out", "array", "list"], out=[[0.0]]),
    case("out read-only", ValueError, ["out", "writeable", "read-only"],
         out=np.broadcast_to(np.zeros(96, np.float32), (64, 96))),
]


@pytest.mark.parametrize(("changes", "error", "words"), CASES)
def test_infer_refuses(frame, changes, error, words):
    arguments = {"normal": frame.normal, "depth": frame.depth, **frame.camera}
    arguments |= {k: v(frame) if callable(v) else v for k, v in changes.items()}
    with pytest.raises(error) as caught:
        aonet.infer(**arguments)
    message = str(caught.value)
    assert all(word in message for word in [*words, "expected", "found"]), message


def test_a_missing_radius_is_named(frame):
    with pytest.raises(TypeError, match="radius"):
        aonet.infer(frame.normal, frame.depth, fov_y=50.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="positional"):
        aonet.infer(frame.normal, frame.depth, 0.6, 50.0)  # type: ignore[misc]


@pytest.mark.parametrize(("method", "parameters", "error", "words"), [
    ("gtoa", None, ValueError, ["method", "gtao", "gtoa"]),
    ("agtao:huge", None, ValueError, ["method", "tuned", "agtao:huge"]),
    (None, None, TypeError, ["method", "None"]),
    ("gtao", {"slice": 3}, ValueError, ["parameter", "slices", "slice"]),
    ("gtao", {"slices": 1.5}, ValueError, ["slices", "whole", "1.5"]),
    ("gtao", {"slices": 1000}, ValueError, ["slices", "1000"]),
    ("gtao", {"slices": "9"}, TypeError, ["slices", "number", "str"]),
])
def test_classic_refuses(frame, method, parameters, error, words):
    with pytest.raises(error) as caught:
        aonet.classic(method, frame.normal, frame.depth, parameters=parameters, **frame.camera)
    assert all(word in str(caught.value) for word in [*words, "expected", "found"]), caught.value


@pytest.mark.parametrize(("width", "height", "margin", "error", "words"), [
    (0, 64, 0, ValueError, ["width", "0x64"]),
    (96, 40_000, 0, ValueError, ["96x40000", "32768"]),
    (96, 64, 20_000, ValueError, ["32768"]),
    (96.0, 64, 0, TypeError, ["width", "integer", "96.0"]),
    (96, -1, 0, ValueError, ["height", "-1"]),
    (2**70, 64, 0, (ValueError, OverflowError), []),
])
def test_sessions_refuse_sizes(width, height, margin, error, words):
    with pytest.raises(error) as caught:
        aonet.Session(width, height, margin=margin)
    assert all(word in str(caught.value) for word in words), caught.value


def test_frames_of_another_size_are_refused(frame):
    session = aonet.Session(96, 64, margin=(2, 1))
    with pytest.raises(ValueError, match=r"normal: expected shape \(66, 100, 3\), the size of the session with its margin"):
        session.run(frame.normal, frame.depth, **frame.camera)


def test_a_session_survives_an_error(frame):
    session = aonet.Session(96, 64)
    expected = session.run(frame.normal, frame.depth, **frame.camera)
    out = np.full(frame.shape, 7, np.float32)
    with pytest.raises(ValueError, match="NaN"):
        session.run(frame.normal, frame.depth * np.float32(np.nan), out=out, **frame.camera)
    assert np.all(out == 7)
    assert np.array_equal(session.run(frame.normal, frame.depth, **frame.camera), expected)


def test_files_are_named(tmp_path, frame):
    nowhere = tmp_path / "nowhere.exr"
    for run in (aonet.load_exr, aonet.load_ao, aonet.infer_exr):
        with pytest.raises(FileNotFoundError) as caught:
            run(nowhere)
        assert caught.value.filename == str(nowhere)
    with pytest.raises(FileNotFoundError):
        aonet.Session(96, 64, model=pathlib.Path("high"))
    broken = tmp_path / "broken.safetensors"
    broken.write_bytes(b"no network")
    with pytest.raises(ValueError, match="broken.safetensors.*expected safetensors"):
        aonet.infer(frame.normal, frame.depth, model=broken, **frame.camera)
    for name, run in [("broken.exr", aonet.load_exr), ("broken.exr", aonet.load_ao), ("broken.png", aonet.load_ao)]:
        path = tmp_path / name
        path.write_bytes(b"no image")
        with pytest.raises(ValueError, match=name):
            run(path)
    with pytest.raises(ValueError, match="ao.jpg.*expected the extension .exr or .png"):
        aonet.save_ao(tmp_path / "ao.jpg", frame.depth)
    with pytest.raises(OSError, match="missing"):
        aonet.save_ao(tmp_path / "missing" / "ao.png", np.ones((2, 2)))
    with pytest.raises(TypeError):
        aonet.load_exr(3)  # type: ignore[arg-type]


def test_images_to_compare_are_checked():
    image = np.full((16, 16), 0.5)
    for arguments, error, words in [
        ((image, image[1:]), ValueError, ["image", "(16, 16)", "(15, 16)"]),
        ((image[:10], image[:10]), ValueError, ["11x11", "16x10"]),
        ((image.astype(int), image), TypeError, ["reference", "int64"]),
        ((image, changed(image, (3, 4), np.nan)), ValueError, ["image", "(4, 3)", "NaN"]),
        ((image, image, np.ones((16, 16), np.uint8)), TypeError, ["mask", "bool", "uint8"]),
        ((image, image, np.ones((16, 15), bool)), ValueError, ["mask", "(16, 16)", "(16, 15)"]),
    ]:
        with pytest.raises(error) as caught:
            aonet.compare(*arguments)
        assert all(word in str(caught.value) for word in words), caught.value
