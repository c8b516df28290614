"""Equality with the program `aonet`: the same pixels, bit for bit, from the same files."""

import dataclasses
import json

import aonet
import numpy as np
import pytest


def same(found, path):
    expected = aonet.load_ao(path)
    assert expected.min() < 0.9
    assert np.array_equal(found, expected), np.abs(found - expected).max()


@pytest.mark.parametrize("model", aonet.models())
@pytest.mark.parametrize("precision", aonet.precisions())
def test_networks(program, exr, deep_exr, tmp_path, model, precision):
    for frame in (exr, deep_exr):
        program("infer", frame, "-o", tmp_path / "ao.exr", "--model", model, "--precision", precision)
        found = aonet.infer_exr(frame, tmp_path / "ours.exr", model=model, precision=precision)
        same(found, tmp_path / "ao.exr")
        same(found, tmp_path / "ours.exr")


@pytest.mark.parametrize("method", aonet.methods())
def test_methods(program, deep_exr, tmp_path, method):
    program("classic", method, deep_exr, "-o", tmp_path / "ao.exr")
    same(aonet.load_exr(deep_exr).classic(method), tmp_path / "ao.exr")


def test_parameters(program, exr, tmp_path):
    program("classic", "gtao", exr, "-o", tmp_path / "ao.exr", "--set", "slices=5", "--set", "falloff=0.1")
    frame = aonet.load_exr(exr)
    found = frame.classic("gtao", parameters={"slices": 5, "falloff": 0.1})
    same(found, tmp_path / "ao.exr")
    assert not np.array_equal(found, frame.classic("gtao"))


def test_a_model_file_and_other_values_of_a_frame(program, exr, deep_exr, tmp_path):
    view = tmp_path / "other.json"
    view.write_text((exr.parent / "view.json").read_text().replace('"radius": 0.4', '"radius": 0.2'))
    for flags, options in [
        (["--radius", 0.7], {"radius": 0.7}),
        (["--fov-y", 70], {"fov_y": 70.0}),
        (["--view", view], {"view": view}),
        (["--second", exr], {"second": exr}),
    ]:
        common = ["--model", "high", "--precision", "f32"]
        program("infer", exr, "-o", tmp_path / "ao.exr", *common, *flags)
        found = aonet.infer_exr(exr, model="high", **options)
        same(found, tmp_path / "ao.exr")
        assert not np.array_equal(found, aonet.infer_exr(exr, model="high")), flags


def test_arrays_give_what_the_file_gives(deep_exr):
    """The same frame through `infer`, with matrices instead of the file's exact camera."""
    frame = aonet.load_exr(deep_exr)
    expected = frame.infer(model="high")
    common = {"radius": frame.radius, "margin": frame.margin, "second": frame.second, "model": "high"}
    rotation = frame.view[:3, :3]
    world = frame.normal @ rotation.astype(np.float32)
    for normal, options in [
        (frame.normal, {"projection": frame.projection}),
        (frame.normal, {"fov_y": frame.fov_y}),
        (world, {"fov_y": frame.fov_y, "normals": "world", "view": frame.view}),
    ]:
        assert np.abs(aonet.infer(normal, frame.depth, **common, **options) - expected).max() < 5e-4
    assert np.abs(aonet.infer(frame.normal, frame.depth, fov_y=30.0, **common) - expected).max() > 5e-3


def test_frames_are_what_the_program_reports(program, exr, deep_exr):
    for path in (exr, deep_exr):
        frame, facts = aonet.load_exr(path), json.loads(program("info", path, "--json"))
        assert (frame.width, frame.height) == (facts["width"], facts["height"]) == (96, 64)
        assert frame.radius == np.float32(0.4) and abs(frame.fov_y - 55) < 1e-4
        assert frame.ao.shape == frame.foreground.shape == (64, 96)
        assert np.array_equal(frame.ao, aonet.load_ao(path))
    plain, deep = aonet.load_exr(exr), aonet.load_exr(deep_exr)
    assert plain.margin == (0, 0) and deep.margin == (14, 10) and deep.depth.shape == (84, 124)
    assert plain.second is None and deep.second.shape == deep.depth.shape and np.all(deep.second >= deep.depth)
    assert np.array_equal(deep.depth[10:-10, 14:-14], plain.depth)
    assert np.allclose(np.linalg.norm(deep.normal[np.isfinite(deep.depth)], axis=-1), 1, atol=1e-6)
    eye = -deep.view[:3, :3].T @ deep.view[:3, 3]
    assert np.allclose(eye, [0.4, 1.9, 3.2], atol=1e-5)


def test_a_frame_without_a_radius(exr):
    frame = aonet.load_exr(exr)
    without = dataclasses.replace(frame, radius=None)
    assert np.array_equal(without.infer(radius=frame.radius), frame.infer())
    with pytest.raises(ValueError, match="radius: expected a length > 0 .* found none in the file"):
        without.infer()
    # The paper's network has its radius built in.
    assert np.array_equal(without.infer(model="paper"), frame.infer(model="paper"))


def test_scores(program, exr, tmp_path):
    frame = aonet.load_exr(exr)
    for name, image in [("net.exr", frame.infer()), ("ssao.png", frame.classic("ssao")), ("same.exr", frame.ao)]:
        aonet.save_ao(tmp_path / name, image)
        expected = json.loads(program("compare", exr, tmp_path / name, "--json"))["images"][0]
        found = aonet.compare(frame.ao, aonet.load_ao(tmp_path / name), frame.foreground)
        for scores, numbers in [(found.full, expected["full"]), (found.foreground, expected["foreground"])]:
            psnr = np.inf if numbers["psnr"] is None else numbers["psnr"]
            assert scores == (numbers["ssim"], numbers["ssim_8x8"], numbers["mse"], psnr, numbers["pixels"])
    assert aonet.compare(frame.ao, frame.ao).foreground is None
    assert aonet.compare(frame.ao, frame.classic("ssao")).full.ssim < 1


def test_names():
    assert aonet.models() == ["fast", "balanced", "high", "paper"]
    assert {"agtao:tuned", "arcs:deep", "gtao:ultra", "nnao", "ssao"} <= set(aonet.methods())
    assert "f32" in aonet.precisions()
    names = [p.name for p in aonet.parameters("gtao:low")]
    values = {p.name: p for p in aonet.parameters("gtao:low")}
    assert "slices" in names and values["slices"].whole and values["slices"].doc
    assert all(p.low <= p.value <= p.high for m in aonet.methods() for p in aonet.parameters(m))
