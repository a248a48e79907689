"""One network in all formats of weight files, as written by PyTorch, ONNX exporters and the authors of networks."""
import io
import pickle
import struct
import sys
import types
import zipfile
from collections import OrderedDict


def layers(sizes, generator):
    """(name, rows, biases) in float32."""
    number = lambda: struct.unpack("<f", struct.pack("<f", generator.uniform(-1, 1)))[0]
    found = [(f"fc{k + 1}", [[number() for _ in range(inputs)] for _ in range(outputs)],
              [number() for _ in range(outputs)])
             for k, (inputs, outputs) in enumerate(zip(sizes, sizes[1:]))]
    found[0][1][0][0] = JUST_ABOVE_ONE
    return found


JUST_ABOVE_ONE = 1 + 2.0 ** -23  # as float32


def flat(rows):
    return [x for row in rows for x in row]


def raw(numbers):
    return struct.pack(f"<{len(numbers)}f", *numbers)


# --- PyTorch -------------------------------------------------------------------------------------------------------

class Storage:
    def __init__(self, key, numbers):
        self.key, self.numbers = key, numbers


class Tensor:
    def __init__(self, storage, shape, strides):
        self.storage, self.shape, self.strides = storage, shape, strides

    def __reduce__(self):
        arguments = self.storage, 0, self.shape, self.strides, False, OrderedDict()
        return sys.modules["torch._utils"]._rebuild_tensor_v2, arguments


class Pickler(pickle.Pickler):
    def persistent_id(self, value):
        if isinstance(value, Storage):
            return "storage", sys.modules["torch"].FloatStorage, value.key, "cpu", len(value.numbers)
        return None


