"""ONNX models for check_certificate.py as chains of layers, with the standard library only. Every value of the graph is
an affine map of the outputs of the last layer. Each number of it is a double, computed exactly and rounded once per
operation, with a bound on its error, which decides how a value that may be negative passes a ReLU. Piecewise linear
functions are written with ReLU."""
import itertools
import math
import re
import struct

from onnx_file import MOST_NUMBERS, MOST_ROWS, need, Node, protobuf, Refused, signed, Tensor, Unread, with_groups_joined
from onnx_maps import exactly, Map, MINUS_ONE, ONE, opposite, stacked, Value, ZERO
from onnx_operators import (
    average_map, axis_of, broadcast, concatenated, convolution_map, flattened, gemm_map, matmul_map, need_exact_cast,
    need_inference, need_trailing_axes, normalization, padded, pooling, reshaped, sizes_between, sorting, squeezed,
    transposition, unsqueezed)

SMOOTH = {"Tanh": "tanh", "Sigmoid": "sigmoid", "Softplus": "softplus", "Elu": "elu", "Celu": "elu", "Gelu": "gelu",
          "Swish": "silu"}


def layer_name(weight, names):
    """Returns the name of the layer with these weights, given the `names` of the previous layers."""
    name = weight[:-7] if weight.endswith(".weight") and len(weight) > 7 else weight
    while not name or name in names:
        name = f"layer{len(names) + 1}" + (f"_{name}" if name else "")
    return name


class Layers:
    """The chain: names, maps, numbers of outputs that the activation behind a layer leaves unchanged, activations."""

    def __init__(self, width):
        self.width, self.names, self.maps, self.kept, self.ops, self.size = width, [], [], [], [], 0

    def append(self, first, rows, shifts, kept):
        self.size += len(rows) * self.width
        need(self.size <= MOST_NUMBERS, "the network as a chain of dense layers has more than 2^25 numbers",
             "certify a smaller network")
        self.names.append(layer_name(first, self.names))
        self.maps.append((self.width, rows, shifts))
        self.kept.append(kept)
        self.width = len(rows)

    def is_never_negative(self, row, shift):
        behind_relu = self.ops[-1] == "relu" if self.ops else not row
        return shift[0] >= shift[1] and behind_relu and all(value >= radius for value, radius in row.values())

    def activated(self, op, own, first, carried):
        """Appends a layer with activation `op`; returns its outputs and the maps `carried` past it as maps of its
        outputs. They pass a ReLU as x if x >= 0, else as relu(x) - relu(-x), and other activations unchanged."""
        is_relu = op == "relu"
        rows, shifts, known = [], [], {}
        if not is_relu:
            rows, shifts = list(own.rows), list(own.shifts)

        def taken(row, shift):
            key = next(iter(row.items())) if len(row) == 1 and shift == ZERO else None
            if key not in known:
                rows.append(row)
                shifts.append(shift)
                if key is None:
                    return len(rows) - 1
                known[key] = len(rows) - 1
            return known[key]

        which = [taken(row, shift) for row, shift in zip(own.rows, own.shifts)] if is_relu else range(len(own.rows))
        behind = []
        for one in carried:
            maps, constants = [], []
            for row, shift in zip(one.rows, one.shifts):
                maps.append({taken(row, shift): ONE} if row else {})
                constants.append(ZERO if row else shift)
                if row and is_relu and not self.is_never_negative(row, shift):
                    k = taken({column: opposite(x) for column, x in row.items()}, opposite(shift))
                    maps[-1][k] = MINUS_ONE
            behind.append(Map([dict(sorted(row.items())) for row in maps], constants))
        self.append(first, rows, shifts, 0 if is_relu else len(rows) - len(own.rows))
        self.ops.append(op)
        return Map([{k: ONE} for k in which], [ZERO] * len(own.rows)), behind


