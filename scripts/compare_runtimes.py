#!/usr/bin/env python3
"""Times one network in several runtimes on the CPU, in turn, and prints a Markdown table.

    scripts/compare_runtimes.py MODEL.safetensors [--size 1280x720] [--threads 1 2] [--rounds 9] [--aonet PATH]

Needs numpy; takes part whoever can be imported: onnxruntime, openvino, ncnn with pnnx (the fixed, plain file, converted).
Every round runs every runtime with every number of threads, so that a machine that slows down slows down all: one call
that does not count, then the median of three, as `aonet bench` does.

What is timed. Others: one call with features in memory, to visibility in memory. `aonet`: a whole frame from the
G-buffer, with horizon search and features. `aonet, network only`: the same less its first step; that step also lays out the
patches, which the others do inside their call and which takes a few milliseconds.
"""
import argparse
import json
import pathlib
import shutil
import statistics
import subprocess
import tempfile
import time

import numpy as np

# Counted calls of a runtime in a round.
RUNS = 3


def importable(name):
    try:
        return __import__(name)
    except ImportError:
        print(f"{name}: not importable, left out")
        return None


def aonet(options, threads):
    """Runs `aonet bench` once; yields both of its times [ms]."""
    command = [options.aonet, "bench", "--model", options.model, "--size", options.size]
    command += ["--threads", str(threads), "--runs", str(RUNS), "--json"]
    timing = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["timings"][0]
    return timing["median_ms"], timing["median_ms"] - timing["features_ms"]


def onnx_runner(path, threads):
    import onnxruntime

    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads, settings.inter_op_num_threads = threads, 1
    session = onnxruntime.InferenceSession(str(path), settings, providers=["CPUExecutionProvider"])
    return lambda features: session.run(None, {"features": features})[0]


def openvino_runner(path, threads):
    import openvino

    settings = {
        "INFERENCE_NUM_THREADS": threads,
        "NUM_STREAMS": 1,
        "INFERENCE_PRECISION_HINT": "f32",
        "PERFORMANCE_HINT": "LATENCY",
    }
    request = openvino.Core().compile_model(str(path), "CPU", settings).create_infer_request()
    return lambda features: request.infer([features])[0]


def ncnn_runner(path, threads):
    import ncnn

    net = ncnn.Net()
    net.opt.num_threads = threads
    net.opt.use_fp16_packed = net.opt.use_fp16_storage = net.opt.use_fp16_arithmetic = False
    net.opt.use_bf16_storage = False
    if net.load_param(str(path.with_suffix(".ncnn.param"))) or net.load_model(str(path.with_suffix(".ncnn.bin"))):
        raise RuntimeError("ncnn cannot load what pnnx wrote")

    def run(features):
        extractor = net.create_extractor()
        extractor.input("in0", ncnn.Mat(features[0]))
        status, visibility = extractor.extract("out0")
        if status:
            raise RuntimeError(f"ncnn: status {status}")
        return np.array(visibility)[None]

    return run


def timed(run, features):
    """Median of RUNS calls after one that does not count [ms]."""
    run(features)
    values = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run(features)
        values.append((time.perf_counter() - start) * 1e3)
    return statistics.median(values)


def export(options, folder):
    """Writes both forms; returns their paths."""
    paths = {}
    for form, flags in (("plain", []), ("tuned", ["--tuned"])):
        paths[form] = folder / f"{form}.onnx"
        command = [options.aonet, "export", options.model, "--onnx", paths[form], "--size", options.size]
        subprocess.run([*command, *flags], check=True, capture_output=True)
    return paths


def runners(paths, folder):
    """Name and maker of every runtime that is there."""
    found = {}
    if importable("onnxruntime"):
        found.update({f"onnxruntime {form}": (onnx_runner, path) for form, path in paths.items()})
    if importable("openvino"):
        found.update({f"openvino {form}": (openvino_runner, path) for form, path in paths.items()})
    if importable("ncnn") and shutil.which("pnnx"):
        converted = folder / "ncnn"
        converted.mkdir()
        path = shutil.copy(paths["plain"], converted)
        done = subprocess.run(["pnnx", path, "fp16=0"], capture_output=True, cwd=converted)
        if done.returncode == 0:
            found["ncnn plain"] = (ncnn_runner, pathlib.Path(path))
        else:
            print("ncnn: pnnx cannot convert the file, left out")
    return found


def prepare(found, threads, features):
    """Runners that ran, and agree with the first of them. What fails or differs is named and left out."""
    ready, expected = {}, None
    for name, (make, path) in found.items():
        for count in threads:
            try:
                run = make(path, count)
                visibility = np.asarray(run(features)).reshape(-1)
            except Exception as why:  # A runtime that does not support the file says so in its own way.
                print(f"{name}: {str(why).splitlines()[0]}, left out")
                continue
            expected = visibility if expected is None else expected
            same_size = visibility.shape == expected.shape
            error = float(np.abs(visibility - expected).max()) if same_size else float("inf")
            if error > 1e-4:
                print(f"{name}: differs by {error:.1e}, left out")
                continue
            ready[name, count] = run
    return ready


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--aonet", default="target/release/aonet")
    options = parser.parse_args()
    times = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        facts = json.loads(subprocess.run([options.aonet, "export", options.model, "--onnx", folder / "facts.onnx",
                                           "--size", options.size, "--json"], check=True, capture_output=True).stdout)
        shape = facts["inputs"][0]["shape"]
        features = np.random.default_rng(1).uniform(-0.5, 0.5, shape).astype(np.float32)
        ready = prepare(runners(export(options, folder), folder), options.threads, features)
        for _ in range(options.rounds):
            for count in options.threads:
                frame, network = aonet(options, count)
                times.setdefault(("aonet, network only", count), []).append(network)
                times.setdefault(("aonet", count), []).append(frame)
            for key, run in ready.items():
                times.setdefault(key, []).append(timed(run, features))
    print(f"\n{pathlib.Path(options.model).stem}, {options.size}, {options.rounds} rounds; medians, least to greatest\n")
    print("| runtime | threads | median ms | spread ms | over aonet, network only |\n|---|---:|---:|---:|---:|")
    for (name, count), values in sorted(times.items(), key=lambda item: (item[0][1], statistics.median(item[1]))):
        ratio = statistics.median(values) / statistics.median(times["aonet, network only", count])
        spread = f"{min(values):.1f} to {max(values):.1f}"
        print(f"| {name} | {count} | {statistics.median(values):.1f} | {spread} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
