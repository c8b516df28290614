"""Frames and AO images as files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _aonet, _checks
from ._checks import Floats
from ._session import RADIUS, ClassicSession, Precision, Session, _Runner

Path = str | os.PathLike[str]
FileSpace = Literal["view", "world", "blender"]


@dataclass(frozen=True, eq=False)
class Frame:
    """What a file shows: the arrays cover the picture and its guard band."""

    #: (H, W, 3) unit vectors in view space; zero on the background.
    normal: Floats = field(repr=False)
    #: (H, W) distance along the viewing axis (world units); infinite on the background.
    depth: Floats = field(repr=False)
    #: (H, W) depth of the second layer, where the file has one.
    second: Floats | None = field(repr=False)
    #: (height, width) visibility of the picture by ray tracing, where the file has it.
    ao: Floats | None = field(repr=False)
    #: Columns on each side and rows above and below that surround the picture (px).
    margin: tuple[int, int]
    #: AO radius (world units), where it is known.
    radius: float | None
    _camera: _aonet.Camera = field(repr=False)

    @property
    def width(self) -> int:
        """Width of the picture (px)."""
        width: int = self.depth.shape[1]
        return width - 2 * self.margin[0]

    @property
    def height(self) -> int:
        """Height of the picture (px)."""
        height: int = self.depth.shape[0]
        return height - 2 * self.margin[1]

    @property
    def fov_y(self) -> float | None:
        """Vertical field of view of the picture (degrees); None for an orthographic camera."""
        return self._camera.fov_y

    @property
    def projection(self) -> NDArray[np.float64]:
        """The 4x4 matrix from view to clip space of the picture, for column vectors: reversed depth in [0, 1]."""
        return np.array(self._camera.projection)

    @property
    def view(self) -> NDArray[np.float64]:
        """The 4x4 transform from world to view space, for column vectors; the identity where it is not known."""
        return np.array(self._camera.view)

    @property
    def foreground(self) -> NDArray[np.bool_]:
        """(height, width) bool: whether a pixel of the picture shows geometry."""
        x, y = self.margin
        return np.isfinite(self.depth[y : y + self.height, x : x + self.width])

    def infer(
        self,
        *,
        radius: float | None = None,
        model: str | os.PathLike[str] = "balanced",
        precision: Precision = "f32",
        threads: int | None = None,
        out: Floats | None = None,
    ) -> Floats:
        """:func:`infer` of this frame; the radius is by default the frame's."""
        sizes = (self.width, self.height)
        session = Session(*sizes, model=model, margin=self.margin, precision=precision, threads=threads)
        return self._run(session, radius, out)

    def classic(
        self,
        method: str,
        *,
        radius: float | None = None,
        parameters: Mapping[str, float] | None = None,
        threads: int | None = None,
        out: Floats | None = None,
    ) -> Floats:
        """:func:`classic` of this frame; the radius is by default the frame's."""
        sizes = (self.width, self.height)
        session = ClassicSession(*sizes, method, parameters=parameters, margin=self.margin, threads=threads)
        return self._run(session, radius, out)

    def _run(self, runner: _Runner, radius: float | None, out: Floats | None) -> Floats:
        chosen = self.radius if radius is None else radius
        if chosen is None:
            if runner._compiled.sees_radius:
                raise ValueError(f"radius: expected {RADIUS}, found none in the file and none given")
            chosen = 1.0
        return runner._run(self._camera, (self.normal, self.depth, self.second), False, chosen, out)


def load_exr(
    path: Path,
    *,
    second: Path | None = None,
    view: Path | None = None,
    fov_y: float | None = None,
    radius: float | None = None,
    normals: FileSpace | None = None,
) -> Frame:
    """Reads a frame: an OpenEXR file of ``aonet``, of an engine, or Blender's multi-layer EXR.

    Channels are ``normal.X/Y/Z`` and ``depth``, or passes of a layer such as ``ViewLayer.Normal.X``; the pixels that
    the data window has around the display window are the guard band. What is given goes before what the file has.

    Args:
        path: the file.
        second: a file with the second layer: the same camera and size, without the objects in front.
        view: a JSON file with camera and radius, as ``aonet render --view`` reads it.
        fov_y: vertical field of view of the picture (degrees).
        radius: AO radius (world units).
        normals: space of the file's normals; "world" is glTF's (+Y up), "blender" is Blender's (+Z up); by default as
            the names of the channels say. Both need a view.

    Raises:
        OSError: a file cannot be read.
        ValueError: a file is no frame, or lacks the camera.
    """
    angle = None if fov_y is None else _checks.number("fov_y", fov_y, "an angle in (0, 180) degrees")
    length = None if radius is None else _checks.number("radius", radius, RADIUS)
    camera, normal, depth, behind, ao, margin, found = _aonet.load_exr(path, second, view, angle, length, normals)
    return Frame(normal, depth, behind, ao, margin, found, camera)


def infer_exr(
    path: Path,
    out_path: Path | None = None,
    *,
    second: Path | None = None,
    view: Path | None = None,
    fov_y: float | None = None,
    radius: float | None = None,
    normals: FileSpace | None = None,
    model: str | os.PathLike[str] = "balanced",
    precision: Precision = "f32",
    threads: int | None = None,
) -> Floats:
    """The visibility of a file's frame by a network; written to ``out_path`` (.exr or .png) where one is given.

    Arguments are those of :func:`load_exr` and :func:`infer`. The result is that of ``aonet infer`` with the same
    precision.
    """
    frame = load_exr(path, second=second, view=view, fov_y=fov_y, radius=radius, normals=normals)
    visibility = frame.infer(model=model, precision=precision, threads=threads)
    if out_path is not None:
        save_ao(out_path, visibility)
    return visibility


def load_ao(path: Path) -> Floats:
    """Reads an AO image, .exr or .png, or the AO of a frame's file: (H, W) float32 visibility.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is no such image.
    """
    return _aonet.load_ao(path)


def save_ao(path: Path, image: ArrayLike) -> None:
    """Writes visibility as .exr (32-bit, channel ``ao``) or .png (16-bit grey, linear).

    Raises:
        OSError: the file cannot be written.
        ValueError: the extension is another one, or a value is NaN.
    """
    _aonet.save_ao(path, _checks.floats("image", image, ("height", "width")))
