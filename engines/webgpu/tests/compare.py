#!/usr/bin/env python3
"""compare.py AONET MODEL PREFIX WIDTH HEIGHT FOV_Y RADIUS: compares what `offscreen` wrote with the CPU's visibility of the same
depth and normals, which the program AONET computes."""

import array
import json
import struct
import subprocess
import sys
from pathlib import Path


def write_exr(path, channels, width, height):
    """An OpenEXR file of 32-bit float channels, without compression."""

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    names = sorted(channels)
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in names) + b"\0"
    box = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2) + b"".join([
        attribute("channels", "chlist", listed), attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", box), attribute("displayWindow", "box2i", box),
        attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)), attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]) + b"\0"
    line = 4 * width * len(names)
    first = len(header) + 8 * height
    offsets = b"".join(struct.pack("<Q", first + y * (8 + line)) for y in range(height))
    rows = []
    for y in range(height):
        values = b"".join(channels[name][y * width : (y + 1) * width].tobytes() for name in names)
        rows.append(struct.pack("<ii", y, line) + values)
    path.write_bytes(header + offsets + b"".join(rows))


def floats(path):
    return array.array("f", Path(path).read_bytes())


def main():
    program, model, prefix, width, height, fov_y, radius = sys.argv[1:]
    width, height = int(width), int(height)
    normal, visibility = floats(prefix + ".normal"), floats(prefix + ".visibility")
    frame, expected, found = (Path(f"{prefix}.{name}.exr") for name in ("frame", "expected", "found"))
    channels = {f"normal.{axis}": normal[i::3] for i, axis in enumerate("XYZ")}
    write_exr(frame, channels | {"depth": floats(prefix + ".depth")}, width, height)
    run = [program, "classic", model] if ":" in model else [program, "infer", "--model", model, "--precision", "f32"]
    subprocess.run([*run, str(frame), "-o", str(expected), "--fov-y", fov_y, "--radius", radius], check=True, stdout=subprocess.DEVNULL)
    write_exr(found, {"ao": visibility}, width, height)
    assert min(visibility) < 0.5 < max(visibility), "nothing to see"
    # 60 dB: a mean difference of a thousandth.
    output = subprocess.run([program, "compare", str(expected), str(found), "--min-psnr", "60", "--json"], capture_output=True, text=True)
    print(output.stdout.strip(), output.stderr.strip())
    assert output.returncode == 0, "the images differ"
    # A test that a wrong image fails: the same one, upside down.
    rows = [visibility[y * width : (y + 1) * width] for y in reversed(range(height))]
    write_exr(found, {"ao": sum(rows, array.array("f"))}, width, height)
    wrong = subprocess.run([program, "compare", str(expected), str(found), "--min-psnr", "60", "--json"], capture_output=True, text=True)
    assert wrong.returncode == 1, wrong.stdout


main()
