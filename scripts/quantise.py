"""8-bit forms of exported networks, calibrated on the inputs of frames: for compare_runtimes.py.

The trunk is quantised: convolutions and the operations between them, so that values stay 8-bit throughout. Kernels over the
normals and later operations stay f32, where a few 8-bit steps would be visible.
"""
import contextlib
import io
import logging

from runtimes import importable

# Convolutions and the operations between them.
OPERATORS = ["Conv", "LeakyRelu", "Pad", "AveragePool", "Concat", "Resize"]
# Prefixes of the names of operations that apply kernels: see aonet_lab's onnx/ops.rs and onnx/tuned.rs.
TAIL = ("normal", "kernel", "weighted", "softmax", "component", "head/")


def is_tail(name):
    return name.startswith(TAIL)


def with_onnxruntime(source, target, frames):
    """Static quantisation with QDQ nodes: activations unsigned, weights signed and by output channel."""
    from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
    import onnx

    class Reader(CalibrationDataReader):
        def __init__(self):
            self.rest = iter(frames)

        def get_next(self):
            return next(self.rest, None)

    tail = [node.name for node in onnx.load(str(source)).graph.node if is_tail(node.name)]
    quantize_static(
        str(source), str(target), Reader(), quant_format=QuantFormat.QDQ, op_types_to_quantize=OPERATORS,
        per_channel=True, activation_type=QuantType.QUInt8, weight_type=QuantType.QInt8, nodes_to_exclude=tail,
    )


def with_nncf(source, target, frames):
    """NNCF's post-training quantisation of the model as OpenVINO reads it."""
    import nncf
    import openvino

    nncf.set_log_level(logging.ERROR)
    model = openvino.Core().read_model(str(source))
    tail = [op.get_friendly_name() for op in model.get_ordered_ops() if is_tail(op.get_friendly_name())]
    ignored = nncf.IgnoredScope(names=tail, validate=False)
    dataset = nncf.Dataset(frames)
    # Its progress bars are no part of our result.
    with contextlib.redirect_stdout(io.StringIO()):
        quantised = nncf.quantize(model, dataset, subset_size=len(frames), ignored_scope=ignored,
                                  preset=nncf.QuantizationPreset.MIXED)
    openvino.save_model(quantised, str(target), compress_to_fp16=False)


def quantised(paths, folder, frames):
    """Paths of the 8-bit forms that can be made of the others, by form and quantiser."""
    logging.getLogger().setLevel(logging.ERROR)
    made = {}
    makers = []
    if importable("onnxruntime") and importable("onnx"):
        makers.append(("int8", ".onnx", with_onnxruntime))
    if importable("openvino") and importable("nncf"):
        makers.append(("nncf", ".xml", with_nncf))
    for form in list(paths):
        for name, suffix, make in makers:
            target = folder / f"{form}_{name}{suffix}"
            try:
                make(paths[form], target, frames)
            except Exception as why:  # A quantiser that does not support the file says so in its own way.
                print(f"{form} {name}: {str(why).splitlines()[0]}, left out")
                continue
            made[f"{form} {name}"] = target
    return made
