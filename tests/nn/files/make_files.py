#!/usr/bin/python3
"""Writes the weight files of this folder with PyTorch, onnx, SciPy and NumPy, and the outputs of these networks.

Run it in this folder: `python3 make_files.py`. It needs Debian's python3-torch, python3-onnx and python3-scipy.
"""
import json

import numpy as np
import onnx
import scipy.io
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

torch.manual_seed(7)
rng = np.random.default_rng(7)
expected = {}


def record(name, inputs, function, count=6):
    """Returns inputs, and the outputs of `function` in double."""
    cases = []
    for _ in range(count):
        x = rng.normal(size=inputs).round(3) * 2
        cases.append({"x": x.ravel().tolist(), "y": np.asarray(function(x)).ravel().tolist()})
    expected[name] = cases


def in_double(model):
    copy = model.double()
    return lambda x: copy(torch.tensor(x, dtype=torch.float64)[None]).detach().numpy()


def set_statistics(model):
    for module in model.modules():
        if isinstance(module, (nn.BatchNorm1d, nn.BatchNorm2d)):
            nn.init.uniform_(module.running_mean, -0.5, 0.5)
            nn.init.uniform_(module.running_var, 0.5, 2)
            nn.init.uniform_(module.weight, 0.5, 1.5)
            nn.init.uniform_(module.bias, -0.5, 0.5)


def export(name, model, shape):
    model.eval()
    torch.onnx.export(model, torch.zeros(1, *shape), name, opset_version=13, training=torch.onnx.TrainingMode.PRESERVE,
                      do_constant_folding=False)
    record(name, shape, in_double(model))


class Residual(nn.Module):
    def __init__(self):
        super().__init__()
        self.into = nn.Linear(4, 6)
        self.norm = nn.BatchNorm1d(6)
        self.inner = nn.Linear(6, 6)
        self.prelu = nn.PReLU(6)
        self.out = nn.Linear(6, 3)

    def forward(self, x):
        x = nn.functional.leaky_relu(self.norm(self.into(x)), 0.25)
        x = x + self.prelu(self.inner(x))
        return nn.functional.relu(self.out(nn.functional.hardtanh(x)))


def torch_onnx():
    image = nn.Sequential(nn.Conv2d(2, 4, 3, stride=2, padding=1), nn.BatchNorm2d(4), nn.ReLU(), nn.AvgPool2d(2),
                          nn.Conv2d(4, 4, 2, groups=2), nn.ReLU6(), nn.Flatten(), nn.Dropout(0.5), nn.Linear(4, 3))
    set_statistics(image)
    export("torch_image.onnx", image, (2, 8, 8))
    series = nn.Sequential(nn.Conv1d(1, 3, 3, dilation=2, padding=1), nn.ReLU(), nn.MaxPool1d(2), nn.Flatten(),
                           nn.Linear(9, 4), nn.Linear(4, 2))
    export("torch_series.onnx", series, (1, 8))
    residual = Residual()
    set_statistics(residual)
    export("torch_residual.onnx", residual, (4,))


