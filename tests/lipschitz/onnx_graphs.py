"""ONNX models for check_certificate.py as chains of layers, with the standard library only. Every value of the graph is
an affine map of the outputs of the last layer. Each number of it is a double, computed exactly and rounded once per
operation, with a bound on its error, which decides how a value that may be negative passes a ReLU. Piecewise linear
functions are written with ReLU."""
import itertools
import math
import re
import struct

MOST_NUMBERS, MOST_PRODUCTS, MOST_ROWS, MOST_WINDOW_NUMBERS, MOST_STEP = 2 ** 25, 2 ** 30, 2 ** 20, 2 ** 23, 2 ** 20
EXPORT = "export a plain chain of linear layers with ReLU between them"


class Refused(Exception):
    """A model that is not read; the message names operator, node and remedy."""


class Unread(Exception):
    """A node that is not read: the reason, and a remedy."""


def need(condition, reason, remedy=EXPORT):
    if not condition:
        raise Unread(reason, remedy)


# --- the file ------------------------------------------------------------------------------------------------------

def varint(data, at):
    value = shift = 0
    while True:
        if at == len(data):
            raise Refused("the file is damaged: a protobuf number is cut off")
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return value, at


def protobuf(data):
    """Yields (field number, value) of a message; values of length-delimited and fixed fields are bytes."""
    at = 0
    while at < len(data):
        tag, at = varint(data, at)
        if tag & 7 == 0:
            value, at = varint(data, at)
            yield tag >> 3, value
        else:
            if not 0 < tag >> 3 < 2 ** 29 or tag & 7 not in (1, 2, 5):
                raise Refused("the file is damaged: there is no such protobuf field")
            length, at = {1: (8, at), 5: (4, at)}.get(tag & 7) or varint(data, at)
            if length > len(data) - at:
                raise Refused("the file is damaged: a protobuf field is longer than what holds it")
            yield tag >> 3, data[at:at + length]
            at += length


def integers_of(value):
    """Returns the integers of a repeated field, which may be stored as single numbers or packed."""
    if isinstance(value, int):
        return [value]
    result, at = [], 0
    while at < len(value):
        number, at = varint(value, at)
        result.append(number)
    return result


def signed(value):
    return value - 2 ** 64 if value >= 2 ** 63 else value


class Tensor:
    """`numbers`: floats or, for int64, integers; None for other types."""

    def __init__(self, name, shape, kind, numbers):
        self.name, self.shape, self.kind, self.numbers = name, shape, kind, numbers

    @staticmethod
    def of(message):
        fields = list(protobuf(message))
        shape = [d for n, v in fields if n == 1 for d in integers_of(v)]
        kind = {1: "float32", 7: "int64", 11: "float64"}.get(next((v for n, v in fields if n == 2), 0))
        raw = [v for n, v in fields if n in (4, 9, 10)]
        if len(raw) > 1 or any(n == 13 or n == 14 and v for n, v in fields):
            raise Refused("the numbers of a tensor are not in one piece")
        numbers = None
        if kind is not None:
            data = raw[0] if raw else b""
            code, width = {"float32": ("f", 4), "int64": ("q", 8), "float64": ("d", 8)}[kind]
            numbers = list(struct.unpack(f"<{len(data) // width}{code}", data))
            if kind == "int64" and not raw:
                numbers = [signed(k) for n, v in fields if n == 7 for k in integers_of(v)]
            if len(numbers) != math.prod(shape):
                raise Refused("a tensor contradicts its shape")
        return Tensor(next((v.decode() for n, v in fields if n == 8), ""), shape, kind, numbers)

    def is_float(self):
        return self.kind in ("float32", "float64")

    def integers(self):
        return self.numbers if self.kind == "int64" else []