def torch_modules():
    """Names to which the pickles refer; torch itself is not needed."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")
    torch.FloatStorage = type("FloatStorage", (), {"__module__": "torch", "__qualname__": "FloatStorage"})

    def _rebuild_tensor_v2():
        raise NotImplementedError
    _rebuild_tensor_v2.__module__, _rebuild_tensor_v2.__qualname__ = "torch._utils", "_rebuild_tensor_v2"
    utils._rebuild_tensor_v2 = _rebuild_tensor_v2
    sys.modules.update({"torch": torch, "torch._utils": utils})


def state_dict(network):
    """One matrix is a transposed view."""
    state, storages = OrderedDict(), []
    for k, (name, rows, biases) in enumerate(network):
        shape = (len(rows), len(rows[0]))
        strides = (1, shape[0]) if k == 0 else (shape[1], 1)
        storages.append(Storage(str(2 * k), [rows[i][j] for j in range(shape[1]) for i in range(shape[0])] if k == 0
                                else flat(rows)))
        state[f"{name}.weight"] = Tensor(storages[-1], shape, strides)
        storages.append(Storage(str(2 * k + 1), biases))
        state[f"{name}.bias"] = Tensor(storages[-1], (len(biases),), (1,))
    return state, storages


def pickled(value):
    out = io.BytesIO()
    Pickler(out, 2).dump(value)
    return out.getvalue()


def pth_zip(network):
    torch_modules()
    state, storages = state_dict(network)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("archive/data.pkl", pickled({"model": state, "epoch": 3}))
        for storage in storages:
            archive.writestr(f"archive/data/{storage.key}", raw(storage.numbers))
    return out.getvalue()


def pth_legacy(network):
    torch_modules()
    state, storages = state_dict(network)
    parts = [pickle.dumps(value, 2) for value in (0x1950a86a20f9469cfc6c, 1001, {"little_endian": True})]
    parts += [pickled(state), pickle.dumps([storage.key for storage in storages], 2)]
    return b"".join(parts + [struct.pack("<q", len(s.numbers)) + raw(s.numbers) for s in storages])


# --- ONNX ----------------------------------------------------------------------------------------------------------

def varint(value):
    return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + varint(value >> 7)


def field(number, value):
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


def integers(name, values):
    """A stored tensor of int64."""
    stored = struct.pack(f"<{len(values)}q", *values)
    return field(5, field(1, len(values)) + field(2, 7) + field(8, name) + field(9, stored))


def node(kind, inputs, outputs, **attributes):
    """Attributes are an integer or a list of them."""
    message = b"".join(field(1, i) for i in inputs) + b"".join(field(2, o) for o in outputs) + field(4, kind)
    for name, value in attributes.items():
        numbers = [varint(v % 2 ** 64) for v in (value if isinstance(value, list) else [value])]
        listed = isinstance(value, list)
        message += field(5, field(1, name) + b"".join(varint((8 if listed else 3) << 3) + n for n in numbers)
                         + field(20, 7 if listed else 2))
    return field(1, message)


def sorting(op, k, current, width, change):
    """Returns the nodes of one sorted layer as exported by PyTorch, and the name of their result; `change` gives other
    arguments of single nodes, by their kind."""
    def made(kind, inputs, outputs, **attributes):
        inputs, attributes = change.get(kind, lambda i, a: (i, a))(inputs, attributes)
        return node(kind, inputs, outputs, **attributes)
    name, _, size = op.partition(":")
    own = [f"{letter}{k}" for letter in "pqcdirs"]
    p, q, c, d, i, r, s = own
    if size == "halves":
        nodes = integers(f"half{k}", [width // 2] * 2) + made("Split", [current, f"half{k}"], [p, q], axis=1)
        nodes += made("Max", [p, q], [c]) + made("Min", [p, q], [d])
        return nodes + made("Concat", [c, d], [f"h{k}"], axis=-1), f"h{k}"
    group = 2 if size == "pairs" else int(size)
    nodes = integers(f"groups{k}", [1, -1, group]) + made("Reshape", [current, f"groups{k}"], [r])
    if size == "pairs":
        nodes += made("ReduceMax", [r], [c], axes=[-1], keepdims=0) + made("ReduceMin", [r], [d], axes=[2], keepdims=0)
        return nodes + made("Concat", [c, d], [f"h{k}"], axis=1), f"h{k}"
    nodes += integers(f"size{k}", [group]) + integers(f"flat{k}", [1, -1])
    nodes += made("TopK", [r, f"size{k}"], [s, i], axis=-1, largest=int(name == "descending"))
    return nodes + made("Reshape", [s, f"flat{k}"], [f"h{k}"]), f"h{k}"


def onnx(network, activation="Relu", first=None, attributes=b"", change={}):
    """`activation` by its node, or MaxMin and GroupSort by their name in chains, and "descending:SIZE".
    `first`: activation after the first layer, if different."""
    graph, current = b"", "x"
    for k, (name, rows, biases) in enumerate(network):
        weights = [f"{name}.weight", f"{name}.bias"]
        as_stored = flat(rows) if k % 2 == 0 else flat(zip(*rows))
        dims = (len(rows), len(rows[0])) if k % 2 == 0 else (len(rows[0]), len(rows))
        graph += field(5, b"".join(field(1, d) for d in dims) + field(2, 1) + field(8, weights[0])
                       + field(9, raw(as_stored)))
        graph += field(5, field(1, len(biases)) + field(2, 1) + field(8, weights[1]) + field(9, raw(biases)))
        if k % 2 == 0:
            graph += node("Gemm", [current] + weights, [f"y{k}"], transB=1)
        else:
            graph += node("MatMul", [current, weights[0]], [f"m{k}"]) + node("Add", [f"m{k}", weights[1]], [f"y{k}"])
        current = f"y{k}"
        if k + 1 == len(network):
            continue
        if ":" in activation:
            nodes, current = sorting(activation, k, current, len(rows), change)
            graph += nodes
        elif activation == "SiLU":  # as PyTorch exports it
            graph += node("Sigmoid", [current], [f"s{k}"]) + node("Mul", [current, f"s{k}"], [f"h{k}"])
            current = f"h{k}"
        else:
            graph += field(1, field(1, current) + field(2, f"h{k}")
                           + field(4, first if first and k == 0 else activation) + attributes)
            current = f"h{k}"
    graph += field(11, field(1, "x")) + field(12, field(1, current))
    return field(1, 7) + field(2, "test") + field(7, graph)


# --- C source ------------------------------------------------------------------------------------------------------

def c_source(network):
    """Matrices as [inputs][outputs]. A literal with f is rounded once, from the decimal: one of them is just above the
    midpoint between two floats, to which it would be rounded as a double."""
    declared, values = "", ""
    for name, rows, biases in network:
        declared += f"  float {name}_weight[{len(rows[0])}][{len(rows)}];\n  float {name}_bias[{len(rows)}];\n"
        literal = lambda x: "1.0000000596046447754f" if x == JUST_ABOVE_ONE else f"{x!r}f"
        columns = ",".join("{" + ",".join(map(literal, column)) + "}" for column in zip(*rows))
        values += f"  .{name}_weight = {{{columns}}},\n  .{name}_bias = {{{','.join(f'{x!r}' for x in biases)}}},\n"
    return (f"/* weights */\n#include <x.h>\nstruct net {{\n{declared}}};\n"
            f"static const struct net weights_it = {{\n{values}}};\n").encode()
