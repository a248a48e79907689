"""ONNX models as exporters and operator sets write them in different ways, with what every reader decides: training
mode, casts of stored numbers, limits, constants aligned with channels, padded axes, parts of shapes, constants without
a tensor. The same kinds as in tests/nn/onnx_exporters_test.cpp."""
import math
from struct import pack

from onnx_models import field, model, node, tensor, varint

MOST = (2 - 2.0 ** -23) * 2.0 ** 127  # the largest float32


def of_type(name, kind, shape, data):
    """A stored tensor with the field of numbers `data`."""
    return field(5, b"".join(field(1, size) for size in shape) + field(2, kind) + field(8, name) + data)


def with_attribute(kind, inputs, outputs, name, value):
    """A node with an attribute in its stored form."""
    return field(1, b"".join(field(1, i) for i in inputs) + b"".join(field(2, o) for o in outputs) + field(4, kind)
                 + field(5, field(1, name) + value))


STORED = (tensor("w", [2, 2], [1.0, 2.0, 3.0, 4.0]) + tensor("b", [2], [1.0, -2.0]) + tensor("pos", [2], [1.0, 4.0])
          + of_type("yes", 9, [], field(9, b"\1")) + of_type("no", 9, [], field(5, varint(0)))
          + tensor("real", [], [0.0]))
LAYER = node("Gemm", ["x", "w", "b"], ["h"])
GEMM = [1.0, 3.0, 2.0, 4.0, 1.0, -2.0]


def on_row(*nodes, shape=(1, 2)):
    return model([*nodes, STORED], shape)


def training():
    words = ["is in training mode", "model.eval()"]
    inputs = ["h", "b", "b", "b", "pos"]
    dropout = lambda inputs, outputs=("y",), **attributes: on_row(LAYER, node("Dropout", inputs, outputs, **attributes))
    normal = lambda outputs, **attributes: on_row(LAYER, node("BatchNormalization", inputs, outputs, **attributes))
    return [
        (dropout(["h", "", "no"], ["y", "mask"]), GEMM), (dropout(["h", "", ""], ["y", "mask"]), GEMM),
        (dropout(["h", "", "yes"]), words), (dropout(["h", "", "real"]), words), (dropout(["h"], is_test=0), words),
        (dropout(["h"], training_mode=1), words), (dropout(["h"], is_test=1), GEMM),
        (dropout(["h", "", "x"]), ["as an input that must be stored"]),
        (normal(["y"]), None), (normal(["y", "", "", "", ""]), None), (normal(["y", "m", "v", "s", "t"]), words),
        (normal(["y", "m", "v", "s", "t"], is_test=1), None), (normal(["y"], is_test=0), words),
        (normal(["y"], training_mode=1), words)]


def casts():
    def cast(number, to):
        return model([node("Cast", ["d"], ["c"], to=to), node("MatMul", ["x", "c"], ["y"]),
                      tensor("d", [1, 1], [number], 11)], [1, 1])
    words = ["rounds stored numbers", "do_constant_folding"]
    return [(cast(number, to), [number, 0]) for number, to in
            [(0.5, 1), (0.1, 11), (3.0, 7), (-3.0, 6), (2.0 ** 30, 7), (1e20, 11)]] + \
        [(cast(number, to), words) for number, to in
         [(0.1, 1), (0.5, 7), (0.1, 10), (0.5, 10), (1e300, 1), (2.0 ** 31, 7), (0.5, 9), (math.nan, 1), (math.nan, 6),
          (MOST * (1 + 2.0 ** -30), 1)]]


def limits():
    words = ["its minimum or maximum is not a number within 2^127"]
    clip = lambda **attributes: on_row(LAYER, node("Clip", ["h"], ["y"], **attributes))
    both = lambda least: on_row(LAYER, node("Clip", ["h", "least"], ["y"]), tensor("least", [2], least))
    return [(clip(min=-MOST), GEMM), (clip(max=MOST), GEMM), (clip(max=math.inf), GEMM),
            (clip(min=-math.inf, max=math.inf), GEMM), (clip(min=MOST), words), (clip(min=math.inf), words),
            (clip(max=-math.inf), words), (clip(max=-MOST), words), (clip(max=math.nan), words),
            (clip(min=math.nan), words), (both([-math.inf, -math.inf]), GEMM), (both([-math.inf, 0.0]), words),
            (on_row(LAYER, node("Clip", ["h", "h"], ["y"], min=0.0)), ["as an input that must be stored"])]


def channels():
    """x [1, 4] as an image [1, 2, 2]: a constant of 2 numbers fits the channels as well as the last axis."""
    words = ["aligns its constant with other axes than the last ones", "operator set 7 or newer"]
    def image(kind, versions=b"", constant=("c", [2], [1.0, 5.0]), **attributes):
        return model([node("Reshape", ["x", "sizes"], ["i"]), node(kind, ["i", "c"], ["y"], **attributes),
                      tensor("sizes", [3], [1, 2, 2], 7), tensor(*constant)], [1, 4]) + versions
    version = lambda number, domain="": field(8, field(1, domain) + field(2, number))
    identity = [float(i == k) for i in range(4) for k in range(4)]
    found = [(image("Add", broadcast=1, axis=axis), identity + [1, 5, 1, 5]) for axis in (2, -1)]
    found += [(image(kind, broadcast=1, axis=axis), words) for kind in ("Add", "Sub", "Mul", "Div", "PRelu")
              for axis in (0, 1, -2)]
    found += [(image("Add", axis=1, constant=("c", [1], [1.0])), identity + [1] * 4),
              (image("Add", axis=0, constant=("c", [1, 1, 2], [1.0, 5.0])), identity + [1, 5, 1, 5]),
              (image("Add", version(6)), identity + [1, 5, 1, 5]), (image("PRelu"), None),
              (image("PRelu", version(7)), None), (image("PRelu", version(6)), words),
              (image("PRelu", version(1, "ai.onnx")), words), (image("PRelu", version(6, "other")), None),
              (image("PRelu", version(6) + version(9)), None), (image("PRelu", version(6), axis=2), None)]
    return found


