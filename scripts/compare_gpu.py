#!/usr/bin/env python3
"""Times networks in PyTorch and in our runtime on the same graphics processor, in turn, and prints a Markdown table.

    scripts/compare_gpu.py MODEL... [--size 1280x720 1920x1080 3840x2160] [--runs 50] [--mode MODE] [--aonet PATH] [--check] [--json FILE]

A MODEL is a network (.safetensors). Needs a program built with `cargo build --release --features gpu`, PyTorch with CUDA, numpy,
Pillow and safetensors. --check needs no GPU: it only compares PyTorch's image with that of `aonet infer` on the CPU; the
same comparison comes before every measurement.

What is timed. PyTorch: a network with features, search and survey in the GPU's memory, to visibility in it, not smoothed, by CUDA events; eager and compiled, in
32-bit floats (without TF32) and 16-bit ones. `aonet`: a whole frame from the G-buffer's textures to the AO texture, with horizon
search and features. `aonet, network only`: the passes of convolutions and kernels alone, each waiting for the one before.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

import numpy as np
import torch
import torch.nn.functional as functional
from PIL import Image
from safetensors import safe_open
from safetensors.numpy import save_file

LEAKY_SLOPE = 0.01
# Of the kernels: pixels a side of their window, and where it begins.
WINDOW, FIRST_TAP = 4, -1
# Passes of a frame that are no part of the network.
AROUND = ("depth range", "agtao", "arcs", "denoise", "features", "surfels", "survey", "smooth", "image")
# Largest difference between PyTorch's image and ours, in f32 on the CPU. A 16-bit image rounds by 8e-6; measured: 8.4e-6.
LARGEST_ERROR = 2e-5
# Calls that are not counted: compilation, and clocks that rise.
WARM_UP = 10


class Network(torch.nn.Module):
    """AO-Net as a weights file describes it: features to visibility before it is clamped."""

    def __init__(self, path):
        super().__init__()
        with safe_open(str(path), "pt") as file:
            self.config = json.loads(file.metadata()["aonet"])["config"]
            if self.config["arch"] != "ao_net":
                raise SystemExit(f"{path}: expected the architecture ao_net, found {self.config['arch']}")
            for name in file.keys():
                self.register_buffer(name.replace(".", "_"), file.get_tensor(name).float())

    def conv(self, x, name):
        weight, bias = (getattr(self, f"{name.replace('.', '_')}_{part}") for part in ("weight", "bias"))
        border = weight.shape[-1] // 2
        x = functional.pad(x, [border] * 4, mode="replicate") if border else x
        return functional.conv2d(x, weight, bias)

    def double_conv(self, x, name):
        for layer in ("conv0", "conv1"):
            x = functional.leaky_relu(self.conv(x, f"{name}.{layer}"), LEAKY_SLOPE)
        return x

    def seen(self, features, search):
        """Features with what the network sees of its search, which ONNX files take apart."""
        if search is None:
            return features
        names = self.config["features"]
        if "horizon_occlusion" in names:
            place, seen = names.index("horizon_occlusion"), 1.0 - search[:, :1]
        else:
            place, seen = names.index("hit_light"), search[:, 1:]
        return torch.cat([features[:, :place], seen, features[:, place:]], 1)

    def forward(self, features, search=None, survey=None):
        config, skips = self.config, []
        x = functional.pixel_unshuffle(self.seen(features, search), config["patch"])
        x = x if survey is None else torch.cat([x, survey], 1)
        for level in range(len(config["encoder"])):
            if level:
                skips.append(x)
                x = functional.avg_pool2d(x, 2)
            x = self.double_conv(x, f"enc{level}")
        for level in reversed(range(len(config["decoder"]))):
            x = functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)
            x = torch.cat([x, skips[level]], 1) if config.get("skips", "concat") == "concat" else x
            x = self.double_conv(x, f"dec{level}")
        x = self.conv(x, "head")
        if config["kernel"] in ("linear", "softmax"):
            x = self.weigh(x, features[:, :3])
        x = functional.pixel_shuffle(x, config["patch"])
        if search is None:
            return x
        # What is added to the search's visibility, and what weighs its shares of light.
        return search[:, :1] + x[:, :1] + (x[:, 1:] * search[:, 1:]).sum(1, keepdim=True)

    def weigh(self, kernels, normals):
        """AO-Net §3.3, Eq. 2: what each pixel's kernel says of the normals around it."""
        patch, (height, width) = self.config["patch"], kernels.shape[-2:]
        after = WINDOW - 1 + FIRST_TAP
        around = functional.pad(normals, [-FIRST_TAP, after, -FIRST_TAP, after], mode="replicate")
        # By component, tap, row and column of cells, row and column of the patch.
        around = functional.unfold(around, WINDOW).view(3, WINDOW**2, height, patch, width, patch)
        around = around.permute(3, 5, 1, 0, 2, 4).reshape(patch**2, WINDOW**2, 3, height, width)
        kernels = kernels.view(patch**2, WINDOW**2, 3, height, width)
        kernels = kernels.softmax(1) if self.config["kernel"] == "softmax" else kernels
        return (kernels * around).sum((1, 2))[None] / 3.0