def onnx_file(name, nodes, constants, shape, outputs):
    graph = helper.make_graph(
        nodes, name.split(".")[0], [helper.make_tensor_value_info("input", TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info("output", TensorProto.FLOAT, [1, outputs])],
        [numpy_helper.from_array(value, key) for key, value in constants.items()])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    onnx.checker.check_model(model)
    onnx.save(model, name)


def normal(*shape):
    return rng.normal(size=shape).astype(np.float32)


def collision_avoidance():
    """Like VNN-COMP's ACAS-Xu files: Flatten, Sub, then MatMul, Add and Relu."""
    widths = [5, 6, 6, 5]
    constants = {"mean": normal(1, 5)}
    nodes = [helper.make_node("Flatten", ["input"], ["flat"], axis=1),
             helper.make_node("Sub", ["flat", "mean"], ["h0"])]
    for k in range(3):
        constants[f"W{k}"] = normal(widths[k], widths[k + 1])
        constants[f"b{k}"] = normal(widths[k + 1])
        nodes.append(helper.make_node("MatMul", [f"h{k}", f"W{k}"], [f"m{k}"]))
        nodes.append(helper.make_node("Add", [f"m{k}", f"b{k}"], ["output" if k == 2 else f"a{k}"]))
        if k < 2:
            nodes.append(helper.make_node("Relu", [f"a{k}"], [f"h{k + 1}"]))
    onnx_file("onnx_acas.onnx", nodes, constants, [1, 1, 1, 5], 5)

    def function(x):
        h = x.ravel() - constants["mean"].ravel().astype(float)
        for k in range(3):
            h = h @ constants[f"W{k}"].astype(float) + constants[f"b{k}"].astype(float)
            h = np.maximum(h, 0) if k < 2 else h
        return h

    record("onnx_acas.onnx", (5,), function)


def digits():
    """Like an MNIST model with built-in normalization, channels last as written by TensorFlow, and a Softmax."""
    constants = {"mean": np.float32(0.1307).reshape(1), "deviation": np.float32(0.3081).reshape(1),
                 "kernel": normal(2, 1, 2, 2), "W": normal(8, 3), "b": normal(3), "shape": np.array([-1, 8])}
    nodes = [helper.make_node("Transpose", ["input"], ["planes"], perm=[0, 3, 1, 2]),
             helper.make_node("Sub", ["planes", "mean"], ["centred"]),
             helper.make_node("Div", ["centred", "deviation"], ["scaled"]),
             helper.make_node("Conv", ["scaled", "kernel"], ["features"], auto_pad="SAME_UPPER", strides=[2, 2]),
             helper.make_node("Relu", ["features"], ["active"]),
             helper.make_node("Transpose", ["active"], ["last"], perm=[0, 2, 3, 1]),
             helper.make_node("Reshape", ["last", "shape"], ["flat"]),
             helper.make_node("MatMul", ["flat", "W"], ["product"]),
             helper.make_node("Add", ["product", "b"], ["logits"]),
             helper.make_node("Softmax", ["logits"], ["output"])]
    onnx_file("onnx_digits.onnx", nodes, constants, ["batch", 4, 4, 1], 3)

    def function(x):
        planes = torch.tensor((x.reshape(4, 4) - float(constants["mean"][0])) / float(constants["deviation"][0]))
        h = nn.functional.conv2d(planes[None, None], torch.tensor(constants["kernel"]).double(), stride=2)
        h = torch.relu(h)[0].permute(1, 2, 0).reshape(-1).numpy()
        return h @ constants["W"].astype(float) + constants["b"].astype(float)

    record("onnx_digits.onnx", (4, 4), function)


class Plain(nn.Module):
    def __init__(self, wrap=lambda layer: layer):
        super().__init__()
        self.fc1 = wrap(nn.Linear(3, 5))
        self.fc2 = wrap(nn.Linear(5, 4))
        self.fc3 = nn.Linear(4, 2)

    def forward(self, x):
        return self.fc3(torch.relu(self.fc2(torch.relu(self.fc1(x)))))


def state_dicts():
    for name, wrap in [("torch_spectral_old.pth", torch.nn.utils.spectral_norm),
                       ("torch_spectral_new.pth", torch.nn.utils.parametrizations.spectral_norm),
                       ("torch_weight_norm.pth", torch.nn.utils.weight_norm)]:
        model = Plain(wrap)
        model(torch.randn(8, 3))
        model.eval()
        torch.save(model.state_dict(), name)
        record(name, (3,), in_double(model))
    for name, kind in [("torch_half.pth", torch.float16), ("torch_bfloat16.pth", torch.bfloat16)]:
        model = Plain().to(kind)
        torch.save(model.state_dict(), name)
        record(name, (3,), in_double(model))


def arrays():
    model = Plain().double()
    values = {key: value.detach().numpy() for key, value in model.state_dict().items()}
    in_order = list(values.values())
    weights, biases = in_order[0::2], in_order[1::2]
    np.savez("numpy_named.npz", **values)
    np.savez("numpy_list.npz", *in_order)
    cells = np.empty((1, 3), dtype=object)
    bias_cells = np.empty((1, 3), dtype=object)
    for k in range(3):
        cells[0, k] = weights[k]
        bias_cells[0, k] = biases[k][:, None]
    scipy.io.savemat("scipy_weights.mat", {"weights": cells})  # as LipSDP and ECLipsE
    scipy.io.savemat("scipy_biases.mat", {"weights": cells, "biases": bias_cells}, do_compression=True)
    scipy.io.savemat("scipy_named.mat", {f"{letter}{k + 1}": [weights, biases][i][k]
                                         for k in range(3) for i, letter in enumerate("Wb")})
    for name in ["numpy_named.npz", "numpy_list.npz", "scipy_biases.mat", "scipy_named.mat"]:
        record(name, (3,), in_double(model))

    def without_biases(x):
        for k, w in enumerate(weights):
            x = w @ (np.maximum(x, 0) if k else x)
        return x

    record("scipy_weights.mat", (3,), without_biases)


torch_onnx()
collision_avoidance()
digits()
state_dicts()
arrays()
with open("expected.json", "w") as file:
    json.dump(expected, file, indent=0)
    file.write("\n")
