"""How alike two AO images are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import _aonet, _checks


class Scores(NamedTuple):
    """Similarity over a set of pixels."""

    #: Mean SSIM of the Gaussian 11x11 window, in [-1, 1]; 1 is identical.
    ssim: float
    #: Mean SSIM of the flat 8x8 window.
    ssim_8x8: float
    #: Mean squared error.
    mse: float
    #: Peak signal-to-noise ratio (dB); infinite for identical pixels.
    psnr: float
    #: Pixels that the error was averaged over.
    pixels: int


class Comparison(NamedTuple):
    """Similarity over the full frame and over its foreground."""

    #: Every pixel.
    full: Scores
    #: Pixels of the mask; None without one, or where it is empty.
    foreground: Scores | None


def compare(reference: ArrayLike, image: ArrayLike, mask: ArrayLike | None = None) -> Comparison:
    """SSIM and PSNR of an AO image against a reference, as ``aonet compare`` reports them.

    Args:
        reference: (H, W) visibility; values are clamped to [0, 1].
        image: the same.
        mask: (H, W) bool: True on the foreground, such as :attr:`Frame.foreground`.

    Raises:
        ValueError: shapes differ, a side is shorter than 11 pixels, or a value is NaN.
        TypeError: images are not floating-point, or the mask is not bool.
    """
    a = _checks.floats("reference", reference, ("height", "width"))
    b = _checks.image("image", image, a.shape, "as the reference")
    inside = None
    if mask is not None:
        inside = np.ascontiguousarray(mask)
        if inside.dtype != np.bool_:
            raise TypeError(f"mask: expected an array of bool, found dtype {inside.dtype}")
        if inside.shape != a.shape:
            raise ValueError(f"mask: expected shape {a.shape}, as the reference, found {inside.shape}")
    full, foreground = _aonet.compare(a, b, inside)
    return Comparison(Scores(*full), None if foreground is None else Scores(*foreground))
