"""The nodes and tensors of an ONNX file, for onnx_graphs.py, with activations in several nodes joined."""
import math
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
        if not 0 < tag >> 3 < 2 ** 29 or tag & 7 not in (0, 1, 2, 5):
            raise Refused("the file is damaged: there is no such protobuf field")
        if tag & 7 == 0:
            value, at = varint(data, at)
            yield tag >> 3, value
        else:
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


FLOATS = ("float16", "bfloat16", "float32", "float64")
# Types by their number in the file: name, code of struct, bytes, field of numbers that are not raw.
TYPES = {1: ("float32", "f", 4, 4), 6: ("int32", "i", 4, 5), 7: ("int64", "q", 8, 7), 9: ("bool", "B", 1, 5),
         10: ("float16", "e", 2, 5), 11: ("float64", "d", 8, 10), 16: ("bfloat16", "H", 2, 5)}


def bfloat16(bits):
    return struct.unpack("<f", struct.pack("<I", bits << 16))[0]


def stored_numbers(kind, code, width, data):
    if len(data) % width:
        raise Refused("a tensor contradicts its shape; export the model again")
    numbers = list(struct.unpack(f"<{len(data) // width}{code}", data))
    return list(map(bfloat16, numbers)) if kind == "bfloat16" else numbers


def listed_numbers(kind, value):
    """Returns numbers that are stored as protobuf integers: halves by their bits."""
    numbers = integers_of(value)
    if kind == "float16":
        return [struct.unpack("<e", struct.pack("<H", bits & 0xffff))[0] for bits in numbers]
    if kind == "bfloat16":
        return [bfloat16(bits & 0xffff) for bits in numbers]
    return list(map(signed, numbers))


class Tensor:
    """`numbers`: floats or, for int32, int64 and bool, integers; None for other types."""

    def __init__(self, name, shape, kind, numbers):
        self.name, self.shape, self.kind, self.numbers = name, shape, kind, numbers

    @staticmethod
    def of(message):
        fields = list(protobuf(message))
        name = next((v.decode() for n, v in fields if n == 8), "")
        shape = [signed(d) for n, v in fields if n == 1 for d in integers_of(v)]
        stored = [(n, v) for n, v in fields if n in (4, 5, 7, 9, 10)]
        if any(n == 13 or n == 14 and v for n, v in fields):
            raise Refused(f'the numbers of "{name}" are in another file; onnx.save(..., save_as_external_data=False)')
        if len({n for n, _ in stored}) < len(stored) or any(isinstance(v, int) for _, v in stored):
            raise Refused(f'the numbers of "{name}" are not in one piece; export the model again')
        number = next((v for n, v in reversed(fields) if n == 2), 0)
        if number not in TYPES:
            return Tensor(name, shape, None, None)
        kind, code, width, field = TYPES[number]
        numbers = []
        if stored and stored[0][0] == field and field in (5, 7):
            numbers = listed_numbers(kind, stored[0][1])
        elif stored and stored[0][0] in (9, field):
            numbers = stored_numbers(kind, code, width, stored[0][1])
        if len(stored) > 1 or any(size < 0 for size in shape) or len(numbers) != math.prod(shape):
            raise Refused(f'"{name}" contradicts its shape; export the model again')
        return Tensor(name, shape, kind, numbers)

    def is_float(self):
        return self.kind in FLOATS

    def integers(self):
        return self.numbers if self.kind in ("int32", "int64", "bool") else []


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

    def floats(self, name):
        packed = [v for n, v in self.attributes[name] if n == 7 and isinstance(v, bytes) and len(v) % 4 == 0]
        return [x for v in packed for (x,) in struct.iter_unpack("<f", v)]


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