class Graph:
    def __init__(self, nodes, stored, name, shape, output, operator_set):
        self.stored, self.output, self.operator_set = stored, output, operator_set
        self.layers, self.values = Layers(math.prod(shape)), {}
        self.values[name] = Value(Map.identity(self.layers.width), shape)
        self.uses = {output: 1}
        for node in nodes:
            for used in self.used(node):
                self.uses[used] = self.uses.get(used, 0) + 1

    @staticmethod
    def used(node):
        return node.inputs[:1] if node.kind in ("BatchNormalization", "Dropout") else node.inputs

    def input(self, node, k):
        return node.inputs[k] if k < len(node.inputs) else ""

    def value(self, node, k):
        need(self.input(node, k) in self.values, "does not use the output of the preceding node")
        return self.values[node.inputs[k]]

    def constant(self, node, k):
        name = self.input(node, k)
        need(name == "" or name in self.stored, f'uses "{name}" as an input that must be stored')
        return self.stored[name] if name else None

    def needed_constant(self, node, k):
        need(self.input(node, k), "lacks its weights or biases")
        return self.constant(node, k)

    def broadcast(self, node, k, shape):
        """Returns the numbers of the constant input `k` of an elementwise node, one per entry of `shape`."""
        tensor = self.needed_constant(node, k)
        need_trailing_axes(node, tensor, shape, self.operator_set)
        return broadcast(tensor, shape)

    def integers(self, node, k, attribute):
        """Returns integers that older operator sets store in an attribute and newer ones in input `k`."""
        if attribute in node.attributes:
            return node.listed(attribute)
        tensor = self.constant(node, k)
        return tensor.integers() if tensor else []

    def needed_after(self, node):
        return sorted((name for name in self.values if self.uses[name] > node.inputs.count(name)), key=str.encode)

    def with_layer(self, node, op, own, first, also=()):
        """Returns op(own) and the maps `also`, carried past it together with all values that later nodes need."""
        needed = self.needed_after(node)
        result, behind = self.layers.activated(op, own, first, [*also, *(self.values[name].map for name in needed)])
        for name, one in zip(needed, behind[len(also):]):
            self.values[name] = Value(one, self.values[name].shape)
        for name, value in self.values.items():
            self.values[name] = Value(value.map, value.shape)
        return result, behind[:len(also)]

    def sum_of_relus(self, node, x, terms, shift=None):
        """Returns shift + the sum of factors relu(term), for `terms` as (term, factors)."""
        rectified, _ = self.with_layer(node, "relu", stacked([term for term, _ in terms]), x.first)
        size, result = len(x.map.rows), None
        for k, (_, factors) in enumerate(terms):
            part = rectified.selected(range(k * size, (k + 1) * size)).scaled(factors)
            result = part if result is None else result.plus(part)
        return Value(result.shifted(shift) if shift else result, x.shape)

    def clipped(self, node, x, least, most):
        """Returns min(max(x, least), most); each limit may be None, or without bound."""
        def limits(tensor, outwards):
            numbers = broadcast(tensor, x.shape) if tensor else []
            if all(outwards * value > 2.0 ** 127 for value, _ in numbers):  # the largest float32 means no limit
                return []
            need(all(abs(value) <= 2.0 ** 127 for value, _ in numbers),
                 "its minimum or maximum is not a number within 2^127", "leave out a limit that no value reaches")
            return numbers
        low, high = limits(least, -1), limits(most, 1)
        need(not low or not high or all(a <= b for a, b in zip(low, high)), "its minimum is above its maximum")
        if low and high:
            return self.sum_of_relus(node, x, [(x.map.shifted(low, -1), [ONE]), (x.map.shifted(high, -1), [MINUS_ONE])],
                                     low)
        if low:
            return self.sum_of_relus(node, x, [(x.map.shifted(low, -1), [ONE])], low)
        if high:
            return self.sum_of_relus(node, x, [(x.map.scaled([MINUS_ONE]).shifted(high), [MINUS_ONE])], high)
        return x

    def largest(self, node, x, windows, shape):
        """Returns the largest entry of each window, by max(a, b) = b + relu(a - b) for pairs."""
        own, first = x.map, x.first
        while any(len(window) > 1 for window in windows):
            pairs = [pair for window in windows for pair in zip(window[::2], window[1::2])]
            single = [window[-1] for window in windows if len(window) % 2]
            base, rest = own.selected([b for _, b in pairs]), own.selected(single)
            difference = own.selected([a for a, _ in pairs]).plus(base, -1)
            rectified, (base, rest) = self.with_layer(node, "relu", difference, first, (base, rest))
            own, first = stacked([rectified.plus(base), rest]), ""
            pair, alone = itertools.count(), itertools.count(len(pairs))
            windows = [[next(pair) for _ in range(len(window) // 2)] + [next(alone) for _ in range(len(window) % 2)]
                       for window in windows]
        return Value(own.selected([k for (k,) in windows]), shape, first)

    def largest_of_inputs(self, node):
        first = next(self.values[name] for name in node.inputs if name in self.values)
        sign, parts, size = [MINUS_ONE if node.kind == "Min" else ONE], [], len(first.map.rows)
        for k, name in enumerate(node.inputs):
            if name in self.values:
                need(self.values[name].shape == first.shape, "its inputs are of different shapes")
                part = self.values[name].map
            else:
                part = Map([{}] * size, broadcast(self.needed_constant(node, k), first.shape))
            parts.append(part.scaled(sign))
        windows = [[k * size + i for k in range(len(parts))] for i in range(size)]
        result = self.largest(node, Value(stacked(parts), first.shape, first.first), windows, first.shape)
        return Value(result.map.scaled(sign), result.shape, result.first)

    def piecewise_linear(self, node):
        if node.kind in ("Max", "Min"):
            return self.largest_of_inputs(node)
        x, f32 = self.value(node, 0), lambda number: struct.unpack("<f", struct.pack("<f", number))[0]
        scalar = lambda number: Tensor("", [], "float64", [number])
        if node.kind == "Relu":
            return self.sum_of_relus(node, x, [(x.map, [ONE])])
        if node.kind in ("MaxPool", "GlobalMaxPool"):
            covered, _, shape = pooling(node, x.shape)
            image = math.prod(x.shape[2:])
            windows = [[channel * image + at for at in inside] for channel in range(x.shape[1]) for inside in covered]
            return self.largest(node, x, windows, shape)
        if node.kind in ("Abs", "LeakyRelu", "PRelu"):
            slopes = {"Abs": lambda: [MINUS_ONE], "LeakyRelu": lambda: [exactly(node.number("alpha", f32(0.01)))],
                      "PRelu": lambda: self.broadcast(node, 1, x.shape)}[node.kind]()
            return self.sum_of_relus(node, x, [(x.map, [ONE]),
                                               (x.map.scaled([MINUS_ONE]), [opposite(slope) for slope in slopes])])
        if node.kind == "HardSigmoid":
            line = x.map.scaled([exactly(node.number("alpha", f32(0.2)))])
            line = line.shifted([exactly(node.number("beta", 0.5))] * len(line.rows))
            return self.clipped(node, Value(line, x.shape, x.first), scalar(0.0), scalar(1.0))
        limits = [(self.constant(node, k), name) for k, name in ((1, "min"), (2, "max"))]
        limits = [scalar(node.number(name, 0)) if name in node.attributes else limit for limit, name in limits]
        return self.clipped(node, x, *limits)

    def activation(self, node):
        x = self.value(node, 0)
        default = "use the activation with its default parameters"
        need(node.kind not in ("Elu", "Celu", "Swish") or node.number("alpha", 1) == 1, "alpha is not 1", default)
        need(node.text("approximate", "none") == "none", "approximate is not none", default)
        result, _ = self.with_layer(node, SMOOTH[node.kind], x.map, x.first)
        return Value(result, x.shape)

    def ordered(self, node, own, first, pairs):
        """Orders the rows of each pair, the larger one at its second place, by max(a, b) = b + relu(a - b) and
        min(a, b) = b - relu(b - a)."""
        smaller, larger = [list(some) for some in zip(*pairs)]
        others = [k for k in range(len(own.rows)) if k not in smaller and k not in larger]
        difference = own.selected(larger).plus(own.selected(smaller), -1)
        rectified, (base, rest) = self.with_layer(node, "relu", stacked([difference, difference.scaled([MINUS_ONE])]),
                                                  first, (own.selected(smaller), own.selected(others)))
        size = len(pairs)
        above, below = rectified.selected(range(size)), rectified.selected(range(size, 2 * size))
        found = dict(zip(smaller + larger + others, range(len(own.rows))))
        return stacked([base.plus(below, -1), base.plus(above), rest]).selected(
            [found[k] for k in range(len(own.rows))])

    def sorted_with_relu(self, node, x, op):
        """Returns the sorted value beside a skip connection, past which the sorting itself is not known."""
        size, name = len(x.map.rows), op.split(":")[1]
        if name == "halves":
            return self.ordered(node, x.map, x.first, [(size // 2 + k, k) for k in range(size // 2)])
        if name == "pairs":
            result = self.ordered(node, x.map, x.first, [(k + 1, k) for k in range(0, size, 2)])
            return result.selected([*range(0, size, 2), *range(1, size, 2)])
        need(int(name) <= 8, "sorts groups of more than 8 numbers beside a skip connection",
             "leave the skip connection out, or train with MaxMin or ReLU")
        result, first = x.map, x.first
        for turn in range(int(name)):  # odd-even transposition sort
            pairs = [(k, k + 1) for k in range(size) if k % int(name) in range(turn % 2, int(name) - 1, 2)]
            if pairs:
                result, first = self.ordered(node, result, first, pairs), ""
        return result

    def sorted(self, node):
        x = self.value(node, 0)
        op, shape, which = sorting(node, x.shape, self.integers)
        if self.needed_after(node):
            result = self.sorted_with_relu(node, x, op)
        else:
            result, _ = self.with_layer(node, op, x.map, x.first)
        return Value(result.selected(which), shape)

    def applied(self, x, map_and_shape, weight=""):
        one, shape = map_and_shape
        return Value(one.of(x.map, self.layers.width), shape, x.first or weight)

    def affine(self, node):
        if node.kind == "MatMul":
            is_left = self.input(node, 0) not in self.values
            weight, x = self.needed_constant(node, int(not is_left)), self.value(node, int(is_left))
            return self.applied(x, matmul_map(weight, is_left, x.shape), weight.name)
        x = self.value(node, 0)
        if node.kind == "BatchNormalization":
            factors, amounts = normalization(node, [self.needed_constant(node, k) for k in range(1, 5)], x.shape)
            return Value(x.map.scaled(factors).shifted(amounts), x.shape, x.first)
        if node.kind in ("AveragePool", "GlobalAveragePool"):
            return self.applied(x, average_map(node, x.shape))
        weight, bias = self.needed_constant(node, 1), self.constant(node, 2)
        make = gemm_map if node.kind == "Gemm" else convolution_map
        return self.applied(x, make(node, weight, bias, x.shape), weight.name)

    def elementwise(self, node):
        if node.kind == "Neg":
            x = self.value(node, 0)
            return Value(x.map.scaled([MINUS_ONE]), x.shape, x.first)
        need(len(node.inputs) == 2 or node.kind == "Sum", "does not have two inputs")
        base = next(k for k, name in enumerate(node.inputs) if name in self.values)
        x, sign = self.value(node, base), -1 if node.kind == "Sub" else 1
        result, first = x.map, x.first
        for k, name in enumerate(node.inputs):
            if k == base:
                continue
            if name in self.values:
                other = self.values[name]
                need(node.kind in ("Add", "Sub", "Sum"), "is not an affine function of the network's input")
                need(other.shape == x.shape, "its inputs are of different shapes")
                result, first = result.plus(other.map, sign), first or other.first
                continue
            numbers = self.broadcast(node, k, x.shape)
            if node.kind == "Mul":
                result = result.scaled(numbers)
            elif node.kind == "Div":
                need(base == 0, "divides a constant by a value")
                need(all(value != 0 for value, _ in numbers), "divides by 0")
                result = result.over(numbers)
            elif base > 0 and sign < 0:
                result = result.scaled([MINUS_ONE]).shifted(numbers)
            else:
                result = result.shifted(numbers, sign)
        return Value(result, x.shape, first)

    def layout(self, node):
        x = self.value(node, 0)
        if node.kind == "Concat":
            return concatenated([self.value(node, k) for k in range(len(node.inputs))], node.whole("axis", 0))
        if node.kind == "Pad":
            filler = self.constant(node, 2)
            filler = filler.numbers[0] if filler and filler.is_float() and filler.numbers else node.number("value", 0)
            return padded(node, x, self.integers(node, 1, "pads"), filler, self.constant(node, 3))
        if node.kind == "Transpose":
            shape, which = transposition(x.shape, node.listed("perm"))
            return Value(x.map.selected(which), shape, x.first)
        shape = x.shape
        if node.kind == "Dropout":
            need_inference(node, self.constant(node, 2))
        elif node.kind == "Cast":
            need(node.whole("to", 0) in (1, 11), "casts to a type that is neither float32 nor float64")
        elif node.kind == "Flatten":
            shape = flattened(shape, node.whole("axis", 1))
        elif node.kind == "Reshape":
            shape = reshaped(shape, self.integers(node, 1, "shape"), node.number("allowzero", 0) != 0)
        elif node.kind in ("Squeeze", "Unsqueeze"):
            shape = {"Squeeze": squeezed, "Unsqueeze": unsqueezed}[node.kind](shape, self.integers(node, 1, "axes"))
        return Value(x.map, shape, x.first)

    def computed(self, node):
        names = self.used(node)
        for name in names:
            need(not name or name in self.values or name in self.stored,
                 f'uses "{name}", which is neither stored nor computed before it')
        need(any(name in self.values for name in names), "does not use the output of the preceding node")
        handlers = {"MaxMin PairsMaxMin TopK": self.sorted,
                    "Gemm MatMul Conv BatchNormalization AveragePool GlobalAveragePool": self.affine,
                    "Add Sub Mul Div Neg Sum": self.elementwise,
                    "Identity Dropout Cast Flatten Reshape Squeeze Unsqueeze Transpose Concat Pad": self.layout,
                    "Relu LeakyRelu PRelu Clip Abs Max Min HardSigmoid MaxPool GlobalMaxPool": self.piecewise_linear,
                    " ".join(SMOOTH): self.activation}
        if node.kind in ("Softmax", "LogSoftmax") and node.outputs[0] == self.output:
            return self.value(node, 0)  # bounds are of the logits
        handler = next((f for kinds, f in handlers.items() if node.kind in kinds.split()), None)
        need(handler is not None, "is no operator that is read")
        return handler(node)

    def is_constant(self, node):
        if node.kind == "Shape" and node.inputs and node.inputs[0] in self.values:
            return True
        return is_constant(node, self.stored)

    def follow(self, node):
        constant, result = self.is_constant(node), None
        if constant:
            of_value = self.values.get(node.inputs[0]) if node.kind == "Shape" else None
            store(node, self.stored, of_value.shape if of_value else None)
        else:
            result = self.computed(node)
            need(all(math.isfinite(x) for row in result.map.rows for pair in row.values() for x in pair)
                 and all(math.isfinite(x) for pair in result.map.shifts for x in pair),
                 "its weights, or their folded values, are not finite", "take an earlier checkpoint")
        for name in self.used(node):
            self.uses[name] -= 1
            if self.uses[name] == 0:
                self.values.pop(name, None)
        if not constant and self.uses.get(node.outputs[0], 0) > 0:
            self.values[node.outputs[0]] = result


def is_constant(node, stored):
    return node.kind == "Constant" or bool(node.inputs and node.inputs[0]) and all(
        not name or name in stored for name in node.inputs)


def stated(node):
    """Returns the tensor of a Constant node, which states it in one of five attributes."""
    tensors = [v for n, v in node.attributes.get("value", []) if n == 5]
    if tensors:
        return Tensor.of(tensors[-1])
    name = next((name for name in ("value_float", "value_floats", "value_int", "value_ints")
                 if name in node.attributes), None)
    need(name is not None, "holds no tensor")
    if name == "value_int":
        need(abs(node.number(name, 0)) < 2 ** 53, "value_int is out of range")
    numbers = {"value_float": lambda: [node.number(name, 0)], "value_floats": lambda: node.floats(name),
               "value_int": lambda: [int(node.number(name, 0))], "value_ints": lambda: node.listed(name)}[name]()
    return Tensor("", [len(numbers)] if name.endswith("s") else [], "int64" if "int" in name else "float32", numbers)


def store(node, stored, sizes=None):
    """Adds what a node computes from constants, or from the shape of a value, `sizes`."""
    remedy = "fold constants: torch.onnx.export(..., do_constant_folding=True)"
    of_integers = lambda numbers: Tensor("", [len(numbers)], "int64", numbers)
    first = stored[node.inputs[0]] if node.inputs and sizes is None else None
    integers = lambda k: stored[node.inputs[k]].integers()
    if node.kind == "Constant":
        result = stated(node)
    elif node.kind == "Shape":
        result = of_integers(sizes_between(node, list(first.shape if sizes is None else sizes)))
    elif node.kind in ("Identity", "Cast"):
        result = first
        if node.kind == "Cast" and first.is_float():
            need_exact_cast(node.number("to", 0), first.numbers)
    elif node.kind == "Reshape" and first.is_float() and first.numbers:
        shape = node.listed("shape") if "shape" in node.attributes else integers(1)
        result = Tensor(first.name, reshaped(first.shape, shape), first.kind, first.numbers)
    elif node.kind in ("Reshape", "Squeeze", "Unsqueeze", "Flatten") and first.integers():
        result = first
    elif node.kind == "Transpose" and first.is_float() and first.numbers:
        shape, which = transposition(first.shape, node.listed("perm"))
        result = Tensor(first.name, shape, first.kind, [first.numbers[k] for k in which])
    elif node.kind == "Gather" and first.integers():
        result = of_integers([first.numbers[axis_of(k, len(first.numbers))] for k in integers(1)])
    elif node.kind == "Concat" and first.integers():
        result = of_integers([number for k in range(len(node.inputs)) for number in integers(k)])
        need(len(result.numbers) <= 64, "its result has too many entries", remedy)
    else:
        raise Unread("is not computed from constants by this reader", remedy)
    is_named_anew = node.kind in ("Constant", "Identity", "Shape") or not result.name
    stored[node.outputs[0]] = Tensor(node.outputs[0] if is_named_anew else result.name, result.shape, result.kind,
                                     result.numbers)


def naming(what, work, *arguments):
    """Calls `work`; what it does not read is refused with its name."""
    try:
        return work(*arguments)
    except Unread as unread:
        raise Refused(f"{what}: {unread.args[0]}; {unread.args[1]}") from None


def input_shape(message, name, nodes, stored):
    """Returns the shape in a ValueInfoProto. One size that it leaves open is that of the first weights; that of the
    batch is 1."""
    found = [[message]]
    for number in 2, 1, 2:
        found.append([v for part in found[-1] for n, v in protobuf(part) if n == number])
    sizes = [next((v for n, v in protobuf(d) if n == 1), 0) for part in found[-1] for n, d in protobuf(part) if n == 1]
    sizes = [size if 0 < size <= MOST_NUMBERS else 0 for size in sizes] if found[-1] else [1, 0]
    sizes = sizes or [0]
    if len(sizes) > 8:
        raise Refused("the input has more than 8 dimensions")
    if len(sizes) > 1 and sizes[0] == 0:
        sizes[0] = 1
    if sizes.count(0) > 1:
        raise Refused("the model leaves open more than the size of the batch; export with inputs of a fixed size")
    if 0 in sizes:
        inputs = inputs_by_weights(name, nodes, stored)
        known = math.prod(size for size in sizes if size)
        if inputs % known != 0 or inputs < known:
            raise Refused("the shape of the input does not fit the first node")
        sizes[sizes.index(0)] = inputs // known
    if math.prod(sizes) > MOST_ROWS:
        raise Refused("the input has more than 2^20 entries")
    return sizes


def inputs_by_weights(current, nodes, stored):
    """Returns the number of inputs of the first weights that the graph's input reaches."""
    for node in nodes:
        if current not in node.inputs:
            continue
        is_first = node.inputs[0] == current
        weight = stored.get(node.inputs[int(is_first)]) if len(node.inputs) > 1 else None
        if node.kind in ("Gemm", "MatMul") and weight is not None and len(weight.shape) == 2:
            outputs_first = node.number("transB", 0) != 0 if node.kind == "Gemm" else not is_first
            return weight.shape[int(outputs_first)]
        current = node.outputs[0]
    raise Refused("the model does not state the size of its input")


DECIMAL = re.compile(r"-?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


def written_with_relu(name):
    """Returns (terms, constant) of a piecewise linear activation that is the constant plus the sum of factor
    relu(scale x + shift), for terms (scale, shift, factor); None for others."""
    if name == "relu6":
        return [(1.0, 0.0, 1.0), (1.0, -6.0, -1.0)], 0.0
    if name == "hardtanh":
        return [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0)], -1.0
    kind, colon, text = name.partition(":")
    if kind != "leaky_relu" or colon and not (DECIMAL.fullmatch(text) and abs(float(text)) <= 1e6):
        return None
    return [(1.0, 0.0, 1.0), (-1.0, 0.0, -float(text) if colon else -0.01)], 0.0


def rewritten(layers, activations, written):
    """Returns layers, activations and precision, as read(), of a network with `layers` as (inputs, rows, biases) and
    these activations, those with an entry of `written` replaced by ReLU."""
    exact_rows = lambda rows: [{column: exactly(x) for column, x in row.items() if x != 0} for row in rows]
    maps = [Map(exact_rows(rows), list(map(exactly, shifts))) for _, rows, shifts in layers]
    chain = Layers(layers[0][0])

    def behind(own, op, terms):
        if op != "relu" and not terms:
            return chain.activated(op, own, "", [])[0]
        parts, constant = terms or ([(1.0, 0.0, 1.0)], 0.0)
        size, result = len(own.rows), None
        arguments = [own.scaled([exactly(scale)]).shifted([exactly(shift)] * size) for scale, shift, _ in parts]
        rectified, _ = chain.activated("relu", stacked(arguments), "", [])
        for k, (_, _, factor) in enumerate(parts):
            part = rectified.selected(range(k * size, (k + 1) * size)).scaled([exactly(factor)])
            result = part if result is None else result.plus(part)
        return result.shifted([exactly(constant)] * size)

    def run():
        current = maps[0]
        for one, op, terms in zip(maps[1:], activations, written):
            current = one.of(behind(current, op, terms), chain.width)
        chain.append("", current.rows, current.shifts, 0)
    naming("the activation", run)
    return layers_of(chain)


def layers_of(chain):
    """Returns what read() returns."""
    numbers = [x for _, rows, shifts in chain.maps for x in itertools.chain(shifts, *(row.values() for row in rows))]
    found = [(name, width, [{column: x[0] for column, x in row.items()} for row in rows], [x[0] for x in shifts], kept)
             for name, (width, rows, shifts), kept in zip(chain.names, chain.maps, chain.kept)]
    return found, chain.ops, "float32" if all(map(is_float32, numbers)) else "float64"


def only(values, what):
    if len(values) != 1:
        raise Refused(f"the model has {len(values)} {what}, not one")
    return values[0]


def operator_set_of(model):
    """Returns the version of the operators of ONNX itself, and 0 if the model does not state it."""
    version = 0
    for fields in (list(protobuf(v)) for n, v in model if n == 8):
        domain = next((v for n, v in reversed(fields) if n == 1), b"")
        if domain in (b"", b"ai.onnx"):
            version = signed(next((v for n, v in reversed(fields) if n == 2 and isinstance(v, int)), 0))
    return version


def read(data):
    """Returns (layers, activations, precision): layers as (name, inputs, rows {column: number}, biases, kept), and
    activations behind all layers but the last, by their names in chains."""
    model = list(protobuf(data))
    graph = list(protobuf(only([v for n, v in model if n == 7], "graphs")))
    if any(n == 15 for n, _ in graph):
        raise Refused("sparse tensors are not read")
    tensors = [Tensor.of(value) for n, value in graph if n == 5]
    nodes = [Node.of(value) for n, value in graph if n == 1]
    named = lambda number: [("".join(v.decode() for n, v in protobuf(value) if n == 1), value)
                            for m, value in graph if m == number]
    stored = {tensor.name: tensor for tensor in tensors}
    name, message = only([(name, value) for name, value in named(11) if name not in stored], "inputs")
    output, _ = only(named(12), "outputs")
    names = [name] + list(stored) + [one for node in nodes for one in node.outputs if one]
    if len(stored) != len(tensors) or len(set(names)) != len(names):
        raise Refused("two values have the same name")
    rest = []
    for node in nodes:  # numbers first, which groups of nodes take
        if node.kind == "Constant" or node.kind == "Identity" and is_constant(node, stored):
            naming(f"node {node.label()}", store, node, stored)
        else:
            rest.append(node)
    nodes = with_groups_joined(rest, stored, output)
    followed = Graph(nodes, stored, name, input_shape(message, name, nodes, stored), output, operator_set_of(model))
    inputs, layers = followed.layers.width, followed.layers
    for node in nodes:
        naming(f"node {node.label()}", followed.follow, node)
    if output not in followed.values:
        raise Refused("the graph's output is not where its nodes end")
    last = followed.values[output]
    if not layers.names and last.map.is_identity(inputs):
        raise Refused("the graph has no linear layer")
    naming("the graph's output", layers.append, last.first, last.map.rows, last.map.shifts, 0)
    found, ops, precision = layers_of(layers)
    is_double = any(tensor.kind == "float64" for tensor in stored.values())
    return found, ops, "float64" if is_double else precision


def is_float32(number):
    value, radius = number
    return radius == 0 and abs(value) <= 2.0 ** 128 - 2.0 ** 104 and struct.unpack(
        "<f", struct.pack("<f", value))[0] == value
