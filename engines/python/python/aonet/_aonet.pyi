"""The compiled part. It expects what the other modules have checked: C-contiguous float32 arrays."""

from os import PathLike
from typing import final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Camera",
    "Session",
    "__version__",
    "compare",
    "load_ao",
    "load_exr",
    "methods",
    "models",
    "parameters",
    "precisions",
    "save_ao",
]

__version__: str

_Rows = list[list[float]]
_Floats = NDArray[np.float32]
_Path = str | PathLike[str]
_Row = tuple[float, float, float, float, int]

@final
class Camera:
    @staticmethod
    def perspective(width: int, height: int, fov_y: float) -> Camera: ...
    @staticmethod
    def of_projection(width: int, height: int, projection: _Rows) -> Camera: ...
    def with_view(self, view: _Rows) -> Camera: ...
    @property
    def fov_y(self) -> float | None: ...
    @property
    def projection(self) -> _Rows: ...
    @property
    def view(self) -> _Rows: ...

@final
class Session:
    @staticmethod
    def network(
        source: tuple[_Path, bool], sides: tuple[int, int, int, int], precision: str, threads: int | None
    ) -> Session: ...
    @staticmethod
    def classic(
        method: str, parameters: list[tuple[str, float]], sides: tuple[int, int, int, int], threads: int | None
    ) -> Session: ...
    @property
    def sees_radius(self) -> bool: ...
    def run(
        self,
        camera: Camera,
        arrays: tuple[_Floats, _Floats, _Floats | None],
        is_world: bool,
        radius: float,
        out: _Floats,
    ) -> None: ...

def compare(reference: _Floats, image: _Floats, mask: NDArray[np.bool_] | None) -> tuple[_Row, _Row | None]: ...
def load_ao(path: _Path) -> _Floats: ...
def load_exr(
    path: _Path,
    second: _Path | None,
    view: _Path | None,
    fov_y: float | None,
    radius: float | None,
    normals: str | None,
) -> tuple[Camera, _Floats, _Floats, _Floats | None, _Floats | None, tuple[int, int], float | None]: ...
def methods() -> list[str]: ...
def models() -> list[str]: ...
def parameters(method: str) -> list[tuple[str, float, float, float, bool, str]]: ...
def precisions() -> list[str]: ...
def save_ao(path: _Path, image: _Floats) -> None: ...