def run(*command):
    """What a command prints; ends the program with what it says where it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    return done.stdout


def inputs_of(options, model, size, folder):
    """What the network reads of a rendered frame, by name, and the path of that frame."""
    width, height = map(int, size.split("x"))
    view = {"eye": [0.25, 1.4, 1.9], "target": [0.0, 0.3, 0.0], "fov_y_deg": 60, "radius": 0.5, "width": width, "height": height}
    (folder / "view.json").write_text(json.dumps(view))
    frame = folder / "frame.exr"
    run(options.aonet, "render", "procedural:clutter_pile:1", "--view", folder / "view.json", "--ground", "-o", frame)
    words = [options.aonet, "export", model, "--onnx", folder / "network.onnx", "--frame", frame, "--json"]
    path = pathlib.Path(json.loads(run(*words))["frames"][0])
    inputs = {"features": path}
    inputs |= {name: path.with_name(f"{path.stem}_{name}.npy") for name in ("search", "survey")}
    return {name: torch.from_numpy(np.load(of)) for name, of in inputs.items() if of.exists()}, frame


def unsmoothed(model, folder):
    """The network without the filter of its correction, which takes the frame's depth: PyTorch's has none."""
    with safe_open(str(model), "np") as file:
        facts = json.loads(file.metadata()["aonet"])
        tensors = {name: file.get_tensor(name) for name in file.keys()}
    if not facts["config"].pop("smooth", False):
        return model
    path = folder / f"{pathlib.Path(model).stem}_unsmoothed.safetensors"
    save_file(tensors, path, {"aonet": json.dumps(facts)})
    return path


def check(options, model, size, folder):
    """Compares PyTorch's image with ours on the CPU; returns the largest difference on the foreground."""
    model = unsmoothed(model, folder)
    inputs, frame = inputs_of(options, model, size, folder)
    width, height = map(int, size.split("x"))
    with torch.inference_mode():
        found = Network(model)(**inputs)[0, 0, :height, :width].clamp(0.0, 1.0).numpy()
    target = folder / "ao.png"
    run(options.aonet, "infer", frame, "-o", target, "--model", model, "--precision", "f32")
    expected = np.asarray(Image.open(target)).astype(np.float32) / 65535.0
    foreground = (inputs["features"][0, :3, :height, :width] != 0.0).any(0).numpy()
    if expected[foreground].std() < 0.05:
        raise SystemExit(f"{model}: nothing to see on the frame")
    largest = float(np.abs(found - expected)[foreground].max())
    if not largest <= LARGEST_ERROR:
        raise SystemExit(f"{model}: PyTorch's image differs from ours by {largest:.1e}, more than {LARGEST_ERROR:.0e}")
    return largest


