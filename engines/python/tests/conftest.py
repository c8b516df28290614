"""Frames for the tests: one from the example's ray caster, and some from the program `aonet`, which is the truth."""

import json
import os
import pathlib
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "examples"))

import first_picture  # noqa: E402

VIEW = {"eye": [0.4, 1.9, 3.2], "target": [0, 0.4, 0], "fov_y_deg": 55, "width": 96, "height": 64, "radius": 0.4}


class Cast(NamedTuple):
    """A frame as arrays, and what its camera is."""

    normal: np.ndarray
    depth: np.ndarray
    camera: dict

    @property
    def shape(self):
        return self.depth.shape


def cast(width=96, height=64, margin=(0, 0), **options):
    normal, depth = first_picture.scene(width, height, margin, **options)
    camera = {"fov_y": options.get("fov_y", first_picture.FOV_Y), "radius": first_picture.RADIUS}
    return Cast(normal.astype(np.float32), depth.astype(np.float32), camera)


def perspective(fov_y, width, height):
    """An OpenGL projection matrix."""
    f, near, far = 1 / np.tan(np.radians(fov_y) / 2), 0.1, 100.0
    third = [0, 0, (far + near) / (near - far), 2 * far * near / (near - far)]
    return np.array([[f * height / width, 0, 0, 0], [0, f, 0, 0], third, [0, 0, -1, 0]])


@pytest.fixture(scope="session")
def frame():
    return cast()


@pytest.fixture(scope="session")
def program():
    """Runs `aonet` and returns what it prints. Tests need the program: there is nothing to skip to."""
    path = os.environ.get("AONET")
    if not path:
        pytest.exit("AONET: expected the path of the program aonet, found none; engines/python/test builds it", 2)

    def run(*arguments):
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("frames")


@pytest.fixture(scope="session")
def exr(program, folder):
    """A frame with ray-traced AO, without a guard band and a second layer."""
    view, path = folder / "view.json", folder / "frame.exr"
    view.write_text(json.dumps(VIEW))
    program("trace", "procedural:clutter_pile:1", "--ground", "--view", view, "--spp", 16, "-o", path)
    return path


@pytest.fixture(scope="session")
def deep_exr(program, folder, exr):
    """The same with a guard band and a second layer."""
    path = folder / "deep.exr"
    surround = ["--margin", 0.15, "--layers", 2]
    program("trace", "procedural:clutter_pile:1", "--ground", "--view", folder / "view.json", *surround, "--spp", 16, "-o", path)
    return path