class Node:
    """`attributes`: number, text, tensor or list of integers by name. `parts`: the nodes that this node replaces."""

    def __init__(self, kind, name, inputs, outputs, attributes, parts=()):
        self.kind, self.name, self.inputs, self.outputs = kind, name, inputs, outputs
        self.attributes, self.parts = attributes, parts

    @staticmethod
    def of(message):
        fields = list(protobuf(message))
        texts = lambda number: [v.decode() for n, v in fields if n == number]
        node = Node("".join(texts(4)[-1:]), "".join(texts(3)[-1:]), texts(1), texts(2), {})
        if texts(7) and texts(7)[-1] not in ("", "ai.onnx"):
            raise Refused(f"node {node.label()} is of an operator set that is not read")
        may_have_more = node.kind in ("Dropout", "BatchNormalization", "TopK", "Split")
        if not node.outputs or len(node.outputs) > 1 and not may_have_more:
            raise Refused(f"node {node.label()} has not exactly one output")
        for attribute in (list(protobuf(v)) for n, v in fields if n == 5):
            node.attributes["".join(v.decode() for n, v in attribute if n == 1)] = attribute
        return node

    def label(self):
        return self.kind + (f' "{self.name}"' if self.name else "")

    def number(self, name, otherwise):
        for n, v in reversed(self.attributes.get(name, [])):
            if n == 2 and isinstance(v, bytes) and len(v) == 4:
                return struct.unpack("<f", v)[0]
            if n == 3 and isinstance(v, int):
                return float(signed(v))
        return float(otherwise)

    def whole(self, name, otherwise):
        value = self.number(name, otherwise)
        need(abs(value) < 2 ** 30, f"{name} is out of range")
        return int(value)

    def text(self, name, otherwise):
        return next((v.decode() for n, v in reversed(self.attributes.get(name, [])) if n == 4), otherwise)

    def listed(self, name, otherwise=()):
        if name not in self.attributes:
            return list(otherwise)
        return [signed(k) for n, v in self.attributes[name] if n == 8 for k in integers_of(v)]


# --- activations in several nodes ----------------------------------------------------------------------------------

def gelu_from(node, takers, stored):
    """Returns the nodes of the GELU that starts with `node`: x / sqrt 2, Erf, + 1, times x, times 0.5; [] if none."""
    def holds(name, wanted, error=0.0):
        return name in stored and stored[name].is_float() and len(stored[name].numbers) == 1 and \
            abs(stored[name].numbers[0] - wanted) <= error

    def taker(kind, name, *second):
        """Returns the only node that uses `name`, if it is of this kind and its other input satisfies `second`."""
        (found,) = takers.get(name, []) if len(takers.get(name, [])) == 1 else [None]
        fits = found is not None and found.kind == kind and found.inputs.count(name) == 1
        others = [other for other in found.inputs if other != name] if fits else []
        return found if fits and len(others) == len(second) and all(is_(o) for is_, o in zip(second, others)) else None

    x, group = node.inputs[0], [node]
    if len(node.inputs) != 2 or not holds(node.inputs[1], math.sqrt(2), 1e-7):
        return []
    for kind, *second in (("Erf",), ("Add", lambda name: holds(name, 1.0)), ("Mul", lambda name: name == x),
                          ("Mul", lambda name: holds(name, 0.5))):
        following = taker(kind, group[-1].outputs[0], *second)
        if following is None:
            return []
        group.append(following)
    return group


def group_from(node, takers, stored):
    """Returns the nodes that together compute one activation, starting with `node`; the last node comes last."""
    if len(node.inputs) == 0:
        return []
    x, y = node.inputs[0], node.outputs[0]
    if node.kind == "Sigmoid" and [n.kind for n in takers.get(y, [])] == ["Mul"]:
        (product,) = takers[y]
        return [node, product] if sorted(product.inputs) == sorted([x, y]) else []
    if node.kind == "Div":
        return gelu_from(node, takers, stored)
    if node.kind == "Split" and len(node.outputs) == 2 and len(set(node.outputs)) == 2:
        pair = takers.get(y, [])
        if takers.get(node.outputs[1], []) != pair or any(sorted(n.inputs) != sorted(node.outputs) for n in pair):
            return []
    elif node.kind == "ReduceMax":
        pair = takers[x]
    else:
        return []
    larger, smaller = ("Max", "Min") if node.kind == "Split" else ("ReduceMax", "ReduceMin")
    pair = sorted(pair, key=lambda n: n.kind)
    if [n.kind for n in pair] != [larger, smaller] or any(n.inputs[0] != x for n in pair) and node.kind != "Split":
        return []
    results = [n.outputs[0] for n in pair]
    both = takers.get(results[0], []) + takers.get(results[1], [])
    if len(both) != 2 or both[0] is not both[1] or both[0].kind != "Concat" or both[0].inputs != results:
        return []
    return [node] * (node.kind == "Split") + pair + both[:1]


