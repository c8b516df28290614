"""Checks and runs ONNX files: for crates/aonet_lab/tests/onnx.rs. Needs onnx, onnxruntime, numpy.

    run_onnx.py FOLDER

FOLDER/cases.json is a list of {"name", "shapes"}; NAME.onnx runs on NAME.INPUT.npy for every input (f32, of its shape), and
what comes out becomes NAME.visibility (f32).
"""
import json
import pathlib
import sys

import numpy as np
import onnx
import onnxruntime

folder = pathlib.Path(sys.argv[1])
options = onnxruntime.SessionOptions()
options.intra_op_num_threads = 1
for case in json.loads((folder / "cases.json").read_text()):
    path = folder / f"{case['name']}.onnx"
    onnx.checker.check_model(str(path), full_check=True)
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    shapes = case["shapes"]
    assert sorted(i.name for i in session.get_inputs()) == sorted(shapes), case
    inputs = {name: np.load(folder / f"{case['name']}.{name}.npy") for name in shapes}
    for name, values in inputs.items():
        assert values.dtype == np.float32 and list(values.shape) == shapes[name], (case, values.shape)
    (visibility,) = session.run(["visibility"], inputs)
    batch, _, height, width = shapes["features"]
    assert visibility.shape == (batch, 1, height, width), (case, visibility.shape)
    visibility.astype(np.float32).tofile(folder / f"{case['name']}.visibility")
