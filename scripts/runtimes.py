"""Other runtimes as functions from inputs, a dictionary of arrays by name, to visibility: for compare_runtimes.py."""
import pathlib
import shutil
import subprocess

import numpy as np

# Of `aonet export`.
FORMS = ("plain", "tuned")
# Who made an 8-bit form.
QUANTISERS = {"int8": "onnxruntime's quantiser", "nncf": "nncf"}


def importable(name):
    try:
        return __import__(name)
    except ImportError:
        print(f"{name}: not importable, left out")
        return None


def onnxruntime_runner(path, threads):
    import onnxruntime

    onnxruntime.set_default_logger_severity(3)
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads, settings.inter_op_num_threads = threads, 1
    session = onnxruntime.InferenceSession(str(path), settings, providers=["CPUExecutionProvider"])
    return lambda inputs: session.run(None, inputs)[0]


def openvino_runner(path, threads, precision="f32"):
    import openvino

    settings = {
        "INFERENCE_NUM_THREADS": threads,
        "NUM_STREAMS": 1,
        "INFERENCE_PRECISION_HINT": precision,
        "PERFORMANCE_HINT": "LATENCY",
    }
    request = openvino.Core().compile_model(str(path), "CPU", settings).create_infer_request()
    return lambda inputs: request.infer(inputs)[0]


def ncnn_runner(path, threads, bf16=False):
    import ncnn

    net = ncnn.Net()
    net.opt.num_threads = threads
    net.opt.use_fp16_packed = net.opt.use_fp16_storage = net.opt.use_fp16_arithmetic = False
    net.opt.use_bf16_storage = bf16
    if net.load_param(str(path.with_suffix(".ncnn.param"))) or net.load_model(str(path.with_suffix(".ncnn.bin"))):
        raise RuntimeError("ncnn cannot load what pnnx wrote")

    def run(inputs):
        extractor = net.create_extractor()
        for place, values in enumerate(inputs.values()):
            extractor.input(f"in{place}", ncnn.Mat(values[0]))
        status, visibility = extractor.extract("out0")
        if status:
            raise RuntimeError(f"ncnn: status {status}")
        return np.array(visibility)[None]

    return run


def converted(path, folder):
    """The path beside which pnnx has put ncnn's files; none if it cannot."""
    folder.mkdir(exist_ok=True)
    path = pathlib.Path(shutil.copy(path, folder))
    done = subprocess.run(["pnnx", path.name, "fp16=0"], capture_output=True, cwd=folder)
    if done.returncode or not path.with_suffix(".ncnn.param").exists():
        print(f"ncnn: pnnx cannot convert {path.name}, left out")
        return None
    return path


def available(paths, folder):
    """Maker by (runtime and form, precision): functions from a number of threads to a function of inputs."""
    found, forms = {}, [form for form in FORMS if form in paths]
    if importable("onnxruntime"):
        for form in forms:
            found[f"onnxruntime {form}", "f32"] = lambda n, p=paths[form]: onnxruntime_runner(p, n)
            if p8 := paths.get(f"{form} int8"):
                found[f"onnxruntime {form}", "int8"] = lambda n, p=p8: onnxruntime_runner(p, n)
    if importable("openvino"):
        for form in forms:
            found[f"openvino {form}", "f32"] = lambda n, p=paths[form]: openvino_runner(p, n)
            found[f"openvino {form}", "bf16"] = lambda n, p=paths[form]: openvino_runner(p, n, "bf16")
            # What is not quantised in bf16, its own choice where the processor has it: the faster one (tuned form of the
            # paper's network, 1280x720, one thread: 161 instead of 236 ms).
            for quantiser in ("int8", "nncf"):
                if p8 := paths.get(f"{form} {quantiser}"):
                    label = f"openvino {form}, {QUANTISERS[quantiser]}"
                    found[label, "int8"] = lambda n, p=p8: openvino_runner(p, n, "bf16")
    if importable("ncnn") and shutil.which("pnnx"):
        for form in forms:
            if path := converted(paths[form], folder / f"ncnn_{form}"):
                found[f"ncnn {form}", "f32"] = lambda n, p=path: ncnn_runner(p, n)
                found[f"ncnn {form}", "bf16"] = lambda n, p=path: ncnn_runner(p, n, bf16=True)
    return found