def timed(call, runs):
    """Times of single calls on the GPU [ms]."""
    for _ in range(WARM_UP):
        call()
    times = []
    for _ in range(runs):
        begin, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
        begin.record()
        call()
        end.record()
        end.synchronize()
        times.append(begin.elapsed_time(end))
    return times


def torch_times(options, model, inputs):
    """Times by (name, precision)."""
    times = {}
    for precision, kind in (("f32", torch.float32), ("f16", torch.float16)):
        network = Network(model).to("cuda", kind).eval()
        values = {name: of.to("cuda", kind).contiguous(memory_format=torch.channels_last) for name, of in inputs.items()}
        for name, form in (("eager", network), ("compiled", torch.compile(network, mode=options.mode))):
            with torch.inference_mode():
                times[f"PyTorch {name}", precision] = timed(lambda f=form: f(**values), options.runs)
    return times


def spread(times):
    return {"median_ms": statistics.median(times), "min_ms": min(times), "max_ms": max(times)}


def aonet_rows(options, model, size):
    """The adapter, and spreads by (name, precision)."""
    words = ["--model", model, "--size", size, "--runs", options.runs, "--json"]
    facts = json.loads(run(options.aonet, "bench", "--device", "gpu", *words))
    if facts["not_measured"]:
        raise SystemExit(facts["not_measured"])
    found = {}
    for row in facts["rows"]:
        how = "" if row["kernels"] == "plain" else f" ({row['kernels']})"
        found[f"aonet{how}", row["precision"]] = row["frame"]
        passes = [one["time"] for one in row["passes"] if one["pass"] not in AROUND and one["time"]]
        if passes:
            sums = {key: sum(time[key] for time in passes) for key in ("median_ms", "min_ms", "max_ms")}
            found[f"aonet, network only{how}", row["precision"]] = sums
    return facts["adapter"], found


def measure(options, model, size, folder):
    """Spreads by (name, precision), and whose."""
    inputs, _ = inputs_of(options, model, size, folder)
    adapter, found = aonet_rows(options, model, size)
    ours, theirs = adapter, torch.cuda.get_device_name()
    if theirs.split()[-1] not in ours:
        print(f"note: `aonet` runs on {ours}, PyTorch on {theirs}")
    found.update({key: spread(times) for key, times in torch_times(options, model, inputs).items()})
    return found, f"{ours}, PyTorch {torch.__version__}"


def table(model, size, found, where):
    lines = [f"`{pathlib.Path(model).stem}`, {size}, {where}", "", "| runtime | precision | median ms | spread ms |",
             "|---|---|---:|---:|"]
    for (name, precision), time in sorted(found.items(), key=lambda item: (item[0][1], item[1]["median_ms"])):
        lines.append(f"| {name} | {precision} | {time['median_ms']:.3f} | {time['min_ms']:.3f} to {time['max_ms']:.3f} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("model", nargs="+")
    parser.add_argument("--size", nargs="+", default=["1280x720", "1920x1080", "3840x2160"])
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--mode", default="max-autotune", help="of torch.compile: max-autotune takes minutes")
    parser.add_argument("--aonet", default="target/release/aonet")
    parser.add_argument("--check", action="store_true", help="compare images on the CPU only")
    parser.add_argument("--json", type=pathlib.Path, help="all times, for other tables")
    options = parser.parse_args()
    if not options.check and not torch.cuda.is_available():
        raise SystemExit("no GPU that PyTorch can use: --check compares images without one")
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = False
    torch.backends.cudnn.benchmark = True
    everything = []
    for model in options.model:
        for size in ["321x187"] if options.check else options.size:
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                print(f"{model}: PyTorch's image is ours to {check(options, model, '321x187', folder):.1e}", flush=True)
                if options.check:
                    continue
                found, where = measure(options, model, size, folder)
            print(f"\n{table(model, size, found, where)}\n", flush=True)
            everything += [{"model": model, "size": size, "runtime": name, "precision": precision, **time}
                           for (name, precision), time in found.items()]
    if options.json:
        options.json.write_text(json.dumps(everything))


if __name__ == "__main__":
    main()
