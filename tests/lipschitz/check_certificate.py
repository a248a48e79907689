#!/usr/bin/env python3
"""A second checker of certificates, in another language and written from the mathematics: exact integers, standard
library only; trees of parts also in double with numpy, where it is installed. It shares no line with the C++ checker,
reads the weight files itself, and must accept and reject the same certificates.

    check_certificate.py CERTIFICATE NET | --phi F --rho F  [--key KEY] [--order A,B,C | PART=A,B,C]
        [--activation OP,...]

Exit 0: accepted; 1: rejected, with the reason; 2: usage; 3: a weight file or network.toml that cannot be read, or a
file that is no certificate.

Every finite double is an integer times a power of two. A matrix is held as rows of integers with one exponent for all
of them, so that sums and products of matrices are exact.
"""
import functools
import hashlib
import json
import math
import pickle
import re
import struct
import sys
import tomllib
from collections import OrderedDict
from fractions import Fraction
from io import BytesIO
from itertools import islice
from operator import mul
from pathlib import Path

import mat_file
import named_arrays
import nnet_file
import onnx_graphs
from effective_weights import Tensor, with_effective_weights

try:
    import parts_in_double
except ImportError:  # without numpy
    parts_in_double = None

SCHEMA = "swarmcert/certificate/1"
STATEMENT = (
    "The functions are the operations listed under chain, in that order, with the weights stored in the files named by "
    "sha256, rounded to float32 where `as` says so: linear is W x + b; of each number t, relu is the positive part, "
    "tanh and sigmoid, 1 / (1 + e^-t), are the functions of these names, softplus is ln(1 + e^t), elu is max(0, t) + "
    "min(0, e^t - 1), selu is 1.0507009873554805 max(0, t) + 1.0507009873554805 * 1.6732632423543772 min(0, e^t - 1), "
    "silu is t / (1 + e^-t), gelu is t/2 (1 + erf(t / sqrt 2)); clamp is the input clamp of network.toml. Where "
    "samples are named, they were reproduced up to largest_deviation when this was written; checking does not repeat "
    "that. Every bound holds in exact arithmetic: |f(x) - f(y)| <= upper |x - y| for all x and y that differ in the "
    "block only, and |f(x) - f(y)| >= lower |x - y| at the witness; where the domain is box, for x and y in the box. "
    "So |df| <= the sum of upper |dx_block| over blocks that make up the input. With a scale, |x - y|^2 is the sum of "
    "((x_k - y_k) / scale_k)^2. In a set function one neighbour moves from x to y, whatever the number and the places "
    "of the others; where neighbours are listed, with at most so many of each kind, the moving one included, all in "
    "the box, and the ground's input where there is one. Laws hold for the neighbours listed and the ground's input "
    "where there is one, in the box where their domain is box: all_stacked, |df| <= upper sqrt(sum |dx_j|^2); all_max, "
    "|df| <= upper max |dx_j|; own_state, |df| <= upper |dx| where the vehicle's own state moves by dx. Values hold "
    "for inputs in the box, or in the input clamp where their domain is clamp, with up to as many neighbours of the "
    "kind as listed and the ground's input where there is one: lower <= f <= upper, and |df| <= jump where one more "
    "neighbour comes or goes, whatever the others are, in exact arithmetic; and |g - f| <= float32_error for each g "
    "that float32 arithmetic may give, whose inputs after the clamp are off by at most input_error: sums of products "
    "in any order, fused or not, each operation rounded to nearest.")
# Added for networks with a layer that is sorted.
SORTING_STATEMENT = (
    " Of the numbers t_1, t_2, ... of a layer, groupsort:k sorts each k side by side, the smallest first; "
    "maxmin:halves, of 2 h numbers, is max(t_i, t_(i+h)) for i = 1 .. h and then min(t_i, t_(i+h)); "
    "maxmin:pairs is max(t_(2i-1), t_(2i)) for i = 1 .. h and then min(t_(2i-1), t_(2i)).")
# Added for networks with a skip connection past an activation other than ReLU.
KEEPING_STATEMENT = (
    " tanh:n, and so with other names, is that function of each of the first n numbers of a layer and leaves the "
    "others as they are.")
# Added for networks of rotation invariants.
INVARIANTS_STATEMENT = (
    " A set function takes of each neighbour its relative position p in m and velocity v in m/s, whose vertical "
    "components are p_z and v_z, and of the vehicle -z in m and -v in m/s; phi sees their invariants: of a neighbour "
    "|p_xy|, 3/2 p_z, |v_xy|, 3/2 v_z, |p_xy + v_xy / 2|, and the ground's phi -z, |v_xy|, -v_z. So the input clamp is "
    "one of invariants, and phi alone is a function of them.")
# Added for networks that are silent in some compositions.
SILENT_STATEMENT = (
    " Among these neighbours > vehicle, as many of each kind and no others, the set functions of that kind of vehicle "
    "are 0. Bounds and laws hold while the neighbours stay the same, lower bounds at witnesses among other neighbours "
    "than these. Ranges hold this 0, and jumps bound the steps as well by which one neighbour that comes or goes makes "
    "or ends such a composition, while all are in the box or clamp: ")
# The map to the invariants of a neighbour is 3/2-Lipschitz: the three norms change by at most the square root of the
# largest eigenvalue of I + (1, 1/2)' (1, 1/2), which is 1 + 1 + 1/4. The map for the ground is 1-Lipschitz.
SLOPE_OF_INVARIANTS, SLOPE_OF_GROUND_INVARIANTS = Fraction(3, 2), Fraction(1)


# Activations by their name in a chain, with their steepest slope: slopes are in [0, steepest] if the activation is
# monotone, else in [1 - steepest, steepest], because s(t) - t / 2 is even.
MONOTONE = {"relu": Fraction(1), "tanh": Fraction(1), "sigmoid": Fraction(1, 4), "softplus": Fraction(1),
            "elu": Fraction(1),
            # at least 1.0507009873554805 * 1.6732632423543772
            "selu": Fraction(0x1c212cc640f031, 2 ** 52)}
# Operations that act on whole layers and are 1-Lipschitz; the width of a layer must be a multiple of the number.
SORTING = {"maxmin:halves": 2, "maxmin:pairs": 2, **{f"groupsort:{k}": k for k in range(2, 65)}}
STEEPEST = {**MONOTONE, "silu": 1 + Fraction(0x1999, 2 ** 16), "gelu": 1 + Fraction(0x211, 2 ** 12),
            **dict.fromkeys(SORTING, Fraction(1))}
# Enclosure of the slope 1 of entries that an activation leaves unchanged, for bounds on a box.
KEPT_SLOPES = (1 - Fraction(1, 2 ** 24), Fraction(1))


class Rejected(Exception):
    pass


class BadInput(Exception):
    """A weight file, network.toml or option that is invalid or contradicts another one."""


def require(condition, reason):
    if not condition:
        raise Rejected(reason)


def require_input(condition, reason):
    """Replaces `assert`, which `python3 -O` removes: the checker must refuse invalid input in every mode."""
    if not condition:
        raise BadInput(reason)


def f32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def f32_of(decimal):
    """Rounds a decimal to float32 in one step. Via double it would be rounded twice, which matters halfway between two
    floats."""
    double = float(decimal)
    near = f32(double)
    if near == double or math.isinf(near) or abs(double) < 2.0 ** -200:
        return near
    (bits,) = struct.unpack("<i", struct.pack("<f", near))
    around = [struct.unpack("<f", struct.pack("<i", b))[0] for b in (bits - 1, bits, bits + 1)
              if b & 0x7fffffff < 0x7f800000]
    return min(around, key=lambda x: (abs(Fraction(x) - Fraction(decimal)), x != near))


# --- exact numbers -------------------------------------------------------------------------------------------------

def dyadics(values):
    """Returns doubles as integers times one power of two: (integers, exponent)."""
    ratios = [x.as_integer_ratio() for x in values]
    exponent = -max((d.bit_length() - 1 for _, d in ratios), default=0)
    return [n << (-exponent - d.bit_length() + 1) for n, d in ratios], exponent


class Matrix:
    """rows[i][j] * 2^exponent."""

    def __init__(self, rows, exponent):
        self.rows, self.exponent = rows, exponent

    @staticmethod
    def of(values, columns):
        integers, exponent = dyadics(values)
        return Matrix([integers[i:i + columns] for i in range(0, len(integers), columns)], exponent)

    def transposed(self):
        return Matrix([list(c) for c in zip(*self.rows)], self.exponent)

    def __matmul__(self, other):
        columns = list(zip(*other.rows))
        return Matrix([[sum(map(mul, r, c)) for c in columns] for r in self.rows], self.exponent + other.exponent)

    def fraction(self, i, j):
        return self.rows[i][j] * power(self.exponent)


def power(exponent):
    return Fraction(2) ** exponent


def shifted(integer, by):
    """integer * 2^by, which must be an integer."""
    return integer << by if by >= 0 else integer >> -by


# --- JSON ----------------------------------------------------------------------------------------------------------

PLAIN_HEX_FLOATS = re.compile(r"(0x[0-9a-f](\.[0-9a-f]{1,13})?p[+-][0-9]{1,4} )*"
                              r"0x[0-9a-f](\.[0-9a-f]{1,13})?p[+-][0-9]{1,4}")
SIGNED_HEX_FLOAT = re.compile(r"-?0x[0-9a-f](\.[0-9a-f]{1,13})?p[+-][0-9]{1,4}")
CONFLICTING = re.compile("[0-9]{1,9}[+-]")
HEX_FLOAT = re.compile(r"-?0[xX](?=\.?[0-9a-fA-F])([0-9a-fA-F]*)(?:\.([0-9a-fA-F]*))?[pP]([+-]?[0-9]{1,6})")


def hex_float(text):
    require(isinstance(text, str), "a hex float is not text")
    match = HEX_FLOAT.fullmatch(text)
    require(match is not None, f"{text!r} is not a hex float")
    whole, fraction, exponent = match.groups()
    mantissa = int(whole + (fraction or ""), 16)
    if mantissa == 0:
        return 0.0
    require(abs(int(exponent)) < 5000 and len(whole + (fraction or "")) < 1000, f"{text!r} is not finite")
    exact = mantissa * power(int(exponent) - 4 * len(fraction or ""))
    try:
        value = exact.numerator / exact.denominator
    except OverflowError:
        raise Rejected(f"{text!r} is not finite") from None
    require(Fraction(value) == exact, f"{text!r} is not a double")
    return -value if text[0] == "-" else value


def listed(array):
    require(isinstance(array, list), "an array is missing")
    return array


def hex_floats(array):
    return [hex_float(text) for text in listed(array)]


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def integer(value):
    require(is_number(value), "a number is missing")
    return int(value)


def number(decimal, text, where):
    value = hex_float(text)
    require(is_number(decimal) and float(decimal) == value, f"{where}: decimal and hex notation differ")
    require(value >= 0, f"{where}: negative")
    return value


def require_keys(value, keys, where):
    require(isinstance(value, dict), f"{where} is not an object")
    for key in sorted(set(value) - set(keys)):
        raise Rejected(f"{where} has unknown field {key}")
    for key in sorted(set(keys) - set(value)):
        raise Rejected(f"{where} lacks field {key}")


def encode(value):
    """Returns the bytes hashed by content_sha256, which do not depend on white space or on the order of members."""
    if value is None:
        return b"n"
    if isinstance(value, bool):
        return b"t" if value else b"f"
    if is_number(value):
        return b"d%016x" % struct.unpack("<Q", struct.pack("<d", float(value)))[0]
    if isinstance(value, str):
        raw = value.encode()
        return b"s%d:" % len(raw) + raw
    if isinstance(value, list):
        return b"[" + b"".join(map(encode, value)) + b"]"
    members = sorted((key.encode(), member) for key, member in value.items())
    return b"{" + b"".join(b"s%d:" % len(k) + k + encode(m) for k, m in members) + b"}"


def content_sha256(document):
    return hashlib.sha256(encode({k: v for k, v in document.items() if k != "content_sha256"})).hexdigest()


# --- weight files --------------------------------------------------------------------------------------------------

class Layer:
    """`kept`: number of outputs, the last ones, that the activation behind the layer leaves unchanged."""

    def __init__(self, name, outputs, inputs, weights, biases, kept=0):
        self.name, self.outputs, self.inputs, self.weights, self.biases = name, outputs, inputs, weights, biases
        self.kept = kept

    def rounded(self):
        return Layer(self.name, self.outputs, self.inputs, list(map(f32, self.weights)), list(map(f32, self.biases)),
                     self.kept)


def identity_layer(name, size):
    return Layer(name, size, size, [float(i == j) for i in range(size) for j in range(size)], [0.0] * size)


def numbered_before(a, b):
    """Returns whether the names first differ in a number and the number of `a` is smaller."""
    for x, y in zip(natural(a), natural(b)):
        if x != y:
            return isinstance(x, int) and isinstance(y, int) and x < y
    return False


def orders_of(layers, by_number, used=()):
    """Yields every order in which the inputs of each layer fit the outputs of the previous one and, with `by_number`,
    that agrees with the numbers in the names."""
    if len(used) == len(layers):
        yield [layers[i] for i in used]
    for i, layer in enumerate(layers):
        if i in used or used and layer.inputs != layers[used[-1]].outputs:
            continue
        if by_number and any(j not in used and numbered_before(layers[j].name, layer.name) for j in range(len(layers))):
            continue
        yield from orders_of(layers, by_number, used + (i,))


def in_order(layers, listing, stated):
    """Returns the layers in the order of evaluation. `listing`: meaning of their order in the file, "evaluation",
    "registration" or "none"."""
    if stated:
        by_name = {layer.name: layer for layer in layers}
        require_input(sorted(stated) == sorted(by_name), "the order does not name every layer once")
        result = [by_name[name] for name in stated]
        require_input(listing != "evaluation" or result == layers, "the file states another order")
        return result
    if listing == "evaluation":
        return layers
    result = sorted(layers, key=lambda layer: natural(layer.name))
    is_total = all(numbered_before(a.name, b.name) for a, b in zip(result, result[1:]))
    is_listed = listing == "none" or result == layers
    if is_total and is_listed and all(a.outputs == b.inputs for a, b in zip(result, result[1:])):
        return result
    fitting = list(islice(orders_of(layers, False), 2))
    require_input(fitting, "no order of the layers fits")
    if len(fitting) == 1:
        return fitting[0]
    by_number = list(islice(orders_of(layers, True), 2))
    require_input(len(by_number) == 1 and (listing == "none" or by_number[0] == layers),
                  "the order of the layers is not stated")
    return by_number[0]


MOST_NUMBERS, MOST_TENSORS = 2 ** 25, 4096


