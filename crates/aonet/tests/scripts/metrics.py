"""Prints the expected values of crates/aonet/src/metrics.rs' tests. Needs numpy, scipy, scikit-image."""
import numpy as np
from scipy.ndimage import uniform_filter
from skimage.metrics import mean_squared_error, structural_similarity

WIDTH, HEIGHT = 56, 40
y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
a = ((x * x + 3 * y * y + 5 * x * y) % 64 + 2 * x + y) / 255
b = np.clip(0.9 * a + 0.08 + ((37 * x + 91 * y) % 17 - 8) / 80, 0, 1)
foreground = (x - 20) ** 2 + (y - 15) ** 2 < 200


def gaussian(a, b):
    """Wang et al. 2004 as scikit-image has it: 11x11, sigma 1.5, windows that lie inside."""
    _, full = structural_similarity(
        a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1, full=True
    )
    return full[5:-5, 5:-5], foreground[5:-5, 5:-5]


def flat(a, b):
    """8x8 means; scikit-image wants odd windows. scipy's window of 8 spans -4..=+3 about its centre."""
    mean = lambda v: uniform_filter(v, 8)[4:-3, 4:-3]
    ma, mb = mean(a), mean(b)
    va, vb, cov = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    full = (2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))
    return full, foreground[4:-3, 4:-3]


for name, ssim in (("gaussian", gaussian), ("flat", flat)):
    full, mask = ssim(a, b)
    print(f"{name}: full {full.mean():.7f} foreground {full[mask].mean():.7f}")
print(f"mse: full {mean_squared_error(a, b):.9f} foreground {((a - b)[foreground] ** 2).mean():.9f}")
