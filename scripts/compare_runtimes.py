#!/usr/bin/env python3
"""Times networks in several runtimes and precisions on the CPU, in turn, and prints Markdown tables.

    scripts/compare_runtimes.py MODEL... [--size 1280x720] [--threads 1 2] [--rounds 9] [--precision f32 bf16 int8]
                                [--only WORD...] [--aonet PATH] [--json FILE]

A MODEL is a network (.safetensors) or a configuration (.json: random weights). Needs numpy and Pillow; includes every runtime that can
be imported: onnxruntime, openvino, nncf (OpenVINO's quantiser), ncnn with pnnx (the fixed files, converted). Every round
runs every runtime with every precision and number of threads, so that a slower machine affects all of them: one call
that does not count, then the median of three, as `aonet bench` does.

What is timed. Others: one call with features in memory, to visibility in memory. `aonet`: a whole frame from the
G-buffer, with horizon search and features. `aonet, network only`: the same less its first step; that step also lays out the
patches, which the others do inside their call and which takes a few milliseconds.

Frames are rendered from procedural scenes: four to calibrate 8-bit forms, another one to measure errors, which are differences
of visibility on its foreground from the first f32 runtime that ran (ours by way of a 16-bit image: 8e-6 are lost). A network without kernels (such as
assets/models/rows/base_patch.safetensors) shows the time of convolutions alone; its table says so.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import numpy as np

import quantise
import runtimes

# Counted calls of a runtime in a round.
RUNS = 3
# Scenes of the frames: the first ones calibrate, the last one is for errors and times.
SEEDS = (1, 2, 3, 4, 5)
# Largest error of a runtime that says it computes in f32.
F32_ERROR = 1e-4


def run(*command):
    """What a command prints; ends the program with what it says where it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    return done.stdout


def reason(done):
    """Why our program could not, without its news."""
    lines = done.stderr.strip().splitlines()
    return next((line for line in lines if line.startswith(("aonet:", "error:"))), lines[-1] if lines else "no reason")


def model_words(model, positional=False):
    """How the program is told of a network or a configuration."""
    if model.endswith(".json"):
        return ["--config", model]
    return [model] if positional else ["--model", model]


def render(options, folder):
    """Frames of procedural scenes; returns their paths."""
    width, height = options.size.split("x")
    frames = []
    for seed in SEEDS:
        view = {"eye": [0.25 * seed, 1.4, 1.9], "target": [0.0, 0.3, 0.0], "fov_y_deg": 60, "radius": 0.5,
                "width": int(width), "height": int(height)}
        (folder / "view.json").write_text(json.dumps(view))
        frames.append(folder / f"frame{seed}.exr")
        run(options.aonet, "render", f"procedural:clutter_pile:{seed}", "--view", folder / "view.json", "--ground",
            "-o", frames[-1])
    return frames


def export(options, model, frames, folder):
    """Writes all forms; returns their paths and the inputs of the frames, arrays by name."""
    paths = {"plain": folder / "plain.onnx", "tuned": folder / "tuned.onnx"}
    words = [options.aonet, "export", *model_words(model, positional=True), "--size", options.size]
    run(*words, "--onnx", paths["tuned"], "--tuned")
    with_frames = [word for frame in frames for word in ("--frame", frame)]
    facts = json.loads(run(*words, "--onnx", paths["plain"], *with_frames, "--json"))
    inputs = [inputs_at(pathlib.Path(path)) for path in facts["frames"]]
    if paths["plain"].read_bytes() == paths["tuned"].read_bytes():
        print("nothing to tune: one form for both")
        del paths["tuned"]
    if "int8" in options.precision:
        paths.update(quantise.quantised(paths, folder, inputs[:-1]))
    return paths, inputs


def inputs_at(features):
    """Features, and what a search and a survey found if the network has them, in files beside it."""
    beside = {name: features.with_name(f"{features.stem}_{name}.npy") for name in ("search", "survey")}
    return {"features": np.load(features)} | {name: np.load(path) for name, path in beside.items() if path.exists()}


def aonet_image(options, model, frame, precision, folder):
    """What our program makes of a frame; none for a configuration, and where the network does not know its ranges."""
    if model.endswith(".json"):
        return None
    from PIL import Image

    target = folder / "ao.png"
    words = [options.aonet, "infer", frame, "-o", target, "--model", model]
    words += ["--precision", precision]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode:
        print(f"{reason(done)}: no error of {precision} is measured")
        return None
    return np.asarray(Image.open(target)).astype(np.float32) / 65535.0


def aonet_precisions(options, model):
    """Those asked for that the machine has."""
    found = []
    for precision in options.precision:
        words = [*model_words(model), "--size", "64x64", "--threads", "1", "--runs", "1", "--precision", precision]
        done = subprocess.run([options.aonet, "bench", *words], capture_output=True, text=True)
        if done.returncode:
            print(f"{reason(done)}, {precision} left out")
        else:
            found.append(precision)
    return found


def aonet_times(options, model, threads, precision):
    """Runs `aonet bench` once; returns both of its times [ms]."""
    words = [options.aonet, "bench", *model_words(model), "--size", options.size, "--threads", threads, "--runs", RUNS]
    timing = json.loads(run(*words, "--precision", precision, "--json"))["timings"][0]
    return timing["median_ms"], timing["median_ms"] - timing["features_ms"]