def layers_of(tensors):
    """Returns the layers of named tensors, W as [outputs x inputs], and the precision of their numbers."""
    require_input(len(tensors) <= MOST_TENSORS, "the file holds more than 4096 tensors")
    by_name = {tensor.name: tensor for tensor in tensors}
    require_input(len(by_name) == len(tensors), "a tensor appears twice")
    require_input(any(name.rpartition(".")[2] == "weight" for name in by_name), "the file holds no layer")
    layers, precision, total = [], None, 0
    for name, tensor in by_name.items():
        layer, _, part = name.rpartition(".")
        require_input(part in ("weight", "bias"), f"{name} is neither the weight nor the bias of a linear layer")
        weight = f"{layer}.weight" if layer else "weight"
        require_input(weight in by_name, f"{name} is a bias without its weight: {weight} is missing")
        require_input(tensor.precision is not None,
                      f"{name}: weights must be float16, bfloat16, float32 or float64; model.float() before saving")
        precision = precision or tensor.precision
        require_input(tensor.precision == precision, f"{name} is {tensor.precision}, and one file has one type, here "
                      f"{precision}; model.float() or model.double() before saving")
        owner = by_name[weight].shape
        require_input(len(owner) == 2 and min(owner) > 0,
                      f"{weight} of shape {owner}: a linear layer's weight has two dimensions, [outputs, inputs]")
        require_input(part == "weight" or tensor.shape == owner[:1], f"{name} does not fit {weight} of shape {owner}")
        total += math.prod(tensor.shape)
    require_input(total <= 2 * MOST_NUMBERS, "the network has more than 2^25 numbers")

    def numbers(tensor):
        result = tensor.numbers()
        require_input(len(result) == math.prod(tensor.shape), f"{tensor.name} does not fit its shape {tensor.shape}")
        require_input(all(map(math.isfinite, result)),
                      f"{tensor.name}: a weight is not finite; take an earlier checkpoint")
        return result
    for name, tensor in by_name.items():
        layer, _, part = name.rpartition(".")
        if part == "weight":
            bias = by_name.get(f"{layer}.bias" if layer else "bias")
            layers.append(Layer(layer, *tensor.shape, numbers(tensor),
                                numbers(bias) if bias else [0.0] * tensor.shape[0]))
    return layers, precision


class Weights:
    def __init__(self, tensors, data, listing, order):
        """`listing`: meaning of the order of the tensors, see in_order()."""
        tensors, are_computed = with_effective_weights(tensors)
        self.layers, precision = layers_of(tensors)
        self.layers = in_order(self.layers, listing, order)
        require_input(all(a.outputs == b.inputs for a, b in zip(self.layers, self.layers[1:])),
                      "a layer does not take what the one before gives")
        self.precision = "float32" if precision in ("float16", "bfloat16") else precision
        if are_computed and not all(tensor.is_float32 for tensor in tensors):
            self.precision = "float64"
        # Activations of all layers but the last. None: the file does not state them. A file that states the order of
        # the layers states ReLU unless its reader finds other activations.
        self.activations = ["relu"] * (len(self.layers) - 1) if listing == "evaluation" else None
        self.sha256 = hashlib.sha256(data).hexdigest()

    def between(self):
        return ["relu"] * (len(self.layers) - 1) if self.activations is None else self.activations

    def is_relu(self):
        return set(self.between()) <= {"relu"}

    def state(self, names):
        """Sets the activations: one name for all layers, or one for each layer but the last, or one for each layer, in
        which case an identity layer is appended."""
        if len(names) == 1:
            names = names * (len(self.layers) - 1)
        written = [onnx_graphs.written_with_relu(name) for name in names]
        require_input(all(name in STEEPEST or terms for name, terms in zip(names, written)),
                      f"an activation of {names} is unknown")
        if self.activations is not None and len(self.layers) > 1:
            require_input(names == self.activations, f"others are stated already: {self.activations}")
            return
        require_input(len(names) in (len(self.layers) - 1, len(self.layers)),
                      f"{len(names)} activations for {len(self.layers)} layers")
        require_input(all(layer.outputs % SORTING.get(name, 1) == 0 for name, layer in zip(names, self.layers)),
                      "the outputs of a layer are no multiple of the group's size")
        if len(names) == len(self.layers):
            name = numbered = f"layer{len(self.layers) + 1}"
            while any(layer.name == name for layer in self.layers):
                name = f"{numbered}_{name}"
            self.layers.append(identity_layer(name, self.layers[-1].outputs))
        self.activations = names
        if any(written):
            self.write_with_relu(written)

    def write_with_relu(self, written):
        """Replaces the activations for which `written` has terms by ReLU."""
        names = [layer.name for layer in self.layers]
        layers = [(layer.inputs, [dict(enumerate(layer.weights[i * layer.inputs:(i + 1) * layer.inputs]))
                                  for i in range(layer.outputs)], layer.biases) for layer in self.layers]
        try:
            found, self.activations, precision = onnx_graphs.rewritten(layers, self.activations, written)
        except onnx_graphs.Refused as refused:
            raise BadInput(str(refused)) from None
        self.layers = []
        for name, (_, inputs, rows, biases, _) in zip(names, found):
            weights = [row.get(column, 0.0) for row in rows for column in range(inputs)]
            self.layers.append(Layer(name, len(rows), inputs, weights, biases))
        if self.precision == "float32":
            self.precision = precision

    def round_to_float32(self):
        self.layers = [layer.rounded() for layer in self.layers]
        self.precision = "float32"


def unpack(precision, data):
    if precision == "float16":
        return list(struct.unpack(f"<{len(data) // 2}e", data))
    if precision == "bfloat16":
        wide = b"".join(b"\0\0" + data[i:i + 2] for i in range(0, len(data), 2))
        return list(struct.unpack(f"<{len(data) // 2}f", wide))
    return list(struct.unpack(f"<{len(data) // (4 if precision == 'float32' else 8)}"
                              f"{'f' if precision == 'float32' else 'd'}", data))


# Bytes of the numbers of PyTorch's storages; those without a precision are not read as weights.
STORAGES = {"FloatStorage": 4, "DoubleStorage": 8, "HalfStorage": 2, "BFloat16Storage": 2, "LongStorage": 8,
            "IntStorage": 4, "ShortStorage": 2, "CharStorage": 1, "ByteStorage": 1, "BoolStorage": 1}


class StorageType:
    def __init__(self, name):
        require_input(name in STORAGES, f"torch.{name}: numbers of this type are not read; model.float() before saving")
        self.bytes = STORAGES[name]
        self.precision = {"FloatStorage": "float32", "DoubleStorage": "float64", "HalfStorage": "float16",
                          "BFloat16Storage": "bfloat16"}.get(name)


class View:
    """A tensor of a pickle: a view of a storage."""

    def __init__(self, storage, offset, shape, strides, *_):
        self.storage, self.offset, self.shape, self.strides = storage, offset, shape, strides
        require_input(all(type(n) is int and n >= 0 for n in (offset, *shape, *strides)) and len(shape) == len(strides),
                      "the shape of a tensor is damaged")
        require_input(math.prod(shape) <= MOST_NUMBERS, "a tensor has more than 2^25 numbers")

    def numbers(self, data):
        """Returns the numbers in row-major order from the bytes of the storage."""
        flat = unpack(self.storage[0].precision, data)
        indices = [self.offset]
        for size, stride in zip(self.shape, self.strides):
            indices = [i + k * stride for i in indices for k in range(size)]
        return [flat[i] for i in indices]


class TorchUnpickler(pickle.Unpickler):
    """Accepts only the types of an allow-list, so that no code of the file is executed."""

    def find_class(self, module, name):
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if module == "torch._utils" and name == "_rebuild_tensor_v2":
            return View
        if module == "torch._utils" and name == "_rebuild_parameter":
            return lambda tensor, *_: tensor
        if module == "torch" and name.endswith("Storage"):
            return StorageType(name)
        raise pickle.UnpicklingError(f"{module}.{name}")

    def persistent_load(self, pid):
        return pid[1], str(pid[2])


def from_state_dict(state, key, storages, data, order):
    for part in filter(None, key.split(".")):
        state = state[part]
    numbers = lambda view: lambda: view.numbers(storages(view.storage))
    tensors = [Tensor(name, view.shape, view.storage[0].precision, numbers(view)) for name, view in state.items()]
    return Weights(tensors, data, "registration", order)


def read_zip(data, key, order):
    archive, entries = named_arrays.entries_of(data, "the archive")
    roots = [name[:-8] for name in entries if name.endswith("/data.pkl")]
    require_input(roots, "the zip archive has no <folder>/data.pkl; of zip archives, those of torch.save and "
                  "numpy.savez are read")
    root = roots[0]
    state = TorchUnpickler(BytesIO(archive.read(root + "data.pkl"))).load()
    return from_state_dict(state, key, lambda storage: archive.read(f"{root}data/{storage[1]}"), data, order)


def read_legacy(data, key, order):
    file = BytesIO(data)
    for _ in range(3):  # magic number, protocol, system
        pickle.load(file)
    state = TorchUnpickler(file).load()
    names = pickle.load(file)
    widths = {}

    def collect(value):
        for tensor in value.values():
            if isinstance(tensor, dict):
                collect(tensor)
            else:
                widths[tensor.storage[1]] = tensor.storage[0].bytes
    collect(state)
    storages = {}
    for name in names:
        count = struct.unpack("<q", file.read(8))[0]
        storages[str(name)] = file.read(count * widths[str(name)])
    return from_state_dict(state, key, lambda storage: storages[storage[1]], data, order)


def natural(text):
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", text)]


def read_safetensors(data, stated):
    length = struct.unpack("<Q", data[:8])[0]
    header = json.loads(data[8:8 + length])
    order = json.loads(header.get("__metadata__", {}).get("swarmcert.layers", "null"))
    names = [name for name in header if name != "__metadata__"]
    layer = lambda name: name.rpartition(".")[0]
    names.sort(key=(lambda n: order.index(layer(n))) if order is not None else (lambda n: natural(layer(n))))
    tensors = []
    for name in names:
        begin, end = header[name]["data_offsets"]
        precision = {"F16": "float16", "BF16": "bfloat16", "F32": "float32", "F64": "float64"}[header[name]["dtype"]]
        numbers = unpack(precision, data[8 + length + begin:8 + length + end])
        tensors.append(Tensor(name, header[name]["shape"], precision, lambda numbers=numbers: numbers))
    return Weights(tensors, data, "none" if order is None else "evaluation", stated)


def read_chain(read, data, order):
    """Reads a file that states the whole chain with `read`, which returns what onnx_graphs.read() returns."""
    layers, activations, precision = read(data)
    tensors = []
    for name, inputs, rows, biases, _ in layers:
        numbers = [row.get(column, 0.0) for row in rows for column in range(inputs)]
        tensors += [Tensor(f"{name}.weight", [len(rows), inputs], precision, lambda numbers=numbers: numbers),
                    Tensor(f"{name}.bias", [len(rows)], precision, lambda biases=biases: biases)]
    result = Weights(tensors, data, "evaluation", order)
    for layer, (*_, kept) in zip(result.layers, layers):
        layer.kept = kept
    result.activations = activations
    return result


def read_c_source(data, key, order):
    text = re.sub(r"/\*.*?\*/|//[^\n]*|^\s*#[^\n]*", " ", data.decode("latin-1"), flags=re.S | re.M)
    require_input(re.match(r"\s*(struct|static|const)\b", text), "is neither a PyTorch state dict (.pth), safetensors, "
                  "ONNX, .npz, .mat, .nnet nor generated C weights; torch.save(model.state_dict(), ...)")
    types = {m[1]: re.findall(r"(float|double)\s+(\w+)((?:\s*\[\s*\d+\s*\])+)\s*;", m[2])
             for m in re.finditer(r"struct\s+(\w+)\s*\{([^{}]*)\}\s*;", text)}
    objects = {m[2].removeprefix("weights_"): (m[1], m[3])
               for m in re.finditer(r"struct\s+(\w+)\s+(\w+)\s*=\s*\{(.*?)\}\s*;", text, flags=re.S)}
    tag, body = objects[key] if key else next(iter(objects.values()))
    values = {m[1]: m[2] for m in re.finditer(r"\.(\w+)\s*=\s*([^.]*(?:\.(?![A-Za-z_])[^.]*)*)", body)}
    tensors = []
    for kind, member, dims in types[tag]:
        shape = [int(d) for d in re.findall(r"\d+", dims)]
        precision = "float32" if kind == "float" else "float64"
        numbers = []
        for literal, suffix in re.findall(r"(-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)([fF]?)", values[member]):
            numbers.append(f32_of(literal) if suffix else f32(float(literal)) if kind == "float" else float(literal))
        if len(shape) == 2:
            numbers = [numbers[i * shape[1] + j] for j in range(shape[1]) for i in range(shape[0])]
            shape.reverse()
        tensors.append(Tensor(re.sub(r"_(weight|bias)$", r".\1", member), shape, precision,
                              lambda numbers=numbers: numbers))
    return Weights(tensors, data, "registration", order)


def read_weights(path, key="", order=None, activation=None):
    """Reads a weight file. `activation`: activations stated by network.toml or the user, separated by commas."""
    weights = read_file(path, key, order)
    if activation is not None:
        weights.state(activation.split(","))
    return weights


def read_file(path, key, order):
    path = str(path)
    if "#" in path and not Path(path).exists():
        path, key = path.rsplit("#", 1)
    data = Path(path).read_bytes()
    try:
        return parse_weights(data, key, order)
    except (BadInput, onnx_graphs.Refused) as refused:
        raise BadInput(f"{path}: {refused}") from None
    except Exception as fault:  # any other one means that the file is not as its format requires
        raise BadInput(f"{path}: is damaged, or written by another program than those whose files are read "
                       f"({type(fault).__name__} {fault}); copy it again, or save it again as a state dict") from None


def looks_like_safetensors(data):
    return len(data) >= 10 and struct.unpack("<Q", data[:8])[0] <= 4 * 2 ** 20 and data[8:9] == b"{"


def looks_like_onnx(data):
    return len(data) >= 3 and data[0] == 8 and 1 <= data[1] <= 31 and data[2:3] in b"\x12\x1a\x22\x28\x32\x3a\x42"


def parse_weights(data, key, order):
    """Detects the format by the content, in the order in which all checkers do."""
    is_npz = named_arrays.looks_like_npz(data)
    if not is_npz and data[:4] in (b"PK\3\4", b"PK\5\6"):
        return read_zip(data, key, order)
    if data[:1] == b"\x80":
        return read_legacy(data, key, order)
    formats = (
        (is_npz, lambda: Weights(named_arrays.read_npz(data), data, "none", order)),
        (looks_like_safetensors(data), lambda: read_safetensors(data, order)),
        (looks_like_onnx(data), lambda: read_chain(onnx_graphs.read, data, order)),
        (mat_file.looks_like_mat(data), lambda: Weights(mat_file.read_mat(data), data, "none", order)),
        (nnet_file.looks_like_nnet(data), lambda: read_chain(nnet_file.read_nnet, data, order)))
    for is_this, read in formats:
        if is_this:
            require_input(not key, f"the file is not nested: it has no key {key}; leave --key out")
            return read()
    return read_c_source(data, key, order)


RELATIVE_STATE = ["dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"]


