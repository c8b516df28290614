"""Draws a small scene without ambient occlusion, with a classic method, and with the network.

    python first_picture.py                 a floor, a wall, spheres and a box, ray-cast with numpy
    python first_picture.py frame.exr       a frame of yours, or the one of `aonet demo`

The picture is first_picture.png: above the lit scene, below the visibility that it was lit with.
"""

import sys
from typing import NamedTuple

import aonet
import numpy as np

RADIUS = 0.6
FOV_Y = 50.0
SPHERES = [((-0.9, 0.5, -4.0), 0.5), ((0.1, 0.35, -3.4), 0.35), ((0.45, 0.95, -4.3), 0.3)]
BOX = ((0.15, 0.0, -5.0), (1.3, 0.65, -3.9))
LIGHT = np.array([-0.4, 0.8, 0.45]) / np.linalg.norm([-0.4, 0.8, 0.45])


class Hits(NamedTuple):
    """What the rays of an image meet: (H, W, 3) normals and (H, W) distances along the viewing axis."""

    normal: np.ndarray
    depth: np.ndarray

    def or_nearer(self, distance, normal):
        """The same where `distance` is not nearer (and ahead)."""
        nearer = (distance > 1e-6) & (distance < self.depth)
        return Hits(np.where(nearer[..., None], normal, self.normal), np.where(nearer, distance, self.depth))


def plane(hits, ray, normal, offset):
    """The points p with dot(normal, p) = offset."""
    with np.errstate(divide="ignore"):
        return hits.or_nearer(offset / (ray @ normal), normal)


def sphere(hits, ray, centre, radius):
    a, b = np.sum(ray * ray, axis=-1), ray @ centre
    root = b * b - a * (centre @ centre - radius**2)
    distance = np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    point = ray * np.where(root > 0, distance, 0)[..., None]
    return hits.or_nearer(distance, (point - centre) / radius)


def box(hits, ray, low, high):
    with np.errstate(divide="ignore"):
        near, far = np.sort([low / ray, high / ray], axis=0)
    entry = near.max(axis=-1)
    normal = np.where(np.arange(3) == near.argmax(axis=-1)[..., None], -np.sign(ray), 0.0)
    return hits.or_nearer(np.where(entry < far.min(axis=-1), entry, np.inf), normal)


def scene(width, height, margin=(0, 0), fov_y=FOV_Y, spheres=SPHERES):
    """Normals and depth of a picture of width x height pixels and a margin around it, in view space.

    The camera is 1 above the floor and looks along -Z. A ray has length 1 along the axis, so that distances are depths."""
    x = np.arange(-margin[0], width + margin[0]) + 0.5 - width / 2
    y = height / 2 - (np.arange(-margin[1], height + margin[1]) + 0.5)
    pixel = 2 * np.tan(np.radians(fov_y) / 2) / height
    ray = np.stack([*np.meshgrid(x * pixel, y * pixel), np.full((len(y), len(x)), -1.0)], axis=-1)
    eye = np.array([0.0, 1.0, 0.0])
    hits = Hits(np.zeros(ray.shape), np.full(ray.shape[:2], np.inf))
    hits = plane(hits, ray, np.array([0.0, 1.0, 0.0]), -eye[1])
    hits = plane(hits, ray, np.array([0.0, 0.0, 1.0]), -5.6)
    hits = plane(hits, ray, np.array([1.0, 0.0, 0.0]), -1.8)
    for centre, radius in spheres:
        hits = sphere(hits, ray, np.array(centre) - eye, radius)
    return box(hits, ray, *(np.array(corner) - eye for corner in BOX))


def lit(normal, visibility):
    """A grey picture: light from the sky, which AO dims, and a lamp, which it does not; encoded for screens."""
    lamp = np.clip(normal @ LIGHT, 0, None)
    return np.clip(0.55 * visibility + 0.3 * lamp, 0, 1) ** (1 / 2.2)


def main(path=None):
    if path is None:
        normal, depth = scene(480, 360)
        frame = {"radius": RADIUS, "fov_y": FOV_Y}
        images = {
            "none": np.ones_like(depth, np.float32),
            "agtao:tuned": aonet.classic("agtao:tuned", normal, depth, **frame),
            "aonet": aonet.infer(normal, depth, **frame),
        }
        reference, foreground = None, None
    else:
        frame = aonet.load_exr(path)
        x, y = frame.margin
        normal, reference = frame.normal[y : y + frame.height, x : x + frame.width], frame.ao
        foreground = frame.foreground
        images = {
            "none": np.ones((frame.height, frame.width), np.float32),
            "agtao:tuned": frame.classic("agtao:tuned"),
            "aonet": frame.infer(),
        }
    for name, image in images.items():
        scores = "" if reference is None else aonet.compare(reference, image, foreground).full
        print(f"{name:12} mean visibility {image.mean():.3f}", scores)
    rows = [np.hstack([lit(normal, image) for image in images.values()]), np.hstack(list(images.values()))]
    aonet.save_ao("first_picture.png", np.vstack(rows))
    print("first_picture.png: from left to right", ", ".join(images))


if __name__ == "__main__":
    main(*sys.argv[1:])
