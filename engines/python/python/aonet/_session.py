"""Networks and classic methods that are ready to run, and the functions that run one once."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from . import _aonet, _checks
from ._checks import Floats

RADIUS = "a length > 0 (world units)"
Margin = int | tuple[int, int]
Space = Literal["view", "world"]
Precision = Literal["f32", "bf16", "int8"]


class _Runner:
    """A method for frames of one size, with its memory and its threads."""

    _compiled: _aonet.Session

    def __init__(self, width: int, height: int, margin: Margin) -> None:
        self._width = _checks.whole("width", width, "pixels, an integer > 0")
        self._height = _checks.whole("height", height, "pixels, an integer > 0")
        self._margin = _checks.margin(margin)

    @property
    def width(self) -> int:
        """Width of the picture (px), without the guard band."""
        return self._width

    @property
    def height(self) -> int:
        """Height of the picture (px), without the guard band."""
        return self._height

    @property
    def margin(self) -> tuple[int, int]:
        """Columns on the left and right, and rows above and below, that inputs have around the picture (px)."""
        return self._margin

    def run(
        self,
        normal: ArrayLike,
        depth: ArrayLike,
        *,
        radius: float,
        fov_y: float | None = None,
        projection: ArrayLike | None = None,
        normals: Space = "view",
        view: ArrayLike | None = None,
        second: ArrayLike | None = None,
        out: Floats | None = None,
    ) -> Floats:
        """The visibility of a frame's picture: (height, width) float32 in [0, 1]. Other Python threads run meanwhile.

        Inputs cover the picture and its guard band. C-contiguous float32 arrays are read where they are; do not change
        them during the call. Everything else is converted. Nothing of a frame's size is allocated if ``out`` is given,
        inputs need no conversion, and normals are of unit length up to rounding.

        Args:
            normal: (H, W, 3) unit vectors; ignored on the background.
            depth: (H, W) distance along the viewing axis (world units), > 0; infinite on the background.
            radius: length of the occlusion rays (world units). The network ``paper`` ignores it.
            fov_y: vertical field of view of the picture (degrees), without the guard band.
            projection: instead of ``fov_y``, the 4x4 matrix from view to clip space, for column vectors, of the
                picture without the guard band. The view space looks along -Z. The third row (depth) is not read.
            normals: space of the normals; "world" needs ``view``.
            view: 3x3 or 4x4 rigid transform from world to view space, for column vectors.
            second: (H, W) depth of a second layer, nowhere in front of the first.
            out: float32 array for the result, which is returned; may be an input.

        Raises:
            ValueError: a shape, a value or a name is wrong.
            TypeError: a dtype or a type is wrong.
        """
        camera = _camera(self._width, self._height, fov_y, projection)
        is_world = _is_world(normals, view)
        if is_world:
            camera = camera.with_view(_checks.matrix("view", view, (3, 4)))  # type: ignore[arg-type]
        return self._run(camera, (normal, depth, second), is_world, radius, out)

    def _run(
        self,
        camera: _aonet.Camera,
        layers: tuple[ArrayLike, ArrayLike, ArrayLike | None],
        is_world: bool,
        radius: float,
        out: Floats | None,
    ) -> Floats:
        radius = _checks.number("radius", radius, RADIUS)
        shape = (self._height + 2 * self._margin[1], self._width + 2 * self._margin[0])
        picture = (self._height, self._width)
        because = "the size of the session" + (" with its margin" if any(self._margin) else "")
        normal = _checks.image("normal", layers[0], (*shape, 3), because)
        depth = _checks.image("depth", layers[1], shape, because)
        second = None if layers[2] is None else _checks.image("second", layers[2], shape, because)
        result = np.empty(picture, np.float32) if out is None else _checks.out(out, picture)
        is_plain = result.flags.c_contiguous and result.flags.aligned
        written = result if is_plain else np.empty(picture, np.float32)
        self._compiled.run(camera, (normal, depth, second), is_world, radius, written)
        if written is not result:
            result[...] = written
        return result


class Session(_Runner):
    """A network for frames of one size. It keeps its memory and its threads from frame to frame.

    Args:
        width: width of the picture (px), without the guard band.
        height: height of the picture (px), without the guard band.
        model: ``"fast"``, ``"balanced"``, ``"high"`` (best), ``"paper"``, or the path of a network.
        margin: guard band on each side (px): one number, or (columns, rows).
        precision: ``"f32"``, or ``"bf16"`` or ``"int8"`` where :func:`precisions` has it.
        threads: the caller's included; by default as many as the process may use cores. Results do not depend on it.

    Raises:
        ValueError: a name or a number is out of range, or the file is no network.
        TypeError: an argument has another type.
        OSError: the network cannot be read.
    """

    def __init__(
        self,
        width: int,
        height: int,
        *,
        model: str | os.PathLike[str] = "balanced",
        margin: Margin = 0,
        precision: Precision = "f32",
        threads: int | None = None,
    ) -> None:
        super().__init__(width, height, margin)
        source = _source(model)
        precision_name = _checks.text("precision", precision, "'f32', 'bf16' or 'int8'")
        sides = (self._width, self._height, *self._margin)
        self._compiled = _aonet.Session.network(source, sides, precision_name, _threads(threads))


class ClassicSession(_Runner):
    """A method without a network for frames of one size. It keeps its memory and its threads from frame to frame.

    Args:
        width: width of the picture (px), without the guard band.
        height: height of the picture (px), without the guard band.
        method: one of :func:`methods`.
        parameters: values instead of the method's; :func:`parameters` lists them.
        margin: guard band on each side (px): one number, or (columns, rows).
        threads: the caller's included; by default as many as the process may use cores. Results do not depend on it.

    Raises:
        ValueError: a name or a number is out of range.
        TypeError: an argument has another type.
    """

    def __init__(
        self,
        width: int,
        height: int,
        method: str,
        *,
        parameters: Mapping[str, float] | None = None,
        margin: Margin = 0,
        threads: int | None = None,
    ) -> None:
        super().__init__(width, height, margin)
        name = _checks.text("method", method, "the name of a method")
        chosen = [(key, _checks.number(key, value, "a number")) for key, value in (parameters or {}).items()]
        sides = (self._width, self._height, *self._margin)
        self._compiled = _aonet.Session.classic(name, chosen, sides, _threads(threads))


def infer(
    normal: ArrayLike,
    depth: ArrayLike,
    *,
    radius: float,
    fov_y: float | None = None,
    projection: ArrayLike | None = None,
    normals: Space = "view",
    view: ArrayLike | None = None,
    margin: Margin = 0,
    second: ArrayLike | None = None,
    model: str | os.PathLike[str] = "balanced",
    precision: Precision = "f32",
    threads: int | None = None,
    out: Floats | None = None,
) -> Floats:
    """The visibility of one frame by a network: (H, W) float32 in [0, 1], without the margin.

    A :class:`Session` does the same for many frames and keeps what this function allocates. Arguments are those of
    :class:`Session` and :meth:`Session.run`.
    """
    depth = _checks.floats("depth", depth, ("height", "width"))
    width, height = picture_size(depth, margin)
    session = Session(width, height, model=model, margin=margin, precision=precision, threads=threads)
    return session.run(
        normal,
        depth,
        radius=radius,
        fov_y=fov_y,
        projection=projection,
        normals=normals,
        view=view,
        second=second,
        out=out,
    )


def classic(
    method: str,
    normal: ArrayLike,
    depth: ArrayLike,
    *,
    radius: float,
    fov_y: float | None = None,
    projection: ArrayLike | None = None,
    normals: Space = "view",
    view: ArrayLike | None = None,
    margin: Margin = 0,
    second: ArrayLike | None = None,
    parameters: Mapping[str, float] | None = None,
    threads: int | None = None,
    out: Floats | None = None,
) -> Floats:
    """The visibility of one frame by a method without a network, such as ``"agtao:tuned"`` or ``"arcs:deep"``.

    A :class:`ClassicSession` does the same for many frames. Arguments are those of :class:`ClassicSession` and
    :meth:`Session.run`.
    """
    depth = _checks.floats("depth", depth, ("height", "width"))
    width, height = picture_size(depth, margin)
    session = ClassicSession(width, height, method, parameters=parameters, margin=margin, threads=threads)
    return session.run(
        normal,
        depth,
        radius=radius,
        fov_y=fov_y,
        projection=projection,
        normals=normals,
        view=view,
        second=second,
        out=out,
    )


def picture_size(depth: Floats, margin: Margin) -> tuple[int, int]:
    """Width and height of what a margin leaves of an image."""
    x, y = _checks.margin(margin)
    height, width = depth.shape
    if 2 * x >= width or 2 * y >= height:
        raise ValueError(f"margin: expected one that leaves a picture of {width}x{height} pixels, found ({x}, {y})")
    return width - 2 * x, height - 2 * y


def _camera(width: int, height: int, fov_y: float | None, projection: ArrayLike | None) -> _aonet.Camera:
    if fov_y is None and projection is None:
        raise TypeError("camera: expected fov_y (degrees) or projection (4x4 matrix), found neither")
    if fov_y is not None and projection is not None:
        raise TypeError("camera: expected fov_y or projection, found both")
    if projection is not None:
        return _aonet.Camera.of_projection(width, height, _checks.matrix("projection", projection, (4,)))
    return _aonet.Camera.perspective(width, height, _checks.number("fov_y", fov_y, "an angle in (0, 180) degrees"))


def _is_world(normals: Space, view: ArrayLike | None) -> bool:
    if normals not in ("view", "world"):
        raise ValueError(f"normals: expected 'view' or 'world', found {normals!r}")
    if normals == "world" and view is None:
        raise TypeError("view: expected a 3x3 or 4x4 matrix from world to view space for normals='world', found None")
    if normals == "view" and view is not None:
        raise TypeError("view: expected None for normals='view', found a matrix")
    return normals == "world"


def _source(model: str | os.PathLike[str]) -> tuple[str, bool]:
    """A name or a path, and whether it is a name."""
    if not isinstance(model, (str, os.PathLike)):
        raise TypeError(f"model: expected a name or a path, found {type(model).__name__}")
    path = os.fspath(model)
    if model in _aonet.models():
        return path, True
    if isinstance(model, str) and not os.path.exists(path):
        names = ", ".join(_aonet.models())
        raise ValueError(f"model: expected {names} or the path of a network, found {path!r}")
    return path, False


def _threads(threads: int | None) -> int | None:
    return None if threads is None else _checks.whole("threads", threads, "a whole number > 0")