class Network:
    """The parts by name ("network", "phi:<kind>", "rho:<kind>") and the statements of network.toml."""

    def __init__(self, net="", phi="", rho="", key="", orders=None, activation=None):
        """orders: orders of layers by "network", "phi" and "rho"; a network.toml states its own."""
        orders = orders or {}
        self.sha256, self.unit, self.order, self.clamp, self.invariants = "", "", [], None, False
        self.silent = set()  # (kind of the vehicle, sorted kinds of its neighbours) for which it has no network
        if phi:
            self.parts = {f"{role}:default": read_weights(file, key, orders.get(role), activation)
                          for role, file in (("phi", phi), ("rho", rho))}
        elif net.endswith(".toml"):
            data = Path(net).read_bytes()
            document = tomllib.loads(data.decode())
            self.sha256 = hashlib.sha256(data).hexdigest()
            self.unit = document.get("output", {}).get("unit", "")
            self.order = document.get("input", {}).get("order", [])
            invariants = document.get("input", {}).get("invariants")
            require_input(invariants in (None, "rotation"), f"{net}: unknown invariants")
            self.invariants = invariants is not None
            require_input(not self.invariants or (self.order == RELATIVE_STATE and
                                                  document.get("output", {}).get("quantity") == "force_z"),
                          f"{net}: invariants are of a relative state and for a vertical force")
            silent = document.get("silent", [])
            require_input(isinstance(silent, list) and all(isinstance(one, str) for one in silent) and
                          all(one.partition(">")[2] in document["rho"] for one in silent),
                          f"{net}: silent: a list of compositions, e.g. large+small>small")
            self.silent = {(own, tuple(sorted(kinds.split("+") if kinds else [])))
                           for kinds, _, own in (one.partition(">") for one in silent)}
            clamp = document.get("input", {}).get("clamp")
            self.clamp = clamp and (clamp["lower"], clamp["upper"])

            def part(entry):
                stated = entry.get("activation")
                stated = ",".join(stated) if isinstance(stated, list) else stated
                require_input(stated is None or not any(map(onnx_graphs.written_with_relu, stated.split(","))),
                              f"network.toml cannot state {stated}, at most --activation")
                weights = read_weights(Path(net).parent / entry["weights"], key, entry.get("order"), stated)
                if activation is not None:
                    weights.state(activation.split(","))
                return weights

            self.parts = {f"{role}:{kind}": part(entry)
                          for role in ("phi", "rho") for kind, entry in sorted(document[role].items())}
            for part, weights in self.parts.items():
                inputs = 3 if part == "phi:ground" else 5
                require_input(not self.invariants or part.startswith("rho:") or weights.layers[0].inputs == inputs,
                              f"{net}: {part} must have {inputs} inputs, as there are invariants")
        else:
            self.parts = {"network": read_weights(net, key, orders.get("network"), activation)}

    def chain(self, part):
        """Returns (op, layer, inputs, outputs) of each operation."""
        layers = self.parts[part].layers
        clamps = self.clamp and part != "phi:ground" and not part.startswith("rho:")
        result = [("clamp", None, layers[0].inputs, layers[0].inputs)] if clamps else []
        for layer, op in zip(layers, self.parts[part].between() + [None]):
            result.append(("linear", layer.name, layer.inputs, layer.outputs))
            stated = f"{op}:{layer.outputs - layer.kept}" if layer.kept else op
            result += [(stated, None, layer.outputs, layer.outputs)] * (op is not None)
        return result

    def maps_to_invariants(self, function):
        return self.invariants and function.startswith("set:")

    def is_silent_among(self, function, parts):
        """Returns whether a set function is 0 for these neighbours, "phi:<kind>" each; the ground is ignored."""
        kinds = sorted(part[4:] for part in parts if part != "phi:ground")
        return function.startswith("set:") and (function.rpartition(":")[2], tuple(kinds)) in self.silent

    def silent_up_to(self, function, most):
        """Returns the number of silent compositions of 0 to `most` neighbours of the function's own kind."""
        kind, _, own = function[4:].partition(":")
        return sum(function.startswith("set:") and vehicle == own and len(kinds) <= most and set(kinds) <= {kind}
                   for vehicle, kinds in self.silent)

    def beside_silent(self, function):
        """Returns the compositions with a network that become silent when one neighbour of the function's own kind
        enters or leaves."""
        kind, _, own = function[4:].partition(":")
        found = set()
        for vehicle, kinds in self.silent:
            if not function.startswith("set:") or vehicle != own or kind == "ground":
                continue
            less = list(kinds)
            if kind in less:
                less.remove(kind)
                found.add(tuple(less))
            found.add(tuple(sorted(kinds + (kind,))))
        return {kinds for kinds in found if (own, kinds) not in self.silent}

    def silent_names(self):
        return ["+".join(kinds) + ">" + own for own, kinds in sorted(self.silent)]

    def slope_of_inputs(self, function):
        """Returns the Lipschitz constant of the map from the function's inputs to the inputs of its first layer."""
        if not self.maps_to_invariants(function):
            return Fraction(1)
        return SLOPE_OF_GROUND_INVARIANTS if function.startswith("set:ground:") else SLOPE_OF_INVARIANTS

    def input_names(self, part):
        if self.invariants and not part.startswith("rho:"):
            return (["minus_z_m", "v_xy_m_s", "minus_v_z_m_s"] if part == "phi:ground" else
                    ["dp_xy_m", "scaled_dp_z_m", "dv_xy_m_s", "scaled_dv_z_m_s", "dp_xy_ahead_m"])
        if part == "phi:ground":
            return ["minus_z_m", "minus_v_x_m_s", "minus_v_y_m_s", "minus_v_z_m_s"]
        if part.startswith("rho:"):
            return []
        return self.order or (RELATIVE_STATE if self.parts[part].layers[0].inputs == 6 else [])


def networks_of(function):
    if function == "network" or function[:4] in ("phi:", "rho:"):
        return [function]
    match = re.fullmatch(r"set:([^:]*):(.*)", function, flags=re.S)
    require(match is not None, f"no function is called {function!r}")
    return ["phi:" + match[1], "rho:" + match[2]]


def block_coordinates(network, function, block):
    part = networks_of(function)[0]
    require(part in network.parts, f"there is no {part}")
    names = network.input_names(part)
    result = []
    for k in range(network.parts[part].layers[0].inputs):
        name = names[k] if k < len(names) else ""
        if block in ("all", f"x{k}") or (block == "position" and name.endswith("_m")) or \
                (block == "velocity" and name.endswith("_m_s")):
            result.append(k)
    require(result, f"{function} has no block {block!r}")
    return result


def unit_of(network, function, block):
    part = networks_of(function)[0]
    require(part in network.parts, f"there is no {part}")
    names = network.input_names(part) if network.order else []
    if names and block != "all":
        names = [names[k] for k in block_coordinates(network, function, block)]
    inputs = "input" if not names else "(m/s)" if all(n.endswith("_m_s") for n in names) else \
        "m" if all(n.endswith("_m") for n in names) else "(m, m/s)"
    output = network.unit or "output"
    return f"hidden/{inputs}" if function.startswith("phi:") else \
        f"{output}/hidden" if function.startswith("rho:") else f"{output}/{inputs}"


# --- the mathematics -----------------------------------------------------------------------------------------------

def stages(network, function, block, scale, divided=True):
    """Returns the matrices between the activations, from the inputs of the block, in units of their scale, to the
    output. An activation with slopes in [0, b] is b times one with slopes in [0, 1]: b is multiplied into the columns
    behind it, except those of kept entries. Other activations are unchanged, as are all if not `divided`. For a
    function of rotation invariants, the inputs are the invariants, and the first matrix is multiplied by the slope of
    the map to them."""
    names = networks_of(function)
    require(all(name in network.parts for name in names), f"there is no {function}")
    inputs = network.parts[names[0]].layers[0].inputs
    coordinates = block_coordinates(network, function, block)
    require(not scale or len(scale) == inputs, "scale has another size")
    selector = [0.0] * (inputs * len(coordinates))
    for j, k in enumerate(coordinates):
        selector[k * len(coordinates) + j] = scale[k] if scale else float(network.slope_of_inputs(function))
    chain = [Matrix.of(selector, len(coordinates))]
    for name in names:
        for index, layer in enumerate(network.parts[name].layers):
            w = Matrix.of(layer.weights, layer.inputs)
            if index == 0:
                chain[-1] = w @ chain[-1]
            else:
                op = network.parts[name].between()[index - 1]
                b = MONOTONE.get(op, Fraction(1)) if divided else Fraction(1)
                changed = layer.inputs - network.parts[name].layers[index - 1].kept
                chain.append(Matrix([[x * (b.numerator if j < changed else b.denominator) for j, x in enumerate(row)]
                                     for row in w.rows], w.exponent + 1 - b.denominator.bit_length()))
    return chain


def lmi(chain, rho, t):
    """Returns the matrix P(rho, t) over the hidden increments dz whose positive semidefiniteness proves
    |df|^2 <= rho |dx|^2: the form rho |dx|^2 - |M_K dz_{K-1}|^2 - 2 sum_i t_i dz_i (dy_i - dz_i) >= 0, minimised over
    dx and multiplied by rho."""
    (rho_integer,), rho_exponent = dyadics([rho])
    if len(chain) == 1:
        m = chain[0]
        small = m @ m.transposed() if len(m.rows) <= len(m.rows[0]) else m.transposed() @ m
        exponent = min(small.exponent, rho_exponent)
        rows = [[-shifted(x, small.exponent - exponent) for x in row] for row in small.rows]
        for i, row in enumerate(rows):
            row[i] += shifted(rho_integer, rho_exponent - exponent)
        return Matrix(rows, exponent)
    ts, t_exponent = dyadics(t)
    n = len(t)
    first, last = chain[0], chain[-1]
    gram, output = first @ first.transposed(), last.transposed() @ last
    exponents = [rho_exponent + t_exponent, 2 * t_exponent + gram.exponent, rho_exponent + output.exponent]
    exponents += [rho_exponent + t_exponent + m.exponent for m in chain[1:-1]]
    exponent = min(exponents)
    p = [[0] * n for _ in range(n)]
    for i in range(n):
        p[i][i] += shifted(2 * rho_integer * ts[i], exponents[0] - exponent)
    for i, row in enumerate(gram.rows):
        for j, x in enumerate(row):
            p[i][j] -= shifted(ts[i] * x * ts[j], exponents[1] - exponent)
    before = 0
    for m, e in zip(chain[1:-1], exponents[3:]):
        begin = before + len(m.rows[0])
        for i, row in enumerate(m.rows):
            for j, x in enumerate(row):
                p[begin + i][before + j] -= shifted(rho_integer * ts[begin + i] * x, e - exponent)
                p[before + j][begin + i] = p[begin + i][before + j]
        before = begin
    for i, row in enumerate(output.rows):
        for j, x in enumerate(row):
            p[before + i][before + j] -= shifted(rho_integer * x, exponents[2] - exponent)
    return Matrix(p, exponent)


def slope_ranges(network, function):
    """Returns the slope range of each hidden neuron of stages(): [0, 1], or [1 - c, c], c > 1, if it is not divided by
    c. Kept entries have slope 1, which is in both ranges."""
    return [(Fraction(0), Fraction(1)) if op in MONOTONE else (1 - STEEPEST[op], STEEPEST[op])
            for part in (network.parts[name] for name in networks_of(function))
            for op, layer in zip(part.between(), part.layers[:-1]) for _ in range(layer.outputs)]


def bent_lmi(chain, slopes, rho, t):
    """Returns the matrix over (dx, dz) of
    rho |dx|^2 - |M_K dz_{K-1}|^2 - 2 sum_i t_i (dz_i - a_i dy_i) (b_i dy_i - dz_i) >= 0 for slopes in [a_i, b_i].
    With dy_i = m_i' dz of the previous layer, neuron i contributes 2 t_i at (i, i), - t_i (a_i + b_i) m_i to its row,
    and 2 t_i a_i b_i m_i m_i' to the diagonal block of the previous layer."""
    (integer,), exponent = dyadics([rho])
    inputs, neuron, weighted = range(len(chain[0].rows[0])), 0, []
    for m in chain[:-1]:
        sums, by = dyadics([a + b for a, b in slopes[neuron:neuron + len(m.rows)]])
        weighted.append(Matrix([[s * x for x in row] for s, row in zip(sums, m.rows)], m.exponent + by))
        neuron += len(m.rows)
    q = Matrix([[integer * (i == j) for j in inputs] for i in inputs], exponent)
    p = quadratic_lmi(weighted + chain[-1:], q, t)
    before = neuron = 0
    for m in chain[:-1]:
        width = len(m.rows[0])
        multipliers = t[neuron:neuron + len(m.rows)]
        weights, exponent = dyadics([2 * a * b * Fraction(s) for (a, b), s in zip(slopes[neuron:], multipliers)])
        if any(weights):
            square = m.transposed() @ Matrix([[w * x for x in row] for w, row in zip(weights, m.rows)],
                                             m.exponent + exponent)
            common = min(square.exponent, p.exponent)
            p = Matrix([[shifted(x, p.exponent - common) for x in row] for row in p.rows], common)
            for i in range(width):
                for j in range(width):
                    p.rows[before + i][before + j] += shifted(square.rows[i][j], square.exponent - common)
        before, neuron = before + width, neuron + len(m.rows)
    return p


def parse_factor(factor, where):
    """Reads a factor; returns None if the certificate omits it."""
    if factor is None:
        return None
    require_keys(factor, ["unit_exponent", "scale", "rows"], where)
    unit, scale = integer(factor["unit_exponent"]), [integer(s) for s in listed(factor["scale"])]
    require(all(abs(e) <= 8192 for e in [unit] + scale), f"{where}: exponent out of range")
    rows = []
    for text in listed(factor["rows"]):
        require(isinstance(text, str), f"{where}: a row is not text")
        words = [w for w in re.split("[ \t\n\v\f\r]+", text) if w]
        require(all(len(w) <= 40 and re.fullmatch("-?[0-9]+", w) for w in words), f"{where}: not an integer")
        rows.append([int(w) for w in words])
    return unit, scale, rows


def quadratic_lmi(chain, q, t):
    """Returns the matrix over (dv, dz) whose positive semidefiniteness proves |drho|^2 <= dv' Q dv."""
    size, fraction = len(q.rows), [[q.fraction(i, j) for j in range(len(q.rows))] for i in range(len(q.rows))]
    n = size + len(t)
    p = [[Fraction(0)] * n for _ in range(n)]
    for i in range(size):
        p[i][:size] = fraction[i]
    before, begin = 0, size
    for m in chain[:-1]:
        for i, row in enumerate(m.rows):
            multiplier = Fraction(t[begin - size + i])
            p[begin + i][begin + i] = 2 * multiplier
            for j in range(len(row)):
                p[begin + i][before + j] = p[before + j][begin + i] = -multiplier * m.fraction(i, j)
        before, begin = begin, begin + len(m.rows)
    gram = chain[-1].transposed() @ chain[-1]
    for i in range(len(gram.rows)):
        for j in range(len(gram.rows)):
            p[before + i][before + j] -= gram.fraction(i, j)
    exponent = -max(x.denominator.bit_length() - 1 for row in p for x in row)  # all denominators are powers of two
    return Matrix([[(x * power(-exponent)).numerator for x in row] for row in p], exponent)