def padded():
    def pad(*axes):
        return model([node("Pad", ["x", "pads", "", "axes"], ["y"]), tensor("pads", [4], [0, 1, 0, 0], 7),
                      tensor("axes", [len(axes)], axes, 7)], [1, 2])
    words = ["its axes are not all axes of its input in order", "state pads for every axis"]
    three = [0, 0, 1, 0, 0, 1, 0, 0, 0]
    return [(pad(0, 1), three), (pad(-2, -1), three), (pad(1, 0), words), (pad(1), words), (pad(0, 1, 1), words),
            (pad(0, 2), ["axis 2 does not exist"])]


def shapes_and_constants():
    """As torch.onnx writes x.view(x.shape[0], -1) and h + torch.tensor([4.0, 5.0])."""
    whole = lambda name, value: with_attribute("Constant", [], [name], "value_ints",
                                               b"".join(field(8, k) for k in value))
    floats = lambda name, data: with_attribute("Constant", [], [name], "value_floats", data)
    def viewed(shape, rest, *more, x="x", **attributes):
        return model([node("Shape", [x], ["n"], **attributes), whole("rest", rest),
                      node("Concat", ["n", "rest"], ["s"], axis=0), node("Reshape", ["x", "s"], ["f"]),
                      *(more or [node("MatMul", ["f", "w"], ["y"])]), STORED], shape)
    more = [node("MatMul", ["f", "w"], ["h"]), floats("c", field(7, pack("<2f", 4, 5))),
            node("Constant", [], ["two"], value_float=2.0), node("Add", ["h", "c"], ["a"]),
            node("Mul", ["a", "two"], ["y"])]
    single = b"".join(varint(7 << 3 | 5) + pack("<f", number) for number in (4, 5))
    plain, refused = [1, 3, 2, 4, 0, 0], ["its shape does not fit its input"]
    found = [(viewed([1, 2], [-1], *more, start=0, end=1), [2, 6, 4, 8, 8, 10]),
             (viewed([1, 2], [2], start=0, end=-1), plain), (viewed([1, 2], [], start=-9, end=9), plain),
             (viewed([1, 1, 2], [-1], start=1, end=2), plain), (viewed([1, 2], [1, 2], start=2, end=1), ["Concat"]),
             (viewed([1, 2], [2], start=1), refused), (viewed([1, 2], [-1], end=-1), plain),
             (viewed([1, 1, 2], [], x="w"), refused), (viewed([1, 4], [1], *[
                 node("Neg", ["f"], ["y"])], x="w"), None)]
    axis = lambda value: on_row(LAYER, with_attribute("Constant", [], ["k"], "value_int", field(3, value)),
                                node("Unsqueeze", ["h", "k"], ["u"]), node("Flatten", ["u"], ["y"], axis=2))
    constant = lambda made: on_row(LAYER, made, node("Add", ["h", "c"], ["y"]))
    found += [(axis(0), GEMM), (axis(3), ["axis 3 does not exist"]), (axis(2 ** 60), ["value_int is out of range"]),
              (constant(floats("c", single)), [1, 3, 2, 4, 5, 3]),
              (constant(floats("c", field(7, b"\0\0\0"))), ["does not fit its input"]),
              (constant(node("Constant", [], ["c"], value_int=2)), ["float"]),
              (constant(node("Constant", [], ["c"])), ["holds no tensor"]),
              (constant(node("Constant", [], ["c"], value_string="4")), ["holds no tensor"])]
    root, one, half = (node("Constant", [], [name], value_float=number)
                       for name, number in (("root", math.sqrt(2)), ("one", 1.0), ("half", 0.5)))
    found += [(on_row(LAYER, root, one, half, node("Div", ["h", "root"], ["q"]), node("Erf", ["q"], ["e"]),
                      node("Add", ["e", "one"], ["p"]), node("Mul", ["h", "p"], ["g"]),
                      node("Mul", ["g", "half"], ["t"]), node("MatMul", ["t", "w"], ["y"])), None)]
    return found


def others():
    several = model([node("Gemm", ["x", "w"], ["y"]), STORED], [4, 2])
    domain = on_row(LAYER, field(1, field(1, "h") + field(2, "y") + field(4, "Relu") + field(7, "com.microsoft")))
    damaged = on_row(LAYER, node("Neg", ["h"], ["y"])) + b"\0\1"  # field number 0
    return [(damaged, ["protobuf field"]),
            (several, ["takes 2 inputs, but gets the shape [4, 2]"]), (domain, ["operator set"])]


def exporter_models():
    """Yields (name, model, decision): the numbers of its only layer, weights before biases; None: it is read; texts: it
    is refused, with these words."""
    for kind in (training, casts, limits, channels, padded, shapes_and_constants, others):
        for k, (data, decision) in enumerate(kind()):
            yield f"{kind.__name__}{k}", data, decision
