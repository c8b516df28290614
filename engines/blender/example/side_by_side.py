# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a small scene with Cycles' ambient occlusion pass and with aonet, and writes them side by side.

    python side_by_side.py OUT.png          # bpy and pyaonet are installed
"""

import sys
import tempfile
import time
from pathlib import Path

import aonet
import bpy
import numpy as np

here = Path(__file__).resolve().parent
sys.path[:0] = [str(here.parent), str(here.parent / "tests")]

import scenes  # noqa: E402
from aonet_blender import occlusion, passes  # noqa: E402

RADIUS = 0.8


def cycles_pass(scene, samples):
    """Cycles' ray-traced pass: (height, width), top row first."""
    if scene.world is None:
        scene.world = bpy.data.worlds.new("World")
    scene.world.light_settings.distance = RADIUS
    with passes.scratch_scene(scene, (0, 0), RADIUS) as scratch, tempfile.TemporaryDirectory() as folder:
        scratch.cycles.samples = samples
        scratch.view_layers[0].use_pass_ambient_occlusion = True
        return aonet.load_exr(passes.write(scratch, Path(folder) / "ao.exr")).ao


def main():
    out = Path(sys.argv[1]).resolve()
    scene = scenes.shelf()
    pictures = []
    for name, compute in (
        ("Cycles, 8 rays a pixel", lambda: cycles_pass(scene, 8)),
        ("aonet balanced", lambda: occlusion.visibility(scene, occlusion.Options(RADIUS, "balanced", 0.1))),
        ("aonet high, second layer", lambda: occlusion.visibility(scene, occlusion.Options(RADIUS, "high", 0.15, True))),
        ("Cycles, 512 rays a pixel", lambda: cycles_pass(scene, 512)),
    ):
        began = time.perf_counter()
        pictures.append(compute())
        print(f"{name}: {time.perf_counter() - began:.1f} s")
    truth = pictures[-1]
    for picture in pictures[:-1]:
        print(f"PSNR {-10 * np.log10(np.mean((picture - truth) ** 2)):.2f} dB")
    both = np.concatenate([np.concatenate(pictures[:2], 1), np.concatenate(pictures[2:], 1)], 0)
    aonet.save_ao(out, np.clip(both, 0, 1))


main()