def shows_positive_semidefinite(p, unit, scale, rows):
    """Returns whether E = D P D - R R' is diagonally dominant with a nonnegative diagonal."""
    n = len(p.rows)
    if len(scale) != n or len(rows) != n or any(len(row) > i + 1 for i, row in enumerate(rows)):
        return False
    exponent = min(p.exponent + 2 * min(scale, default=0), 2 * unit)
    first = [i + 1 - len(row) for i, row in enumerate(rows)]
    slack = [0] * n
    for i in range(n):
        for j in range(i + 1):
            start = max(first[i], first[j])
            gram = sum(map(mul, rows[i][start - first[i]:j + 1 - first[i]], rows[j][start - first[j]:]))
            e = shifted(p.rows[i][j], p.exponent + scale[i] + scale[j] - exponent) - shifted(gram, 2 * unit - exponent)
            if i == j:
                slack[i] += e
            else:
                slack[i] -= abs(e)
                slack[j] -= abs(e)
    return all(s >= 0 for s in slack)


def scaled_double(integer, exponent):
    """Returns an approximation of integer 2^exponent as a double."""
    excess = max(integer.bit_length() - 64, 0)
    return math.ldexp(integer >> excess, exponent + excess)


def factorised(rows, first, shift):
    """Returns R with R R' = (the matrix with these lower rows) - shift I, in floating point; rows with a zero diagonal
    stay zero. Returns None if the factorisation breaks down."""
    result = []
    for i, row in enumerate(rows):
        if row[-1] == 0:
            result.append([0.0] * len(row))
            continue
        out = []
        for j in range(first[i], i):
            begin, other = max(first[i], first[j]), result[j]
            rest = row[j - first[i]] - sum(map(mul, out[begin - first[i]:], other[begin - first[j]:-1]))
            out.append(rest / other[-1] if other[-1] else 0.0)
        square = row[-1] - shift - sum(x * x for x in out)
        if not 0 < square < math.inf:
            return None
        result.append(out + [math.sqrt(square)])
    return result