def timed(call, inputs):
    """Median of RUNS calls after one that does not count [ms]."""
    call(inputs)
    values = []
    for _ in range(RUNS):
        start = time.perf_counter()
        call(inputs)
        values.append((time.perf_counter() - start) * 1e3)
    return statistics.median(values)


class Errors:
    """Differences from the first f32 result, on the foreground."""

    def __init__(self, inputs):
        self.foreground = np.abs(inputs["features"][0, :3]).sum(axis=0).reshape(-1) > 0
        self.expected = None
        self.found = {}

    def add(self, key, visibility):
        values = np.asarray(visibility, dtype=np.float32).reshape(-1)
        if values.shape != self.foreground.shape:
            raise RuntimeError(f"{values.size} values for {self.foreground.size} pixels")
        values = values[self.foreground]
        self.expected = values if self.expected is None else self.expected
        difference = np.abs(values - self.expected)
        self.found[key] = float(np.sqrt(np.mean(difference**2))), float(difference.max())
        return self.found[key]


def prepare(options, found, inputs, errors):
    """Runners that ran. What fails, or computes something else in f32, is named and left out."""
    ready = {}
    for (name, precision), make in found.items():
        if precision not in options.precision or not all(word in name for word in options.only):
            continue
        for count in options.threads:
            try:
                call = make(count)
                _, largest = errors.add((name, precision), call(inputs))
            except Exception as why:  # A runtime that does not support the file says so in its own way.
                print(f"{name} {precision}: {str(why).splitlines()[0]}, left out")
                continue
            if precision == "f32" and not largest <= F32_ERROR:
                print(f"{name}: differs by {largest:.1e}, left out")
                continue
            ready[name, precision, count] = call
    return ready


def measure(options, model, folder):
    """Times [ms] by (name, precision, threads), and errors."""
    frames = render(options, folder)
    paths, inputs = export(options, model, frames, folder)
    errors, times = Errors(inputs[-1]), {}
    ready = prepare(options, runtimes.available(paths, folder), inputs[-1], errors)
    precisions = aonet_precisions(options, model)
    for precision in precisions:
        image = aonet_image(options, model, frames[-1], precision, folder)
        if image is not None:
            errors.add(("aonet, network only", precision), image)
    for _ in range(options.rounds):
        for count in options.threads:
            for precision in precisions:
                frame, network = aonet_times(options, model, count, precision)
                times.setdefault(("aonet, network only", precision, count), []).append(network)
                times.setdefault(("aonet", precision, count), []).append(frame)
        for key, call in ready.items():
            times.setdefault(key, []).append(timed(call, inputs[-1]))
    return times, errors.found


def predicts_kernels(options, model):
    """Whether a network ends in kernels over the normals."""
    words = [*model_words(model), "--size", "64x64", "--threads", 1, "--runs", 1, "--json"]
    config = json.loads(run(options.aonet, "bench", *words))["networks"][0]["config"]
    return config["kernel"] in ("linear", "softmax")


def table(options, model, times, errors):
    kernels = predicts_kernels(options, model)
    what = "" if kernels else "; no kernels: convolutions and what lies between them only"
    lines = [f"`{pathlib.Path(model).stem}`, {options.size}, {options.rounds} rounds; medians, least to greatest{what}", "",
             "| runtime | precision | threads | median ms | spread ms | over aonet, network only | rms error | largest error |",
             "|---|---|---:|---:|---:|---:|---:|---:|"]
    median = {key: statistics.median(values) for key, values in times.items()}
    for key in sorted(times, key=lambda key: (options.precision.index(key[1]), key[2], median[key])):
        name, precision, count = key
        ours = median.get(("aonet, network only", precision, count))
        ratio = f"{median[key] / ours:.2f}" if ours else "-"
        error = errors.get((name, precision))
        rms, largest = (f"{value:.1e}" for value in error) if error else ("-", "-")
        spread = f"{min(times[key]):.1f} to {max(times[key]):.1f}"
        lines.append(f"| {name} | {precision} | {count} | {median[key]:.1f} | {spread} | {ratio} | {rms} | {largest} |")
    return "\n".join(lines)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("model", nargs="+")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--precision", nargs="+", default=["f32", "bf16", "int8"], choices=["f32", "bf16", "int8"])
    parser.add_argument("--only", nargs="+", default=[], help="runtimes whose name has all of these words")
    parser.add_argument("--aonet", default="target/release/aonet")
    parser.add_argument("--json", type=pathlib.Path, help="all times and errors, for other tables")
    return parser.parse_args()


def main():
    options = arguments()
    everything = {}
    for model in options.model:
        with tempfile.TemporaryDirectory() as folder:
            times, errors = measure(options, model, pathlib.Path(folder))
        print(f"\n{table(options, model, times, errors)}", flush=True)
        everything[model] = {"times_ms": [[*key, values] for key, values in times.items()],
                             "errors": [[*key, *values] for key, values in errors.items()]}
    if options.json:
        options.json.write_text(json.dumps(everything))


if __name__ == "__main__":
    main()