def with_groups_joined(nodes, stored, output):
    """Replaces each group by one node at the position of its last node: "Swish", "Gelu", "MaxMin" of halves,
    "PairsMaxMin". Another node that uses a value inside a group then refers to an unknown value and is refused."""
    takers = {output: [None]}
    for node in nodes:
        for name in set(node.inputs):
            takers.setdefault(name, []).append(node)
    takers.pop(output)  # what the graph gives is inside no group
    groups = {id(group[-1]): group for group in (group_from(node, takers, stored) for node in nodes) if group}
    inner = {id(node) for group in groups.values() for node in group}
    joined = []
    for node in nodes:
        if id(node) in groups:
            group = groups[id(node)]
            kind = {"Sigmoid": "Swish", "Div": "Gelu", "Split": "MaxMin", "ReduceMax": "PairsMaxMin"}[group[0].kind]
            joined.append(Node(kind, node.name, group[0].inputs[:1], node.outputs, {}, group))
        elif id(node) not in inner:
            joined.append(node)
    return joined


# --- numbers with a bound on their error ---------------------------------------------------------------------------

ZERO, ONE, MINUS_ONE = (0.0, 0.0), (1.0, 0.0), (-1.0, 0.0)
UNIT, LEAST, TINY, UP = 2.0 ** -53, 2.0 ** -1074, 2.0 ** -960, 1 + 2.0 ** -26


def exactly(value):
    return value, 0.0


def opposite(a):
    return -a[0], a[1]


def dyadic(x):
    """Returns x as an integer times a power of two."""
    need(math.isfinite(x), "its weights, or their folded values, are not finite", "take an earlier checkpoint")
    fraction, exponent = math.frexp(x)
    return int(fraction * 2 ** 53), exponent - 53


class Sum:
    """Sums numbers and products exactly; rounded once, when it is read."""

    def __init__(self):
        self.mantissa, self.exponent, self.radius = 0, 0, 0.0

    def add_exactly(self, mantissa, exponent):
        if mantissa == 0:
            return
        lowest = min(exponent, self.exponent) if self.mantissa else exponent
        self.mantissa = (self.mantissa << (self.exponent - lowest) if self.mantissa else 0) + \
            (mantissa << (exponent - lowest))
        self.exponent = lowest

    def widen(self, radius):
        if radius > 0:
            self.radius = (self.radius + radius) * (1 + 2 * UNIT)

    def plus(self, a):
        self.add_exactly(*dyadic(a[0]))
        self.widen(a[1])
        return self

    def plus_product(self, a, b):
        (m, e), (n, f) = dyadic(a[0]), dyadic(b[0])
        self.add_exactly(m * n, e + f)
        radius = 0.0
        if a[1] > 0 or b[1] > 0:
            radius = (abs(a[0]) * b[1] + abs(b[0]) * a[1] + a[1] * b[1]) * UP + LEAST
        if m != 0 and n != 0 and abs(a[0] * b[0]) < TINY:
            radius += 2 * LEAST
        self.widen(radius)
        return self

    def nearest(self):
        try:
            if self.exponent >= 0:
                return float(self.mantissa << self.exponent)
            return self.mantissa / (1 << -self.exponent)
        except OverflowError:
            raise Unread("its weights, or their folded values, are not finite", "take an earlier checkpoint") from None

    def value(self):
        result = self.nearest()
        rest = Sum()
        rest.mantissa, rest.exponent = self.mantissa, self.exponent
        mantissa, exponent = dyadic(result)
        rest.add_exactly(-mantissa, exponent)
        if rest.mantissa == 0 and self.radius == 0:
            return result, 0.0
        missed = max(LEAST, abs(rest.nearest())) if rest.mantissa else 0.0
        return result, (missed + self.radius) * UP + LEAST


def times(a, b):
    return Sum().plus_product(a, b).value()


def plus(a, b):
    return Sum().plus(a).plus(b).value()


def is_product(x, a, b):
    difference = Sum().plus_product(exactly(a), exactly(b)).plus(exactly(-x))
    return difference.mantissa == 0


def error_of(x):
    return abs(x) * UNIT + LEAST