def shows_or_finds(p, factor):
    """Verifies the factor in exact integers; if the certificate omits it, first computes one in floating point."""
    if factor is not None:
        return shows_positive_semidefinite(p, *factor)
    n = len(p.rows)
    if any(p.rows[i][i] < 0 for i in range(n)):
        return False
    scale = [-((p.rows[i][i].bit_length() + p.exponent + 1) // 2) if p.rows[i][i] else 0 for i in range(n)]
    first = [next(j for j in range(i + 1) if p.rows[i][j] or j == i) for i in range(n)]
    try:
        rows = [[scaled_double(p.rows[i][j], p.exponent + scale[i] + scale[j]) for j in range(first[i], i + 1)]
                for i in range(n)]
    except OverflowError:
        return False
    sums = [sum(map(abs, row)) for row in rows]
    for i, row in enumerate(rows):
        for j, x in zip(range(first[i], i), row):
            sums[j] += abs(x)
    shift = 2.0 ** -56 * (n + max(sums, default=0.0))  # an eighth of the writer's first shift: sums differ
    while shift < 1e-7:
        found = factorised(rows, first, shift)
        if found is None:
            return False
        integers = [[round(math.ldexp(x, 60)) for x in row] for row in found]
        if shows_positive_semidefinite(p, -60, scale, integers):
            return True
        shift *= 8
    return False


def rounded_up(x):
    """Returns the next multiple of 2^-80, which keeps fractions short."""
    return Fraction(-((-x.numerator << 80) // x.denominator), 1 << 80)


def conflicts_in(text, where):
    """Reads (neuron, is on, neuron, is on, lambda, multiplier) from "3+ 17- <lambda> <multiplier>", ..."""
    require(isinstance(text, str), f"{where}: conflicts are not text")
    words = [w for w in re.split("[ \t\n\v\f\r]+", text) if w]
    require(len(words) % 4 == 0, f"{where}: a conflict lacks words")
    result = []
    for first, second, weight, multiplier in zip(*[iter(words)] * 4):
        require(re.fullmatch("[0-9]{1,9}[+-]", first) and re.fullmatch("[0-9]{1,9}[+-]", second),
                f"{where}: a conflict's neuron is not a number with + or -")
        result.append((int(first[:-1]), first[-1] == "+", int(second[:-1]), second[-1] == "+",
                       Fraction(hex_float(weight)), Fraction(hex_float(multiplier))))
    return result


class Hidden:
    """y = W h + b + e for any least <= e <= most; the next h is relu(y), or y for the last `without_relu` outputs."""

    def __init__(self, layer, has_relu=True, bias=True):
        self.weights = [[Fraction(w) for w in layer.weights[i * layer.inputs:(i + 1) * layer.inputs]]
                        for i in range(layer.outputs)]
        self.biases = [Fraction(b) if bias else Fraction(0) for b in layer.biases]
        self.without_relu, self.least, self.most = 0 if has_relu else layer.outputs, None, None

    def homogeneous(self, is_last):
        """Returns the layer y = W h + b s, where s is the last input and, except in the last layer, the last output."""
        self.weights = [row + [b] for row, b in zip(self.weights, self.biases)]
        if not is_last:
            self.weights.append([Fraction(0)] * (len(self.weights[0]) - 1) + [Fraction(1)])
            self.without_relu = 1
        self.biases = [Fraction(0)] * len(self.weights)

    def has_relu(self, i):
        return i < len(self.biases) - self.without_relu

    def constant(self, form):
        """Returns the largest value of form (b + e)."""
        total = sum(map(mul, form, self.biases))
        if self.least:
            total += sum(c * (m if c > 0 else l) for c, l, m in zip(form, self.least, self.most))
        return total


def slopes_at(layers, point, top):
    """Returns for each layer before `top` which outputs are on at a point. An approximation is sufficient, because any
    lower slopes are valid."""
    h, slopes = [float(x) for x in point], []
    for layer in layers[:top]:
        y, is_on = [], []
        for i, (row, bias) in enumerate(zip(layer.weights, layer.biases)):
            terms = [float(w) * x for w, x in zip(row, h)]
            middle = float(bias + ((layer.least[i] + layer.most[i]) / 2 if layer.least else 0))
            y.append(sum(terms) + middle)
            is_on.append(y[-1] > 2 ** -30 * (sum(map(abs, terms)) + abs(middle)))
        slopes.append(is_on)
        h = [max(v, 0) if layer.has_relu(i) else v for i, v in enumerate(y)]
    return slopes


def above(layers, bounds, layer, neuron, sign, slopes=None):
    """Returns coefficients and constant of a linear form in x that bounds sign * y from above, by relaxation of ReLU.
    `slopes`: which undecided neurons have the lower bound y; the others have the lower bound 0."""
    form, constant = [Fraction(0)] * len(layers[layer].biases), Fraction(0)
    form[neuron] = Fraction(sign)
    for j in range(layer, -1, -1):
        constant += layers[j].constant(form)
        form = [sum(c * row[x] for c, row in zip(form, layers[j].weights) if c)
                for x in range(len(layers[j].weights[0]))]
        if j == 0:
            break
        for c, (l, u) in enumerate(bounds[j - 1]):
            if l >= 0 or form[c] == 0 or not layers[j - 1].has_relu(c):
                continue
            is_below = slopes[j - 1][c] if slopes else u > -l
            if u <= 0 or (form[c] < 0 and not is_below):
                form[c] = Fraction(0)
            elif form[c] > 0:
                slope = min(Fraction(1), rounded_up(u / (u - l)))
                constant += form[c] * max(u - slope * u, -slope * l)
                form[c] *= slope
    return form, constant


def largest(form, constant, low, high):
    return rounded_up(constant + sum(c * (h if c > 0 else l) for c, l, h in zip(form, low, high)))


def neuron_bounds(layers, low, high, around, first=(), decisions=()):
    """Returns bounds on every neuron over a box by linear relaxation of ReLU, layer by layer. Neurons decided by
    `around` keep its bounds. Exact except for bounds and slopes, which are rounded such that they remain valid.
    `first`: given bounds of the first layers. `decisions`: (neuron, is on, corner) of neurons decided by the lower
    slopes that are tight at a corner; decisions for other layers are ignored. Returns None if one of them does not
    hold."""
    bounds = list(first)
    before = sum(len(layer.biases) for layer in layers[:len(bounds)])
    for k in range(len(bounds), len(layers)):
        layer = layers[k]
        bounds.append([])
        for i in range(len(layer.biases)):
            lower, upper = around[k][i] if around else (None, None)
            if layer.has_relu(i) and lower is not None and (lower >= 0 or upper <= 0):
                bounds[k].append((lower, upper))
                continue
            ends = [largest(*above(layers, bounds, k, i, sign), low, high) for sign in (1, -1)]
            l, u = -ends[1], ends[0]
            bounds[k].append((l, u) if lower is None else (max(l, lower), min(u, upper)))
        for neuron, is_on, corner in decisions:
            if not before <= neuron < before + len(layer.biases):
                continue
            i = neuron - before
            if not layer.has_relu(i) or len(low) > 48:
                return None
            l, u = bounds[k][i]
            if not l < 0 < u:
                continue
            slopes = slopes_at(layers, [high[j] if corner >> j & 1 else low[j] for j in range(len(low))], k)
            end = largest(*above(layers, bounds, k, i, -1 if is_on else 1, slopes), low, high)
            if end > 0:
                return None
            bounds[k][i] = (-end, u) if is_on else (l, end)
        before += len(layer.biases)
    return bounds


def is_positive_semidefinite(s):
    """Returns whether s is positive semidefinite, by an L D L' factorisation in fractions."""
    n = len(s)
    for j in range(n):
        pivot = s[j][j]
        if pivot < 0 or (pivot == 0 and any(s[i][j] != 0 for i in range(j + 1, n))):
            return False
        for i in range(j + 1, n):
            if pivot == 0 or s[i][j] == 0:
                continue
            factor = s[i][j] / pivot
            for k in range(j + 1, i + 1):
                s[i][k] -= factor * s[k][j]
    return True


def shown(layers, low, high, bounds, conflicts):
    """Returns the conflicts between undecided neurons that are proved by their lambda in this box."""
    places = [(k, i) for k, layer in enumerate(layers) for i in range(len(layer.biases))]
    undecided = lambda at: bounds[at[0]][at[1]][0] < 0 < bounds[at[0]][at[1]][1] and layers[at[0]].has_relu(at[1])
    result = []
    for first, first_on, second, second_on, weight, multiplier in conflicts:
        if not undecided(places[first]) or not undecided(places[second]):
            continue
        one, one_constant = above(layers, bounds, *places[first], 1 if first_on else -1)
        other, other_constant = above(layers, bounds, *places[second], 1 if second_on else -1)
        form = [weight * a + (1 - weight) * b for a, b in zip(one, other)]
        if largest(form, weight * one_constant + (1 - weight) * other_constant, low, high) <= 0:
            result.append((first, first_on, second, second_on, multiplier))
    return result


def part_holds(layers, gram, moving, weight, bounds, form, t, conflicts):
    """Returns whether S = form - F' G F - sum_i t_i (a_i e_i' + e_i a_i') - sum_c s_c (p_c q_c' + q_c p_c') over the
    moving inputs and the undecided neurons is positive semidefinite."""
    forms = {}
    n = len(moving) + sum(l < 0 < u and layer.has_relu(i) for layer, ends in zip(layers, bounds)
                          for i, (l, u) in enumerate(ends))
    s = [[Fraction(0)] * n for _ in range(n)]
    for i in range(len(moving)):
        s[i][:len(moving)] = form[i]
    z = [[weight[j] if j < len(moving) and moving[j] == i else Fraction(0) for j in range(n)]
         for i in range(len(layers[0].weights[0]))]
    variable, neuron = len(moving), 0
    for layer, ends in zip(layers, bounds):
        y = [[sum(w * row[j] for w, row in zip(weights, z)) for j in range(n)] for weights in layer.weights]
        for i, (l, u) in enumerate(ends):
            if not layer.has_relu(i):
                pass
            elif l < 0 < u:
                for j in range(n):
                    s[variable][j] -= t[neuron] * y[i][j]
                    s[j][variable] -= t[neuron] * y[i][j]
                s[variable][variable] += 2 * t[neuron]
                forms[neuron] = (y[i], variable)
                y[i] = [Fraction(int(j == variable)) for j in range(n)]
                variable += 1
            elif l < 0:
                y[i] = [Fraction(0)] * n
            neuron += 1
        z = y
    for first, first_on, second, second_on, multiplier in conflicts:
        p, q = ([(0 if is_on else x) + (1 if is_on else -1) * int(j == forms[at][1])
                 for j, x in enumerate(forms[at][0])]
                for at, is_on in ((first, first_on), (second, second_on)))
        for i in range(n):
            for j in range(n):
                s[i][j] -= multiplier * (p[i] * q[j] + q[i] * p[j])
    h = [[sum(g * row[j] for g, row in zip(gram_row, z)) for j in range(n)] for gram_row in gram]
    for i in range(n):
        for j in range(n):
            s[i][j] -= sum(f[i] * x[j] for f, x in zip(z, h))
    return is_positive_semidefinite(s)


def projective_cover(radius):
    """Returns boxes of (u, s), s >= 0, such that every x equals u / s for a point of one of them."""
    one = Fraction(1)
    boxes = [([-r for r in radius] + [one], radius + [one])]
    for k, r in enumerate(radius):
        for side in -r, r:
            low, high = [-r for r in radius] + [Fraction(0)], radius + [one]
            low[k] = high[k] = side
            boxes.append((low, high))
    return boxes


def scaled_identity(rho, size):
    return [[Fraction(rho) if i == j else Fraction(0) for j in range(size)] for i in range(size)]


class Part:
    """A box, bounds on its neurons and, once a form holds in it, bounds on the neurons of the whole set function and
    the Gram matrix of the form. `around`: bounds over the parent box. `decisions`: decisions not yet verified."""

    def __init__(self, low, high, around, through_rho=None, gram=None):
        self.low, self.high, self.around, self.through_rho, self.gram = low, high, around, through_rho, gram
        self.bounds, self.decisions = None, []

    def bound_neurons(self, layers):
        """Bounds the neurons; returns whether their decisions hold."""
        self.bounds = neuron_bounds(layers, self.low, self.high, self.around, (), self.decisions)
        count = sum(len(layer.biases) for layer in layers)
        self.decisions = [decision for decision in self.decisions if decision[0] >= count]
        return self.bounds is not None


class Forms:
    """Forms (Q, t) with |drho|^2 <= dv' Q dv for rho's neurons as decided by a part. `behind`: phi's last layer, then
    rho's hidden layers."""

    def __init__(self, forms, hidden, behind, gram):
        self.forms, self.layers, self.first, self.gram = forms, hidden + behind, len(hidden) + 1, gram

    def look(self, part):
        """Bounds rho's neurons in the part; returns whether their decisions hold."""
        count = sum(len(layer.biases) for layer in self.layers)
        through = neuron_bounds(self.layers, part.low, part.high, part.through_rho, part.bounds, part.decisions)
        if through is None or any(decision[0] >= count for decision in part.decisions):
            return False
        part.through_rho, part.decisions = through, []
        return True

    def use(self, index, part):
        """Assigns the form to the part if it holds there."""
        if index >= len(self.forms) or not self.look(part):
            return False
        q, t = self.forms[index]
        one = [Fraction(1)] * len(q)
        if not part_holds(self.layers[self.first:], self.gram, list(range(len(q))), one, part.through_rho[self.first:],
                          q, t, []):
            return False
        last = self.layers[self.first - 1].weights
        half = [[sum(a * row[j] for a, row in zip(q_row, last)) for j in range(len(last[0]))] for q_row in q]
        part.gram = [[sum(row[i] * h[j] for row, h in zip(last, half)) for j in range(len(last[0]))]
                     for i in range(len(last[0]))]
        return True


def tree_fails(layers, boxes, text, proves, forms=None):
    """Returns "" if proves(part, index) for every leaf, else the reason."""
    open_parts = [Part(low, high, None) for low, high in reversed(boxes)]
    for word in text.split(" ") if text else []:
        if not re.fullmatch("[stq][0-9]{1,15}|r|d[0-9]{1,15}[+-][0-9]{1,15}", word) or not open_parts:
            return f"{word!r} is no split, no leaf, no form and no decision, or one too many"
        if word[0] == "d":
            neuron, sign, corner = re.fullmatch("d([0-9]*)([+-])([0-9]*)", word).groups()
            open_parts[-1].decisions.append((int(neuron), sign == "+", int(corner)))
            continue
        if open_parts[-1].bounds is None and not open_parts[-1].bound_neurons(layers):
            return f"before {word}: a neuron is not decided by its slopes"
        index = int(word[1:] or 0)
        if word[0] in "qr":
            if forms is None or not (forms.use(index, open_parts[-1]) if word[0] == "q"
                                     else forms.look(open_parts[-1])):
                return f"{word} does not hold in its part"
            continue
        part = open_parts.pop()
        low, high = part.low, part.high
        if part.decisions:
            return f"before {word}: a neuron is decided, but the decision is not used"
        if word[0] == "t":
            if not proves(part, index):
                return f"{word} does not prove its part"
            continue
        if index >= len(low) or len(open_parts) > 2000 + len(boxes):
            return f"{word}: no such coordinate, or too deep"
        middle = Fraction(float(low[index]) + (float(high[index]) - float(low[index])) / 2)
        if not low[index] <= middle <= high[index]:
            return f"{word}: the side cannot be halved"
        for is_upper in True, False:
            l, h = list(low), list(high)
            (l if is_upper else h)[index] = middle
            open_parts.append(Part(l, h, part.bounds, part.through_rho, part.gram))
    return "the tree ends early" if open_parts else ""


def proves_in_double(layers, boxes, proof, gram, moving, weight, rho):
    """Returns whether floating point with bounded errors accepts the tree, which takes seconds instead of hours with
    fractions. Needs numpy. Without numpy, and if the tree is not accepted, fractions decide."""
    texts = proof["multipliers"]
    if parts_in_double is None or not isinstance(proof["tree"], str) or not isinstance(texts, list) or not texts:
        return False
    if not all(isinstance(text, str) and PLAIN_HEX_FLOATS.fullmatch(text) for text in texts):
        return False
    try:
        conflicts = [conflicts_in_double(text) for text in listed(proof.get("conflicts", [""] * len(texts)))]
    except (Rejected, ValueError):
        return False
    rows = [list(map(float.fromhex, text.split(" "))) for text in texts]
    neurons = sum(len(layer.biases) for layer in layers)
    if any(len(row) != neurons or min(row) < 0 or max(row) == math.inf for row in rows) or len(conflicts) != len(rows):
        return False
    if not all(0 <= c[0] < c[2] < neurons and 0 <= c[4] <= 1 and math.isfinite(c[5]) for some in conflicts
               for c in some):
        return False
    near = [[float(x) for x in row] for row in gram]
    if not all(map(math.isfinite, (x for row in near for x in row))):
        return False
    error = [[float(abs(x - Fraction(y))) * (1 + 2.0 ** -50) for x, y in zip(*pair)] for pair in zip(gram, near)]
    as_doubles = lambda row: [float(x) for x in row]
    return parts_in_double.holds(
        [([as_doubles(row) for row in layer.weights], as_doubles(layer.biases), layer.without_relu)
         for layer in layers],
        [(as_doubles(low), as_doubles(high)) for low, high in boxes], proof["tree"],
        (parts_in_double.np.array(near), parts_in_double.np.array(error)), moving, as_doubles(weight), rho,
        parts_in_double.np.array(rows), conflicts)


def conflicts_in_double(text):
    """The same as conflicts_in() for text in the format written by certify."""
    if not isinstance(text, str):
        raise ValueError("not text")
    words = text.split(" ") if text else []
    if len(words) % 4:
        raise ValueError("a conflict lacks words")
    result = []
    for first, second, weight, multiplier in zip(*[iter(words)] * 4):
        if not (CONFLICTING.fullmatch(first) and CONFLICTING.fullmatch(second) and
                SIGNED_HEX_FLOAT.fullmatch(weight) and SIGNED_HEX_FLOAT.fullmatch(multiplier)):
            raise ValueError("written in another way")
        result.append((int(first[:-1]), first[-1] == "+", int(second[:-1]), second[-1] == "+", float.fromhex(weight),
                       float.fromhex(multiplier)))
    return result


def evaluate(weights, values, exponent):
    """Evaluates the network at integers times 2^exponent, exactly."""
    for k, layer in enumerate(weights.layers):
        w = Matrix.of(layer.weights, layer.inputs)
        biases, bias_exponent = dyadics(layer.biases)
        low = min(w.exponent + exponent, bias_exponent)
        values = [shifted(sum(map(mul, row, values)), w.exponent + exponent - low) + shifted(b, bias_exponent - low)
                  for row, b in zip(w.rows, biases)]
        exponent = low
        if k + 1 < len(weights.layers):
            values = [max(v, 0) for v in values]
    return values, exponent


def add(a, b):
    exponent = min(a[1], b[1])
    return [shifted(x, a[1] - exponent) + shifted(y, b[1] - exponent) for x, y in zip(a[0], b[0])], exponent


# --- activations on intervals --------------------------------------------------------------------------------------
# No mathematical library is used. A number is enclosed by a pair of integers over 2^BITS; each operation rounds
# outwards. The series differ from those of the C++ checker.

BITS = 384
ONE = 1 << BITS
VALUE_UNIT, SLOPE_UNIT = power(-64), power(-24)


def enclosed(x):
    """Returns an enclosure of a fraction."""
    x = Fraction(x) * ONE
    return math.floor(x), math.ceil(x)


def plus(a, b):
    return a[0] + b[0], a[1] + b[1]


def negative(a):
    return -a[1], -a[0]


def times(a, b):
    products = [x * y for x in a for y in b]
    return min(products) >> BITS, -(-max(products) >> BITS)


def inverse(a):
    """Returns an enclosure of the inverse of a positive number."""
    return ONE * ONE // a[1], -(-ONE * ONE // a[0])


def over(a, n):
    return a[0] // n, -(-a[1] // n)


@functools.lru_cache(maxsize=1 << 14)  # ends of intervals are asked for several times
def exponential_of_minus(x):
    """e^-x for a fraction x >= 0: 1 - y + y^2/2 - ..., y = x / 2^k <= 1/2, whose terms decrease, squared k times. At 0
    it is no tighter than elsewhere, so that a range that ends at tanh(0) = 0 does not end at 0: the other checkers
    enclose e^0 like this, and the slope of a ReLU behind it depends on that."""
    if x >= 267:
        return 0, 1
    if x == 0:
        return ONE - 1, ONE
    halvings = max(0, math.ceil(x)).bit_length() + 8
    y = enclosed(Fraction(x) / 2 ** halvings)
    total = term = (ONE, ONE)
    k = 0
    while term[1] > 1:
        k += 1
        term = over(times(term, y), k)
        total = plus(total, negative(term) if k % 2 else term)
    total = total[0] - term[1], total[1] + term[1]
    for _ in range(halvings):
        total = times(total, total)
    return max(total[0], 0), total[1]


def sigmoid_of(t):
    e = exponential_of_minus(abs(t))
    return times((ONE, ONE) if t >= 0 else e, inverse(plus((ONE, ONE), e)))


@functools.lru_cache(maxsize=1 << 14)
def log_of_one_plus(e):
    """-ln(1 - u) = u + u^2/2 + ..., u = e / (1 + e) <= 1/2; the rest is at most twice the next power."""
    u = times(e, inverse(plus((ONE, ONE), e)))
    total, p, k = (0, 0), u, 1
    while p[1] > 2:  # rounded up, half of 2 may be 2 again
        total, p, k = plus(total, over(p, k)), times(p, u), k + 1
    return total[0], total[1] + 2 * p[1]


def arctangent(x):
    """arctan x for a fraction x between 0 and 1/2: x - x^3/3 + ..."""
    p, square, total, k = enclosed(x), enclosed(x * x), (0, 0), 0
    while p[1] > 1:
        term = over(p, 2 * k + 1)
        total, p, k = plus(total, negative(term) if k % 2 else term), times(p, square), k + 1
    return total[0] - p[1], total[1] + p[1]


# Euler: pi = 20 arctan(1/7) + 8 arctan(3/79)
PI = tuple(20 * a + 8 * b for a, b in zip(arctangent(Fraction(1, 7)), arctangent(Fraction(3, 79))))
ROOT_OF_TWO_PI = math.isqrt(2 * PI[0] << BITS), math.isqrt(2 * PI[1] << BITS) + 1


def normal_density(t):
    return times(exponential_of_minus(Fraction(t) ** 2 / 2), inverse(ROOT_OF_TWO_PI))


@functools.lru_cache(maxsize=1 << 14)
def normal_probability(t):
    """1/2 + (t - t^3/(2 3) + t^5/(4 2! 5) - ...) / sqrt(2 pi); for |t| >= 14 it is within e^-98 / 2 of 0 or 1."""
    if t <= -14:
        return 0, ONE >> 141
    if t >= 14:
        return ONE - (ONE >> 141), ONE
    x, half_square = enclosed(t), enclosed(Fraction(t) ** 2 / 2)
    p, total, k = x, x, 0
    while max(map(abs, p)) > 1 or k < 2 * half_square[1] >> BITS:
        k += 1
        p = negative(over(times(p, half_square), k))
        total = plus(total, over(p, 2 * k + 1))
    rest = 1 + max(map(abs, p))
    return plus((ONE // 2, ONE // 2), times((total[0] - rest, total[1] + rest), inverse(ROOT_OF_TWO_PI)))


SELU_SCALE = Fraction("1.0507009873554805")
SELU_SLOPE = SELU_SCALE * Fraction("1.6732632423543772")


def value_of(op, t):
    if op == "tanh":  # 2 sigmoid(2 t) - 1
        s = sigmoid_of(2 * t)
        return plus(plus(s, s), (-ONE, -ONE))
    if op == "sigmoid":
        return sigmoid_of(t)
    if op == "softplus":
        return plus(enclosed(max(t, 0)), log_of_one_plus(exponential_of_minus(abs(t))))
    if op in ("elu", "selu"):
        slopes = (1, 1) if op == "elu" else (SELU_SCALE, SELU_SLOPE)
        if t >= 0:
            return enclosed(slopes[0] * t)
        return times(enclosed(slopes[1]), plus(exponential_of_minus(-t), (-ONE, -ONE)))
    return times(enclosed(t), sigmoid_of(t) if op == "silu" else normal_probability(t))


def slope_of(op, t):
    """Returns an enclosure of the derivative; for ELU and SELU at 0, of the derivative from below."""
    if op in ("elu", "selu"):
        slopes = (1, 1) if op == "elu" else (SELU_SCALE, SELU_SLOPE)
        return enclosed(slopes[0]) if t > 0 else times(enclosed(slopes[1]), exponential_of_minus(-t))
    if op == "gelu":
        return plus(normal_probability(t), times(enclosed(t), normal_density(t)))
    s = sigmoid_of(2 * t if op == "tanh" else t)
    falls = times(s, plus((ONE, ONE), negative(s)))  # sigmoid'
    return {"tanh": times((4 * ONE, 4 * ONE), falls), "sigmoid": falls, "softplus": s,
            "silu": plus(s, times(enclosed(t), falls))}[op]


# SiLU and GELU: bounds on the position of the minimum, a lower bound on its value, bounds on the position of the
# steepest slope.
BENT_PLACES = {op: tuple(map(Fraction, map(float.fromhex, places))) for op, places in {
    "silu": ("-0x1.47498p+0", "-0x1.47497p+0", "-0x1.1d26p-2", "0x1.331p+1", "0x1.332p+1"),
    "gelu": ("-0x1.80eaep-1", "-0x1.80eacp-1", "-0x1.5c19ep-3", "0x1.6ap+0", "0x1.6a1p+0")}.items()}


def meets(low, high, first, last):
    return low <= last and first <= high


def values_between(op, low, high):
    """Returns bounds on the values for t between low and high."""
    if op == "relu":
        return max(low, Fraction(0)), max(high, Fraction(0))
    ends = [value_of(op, t) for t in {low, high}]
    least, greatest = (Fraction(f(e[i] for e in ends), ONE) for i, f in enumerate((min, max)))
    if op in BENT_PLACES and meets(low, high, *BENT_PLACES[op][:2]):
        least = BENT_PLACES[op][2]
    return math.floor(least / VALUE_UNIT) * VALUE_UNIT, math.ceil(greatest / VALUE_UNIT) * VALUE_UNIT


def slopes_between(op, low, high):
    """Returns bounds on the slopes for t between low and high. tanh and sigmoid are steepest at the point nearest to 0;
    the slopes of SiLU and GELU have their extremes at the ends or at one point each; those of the others are increasing
    (except that SELU's jumps down at 0)."""
    least_of_all = Fraction(0) if op in MONOTONE else 1 - STEEPEST[op]
    if op == "relu":
        ends = (Fraction(low >= 0 and high > 0), Fraction(high > 0))
    else:
        points = {low, high}
        if low < 0 < high and op not in BENT_PLACES:
            points.add(Fraction(0))
        if op == "selu" and low == 0:  # its slope from below does not belong to the interval
            points.remove(0)
        found = [slope_of(op, t) for t in points]
        found += [enclosed(SELU_SCALE)] * (op == "selu" and (low == 0 or high > 0))
        ends = Fraction(min(a for a, _ in found), ONE), Fraction(max(b for _, b in found), ONE)
        if op in BENT_PLACES:
            first, last = BENT_PLACES[op][3:]
            ends = (least_of_all if meets(low, high, -last, -first) else ends[0],
                    STEEPEST[op] if meets(low, high, first, last) else ends[1])
    return (max((math.ceil(ends[0] / SLOPE_UNIT) - 1) * SLOPE_UNIT, least_of_all),
            min((math.floor(ends[1] / SLOPE_UNIT) + 1) * SLOPE_UNIT, STEEPEST[op]))


def sorted_layer(op, values):
    group = SORTING[op]
    if op.startswith("groupsort"):
        return [x for i in range(0, len(values), group) for x in sorted(values[i:i + group])]
    half = len(values) // 2
    pairs = list(zip(values[:half], values[half:])) if op == "maxmin:halves" else list(zip(values[::2], values[1::2]))
    return list(map(max, pairs)) + list(map(min, pairs))


def applied(w, values):
    integers, exponent = dyadics(values)
    unit = power(w.exponent + exponent)
    return [sum(map(mul, row, integers)) * unit for row in w.rows]


def down(x):
    return math.floor(x / VALUE_UNIT) * VALUE_UNIT


def up(x):
    return math.ceil(x / VALUE_UNIT) * VALUE_UNIT


def layer_ends(layer, low, high):
    """Returns bounds on W h + b for h between low and high."""
    w = Matrix.of(layer.weights, layer.inputs)
    rises = Matrix([[max(x, 0) for x in row] for row in w.rows], w.exponent)
    falls = Matrix([[min(x, 0) for x in row] for row in w.rows], w.exponent)
    return [[Fraction(b) + x + y for b, x, y in zip(layer.biases, applied(rises, p), applied(falls, q))]
            for p, q in ((low, high), (high, low))]


def layers_on_box(weights, low, high):
    """Returns for each layer bounds (low, high) on its output before the activation, and the slopes of the activation
    there: intervals, intersected with a linear form G (x - c) + m with error at most E, where c is the centre of the
    box. For slopes in [a, b] and a point p of [l, u], |s(y) - s(p) - (a + b)/2 (y - p)| <= (b - a)/2 max(u - p, p -
    l)."""
    radius = [(h - l) / 2 for l, h in zip(low, high)]
    rounding = VALUE_UNIT * (1 + sum(radius))
    columns = [[Fraction(i == j) for i in range(len(low))] for j in range(len(low))]
    middle, error, result = [(l + h) / 2 for l, h in zip(low, high)], [Fraction(0)] * len(low), []
    for k, layer in enumerate(weights.layers):
        w = Matrix.of(layer.weights, layer.inputs)
        sizes = Matrix([list(map(abs, row)) for row in w.rows], w.exponent)
        bias = list(map(Fraction, layer.biases))
        columns = [list(map(down, applied(w, column))) for column in columns]
        middle = [down(b + y) for b, y in zip(bias, applied(w, middle))]
        error = [up(e + rounding) for e in applied(sizes, error)]
        spread = [e + sum(abs(column[i]) * r for column, r in zip(columns, radius)) for i, e in enumerate(error)]
        ends = layer_ends(layer, low, high)
        low = [max(l, m - s) for l, m, s in zip(ends[0], middle, spread)]
        high = [min(h, m + s) for h, m, s in zip(ends[1], middle, spread)]
        slopes = []
        result.append((low, high, slopes))
        if k + 1 == len(weights.layers):
            return result
        op = weights.between()[k]
        if op in SORTING:
            low, high = sorted_layer(op, low), sorted_layer(op, high)
            columns = [[Fraction(0)] * len(low) for _ in radius]
            middle = [down((l + h) / 2) for l, h in zip(low, high)]
            error = [up((h - l) / 2) + VALUE_UNIT for l, h in zip(low, high)]
            continue
        changed = layer.outputs - layer.kept
        slopes += [slopes_between(op, l, h) for l, h in zip(low[:changed], high)]
        for i, (l, h, (a, b)) in enumerate(zip(low, high, slopes)):
            p = max(l, min(middle[i], h))
            value = values_between(op, p, p)
            for column in columns:
                column[i] = down((a + b) / 2 * column[i])
            error[i] = up(abs(a + b) / 2 * error[i] + (b - a) / 2 * max(h - p, p - l) + value[1] - value[0] + rounding)
            middle[i] = down(value[0] + (a + b) / 2 * (middle[i] - p))
        slopes += [KEPT_SLOPES] * layer.kept
        low, high = values_behind(op, layer, low, high)


def values_behind(op, layer, low, high):
    """Returns bounds on the output after the activation; the last entries that the layer keeps are unchanged."""
    changed = layer.outputs - layer.kept
    ends = [values_between(op, l, h) for l, h in zip(low[:changed], high)]
    return [a for a, _ in ends] + low[changed:], [b for _, b in ends] + high[changed:]


def enclosed_values(weights, low, high):
    """Returns bounds on the outputs for inputs between low and high, layer by layer."""
    for k, layer in enumerate(weights.layers):
        if k > 0:
            op = weights.between()[k - 1]
            if op in SORTING:
                low, high = sorted_layer(op, low), sorted_layer(op, high)
            else:
                low, high = values_behind(op, weights.layers[k - 1], low, high)
        low, high = layer_ends(layer, low, high)
    return low, high


# --- values over boxes ---------------------------------------------------------------------------------------------

class Bounded:
    """lower <= x <= upper, entry by entry, and |computed - x| <= error if a float32 evaluation is bounded."""

    def __init__(self, lower, upper, error):
        self.lower, self.upper, self.error = lower, upper, error

    def sizes(self):
        return [max(abs(l), abs(u)) for l, u in zip(self.lower, self.upper)]


def layer_bounds(layer, inputs):
    """Returns (lower, upper, error) of W h + b; error is None if it is not requested or cannot be bounded."""
    size = layer.inputs
    ends, exponent = dyadics([float(x) for x in inputs.lower + inputs.upper])
    errors, error_exponent = dyadics([float(x) for x in inputs.error or []])
    w = Matrix.of(layer.weights, size)
    unit = power(w.exponent + exponent)
    lower, upper, error = [], [], []
    for row, bias in zip(w.rows, layer.biases):
        rising, falling = [max(x, 0) for x in row], [min(x, 0) for x in row]
        lower.append(Fraction(bias) + unit * (sum(map(mul, rising, ends[:size])) + sum(map(mul, falling, ends[size:]))))
        upper.append(Fraction(bias) + unit * (sum(map(mul, rising, ends[size:])) + sum(map(mul, falling, ends[:size]))))
        if inputs.error is not None:
            absolute = list(map(abs, row))
            before = sum(map(mul, absolute, errors)) * power(w.exponent + error_exponent)
            largest = sum(map(mul, absolute, map(max, map(abs, ends[:size]), map(abs, ends[size:])))) * unit
            error.append(rounding_error(size + 1, abs(Fraction(bias)) + largest + before, before))
    return lower, upper, error if inputs.error is not None and None not in error else None


def rounding_error(n, size, before):
    """Returns the error bound of a float32 sum of n summands whose absolute values add up to `size`, in any order; None
    if it might overflow."""
    nu = n * power(-24)
    if n > 1 << 23 or size + n * power(-149) > power(126):
        return None
    return before + (nu + nu * nu) * size + n * power(-148)


def sum_bounds(terms, size, is_float32):
    """Returns bounds on a sum of terms, each given as (Bounded, minimum count, maximum count)."""
    lower, upper, error = [Fraction(0)] * size, [Fraction(0)] * size, []
    for i in range(size):
        for term, fewest, most in terms:
            lower[i] += (fewest if term.lower[i] >= 0 else most) * term.lower[i]
            upper[i] += (most if term.upper[i] >= 0 else fewest) * term.upper[i]
        if is_float32:
            before = sum(most * term.error[i] for term, _, most in terms)
            largest = sum(most * term.sizes()[i] for term, _, most in terms)
            error.append(rounding_error(1 + sum(most for _, _, most in terms), largest + before, before))
    return lower, upper, error if is_float32 and None not in error else None


# --- the checker ---------------------------------------------------------------------------------------------------

class Checker:
    def __init__(self, certificate, network):
        self.c, self.network = certificate, network
        self.norms, self.proved, self.local = {}, {}, set()

    def run(self):
        require_keys(self.c, ["schema", "tool", "statement", "network", "box", "layers", "bounds", "laws",
                              "values", "content_sha256"], "certificate")
        require(self.c["schema"] == SCHEMA, "another schema")
        sorting = any(step["op"] in SORTING for weights in self.c["network"]["weights"].values()
                      for step in weights["chain"])
        keeping = any(layer.kept for weights in self.network.parts.values() for layer in weights.layers)
        require(self.c["statement"] == STATEMENT + SORTING_STATEMENT * sorting + KEEPING_STATEMENT * keeping +
                INVARIANTS_STATEMENT * self.network.invariants +
                (SILENT_STATEMENT + ", ".join(self.network.silent_names()) + ".") * bool(self.network.silent),
                "another statement")
        require(self.c["content_sha256"] == content_sha256(self.c), "content_sha256 does not match")
        require(isinstance(self.c["tool"], str), "tool is not text")
        self.check_network(self.c["network"])
        self.check_boxes(self.c["box"])
        expected = [(name, layer) for name in sorted(self.network.parts) for layer in self.network.parts[name].layers]
        require(len(self.c["layers"]) == len(expected), "layers does not list every layer")
        for entry, (name, layer) in zip(self.c["layers"], expected):
            self.check_layer(entry, name, layer)
        require(len(listed(self.c["bounds"])) > 0, "bounds is empty")
        for bound in self.c["bounds"]:
            self.check_bound(bound)
        for law in listed(self.c["laws"]):
            self.check_law(law)
        for entry in listed(self.c["values"]):
            self.check_values(entry)

    def check_network(self, named):
        require_keys(named, ["description_sha256", "as", "weights"], "network")
        require(named["as"] in (None, "float32"), "network.as is unknown")
        if named["as"] == "float32":
            for weights in self.network.parts.values():
                weights.round_to_float32()
        require(named["description_sha256"] == self.network.sha256,
                "network.description_sha256 differs: the certificate was made for another network")
        require(set(named["weights"]) == set(self.network.parts), "other networks")
        for name, weights in self.network.parts.items():
            entry, where = named["weights"][name], f"network.weights.{name}"
            require_keys(entry, ["sha256", "precision", "chain", "samples"], where)
            require((entry["sha256"], entry["precision"]) == (weights.sha256, weights.precision),
                    f"{where} differs: the certificate was made for other weights")
            if weights.activations is None and len(weights.layers) > 1:  # the file does not state them: the chain does
                ops = [step["op"] for step in entry["chain"] if step["op"] not in ("clamp", "linear")]
                try:
                    weights.state(ops)
                except BadInput as fault:
                    raise Rejected(f"{where}: {fault}") from None
            self.check_chain(entry["chain"], name, where)
            self.check_samples(entry["samples"], where)

    def check_chain(self, stated, name, where):
        chain = self.network.chain(name)
        require(isinstance(stated, list) and len(stated) == len(chain), f"{where}: another chain")
        for step, (op, layer, inputs, outputs) in zip(stated, chain):
            require_keys(step, ["op", "layer", "inputs", "outputs"], where)
            require(type(step["inputs"]) is type(step["outputs"]) is int, f"{where}: a size is no integer")
            require(step == {"op": op, "layer": layer, "inputs": inputs, "outputs": outputs}, f"{where}: another chain")

    def check_samples(self, samples, where):
        if samples is None:
            return
        require_keys(samples, ["sha256", "count", "tolerance", "tolerance_hex", "largest_deviation",
                               "largest_deviation_hex"], where)
        require(isinstance(samples["sha256"], str) and re.fullmatch("[0-9a-f]{64}", samples["sha256"]) is not None,
                f"{where}: no hash of samples")
        require(type(samples["count"]) is int and samples["count"] >= 1, f"{where}: no number of samples")
        deviation, tolerance = (number(samples[key], samples[key + "_hex"], where)
                                for key in ("largest_deviation", "tolerance"))
        require(deviation <= tolerance, f"{where}: the largest deviation is above the tolerance")

    def check_boxes(self, boxes):
        """Requires null, or intervals for the inputs of networks that have a box, whether or not a bound uses them."""
        if boxes is None:
            return
        require(isinstance(boxes, dict) and boxes, "box is neither null nor an object with boxes")
        for part, box in boxes.items():
            require(part in self.network.parts and not part.startswith("rho:"),
                    f"box.{part} does not belong to a network with a box")
            require_keys(box, ["lower", "upper"], f"box.{part}")
            low, high = hex_floats(box["lower"]), hex_floats(box["upper"])
            require(len(low) == len(high) == self.network.parts[part].layers[0].inputs, f"box.{part} has another size")
            require(all(a <= b for a, b in zip(low, high)), f"box.{part} is empty")

    def check_layer(self, entry, name, layer):
        where = f"layer {name} {layer.name}"
        require_keys(entry, ["network", "name", "spectral_norm", "spectral_norm_hex", "proof"], where)
        require((entry["network"], entry["name"]) == (name, layer.name), f"{where} is not where it is expected")
        lower, upper = (number(entry["spectral_norm"][i], entry["spectral_norm_hex"][i], where) for i in (0, 1))
        require_keys(entry["proof"], ["lower_vector", "upper"], where)
        vector = hex_floats(entry["proof"]["lower_vector"])
        require(len(vector) == layer.inputs and any(vector), f"{where}: unusable lower_vector")
        w, v = Matrix.of(layer.weights, layer.inputs), Matrix.of(vector, 1)
        square = lambda m: (m.transposed() @ m).fraction(0, 0)
        require(square(w @ v) >= Fraction(lower) ** 2 * square(v), f"{where}: claims more than |W v| / |v|")
        self.check_upper([w], entry["proof"]["upper"], upper, where)
        self.norms[name] = self.norms.get(name, 1) * Fraction(upper)

    def check_upper(self, chain, proof, upper, where, slopes=()):
        require_keys(proof, ["rho", "t", "factor"], where)
        rho, t, factor = hex_float(proof["rho"]), hex_floats(proof["t"]), proof["factor"]
        require(rho > 0 and all(x >= 0 for x in t), f"{where}: rho is not positive, or a t negative")
        require(len(t) == sum(len(m.rows) for m in chain[:-1]), f"{where}: needs one t per hidden neuron")
        require(Fraction(upper) ** 2 >= Fraction(rho), f"{where}: claims less than sqrt(rho)")
        require(shows_or_finds(bent_lmi(chain, slopes, rho, t) if set(slopes) - {(0, 1)} else lmi(chain, rho, t),
                               parse_factor(factor, where)),
                f"{where}: the factor does not show that the matrix inequality holds")

    def check_bound(self, bound):
        require_keys(bound, ["function", "domain", "block", "law", "norm", "scale", "unit", "upper", "upper_hex",
                             "upper_method", "status", "lower", "lower_hex", "lower_witness", "proof"]
                     + ["neighbours"] * ("neighbours" in bound), "bound")
        function, block = bound["function"], bound["block"]
        require(isinstance(function, str) and isinstance(block, str), "bound: a name is not text")
        where = f"bound {function} {block}"
        names, scale = networks_of(function), hex_floats(bound["scale"])
        block_coordinates(self.network, function, block)
        require(all(s > 0 for s in scale), f"{where}: scale is not positive")
        boxed = bound["domain"] == "box"
        require(isinstance(self.c["box"], dict) if boxed else bound["domain"] == "global", f"{where}: unknown domain")
        require(bound["norm"] == ("weighted_l2" if scale else "l2"), f"{where}: another norm")
        require(bound["unit"] == unit_of(self.network, function, block), f"{where}: another unit")
        require(bound["law"] == ("one_neighbour" if len(names) == 2 else "none"), f"{where}: another law")
        require(not scale or len(scale) == self.network.parts[names[0]].layers[0].inputs,
                f"{where}: scale has another size")
        neighbours = self.neighbours_of(bound, where)
        upper = number(bound["upper"], bound["upper_hex"], where)
        require(bound["status"] in ("finished", "interrupted"), f"{where}: unknown status")
        require(all(name in self.network.parts for name in names), f"{where}: no such function")
        activations = {op for name in names for op in self.network.parts[name].between()}
        if not activations <= {"relu"}:
            require(bound["upper_method"] != "branch", f"{where}: a bound by parts of a box is for ReLU only")
            require(activations.isdisjoint(SORTING) or bound["upper_method"] in ("product", "local_product"),
                    f"{where}: a bound from slopes of single numbers")
        if self.network.maps_to_invariants(function):
            require(not boxed and bound["upper_method"] != "branch" and not scale and block == "all",
                    f"{where}: of rotation invariants, only bounds for all inputs together")
            require(bound["lower"] is None and bound["lower_hex"] is None and bound["lower_witness"] is None,
                    f"{where}: a lower bound of a function of rotation invariants")
        if bound["upper_method"] in ("sdp", "eclipse_fast"):
            self.check_upper(stages(self.network, function, block, scale), bound["proof"], upper, where,
                             slope_ranges(self.network, function))
        elif bound["upper_method"] == "local_sdp":
            slopes = [s for layer in self.slopes_on_box(names[0], boxed, where) for s in layer]
            if len(names) == 2:
                behind = self.network.parts[names[1]]
                slopes += [KEPT_SLOPES if i >= layer.outputs - layer.kept else
                           (Fraction(0) if op in MONOTONE else 1 - STEEPEST[op], STEEPEST[op])
                           for op, layer in zip(behind.between(), behind.layers[:-1]) for i in range(layer.outputs)]
            self.check_upper(stages(self.network, function, block, scale, divided=False), bound["proof"], upper, where,
                             slopes)
        elif bound["upper_method"] == "branch":
            self.check_local(bound, upper, scale, where)
        else:
            is_local = bound["upper_method"] == "local_product"
            require((is_local or bound["upper_method"] == "product") and bound["proof"] is None,
                    f"{where}: unknown upper_method")
            require(all(name in self.norms for name in names), f"{where}: no such function")
            total = (Fraction(max(scale)) if scale else Fraction(1)) * self.network.slope_of_inputs(function)
            for name in names:
                part = self.network.parts[name]
                total *= self.norms[name]
                if is_local and name == names[0]:
                    for layer in self.slopes_on_box(name, boxed, where):
                        total *= max((max(b, -a) for a, b in layer), default=Fraction(1))
                else:
                    total *= math.prod(max(STEEPEST[op], 1) if layer.kept else STEEPEST[op]
                                       for op, layer in zip(part.between(), part.layers))
            require(Fraction(upper) >= total, f"{where}: claims less than the product of the norms")
        if not scale:
            key = (function, block, frozenset(neighbours.items()))
            self.proved[key] = Fraction(upper)
            if bound["upper_method"] in ("branch", "local_sdp", "local_product") and boxed:
                self.local.add(key)
        if bound["lower_witness"] is None:
            require(bound["lower"] is None and bound["lower_hex"] is None, f"{where}: lower has no witness")
            return
        lower = number(bound["lower"], bound["lower_hex"], where)
        self.check_lower(bound, Fraction(lower), scale, boxed, where)

    def slopes_on_box(self, part, boxed, where):
        """Returns for each hidden layer the slope ranges of its neurons over the box; none for a layer that is
        sorted."""
        require(boxed and part[:4] != "rho:", f"{where}: slopes on a box of a bound without one")
        require(not self.network.invariants, f"{where}: slopes on a box of a network of rotation invariants")
        low, high = self.box_of(part, where, limited=False)
        return [slopes for _, _, slopes in layers_on_box(self.network.parts[part], low, high)[:-1]]

    def neighbours_of(self, bound, where):
        """Returns the largest number of neighbours of each kind for a set function; empty: any number."""
        if "neighbours" not in bound:
            return {}
        names = networks_of(bound["function"])
        require(isinstance(bound["neighbours"], dict), f"{where}: neighbours is not an object")
        neighbours = {kind: integer(count) for kind, count in bound["neighbours"].items()}
        require(len(names) == 2 and bound["domain"] == "box",
                f"{where}: neighbours may be given only for a set function on a box")
        require(all(kind != "ground" and f"phi:{kind}" in self.network.parts and 1 <= count <= 1000000
                    for kind, count in neighbours.items()), f"{where}: impossible neighbours")
        require(neighbours and (names[0] == "phi:ground" or names[0][4:] in neighbours),
                f"{where}: the neighbour that moves is not among those listed")
        return neighbours

    def box_of(self, part, where, limited=True):
        """Returns the part's box after the input clamp. `limited`: requires a size that proofs by parts support."""
        require(part in self.c["box"] and part in self.network.parts, f"{where}: no box for {part}")
        low, high = (hex_floats(self.c["box"][part][side]) for side in ("lower", "upper"))
        require(len(low) == len(high) == self.network.parts[part].layers[0].inputs,
                f"{where}: the box has another size")
        if self.network.clamp and part != "phi:ground":
            clamp = list(zip(*self.network.clamp))
            low, high = ([min(max(x, a), b) for x, (a, b) in zip(side, clamp)] for side in (low, high))
        require(not limited or all(-2.0 ** 100 <= a <= b <= 2.0 ** 100 for a, b in zip(low, high)),
                f"{where}: the box is empty or too large")
        return [Fraction(x) for x in low], [Fraction(x) for x in high]

    def term_layers(self, phi, rho):
        """Returns the layers of V phi(x), where V is the first layer of rho without its bias."""
        layers = [Hidden(layer) for layer in self.network.parts[phi].layers]
        layers[-1].without_relu = len(layers[-1].biases)
        return layers + [Hidden(self.network.parts[rho].layers[0], False, False)]

    def check_others(self, others, names, neighbours, where):
        """Returns bounds on the contribution of the other terms of the sum before the first ReLU of rho."""
        counts = dict(neighbours)
        if names[0] != "phi:ground":
            counts[names[0][4:]] -= 1
            counts = {kind: count for kind, count in counts.items() if count > 0}
            if "phi:ground" in self.network.parts:
                counts["ground"] = 1
        require(isinstance(others, dict) and len(others) == len(counts),
                f"{where}: others does not list the kinds of the other neighbours")
        rows = self.network.parts[names[1]].layers[0].outputs
        least, most = [Fraction(0)] * rows, [Fraction(0)] * rows
        for kind, count in counts.items():
            part, here = f"phi:{kind}", f"{where} {kind}"
            require_keys(others[part], ["tree", "least", "most"], here)
            low, high = ([Fraction(x) for x in hex_floats(others[part][end])] for end in ("least", "most"))
            require(len(low) == len(high) == rows, f"{here}: the range belongs to something else")
            require(isinstance(others[part]["tree"], str), f"{here}: the tree is not text")
            layers = self.term_layers(part, names[1])
            reason = tree_fails(layers, [self.box_of(part, here)], others[part]["tree"],
                                lambda at, index: index == 0 and all(
                                    a <= l and u <= b for a, (l, u), b in zip(low, at.bounds[-1], high)))
            require(not reason, f"{here}: {reason}")
            for i in range(rows):
                least[i] += low[i] if kind == "ground" else count * min(low[i], 0)
                most[i] += high[i] if kind == "ground" else count * max(high[i], 0)
        return least, most

    def check_local(self, bound, upper, scale, where):
        proof = bound["proof"]
        coupled, everywhere = "others" in proof, bound["domain"] == "global"
        require_keys(proof, ["rho", "tree", "multipliers"] + (["others", "forms"] if coupled else ["form"])
                     + ["radius"] * everywhere + ["conflicts"] * ("conflicts" in proof), where)
        names = networks_of(bound["function"])
        require(all(name in self.network.parts for name in names), f"{where}: no such function")
        require(not names[0].startswith("rho:"), f"{where}: rho has no box")
        forms = None
        layers = self.network.parts[names[0]].layers
        if coupled:
            neighbours = self.neighbours_of(bound, where)
            require(neighbours, f"{where}: a bound for any number of neighbours needs a form")
            behind_rho = self.network.parts[names[1]].layers
            require(len(behind_rho) > 1, f"{where}: rho has no hidden layer")
            require(len(layers) > 1, f"{where}: no hidden layer")
            hidden = self.term_layers(*names)[:-2]
            behind = self.term_layers(*names)[-2:-1] + [Hidden(layer) for layer in behind_rho[:-1]]
            behind[1].least, behind[1].most = self.check_others(proof["others"], names, neighbours, where)
            last = Matrix.of(behind_rho[-1].weights, behind_rho[-1].inputs)
            gram = last.transposed() @ last
            inputs = len(behind[0].biases)
            forms = Forms([self.form_of_part(form, inputs, behind[1:], where) for form in listed(proof["forms"])],
                          hidden, behind,
                          [[gram.fraction(i, j) for j in range(len(gram.rows))] for i in range(len(gram.rows))])
            gram = None
        else:
            require(len(layers) > 1, f"{where}: no hidden layer")
            require((proof["form"] is None) == (len(names) == 1), f"{where}: a form for set functions only")
            hidden = [Hidden(layer) for layer in layers[:-1]]
            last = Matrix.of(layers[-1].weights, layers[-1].inputs)
            gram = last.transposed() @ last
            if len(names) == 2:
                gram = last.transposed() @ self.checked_form(proof["form"], names[1], where) @ last
            gram = [[gram.fraction(i, j) for j in range(len(gram.rows))] for i in range(len(gram.rows))]
        rho = hex_float(proof["rho"])
        require(rho > 0 and Fraction(upper) ** 2 >= Fraction(rho), f"{where}: claims less than sqrt(rho)")

        moving = block_coordinates(self.network, names[0], bound["block"])
        require(not scale or len(scale) == layers[0].inputs, f"{where}: scale has another size")
        weight = [Fraction(scale[k]) if scale else Fraction(1) for k in moving]
        if everywhere:
            radius = [Fraction(r) for r in hex_floats(proof["radius"])]
            require(len(radius) == layers[0].inputs and min(radius) > 0, f"{where}: needs a positive radius per input")
            require(max(radius) <= 2 ** 100, f"{where}: the box is empty or too large")
            boxes = projective_cover(radius)
            for layer in hidden:
                layer.homogeneous(layer is hidden[-1])
        else:
            boxes = [self.box_of(names[0], where)]
        require(2.0 ** -400 <= rho <= 2.0 ** 400, f"{where}: rho is out of range")
        require(all(2.0 ** -200 <= w <= 2.0 ** 200 for w in weight), f"{where}: scale is out of range")
        if not coupled and proves_in_double(hidden, boxes, proof, gram, moving, weight, rho):
            return
        multipliers = []
        for text in listed(proof["multipliers"]):
            multipliers.append([Fraction(x) for x in hex_floats([w for w in re.split("[ \t\n\v\f\r]+", text) if w])])
        require(all(len(t) == sum(len(layer.biases) for layer in hidden) and min(t) >= 0 for t in multipliers),
                f"{where}: multipliers are not one nonnegative number per hidden neuron")
        conflicts = [conflicts_in(text, where) for text in listed(proof.get("conflicts", [""] * len(multipliers)))]
        require(len(conflicts) == len(multipliers), f"{where}: there are conflicts for other multipliers")
        require(all(c[0] < c[2] < sum(len(layer.biases) for layer in hidden) and 0 <= c[4] <= 1
                    for some in conflicts for c in some), f"{where}: a conflict is not between two neurons")
        require(isinstance(proof["tree"], str), f"{where}: the tree is not text")
        square = scaled_identity(rho, len(moving))
        reason = tree_fails(hidden, boxes, proof["tree"],
                            lambda part, index: index < len(multipliers) and (
                                part.gram or gram) is not None and part_holds(
                                hidden, part.gram or gram, moving, weight, part.bounds, square, multipliers[index],
                                shown(hidden, part.low, part.high, part.bounds, conflicts[index])), forms)
        require(not reason, f"{where}: {reason}")

    def form_of_part(self, form, size, rho_layers, where):
        """Reads (Q, t). Forms verifies whether it holds in a part."""
        require_keys(form, ["q", "t"], where)
        values = []
        for key in "q", "t":
            require(isinstance(form[key], str), f"{where}: a form is not text")
            values.append([Fraction(x) for x in hex_floats([w for w in re.split("[ \t\n\v\f\r]+", form[key]) if w])])
        q, t = values
        require(len(q) == size * (size + 1) // 2 and len(t) == sum(len(layer.biases) for layer in rho_layers),
                f"{where}: a form has another size")
        require(min(t) >= 0 and max(map(abs, q + t)) <= 2 ** 400,
                f"{where}: a form is out of range, or a t of it negative")
        return [[q[max(i, j) * (max(i, j) + 1) // 2 + min(i, j)] for j in range(size)] for i in range(size)], t

    def checked_form(self, form, name, where):
        """Returns a verified Q with |rho(v) - rho(w)|^2 <= (v - w)' Q (v - w)."""
        require_keys(form, ["q", "t", "factor"], where)
        chain = stages(self.network, name, "all", [])
        size, t = len(chain[0].rows[0]), hex_floats(form["t"])
        triangle = [hex_floats([w for w in re.split("[ \t\n\v\f\r]+", row) if w]) for row in listed(form["q"])]
        require([len(row) for row in triangle] == list(range(1, size + 1)), f"{where}: q is not a lower triangle")
        require(len(t) == sum(len(m.rows) for m in chain[:-1]) and all(x >= 0 for x in t), f"{where}: unusable t")
        q = Matrix.of([triangle[max(i, j)][min(i, j)] for i in range(size) for j in range(size)], size)
        require(shows_or_finds(quadratic_lmi(chain, q, t), parse_factor(form["factor"], where)),
                f"{where}: the factor does not show that the matrix inequality holds")
        return q

    def point(self, array, part, boxed, where):
        values = hex_floats(array)
        require(part in self.network.parts and len(values) == self.network.parts[part].layers[0].inputs,
                f"{where}: a point of another size")
        require(all(abs(x) <= 3.5e38 and f32(x) == x for x in values), f"{where}: a coordinate is not a float32")
        if boxed:
            require(part in self.c["box"], f"{where}: no box for {part}")
            low, high = (hex_floats(self.c["box"][part][side]) for side in ("lower", "upper"))
            require(len(low) >= len(values) and len(high) >= len(values), f"{where}: the box is too small")
            require(all(a <= x <= b for a, x, b in zip(low, values, high)), f"{where}: a point is outside of the box")
        return values

    def seen(self, part, values):
        """Returns the values after the clamp."""
        if self.network.clamp and (part == "network" or (part.startswith("phi:") and part != "phi:ground")):
            low, high = self.network.clamp
            values = [float(min(max(x, a), b)) for x, a, b in zip(values, low, high)]
        return values

    def term(self, part, values):
        return evaluate(self.network.parts[part], *dyadics(self.seen(part, values)))

    def check_lower(self, bound, lower, scale, boxed, where):
        witness, function = bound["lower_witness"], bound["function"]
        names = networks_of(function)
        require_keys(witness, ["x", "y", "others"], where)
        x, y = (self.point(witness[key], names[0], boxed, where) for key in "xy")
        others = []
        for other in listed(witness["others"]):
            require_keys(other, ["network", "x"], where)
            require(len(names) == 2 and str(other["network"]).startswith("phi:"), f"{where}: no neighbour")
            others.append((other["network"], self.point(other["x"], other["network"], boxed, where)))
        if len(names) == 2:
            grounds = [n for n in [names[0]] + [o for o, _ in others] if n == "phi:ground"]
            require(len(grounds) == ("phi:ground" in self.network.parts), f"{where}: the ground enters exactly once")
        neighbours, there = self.neighbours_of(bound, where), [names[0]] + [o for o, _ in others]
        require(not neighbours or all(there.count(o) <= neighbours.get(o[4:], 0) for o in there if o != "phi:ground"),
                f"{where}: has more neighbours than listed")
        require(not self.network.is_silent_among(function, there), f"{where}: 0 among these neighbours")
        block = block_coordinates(self.network, function, bound["block"])
        require(all(a == b for k, (a, b) in enumerate(zip(x, y)) if k not in block), f"{where}: leaves its block")
        run = sum(((Fraction(a) - Fraction(b)) / (Fraction(s) if scale else 1)) ** 2
                  for a, b, s in zip(x, y, scale or x))
        require(run > 0, f"{where}: x == y")
        require(not scale or len(scale) == len(x), f"{where}: scale has another size")
        is_relu = all(self.network.parts[part].is_relu() for part in there + names[1:])
        rise = (self.exact_rise if is_relu else self.least_rise)(names, x, y, others)
        require(lower ** 2 * run <= rise, f"{where}: claims more than the slope between x and y")

    def exact_rise(self, names, x, y, others):
        """Returns |f(x) - f(y)|^2 for ReLU networks, exactly."""
        outputs = []
        for moved in (x, y):
            value = self.term(names[0], moved)
            for part, fixed in others:
                value = add(value, self.term(part, fixed))
            outputs.append(evaluate(self.network.parts[names[1]], *value) if len(names) == 2 else value)
        difference, exponent = add(outputs[0], ([-v for v in outputs[1][0]], outputs[1][1]))
        return sum(v * v for v in difference) * power(2 * exponent)

    def least_rise(self, names, x, y, others):
        """Returns a lower bound on |f(x) - f(y)|^2 from enclosures of both values."""
        ends = []
        for moved in (x, y):
            terms = [enclosed_values(self.network.parts[part], *[list(map(Fraction, self.seen(part, point)))] * 2)
                     for part, point in [(names[0], moved)] + others]
            low, high = ([sum(column) for column in zip(*side)] for side in zip(*terms))
            ends.append(enclosed_values(self.network.parts[names[1]], low, high) if len(names) == 2 else (low, high))
        return sum(max(a - d, c - b, 0) ** 2 for a, b, c, d in zip(*ends[0], *ends[1]))

    def check_law(self, law):
        require_keys(law, ["rho", "neighbours", "domain", "block", "law", "status", "upper", "upper_hex"], "law")
        where = f"law of {law['rho']} {law['block']}"
        require(law["status"] in ("finished", "interrupted"), f"{where}: unknown status")
        upper = Fraction(number(law["upper"], law["upper_hex"], where))
        require(isinstance(law["neighbours"], dict), f"{where}: neighbours is not an object")
        require("ground" not in law["neighbours"], f"{where}: the ground is not a neighbour")
        terms = {kind: integer(count) for kind, count in law["neighbours"].items()}
        listed_ = frozenset(terms.items())
        if "phi:ground" in self.network.parts:
            terms["ground"] = 1
        require(law["block"] in ("all", "position", "velocity"), f"{where}: no law for this block")
        require(law["domain"] in ("box", "global"), f"{where}: unknown domain")
        total = squares = Fraction(0)
        for kind, count in terms.items():
            require(1 <= count <= 1000000, f"{where}: impossible number of neighbours")
            key = (f"set:{kind}:{law['rho']}", law["block"], frozenset())
            require(key in self.proved, f"{where}: no bound of {key[0]}")
            require(law["domain"] == "box" or key not in self.local, f"{where}: rests on a bound for a box only")
            bound = self.proved[key]
            if law["domain"] == "box":
                bound = min(bound, self.proved.get(key[:2] + (listed_,), bound))
            total += count * bound
            squares += count * bound ** 2
        require(law["law"] in ("all_stacked", "all_max", "own_state"), f"{where}: unknown law")
        require(upper ** 2 >= squares if law["law"] == "all_stacked" else upper >= total,
                f"{where}: claims less than the law gives")

    def check_values(self, entry):
        """Verifies range, jump and float32 error over a box, layer by layer."""
        require_keys(entry, ["function", "neighbours", "domain", "input_error", "networks", "sum", "lower", "upper",
                             "jump", "jump_hex", "float32_error", "float32_error_hex"], "values")
        require(isinstance(entry["function"], str), "values: function is not text")
        where, names = f"values of {entry['function']}", networks_of(entry["function"])
        require(not self.network.invariants, f"{where}: of a function of rotation invariants")
        is_set, is_float32 = len(names) == 2, entry["input_error"] is not None
        require(names[0] != "phi:ground" if is_set else names == ["network"],
                f"{where}: possible only for the network, or for a sum")
        count = entry["neighbours"]
        require(type(count) is int, f"{where}: neighbours is not an integer")
        require(1 <= count <= 1000000 if is_set else count == 0, f"{where}: impossible number of neighbours")
        inputs = names[:1] + ["phi:ground"] * (is_set and "phi:ground" in self.network.parts)
        used = inputs + names[1:]
        require(all(name in self.network.parts for name in used), f"{where}: no such function")
        require(isinstance(entry["networks"], dict) and set(entry["networks"]) == set(used),
                f"{where}: networks lists others")
        if is_float32:
            require(isinstance(entry["input_error"], dict) and set(entry["input_error"]) == set(inputs),
                    f"{where}: input_error is not of the function's inputs")
            require(all(self.network.parts[name].precision == "float32" for name in used),
                    f"{where}: a float32 error of weights that are not float32")
            require(all(self.network.parts[name].is_relu() for name in used),
                    f"{where}: a float32 error is for ReLU only")
        require((entry["sum"] is not None) == is_set,
                f"{where}: a sum must be given for set functions, and only for them")
        terms = []
        for name in inputs:
            result = self.follow_layers(name, entry, self.values_input(name, entry, where), where)
            terms.append((result, 1, 1) if name == "phi:ground" else (result, 0, count))
        if is_set:
            size = self.network.parts[names[1]].layers[0].inputs
            result = self.stated(entry["sum"], size, sum_bounds(terms, size, is_float32), is_float32, f"{where}: sum")
            result = self.follow_layers(names[1], entry, result, where)
        lower, upper = ([Fraction(x) for x in hex_floats(entry[key])] for key in ("lower", "upper"))
        silent = self.network.silent_up_to(entry["function"], count)
        require(len(lower) == len(upper) == len(result.lower), f"{where}: needs one range per output")
        require(silent == 0 or (max(lower) <= 0 <= min(upper)), f"{where}: the range lacks a 0")
        require(silent == count + 1 or all(
            a <= l and u <= b for a, l, u, b in zip(lower, result.lower, result.upper, upper)),
            f"{where}: the values leave the range")
        require((entry["jump"] is not None) == (entry["jump_hex"] is not None) == is_set,
                f"{where}: a jump of set functions only")
        if is_set:
            jump = Fraction(number(entry["jump"], entry["jump_hex"], where))
            key = (names[1], "all", frozenset())
            require(key in self.proved, f"{where}: no bound of {names[1]}")
            require(jump ** 2 >= self.proved[key] ** 2 * sum(x * x for x in terms[0][0].sizes()),
                    f"{where}: claims less than the jump")
            for kinds in self.network.beside_silent(entry["function"]):
                require(jump ** 2 >= self.largest_square(kinds, names[1], entry, where),
                        f"{where}: claims less than the step to a 0")
        require((entry["float32_error"] is not None) == (entry["float32_error_hex"] is not None) == is_float32,
                f"{where}: a float32 error must be given if there are input errors, and only then")
        if is_float32:
            error = Fraction(number(entry["float32_error"], entry["float32_error_hex"], where))
            require(error ** 2 >= sum(x * x for x in result.error), f"{where}: claims less than the float32 error")

    def largest_square(self, kinds, rho, entry, where):
        """Returns an upper bound on |f|^2 for exactly these neighbours."""
        without_error = dict(entry, input_error=None)
        low = high = [Fraction(0)] * self.network.parts[rho].layers[0].inputs
        for part in ["phi:" + kind for kind in kinds] + ["phi:ground"] * ("phi:ground" in self.network.parts):
            box = self.values_input(part, without_error, where)
            least, most = enclosed_values(self.network.parts[part], box.lower, box.upper)
            low, high = ([a + b for a, b in zip(*sides)] for sides in ((low, least), (high, most)))
        low, high = enclosed_values(self.network.parts[rho], low, high)
        return sum(max(abs(a), abs(b)) ** 2 for a, b in zip(low, high))

    def values_input(self, name, entry, where):
        """Returns bounds on the input of the first layer of a network."""
        if entry["domain"] == "box":
            require(isinstance(self.c["box"], dict), f"{where}: there is no box")
            lower, upper = self.box_of(name, where, limited=False)
        else:
            require(entry["domain"] == "clamp" and self.network.clamp and name != "phi:ground",
                    f"{where}: no such domain")
            lower, upper = ([Fraction(x) for x in side] for side in self.network.clamp)
        error = None
        if entry["input_error"] is not None:
            error = [Fraction(x) for x in hex_floats(entry["input_error"][name])]
            require(len(error) == len(lower) and min(error) >= 0,
                    f"{where}: needs one input error per input, none negative")
        return Bounded(lower, upper, error)

    def stated(self, stated, size, found, is_float32, where):
        """Returns the bounds stated for a vector, which must enclose the computed ones."""
        require_keys(stated, ["lower", "upper", "error"], where)
        require((stated["error"] is not None) == is_float32,
                f"{where}: an error must be given if there are input errors, and only then")
        values = []
        for key in ["lower", "upper"] + ["error"] * is_float32:
            require(isinstance(stated[key], str), f"{where}: {key} is not text")
            values.append([Fraction(x) for x in hex_floats([w for w in re.split("[ \t\n\v\f\r]+", stated[key]) if w])])
            require(len(values[-1]) == size, f"{where}: needs one number per output")
        lower, upper, error = found
        require(all(a <= b for a, b in zip(values[0], lower)) and all(a <= b for a, b in zip(upper, values[1])),
                f"{where}: the values leave the bounds")
        if is_float32:
            require(error is not None and all(a <= b for a, b in zip(error, values[2])),
                    f"{where}: claims less than the float32 error")
        return Bounded(values[0], values[1], values[2] if is_float32 else None)

    def follow_layers(self, name, entry, inputs, where):
        layers = self.network.parts[name].layers
        require(isinstance(entry["networks"][name], list) and len(entry["networks"][name]) == len(layers),
                f"{where}: {name} needs one entry per layer")
        if not self.network.parts[name].is_relu():
            found = layers_on_box(self.network.parts[name], inputs.lower, inputs.upper)
            for layer, stated, (low, high, _) in zip(layers, entry["networks"][name], found):
                result = self.stated(stated, layer.outputs, (low, high, None), False, f"{where}: {name}")
            return result
        for k, (layer, stated) in enumerate(zip(layers, entry["networks"][name])):
            if k > 0:
                inputs = Bounded([max(x, Fraction(0)) for x in inputs.lower],
                                 [max(x, Fraction(0)) for x in inputs.upper], inputs.error)
            inputs = self.stated(stated, layer.outputs, layer_bounds(layer, inputs), inputs.error is not None,
                                 f"{where}: {name}")
        return inputs


def check(certificate, network):
    """Returns "" if the certificate is accepted, else the reason. A malformed certificate yields a reason, not an
    exception."""
    try:
        Checker(certificate, network).run()
    except Rejected as reason:
        return str(reason)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as fault:
        return f"malformed: {type(fault).__name__} {fault}"
    return ""


def unique(pairs):
    if len({key for key, _ in pairs}) != len(pairs):
        raise ValueError("a key appears twice")
    return dict(pairs)


def refuse_constant(text):
    raise ValueError(f"{text} is not JSON")


def parse(text):
    """Parses JSON. A byte order mark is refused, as by json.loads()."""
    return json.loads(text, object_pairs_hook=unique, parse_constant=refuse_constant)


def read_certificate(path):
    """Returns the JSON object of a certificate file. Raises ValueError for another kind of file."""
    certificate = parse(Path(path).read_bytes().decode())
    if not isinstance(certificate, dict):
        raise ValueError("is not a JSON object")
    if certificate.get("schema") != SCHEMA:
        raise ValueError(f'schema must be "{SCHEMA}": is this the right file?')
    return certificate


def main(arguments):
    options, positional = {}, []
    while arguments:
        word = arguments.pop(0)
        if word in ("--phi", "--rho", "--key", "--activation") and arguments:
            options[word[2:]] = arguments.pop(0)
        elif word == "--order" and arguments:
            part, _, order = arguments.pop(0).rpartition("=")
            options.setdefault("orders", {})[part or "network"] = order.split(",")
        else:
            positional.append(word)
    if len(positional) != (1 if "phi" in options else 2):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    try:
        network = Network(*positional[1:], **options)
        certificate = read_certificate(positional[0])
    except Exception as fault:  # any exception means that the file cannot be read
        print(f"cannot be read: {type(fault).__name__} {fault}", file=sys.stderr)
        return 3
    reason = check(certificate, network)
    print(f"rejected: {reason}" if reason else "accepted")
    return 1 if reason else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
