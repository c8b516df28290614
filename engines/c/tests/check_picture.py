#!/usr/bin/env python3
"""Checks the picture of the example: three panels with the same surfaces, of which the second and the third are darker in
places and differ. With --write-pfm DEPTH NORMAL, writes a frame for the example instead: a floor in front of the sky."""

import pathlib
import struct
import sys

GAP = 4


def panels(path):
    """Three lists of bytes."""
    kind, size, most, pixels = pathlib.Path(path).read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert (kind, most, len(pixels)) == (b"P6", b"255", 3 * width * height)
    side = (width - 2 * GAP) // 3
    rows = [pixels[3 * width * y : 3 * width * (y + 1)] for y in range(height)]
    return [b"".join(row[3 * left : 3 * (left + side)] for row in rows) for left in (0, side + GAP, 2 * (side + GAP))]


def check(path):
    plain, classic, network = panels(path)
    for panel in (classic, network):
        assert all(a <= b for a, b in zip(panel, plain)), "visibility dims"
        share = sum(a < b - 5 for a, b in zip(panel, plain)) / len(plain)
        assert 0.1 < share < 0.95, f"{share:.2f} of the picture is dimmed"
    assert sum(abs(a - b) > 3 for a, b in zip(classic, network)) > len(plain) // 100, "methods differ"


def write_pfm(depth_path, normal_path, width=64, height=48):
    """Rows from the bottom up, a camera at height 1 with 60 degrees."""
    depth, normal = [], []
    for y in range(height):
        slope = (0.5 * height - y - 0.5) * 2 * 0.5774 / height
        depth += [1 / slope if slope > 0.02 else float("inf")] * width
        normal += [0.0, 1.0, 0.0] * width
    for path, kind, numbers in ((depth_path, "Pf", depth), (normal_path, "PF", normal)):
        head = f"{kind}\n{width} {height}\n-1.0\n".encode()
        pathlib.Path(path).write_bytes(head + struct.pack(f"<{len(numbers)}f", *numbers))


if __name__ == "__main__":
    if sys.argv[1] == "--write-pfm":
        write_pfm(*sys.argv[2:])
    else:
        check(sys.argv[1])