def divided(a, b):
    quotient = a[0] / b[0]
    is_exact = a[0] == 0 or min(abs(quotient), abs(a[0])) >= TINY and is_product(a[0], quotient, b[0])
    radius = 0.0 if is_exact else error_of(quotient)
    if a[1] > 0 or b[1] > 0:
        divisor = (abs(b[0]) - b[1]) * (1 - 4 * UNIT)
        radius = (radius + (a[1] + (abs(quotient) + error_of(quotient)) * b[1]) / divisor) * UP + LEAST
    return quotient, radius


def square_root(a):
    root = math.sqrt(a[0])
    radius = 0.0 if a[0] >= TINY and is_product(a[0], root, root) else error_of(root)
    if a[1] > 0:
        radius = (radius + a[1] / (root * (1 - UNIT))) * UP + LEAST
    return root, radius


# --- affine maps ---------------------------------------------------------------------------------------------------

class Map:
    """x -> M x + c: `rows` holds {column: number} without exact zeros, `shifts` the numbers of c."""

    def __init__(self, rows, shifts):
        self.rows, self.shifts = rows, shifts

    @staticmethod
    def identity(size):
        return Map([{i: ONE} for i in range(size)], [ZERO] * size)

    def is_identity(self, inputs):
        return len(self.rows) == inputs and all(row == {i: ONE} for i, row in enumerate(self.rows)) and \
            all(shift == ZERO for shift in self.shifts)

    def of(self, first, inputs):
        """Returns x -> self(first(x)); `inputs`: number of inputs of `first`."""
        if first.is_identity(inputs):
            return self
        sizes = [len(row) for row in first.rows]
        if sum(sizes[k] for row in self.rows for k in row) > MOST_PRODUCTS:
            raise Unread("folding these layers takes too long", "certify a smaller network")
        rows, shifts = [], []
        for row, own in zip(self.rows, self.shifts):
            if len(row) == 1:
                ((k, outer),) = row.items()
                rows.append({c: x if outer == ONE else times(outer, x) for c, x in first.rows[k].items()})
            else:
                sums = {}
                for k, outer in row.items():
                    for column, inner in first.rows[k].items():
                        sums.setdefault(column, Sum()).plus_product(outer, inner)
                found = ((column, sums[column].value()) for column in sorted(sums))
                rows.append({column: x for column, x in found if x != ZERO})
            shift = Sum().plus(own)
            for k, outer in row.items():
                shift.plus_product(outer, first.shifts[k])
            shifts.append(shift.value())
        return Map(rows, shifts)

    def plus(self, other, sign=1):
        signed_ = opposite if sign < 0 else lambda x: x
        rows = []
        for a, b in zip(self.rows, other.rows):
            found = ((column, plus(a.get(column, ZERO), signed_(b.get(column, ZERO)))) for column in sorted({**a, **b}))
            rows.append({column: x for column, x in found if x != ZERO})
        return Map(rows, [plus(a, signed_(b)) for a, b in zip(self.shifts, other.shifts)])

    def scaled(self, factors):
        """`factors`: one for each row, or one for all."""
        rows, shifts = [], []
        for row, shift, factor in zip(self.rows, self.shifts, factors * (len(self.rows) if len(factors) == 1 else 1)):
            if factor != ONE:
                row = {} if factor == ZERO else {column: times(factor, x) for column, x in row.items()}
                shift = times(factor, shift)
            rows.append(row)
            shifts.append(shift)
        return Map(rows, shifts)

    def shifted(self, amounts, sign=1):
        return Map(self.rows, [plus(shift, opposite(a) if sign < 0 else a) for shift, a in zip(self.shifts, amounts)])

    def over(self, numbers):
        return Map([{column: divided(x, n) for column, x in row.items()} for row, n in zip(self.rows, numbers)],
                   [divided(shift, n) for shift, n in zip(self.shifts, numbers)])

    def selected(self, which):
        return Map([self.rows[k] for k in which], [self.shifts[k] for k in which])


def stacked(maps):
    return Map([row for one in maps for row in one.rows], [shift for one in maps for shift in one.shifts])


class Value:
    """A tensor that the network computes. `first`: name of its first weights since the last layer; "": none yet."""

    def __init__(self, map_, shape, first=""):
        self.map, self.shape, self.first = map_, shape, first


# --- operators -----------------------------------------------------------------------------------------------------

def axis_of(axis, rank):
    need(-rank <= axis < rank, f"axis {axis} does not exist")
    return axis % rank


