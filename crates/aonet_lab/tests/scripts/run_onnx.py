"""Checks and runs ONNX files: for crates/aonet_lab/tests/onnx.rs. Needs onnx, onnxruntime, numpy.

    run_onnx.py FOLDER

FOLDER/cases.json is a list of {"name", "shape"}; NAME.onnx runs on NAME.npy (f32, of that shape), and what comes
out becomes NAME.visibility (f32).
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
    assert [i.name for i in session.get_inputs()] == ["features"], case
    features = np.load(folder / f"{case['name']}.npy")
    assert features.dtype == np.float32 and list(features.shape) == case["shape"], (case, features.shape)
    (visibility,) = session.run(["visibility"], {"features": features})
    batch, _, height, width = case["shape"]
    assert visibility.shape == (batch, 1, height, width), (case, visibility.shape)
    visibility.astype(np.float32).tofile(folder / f"{case['name']}.visibility")