def places(shape):
    """Yields the indices of all entries, row by row."""
    return itertools.product(*map(range, shape))


def index_of(place, shape):
    index = 0
    for at, size in zip(place, shape):
        index = index * size + at
    return index


def broadcast(tensor, shape):
    """Returns the numbers of a tensor, one per entry of `shape`."""
    need(tensor.is_float(), "its constant must be float32 or float64", "convert before exporting: model.float()")
    own = list(tensor.shape)
    while len(own) > len(shape) and own[0] == 1:
        own.pop(0)
    own = [1] * (len(shape) - len(own)) + own
    need(len(own) == len(shape) and all(n in (1, size) for n, size in zip(own, shape)),
         f"its constant of shape {tensor.shape} does not fit its input")
    return [exactly(tensor.numbers[index_of([0 if n == 1 else at for n, at in zip(own, place)], own)])
            for place in places(shape)]


def reshaped(shape, wanted, zero_is_zero=False):
    count = math.prod(shape)
    sizes = [shape[k] if size == 0 and not zero_is_zero and k < len(shape) else size for k, size in enumerate(wanted)]
    known = math.prod(size for size in sizes if size != -1)
    need(all(size == -1 or 1 <= size <= count for size in sizes) and sizes.count(-1) <= 1
         and (count % known == 0 if -1 in sizes else known == count), "its shape does not fit its input")
    return [count // known if size == -1 else size for size in sizes]


def flattened(shape, axis):
    at = len(shape) if axis == len(shape) else axis_of(axis, len(shape))
    return [math.prod(shape[:at]), math.prod(shape[at:])]


def squeezed(shape, axes):
    named = {axis_of(axis, len(shape)) for axis in axes}
    result = [size for d, size in enumerate(shape) if not (d in named if axes else size == 1)]
    need(math.prod(result) == math.prod(shape), "its axes do not fit its input")
    return result


def unsqueezed(shape, axes):
    rank = len(shape) + len(axes)
    named, rest = {axis_of(axis, rank) for axis in axes}, iter(shape)
    need(rank <= 16 and len(named) == len(axes), "its axes do not fit its input")
    return [1 if d in named else next(rest) for d in range(rank)]


def transposition(shape, permutation):
    """Returns the shape of the result and, for each of its entries, the index of the original entry."""
    rank = len(shape)
    axes = [axis_of(axis, rank) for axis in permutation] if permutation else list(range(rank))[::-1]
    need(sorted(axes) == list(range(rank)), "perm is not a permutation of its axes")
    result, which = [shape[axis] for axis in axes], []
    for place in places(result):
        original = [0] * rank
        for axis, at in zip(axes, place):
            original[axis] = at
        which.append(index_of(original, shape))
    return result, which


def matrix_of(tensor, outputs_first):
    need(tensor.is_float() and len(tensor.shape) == 2 and tensor.numbers,
         f"its weights of shape {tensor.shape} are no float32 or float64 matrix")
    first, second = tensor.shape
    rows = [tensor.numbers[i * second:(i + 1) * second] for i in range(first)]
    return rows if outputs_first else list(map(list, zip(*rows)))


def dense(rows, shifts):
    return Map([{j: x for j, x in enumerate(row) if x != ZERO} for row in rows], shifts)


def biases(tensor, factor, repeats, size):
    if tensor is None:
        return [ZERO] * size
    count = len(tensor.numbers) if tensor.is_float() else 0
    need(count == 1 or count > 0 and count * repeats == size, f"its bias of shape {tensor.shape} does not fit")
    return [times(factor, exactly(tensor.numbers[0 if count == 1 else i // repeats])) for i in range(size)]


def need_row(shape, axis, inputs):
    need(shape and shape[axis] == inputs and math.prod(shape) == inputs,
         f"takes {inputs} inputs, but gets the shape {shape}")


def gemm_map(node, weight, bias, shape):
    alpha, beta = exactly(node.number("alpha", 1)), exactly(node.number("beta", 1))
    need(node.number("transA", 0) == 0, "transposes its input")
    rows = [[exactly(x) if alpha == ONE else times(alpha, exactly(x)) for x in row]
            for row in matrix_of(weight, node.number("transB", 0) != 0)]
    need_row(shape, -1, len(rows[0]))
    return dense(rows, biases(bias, beta, 1, len(rows))), [1, len(rows)]


def matmul_map(weight, is_left, shape):
    rows = [[exactly(x) for x in row] for row in matrix_of(weight, is_left)]
    axis = len(shape) - (2 if is_left and len(shape) >= 2 else 1)
    need_row(shape, axis, len(rows[0]))
    return dense(rows, [ZERO] * len(rows)), shape[:axis] + [len(rows)] + shape[axis + 1:]


class Window:
    """Places of a window that slides along the axes behind the channels."""

    def __init__(self, node, shape, kernel):
        axes = len(kernel)
        need(axes > 0 and len(shape) == axes + 2 and shape[0] == 1,
             "its input must have the shape [1, channels, sizes...]")
        self.image, self.kernel = shape[2:], kernel
        self.stride, self.dilation = node.listed("strides", [1] * axes), node.listed("dilations", [1] * axes)
        for sizes in self.kernel, self.stride, self.dilation:
            need(len(sizes) == axes and all(1 <= size <= MOST_STEP for size in sizes),
                 "its strides or dilations do not fit its window")
        need(node.number("ceil_mode", 0) == 0, "ceil_mode is not 0")
        reach = [(k - 1) * d + 1 for k, d in zip(kernel, self.dilation)]
        mode, pads = node.text("auto_pad", "NOTSET"), node.listed("pads", [0] * 2 * axes)
        need(mode in ("NOTSET", "VALID", "SAME_UPPER", "SAME_LOWER"), "auto_pad is unknown")
        if mode == "NOTSET":
            need(len(pads) == 2 * axes, "pads does not fit its window")
            before, after = pads[:axes], pads[axes:]
        else:
            total = [0 if mode == "VALID" else max(0, (math.ceil(n / s) - 1) * s + r - n)
                     for n, s, r in zip(self.image, self.stride, reach)]
            before = [n // 2 if mode == "SAME_UPPER" else n - n // 2 for n in total]
            after = [n - b for n, b in zip(total, before)]
        need(all(0 <= pad <= MOST_STEP for pad in before + after), "pads does not fit its window")
        room = [n + b + a - r for n, b, a, r in zip(self.image, before, after, reach)]
        need(min(room) >= 0, "its window is larger than its input")
        self.before, self.out = before, [r // s + 1 for r, s in zip(room, self.stride)]

    def limit(self, factor, rows):
        if math.prod(self.out) * math.prod(self.kernel) * factor > MOST_WINDOW_NUMBERS or rows > MOST_ROWS:
            raise Unread("as a dense layer it has too many numbers", "certify a smaller network")

    def covered(self):
        """Returns for each place (number k of the window, entry that it covers), without padding."""
        result = []
        for place in places(self.out):
            start = [at * s - b for at, s, b in zip(place, self.stride, self.before)]
            inside = []
            for k, offset in enumerate(places(self.kernel)):
                at = [x + o * d for x, o, d in zip(start, offset, self.dilation)]
                if all(0 <= x < n for x, n in zip(at, self.image)):
                    inside.append((k, index_of(at, self.image)))
            result.append(inside)
        return result


def convolution_map(node, weight, bias, shape):
    need(weight.is_float() and len(weight.shape) >= 3 and weight.numbers,
         f"its weights of shape {weight.shape} are not a kernel")
    (outputs, per_group), kernel = weight.shape[:2], weight.shape[2:]
    window, groups = Window(node, shape, kernel), node.whole("group", 1)
    need(1 <= groups <= shape[1] and shape[1] == per_group * groups and outputs % groups == 0,
         f"its weights of shape {weight.shape} do not fit its input")
    count, image, size = math.prod(window.out), math.prod(window.image), math.prod(kernel)
    window.limit(outputs * per_group, outputs * count)
    covered, rows = window.covered(), []
    for o in range(outputs):
        first = o // (outputs // groups) * per_group
        for inside in covered:
            entries = (((first + c) * image + at, exactly(weight.numbers[(o * per_group + c) * size + k]))
                       for c in range(per_group) for k, at in inside)
            rows.append({column: x for column, x in entries if x != ZERO})
    return Map(rows, biases(bias, ONE, count, outputs * count)), [1, outputs] + window.out


def pooling(node, shape):
    """Returns for each place of a pooling window what it covers of a channel, its size, and the shape of the result."""
    need(len(shape) >= 3, "its input must have the shape [1, channels, sizes...]")
    kernel = shape[2:] if node.kind.startswith("Global") else node.listed("kernel_shape")
    window = Window(node, shape, kernel)
    window.limit(shape[1], shape[1] * math.prod(window.out))
    covered = [[at for _, at in inside] for inside in window.covered()]
    need(all(covered), "its window lies entirely in the padding")
    return covered, math.prod(kernel), shape[:2] + window.out


def average_map(node, shape):
    covered, size, result = pooling(node, shape)
    image, counts_padding = math.prod(shape[2:]), node.number("count_include_pad", 0) != 0
    shares = [divided(ONE, exactly(float(size if counts_padding else len(inside)))) for inside in covered]
    rows = [{channel * image + at: share for at in inside}
            for channel in range(shape[1]) for inside, share in zip(covered, shares)]
    return Map(rows, [ZERO] * len(rows)), result


def normalization(node, parameters, shape):
    """Returns for each entry factor and amount of batch normalization in inference, factor x + amount."""
    need(node.number("training_mode", 0) == 0, "is in training mode", "export the model after model.eval()")
    channels = shape[1] if len(shape) > 1 else 0
    need(all(tensor.is_float() and len(tensor.numbers) == channels for tensor in parameters),
         "its parameters do not fit its channels")
    epsilon = exactly(node.number("epsilon", struct.unpack("<f", struct.pack("<f", 1e-5))[0]))
    repeats, factors, amounts = math.prod(shape) // max(channels, 1), [], []
    for scale, bias, mean, variance in zip(*(map(exactly, tensor.numbers) for tensor in parameters)):
        squared = plus(variance, epsilon)
        need(squared[0] > squared[1], "its variance is not positive")
        factor = divided(scale, square_root(squared))
        factors += [factor] * repeats
        amounts += [Sum().plus(bias).plus_product(opposite(factor), mean).value()] * repeats
    return factors, amounts


def padded(node, x, pads, filler):
    rank = len(x.shape)
    need(node.text("mode", "constant") == "constant", "its mode is not constant")
    need(len(pads) == 2 * rank and all(a >= 0 and b >= 0 and a + b <= MOST_STEP for a, b in zip(pads, pads[rank:])),
         "pads does not fit its input")
    shape = [n + a + b for n, a, b in zip(x.shape, pads, pads[rank:])]
    need(math.prod(shape) <= MOST_ROWS, "its result has more than 2^20 entries", "certify a smaller network")
    result = Map([], [])
    for place in places(shape):
        at = [p - before for p, before in zip(place, pads)]
        is_inside = all(0 <= k < n for k, n in zip(at, x.shape))
        result.rows.append(x.map.rows[index_of(at, x.shape)] if is_inside else {})
        result.shifts.append(x.map.shifts[index_of(at, x.shape)] if is_inside else exactly(filler))
    return Value(result, shape, x.first)


def concatenated(parts, axis):
    first = parts[0].shape
    axis = axis_of(axis, len(first))
    need(all(len(part.shape) == len(first) and part.shape[:axis] + part.shape[axis + 1:] ==
             first[:axis] + first[axis + 1:] for part in parts), "its inputs are of different shapes")
    shape = first[:axis] + [sum(part.shape[axis] for part in parts)] + first[axis + 1:]
    need(math.prod(shape) <= MOST_ROWS, "its result has more than 2^20 entries", "certify a smaller network")
    pieces = []
    for before in range(math.prod(first[:axis])):
        for part in parts:
            size = math.prod(part.shape[axis:])
            pieces.append(part.map.selected(range(before * size, (before + 1) * size)))
    return Value(stacked(pieces), shape, parts[0].first)


SORTING = ("MaxMin is Split into two halves, their Max and Min, and Concat, or ReduceMax and ReduceMin of pairs along "
           "the last axis and Concat; GroupSort is TopK of the whole last axis")


def sorting(node, shape, integers):
    """Returns the name of the operation in chains, the shape of the result, and which sorted number each entry is."""
    rank, which = len(shape), list(range(math.prod(shape)))
    if node.kind == "MaxMin":
        split, concat = node.parts[0], node.parts[-1]
        axis = axis_of(split.whole("axis", 0), rank)
        half = shape[axis] // 2
        need(shape[axis] == 2 * half and integers(split, 1, "split") in ([], [half, half]),
             "joins parts that are not halves", SORTING)
        need(axis_of(concat.whole("axis", 0), rank) == axis and math.prod(shape[:axis]) == 1,
             "does not join the halves of the whole layer along the axis of the Split before it", SORTING)
        return "maxmin:halves", shape, which
    if node.kind == "PairsMaxMin":
        *reduced, concat = node.parts
        for one in reduced:
            axes = integers(one, 1, "axes")
            need(rank >= 2 and len(axes) == 1 and axis_of(axes[0], rank) == rank - 1 and shape[-1] == 2
                 and one.whole("keepdims", 1) == 0,
                 "joins other maxima and minima than those of pairs along the last axis", SORTING)
        need(axis_of(concat.whole("axis", 0), rank - 1) == rank - 2 and math.prod(shape[:-2]) == 1,
             "does not join the maxima and minima of the whole layer", SORTING)
        return "maxmin:pairs", shape[:-2] + [2 * shape[-2]], which
    sizes = [node.whole("k", 0)] if "k" in node.attributes else integers(node, 1, "k")
    need(rank > 0 and axis_of(node.whole("axis", -1), rank) == rank - 1 and sizes == shape[-1:]
         and node.whole("sorted", 1) == 1, "does not sort the whole last axis", SORTING)
    size = shape[-1]
    need(2 <= size <= 64, "sorts groups of less than 2 or more than 64 numbers", SORTING)
    if node.whole("largest", 1) != 0:
        which = [k - k % size + size - 1 - k % size for k in which]
    return f"groupsort:{size}", shape, which


# --- the graph -----------------------------------------------------------------------------------------------------

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
    def __init__(self, nodes, stored, name, shape, output):
        self.stored, self.output = stored, output
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
        def limits(tensor):
            numbers = broadcast(tensor, x.shape) if tensor else []
            return numbers if all(abs(value) <= 2.0 ** 127 for value, _ in numbers) else []
        low, high = limits(least), limits(most)
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
                      "PRelu": lambda: broadcast(self.needed_constant(node, 1), x.shape)}[node.kind]()
            return self.sum_of_relus(node, x, [(x.map, [ONE]),
                                               (x.map.scaled([MINUS_ONE]), [opposite(slope) for slope in slopes])])
        if node.kind == "HardSigmoid":
            line = x.map.scaled([exactly(node.number("alpha", f32(0.2)))])
            line = line.shifted([exactly(node.number("beta", 0.5))] * len(line.rows))
            return self.clipped(node, Value(line, x.shape, x.first), scalar(0.0), scalar(1.0))
        limits = [scalar(node.number(name, 0)) if name in node.attributes else self.constant(node, k)
                  for k, name in ((1, "min"), (2, "max"))]
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
            numbers = broadcast(self.needed_constant(node, k), x.shape)
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
            return padded(node, x, self.integers(node, 1, "pads"), filler)
        if node.kind == "Transpose":
            shape, which = transposition(x.shape, node.listed("perm"))
            return Value(x.map.selected(which), shape, x.first)
        shape = x.shape
        if node.kind == "Cast":
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


def store(node, stored, sizes=None):
    """Adds what a node computes from constants, or from the shape of a value, `sizes`."""
    remedy = "fold constants: torch.onnx.export(..., do_constant_folding=True)"
    of_integers = lambda numbers: Tensor("", [len(numbers)], "int64", numbers)
    first = stored[node.inputs[0]] if node.inputs and sizes is None else None
    integers = lambda k: stored[node.inputs[k]].integers()
    if node.kind == "Constant":
        fields = [v for n, v in node.attributes.get("value", []) if n == 5]
        need(fields, "holds no tensor")
        result = Tensor.of(fields[-1])
    elif node.kind == "Shape":
        result = of_integers(list(first.shape if sizes is None else sizes))
    elif node.kind in ("Identity", "Cast"):
        result = first
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


def read(data):
    """Returns (layers, activations, precision): layers as (name, inputs, rows {column: number}, biases, kept), and
    activations behind all layers but the last, by their names in chains."""
    graph = list(protobuf(only([v for n, v in protobuf(data) if n == 7], "graphs")))
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
    followed = Graph(nodes, stored, name, input_shape(message, name, nodes, stored), output)
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
