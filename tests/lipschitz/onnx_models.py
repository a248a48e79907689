"""Random ONNX models of everything that the readers fold into chains of layers, beside skip connections, each with its
outputs at a random point as floats give them, operator by operator."""
import math
from itertools import product
from random import Random
from struct import pack, unpack


def varint(value):
    return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + varint(value >> 7)


def field(number, value):
    if isinstance(value, int):
        return varint(number << 3) + varint(value % 2 ** 64)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


def attribute(name, value):
    """A float, an integer, a text or a list of integers."""
    if isinstance(value, float):
        return field(1, name) + varint(2 << 3 | 5) + pack("<f", value)
    if isinstance(value, list):
        return field(1, name) + b"".join(field(8, k) for k in value)
    return field(1, name) + field(3 if isinstance(value, int) else 4, value)


def node(kind, inputs, outputs, **attributes):
    return field(1, b"".join(field(1, name) for name in inputs) + b"".join(field(2, name) for name in outputs)
                 + field(3, f"/{outputs[0]}/{kind}") + field(4, kind)
                 + b"".join(field(5, attribute(*pair)) for pair in attributes.items()))


def tensor(name, shape, numbers, kind=1):
    """Of float32, or of float64 with kind 11, or of int64 with 7."""
    code = {1: "f", 7: "q", 11: "d"}[kind]
    return field(5, b"".join(field(1, size) for size in shape) + field(2, kind) + field(8, name)
                 + field(9, pack(f"<{len(numbers)}{code}", *numbers)))


def model(parts, shape):
    """`parts`: nodes and tensors, from x to y; `shape`: of x."""
    sizes = b"".join(field(1, field(1, size)) for size in shape)
    value = field(2, field(1, field(1, 1) + field(2, sizes)))
    return field(1, 8) + field(2, "test") + field(7, b"".join(parts) + field(11, field(1, "x") + value)
                                                  + field(12, field(1, "y")))


def f32(x):
    return unpack("<f", pack("<f", x))[0]


class Array:
    """Numbers of a tensor, row by row."""

    def __init__(self, shape, numbers):
        self.shape, self.numbers = list(shape), list(numbers)

    def __getitem__(self, place):
        index = 0
        for at, size in zip(place, self.shape):
            index = index * size + (at if size > 1 else 0)
        return self.numbers[index]

    def broadcast(self, shape):
        own = Array([1] * (len(shape) - len(self.shape)) + self.shape, self.numbers)
        return Array(shape, [own[place] for place in places(shape)])

    def each(self, function, *others):
        others = [other.broadcast(self.shape).numbers for other in others]
        return Array(self.shape, map(function, self.numbers, *others))


def places(shape):
    return product(*map(range, shape))


class RandomModel:
    """`values`: what has been computed, by name, at the point `values["x"]`. Half of the operators are of one kind, by
    `number`."""

    def __init__(self, number):
        generator = Random(number)
        self.random, self.parts, self.count = generator, [], 0
        self.shape = generator.choice([[1, 3], [1, 4], [1, 1, 2, 3], [1, 2, 2, 2], [1, 1, 3, 3], [1, 2, 4], [1, 1, 6]])
        self.values = {"x": Array(self.shape, [generator.uniform(-2, 2) for _ in range(math.prod(self.shape))])}
        operators = generator.sample(OPERATORS, 5) + [OPERATORS[number % len(OPERATORS)]] * 4
        for _ in range(generator.randint(2, 9)):
            if max(len(value.numbers) for value in self.values.values()) > 30:
                break
            name = generator.choice(list(self.values)[-4:])
            generator.choice(operators)(self, name, self.values[name])
        name, value = list(self.values.items())[-1]
        flat = self.add("Reshape", [name, self.integers([1, -1])], Array([1, len(value.numbers)], value.numbers))
        self.linear(flat, self.values[flat], "y")
        self.outputs = self.values["y"].numbers

    def bytes(self):
        return model(self.parts, self.shape)

    def name(self):
        """Names in another order than the values."""
        self.count += 1
        return f"{self.random.choice('abc')}{self.count}"

    def number(self):
        return self.random.choice([0.0, 1.0, -0.5, *(f32(self.random.uniform(-1, 1)) for _ in range(5))])

    def constant(self, shape, numbers=None):
        """Returns the name of a stored tensor, and its numbers."""
        numbers = [f32(x) for x in numbers] if numbers else [self.number() for _ in range(math.prod(shape))]
        name = self.name() + self.random.choice(["", ".weight"])
        self.parts.append(tensor(name, shape, numbers, self.random.choice([1] * 9 + [11])))
        return name, Array(shape, numbers)

    def integers(self, numbers):
        name = self.name()
        self.parts.append(tensor(name, [len(numbers)], numbers, 7))
        return name

    def add(self, kind, inputs, value, output=None, **attributes):
        output = output or self.name()
        self.parts.append(node(kind, inputs, [output], **attributes))
        self.values[output] = value
        return output

    def inner(self, *arguments, **attributes):
        """A value inside a group of nodes, which nothing else takes."""
        name = self.add(*arguments, **attributes)
        return name, self.values.pop(name)

    def of_shape(self, shape):
        return self.random.choice([name for name, value in self.values.items() if value.shape == shape])

    # --- linear ---
    def linear(self, x, value, output=None):
        size = len(value.numbers)
        if value.shape[-1] != size:
            return
        outputs = self.random.choice([1, 2, 3])
        weights, w = self.constant([outputs, size])
        sums = [sum(w[i, k] * value.numbers[k] for k in range(size)) for i in range(outputs)]
        if len(value.shape) == 2 and self.random.random() < 0.5:
            biases, b = self.constant([outputs])
            alpha, beta = self.random.choice([(1.0, 1.0), (0.3, 2.0)])
            numbers = [f32(alpha) * s + f32(beta) * t for s, t in zip(sums, b.numbers)]
            self.add("Gemm", [x, weights, biases], Array([1, outputs], numbers), output, transB=1, alpha=alpha,
                     beta=beta)
            return
        transposed = self.name()
        self.parts.append(node("Transpose", [weights], [transposed], perm=[1, 0]))
        self.add("MatMul", [x, transposed], Array(value.shape[:-1] + [outputs], sums), output)

    def windows(self, value):
        """Returns attributes of a random window, its kernel, the places that it covers, by number in it, and the shape
        of its places; None if the value is no image."""
        if len(value.shape) < 3 or value.shape[0] != 1:
            return None
        sizes, choice = value.shape[2:], self.random.choice
        kernel = [self.random.randint(1, min(3, n)) for n in sizes]
        strides = [choice([1, 1, 2]) for _ in sizes]
        pads = [[choice([0, 1, 1]) * min(1, k - 1) for k in kernel] for _ in range(2)]
        attributes = {"strides": strides, "pads": sum(pads, []), "dilations": [1] * len(sizes)}
        if self.random.random() < 0.3:
            total = [max(0, (math.ceil(n / s) - 1) * s + k - n) for n, s, k in zip(sizes, strides, kernel)]
            upper = choice([False, True])
            first = [t // 2 if upper else t - t // 2 for t in total]
            pads, attributes = [first, [t - f for t, f in zip(total, first)]], {
                "strides": strides, "auto_pad": "SAME_UPPER" if upper else "SAME_LOWER"}
        out = [(n + a + b - k) // s + 1 for n, a, b, k, s in zip(sizes, *pads, kernel, strides)]
        covered = [{k: at for k, offset in enumerate(places(kernel))
                    for at in [tuple(p * s + o - a for p, s, o, a in zip(place, strides, offset, pads[0]))]
                    if all(0 <= x < n for x, n in zip(at, sizes))} for place in places(out)]
        return attributes, kernel, covered, out

    def convolution(self, x, value):
        found = self.windows(value)
        if found is None:
            return
        attributes, kernel, covered, out = found
        channels = value.shape[1]
        group = self.random.choice([1, channels])
        outputs, inputs = group * self.random.choice([1, 2]), channels // group
        weights, w = self.constant([outputs, inputs, math.prod(kernel)])
        self.parts.pop()
        self.parts.append(tensor(weights, [outputs, inputs, *kernel], w.numbers))
        biases, b = self.constant([outputs])
        numbers = [b.numbers[o] + sum(w[o, c, k] * value[(0, o // (outputs // group) * inputs + c, *at)]
                                      for c in range(inputs) for k, at in inside.items())
                   for o in range(outputs) for inside in covered]
        self.add("Conv", [x, weights, biases], Array([1, outputs, *out], numbers), group=group, **attributes)

    def pooling(self, x, value):
        found = self.windows(value)
        if found is None:
            return
        attributes, kernel, covered, out = found
        kind = self.random.choice(["AveragePool", "AveragePool", "MaxPool", "GlobalAveragePool", "GlobalMaxPool"])
        if kind.startswith("Global"):
            covered, out = [dict(enumerate(places(value.shape[2:])))], [1] * len(kernel)
        seen = [[value[(0, c, *at)] for at in inside.values()] for c in range(value.shape[1]) for inside in covered]
        pads = int(kind == "AveragePool" and self.random.random() < 0.5)
        average = lambda some: sum(some) / (math.prod(kernel) if pads else len(some))
        numbers = [max(some) if "Max" in kind else average(some) for some in seen]
        if not kind.startswith("Global"):
            attributes["kernel_shape"] = kernel
            attributes.update({"count_include_pad": 1} if pads else {})
        self.add(kind, [x], Array(value.shape[:2] + out, numbers), **({} if kind.startswith("Global") else attributes))

    def normalization(self, x, value):
        channels = value.shape[1]
        is_new = self.random.random() < 0.4  # as before training, with zeros
        zeros = [0.0] * channels if is_new else None
        (scale, s), (bias, b), (mean, m) = (self.constant([channels], numbers) for numbers in (None, zeros, zeros))
        variance, v = self.constant([channels], [self.random.uniform(0.2, 2) for _ in range(channels)])
        column = lambda array: Array([channels] + [1] * (len(value.shape) - 2), array.numbers)
        function = lambda x, s, b, m, v: s * (x - m) / math.sqrt(v + f32(1e-3)) + b
        self.add("BatchNormalization", [x, scale, bias, mean, variance],
                 value.each(function, *map(column, (s, b, m, v))), epsilon=1e-3)

    def with_constant(self, x, value):
        kind = self.random.choice(["Add", "Sub", "Mul", "Div", "Max", "Min"])
        shape = [self.random.choice([1, size]) for size in value.shape][self.random.choice([0, 0, -1]):]
        numbers = [self.random.choice([3.0, -0.7, 2.0]) for _ in range(math.prod(shape))] if kind == "Div" else None
        name, c = self.constant(shape, numbers)
        first = kind == "Div" or self.random.random() < 0.5
        function = ARITHMETIC[kind]
        self.add(kind, [x, name] if first else [name, x],
                 value.each(function if first else lambda a, b: function(b, a), c))

    def skip(self, x, value):
        other = self.of_shape(value.shape)
        kind = self.random.choice(["Add", "Add", "Sub", "Max", "Min"])
        self.add(kind, [other, x], self.values[other].each(ARITHMETIC[kind], value))

    def sum_of_three(self, x, value):
        other, (name, c) = self.of_shape(value.shape), self.constant([1])
        names = [x, other, name]
        self.random.shuffle(names)
        self.add("Sum", names, value.each(lambda a, b, c: a + b + c, self.values[other], c))

    # --- activations ---
    def piecewise_linear(self, x, value):
        slopes, s = self.constant([value.shape[-1]])
        low, high = -0.5, 1.5
        (least, _), (most, _) = self.constant([], [low]), self.constant([], [high])
        leaky = lambda slope: lambda t, s=None: t if t > 0 else t * (slope if s is None else s)
        kind, inputs, function, attributes = self.random.choice([
            ("Relu", [], leaky(0.0), {}), ("Abs", [], abs, {}), ("Neg", [], lambda t: -t, {}),
            ("LeakyRelu", [], leaky(f32(0.01)), {}), ("LeakyRelu", [], leaky(0.25), {"alpha": 0.25}),
            ("PRelu", [slopes], leaky(None), {}),
            ("Clip", [], lambda t: min(max(t, 0.0), 6.0), {"min": 0.0, "max": 6.0}),
            ("Clip", [least, most], lambda t: min(max(t, low), high), {}), ("Clip", [least], lambda t: max(t, low), {}),
            ("Clip", ["", most], lambda t: min(t, high), {}),
            ("HardSigmoid", [], lambda t: min(max(f32(0.2) * t + 0.5, 0.0), 1.0), {})])
        self.add(kind, [x, *inputs], value.each(function, *([s] if kind == "PRelu" else [])), **attributes)

    def smooth(self, x, value):
        kind, function = self.random.choice([("Tanh", math.tanh), ("Sigmoid", lambda t: 1 / (1 + math.exp(-t))),
                                             ("Elu", lambda t: max(t, math.expm1(min(t, 0))))])
        self.add(kind, [x], value.each(function))

    def silu(self, x, value):
        sigmoid, _ = self.inner("Sigmoid", [x], value)
        self.add("Mul", [x, sigmoid], value.each(lambda t: t / (1 + math.exp(-t))))

    def sorted(self, x, value):
        size = len(value.numbers)
        if value.shape[-1] != size or size % 2 != 0:
            return
        largest, output, half = self.random.choice([0, 1]), self.name(), size // 2
        if self.random.random() < 0.5:
            self.parts.append(node("TopK", [x, self.integers([size])], [output, self.name()], axis=-1, largest=largest))
            self.values[output] = Array(value.shape, sorted(value.numbers, reverse=bool(largest)))
            return
        a, b = value.numbers[:half], value.numbers[half:]
        p, q, axis = self.name(), self.name(), len(value.shape) - 1
        self.parts.append(node("Split", [x], [p, q], axis=axis))
        (larger, c), (smaller, d) = (self.inner(kind, [p, q], Array([half], map(function, a, b)))
                                     for kind, function in (("Max", max), ("Min", min)))
        self.add("Concat", [larger, smaller], Array(value.shape, c.numbers + d.numbers), axis=axis)

    # --- what rearranges ---
    def reshaped(self, x, value):
        size = len(value.numbers)
        kind, shape = self.random.choice([
            ("Reshape", [1, size]), ("Reshape", [1, 1, size]), ("Reshape", [1, size, 1, 1]),
            ("Flatten", [value.shape[0], size // value.shape[0]]), ("Unsqueeze", [1] + value.shape),
            ("Dropout", value.shape), ("Cast", value.shape)])
        if len(shape) > 4:
            return
        attributes = {"Flatten": {"axis": 1}, "Unsqueeze": {"axes": [0]}, "Cast": {"to": 1}}.get(kind, {})
        sizes = [self.integers(shape)] if kind == "Reshape" else []
        self.add(kind, [x] + sizes, Array(shape, value.numbers), **attributes)

    def transposed(self, x, value):
        perm = [0, *self.random.sample(range(1, len(value.shape)), len(value.shape) - 1)]
        shape = [value.shape[p] for p in perm]
        original = lambda place: [at for _, at in sorted(zip(perm, place))]
        self.add("Transpose", [x], Array(shape, [value[original(place)] for place in places(shape)]), perm=perm)

    def concatenated(self, x, value):
        other = self.values[self.of_shape(value.shape)]
        name = next(name for name, v in self.values.items() if v is other)
        axis, size = len(value.shape) - 1, value.shape[-1]
        shape = value.shape[:-1] + [2 * size]
        numbers = [(other if place[-1] < size else value)[[*place[:-1], place[-1] % size]] for place in places(shape)]
        self.add("Concat", [name, x], Array(shape, numbers), axis=self.random.choice([axis, -1]))

    def padded(self, x, value):
        pads = [[0] + [self.random.choice([0, 0, 1]) for _ in value.shape[1:]] for _ in range(2)]
        shape = [n + a + b for n, a, b in zip(value.shape, *pads)]
        filler, _ = self.constant([], [0.5])
        at = lambda place: [p - a for p, a in zip(place, pads[0])]
        inside = lambda place: all(0 <= k < n for k, n in zip(at(place), value.shape))
        self.add("Pad", [x, self.integers(sum(pads, [])), filler],
                 Array(shape, [value[at(place)] if inside(place) else 0.5 for place in places(shape)]))

    def flattened_by_shape(self, x, value):
        """As exporters write x.view(x.shape[0], -1)."""
        sizes, first, rows, both = (self.name() for _ in range(4))
        self.parts += [node("Shape", [x], [sizes]), node("Gather", [sizes, self.integers([0])], [first]),
                       node("Unsqueeze", [first], [rows], axes=[0]),
                       node("Concat", [rows, self.integers([-1])], [both], axis=0)]
        self.add("Reshape", [x, both], Array([1, len(value.numbers)], value.numbers))


ARITHMETIC = {"Add": lambda a, b: a + b, "Sub": lambda a, b: a - b, "Mul": lambda a, b: a * b,
              "Div": lambda a, b: a / b, "Max": max, "Min": min}
OPERATORS = [RandomModel.linear, RandomModel.convolution, RandomModel.pooling,
             RandomModel.normalization, RandomModel.with_constant, RandomModel.skip,
             RandomModel.sum_of_three, RandomModel.piecewise_linear, RandomModel.smooth,
             RandomModel.silu, RandomModel.sorted, RandomModel.reshaped, RandomModel.transposed,
             RandomModel.concatenated, RandomModel.padded, RandomModel.flattened_by_shape]


def image_model(generator):
    """x [1, 1, 2, 2]: convolution, batch normalization, LeakyRelu, convolution, skip connection, ReLU6, averages, and a
    linear layer."""
    some = lambda count: [generator.uniform(-1, 1) for _ in range(count)]
    parts = [node("Conv", ["x", "k1", "b1"], ["c"], pads=[0, 0, 1, 1]),
             node("BatchNormalization", ["c", "scale", "b1", "b1", "variance"], ["n"]),
             node("LeakyRelu", ["n"], ["l"], alpha=0.1), node("Conv", ["l", "k2"], ["d"], pads=[1, 1, 0, 0]),
             node("Add", ["n", "d"], ["s"]), node("Clip", ["s"], ["r"], min=0.0, max=6.0),
             node("AveragePool", ["r"], ["a"], kernel_shape=[2, 1]), node("Flatten", ["a"], ["f"]),
             node("Gemm", ["f", "w", "b1"], ["y"])]
    return model(parts + [tensor("k1", [1, 1, 2, 2], some(4)), tensor("k2", [1, 1, 2, 2], some(4)),
                          tensor("b1", [1], some(1)), tensor("scale", [1], [0.9]), tensor("variance", [1], [0.3]),
                          tensor("w", [2, 1], some(2))], [1, 1, 2, 2])


def series_model(generator):
    """x [1, 1, 3]: division, convolution, tanh, skip connections, the largest of pairs, PRelu, a linear layer."""
    some = lambda count: [generator.uniform(-1, 1) for _ in range(count)]
    parts = [node("Div", ["x", "three"], ["q"]), node("Conv", ["q", "k"], ["c"], pads=[1, 1]),
             node("Tanh", ["c"], ["t"]), node("Sub", ["t", "q"], ["s"]),
             node("MaxPool", ["s"], ["m"], kernel_shape=[2]),
             node("PRelu", ["m", "slope"], ["p"]), node("Add", ["p", "m"], ["e"]),
             node("Reshape", ["e", "flat"], ["f"]), node("MatMul", ["f", "w"], ["y"])]
    return model(parts + [tensor("three", [1], [3.0]), tensor("k", [1, 1, 3], some(3)), tensor("slope", [1], [0.2]),
                          tensor("flat", [2], [1, -1], 7), tensor("w", [2, 1], some(2))], [1, 1, 3])


def unread_models():
    """(model, words of its refusal): what no reader takes."""
    weights = tensor("w", [3, 3], [1.0] * 9) + tensor("k", [1, 1, 2, 2], [1.0] * 4) + tensor("zero", [1], [0.0])
    layer, relu = node("MatMul", ["x", "w"], ["h"]), node("Relu", ["h"], ["r"])
    row = lambda *nodes: model([*nodes, weights], [1, 3])
    image = lambda *nodes: model([*nodes, weights], [1, 1, 2, 2])
    size = tensor("three", [1], [3], 7)
    return [
        (row(layer, node("Mul", ["h", "x"], ["y"])), ["Mul", "/y/Mul", "is not an affine function"]),
        (row(layer, node("Div", ["h", "zero"], ["y"])), ["Div", "divides by 0"]),
        (row(layer, node("Mystery", ["h"], ["y"])), ["Mystery", "/y/Mystery", "export"]),
        (row(layer, node("Elu", ["h"], ["e"], alpha=0.5), node("Add", ["e", "x"], ["y"])),
         ["Elu", "alpha is not 1", "default parameters"]),
        (model([tensor("nine", [1], [9], 7), node("TopK", ["x", "nine"], ["s"]), node("Add", ["s", "x"], ["y"])],
               [1, 9]),
         ["TopK", "more than 8 numbers beside a skip connection", "leave the skip connection out"]),
        (row(layer, relu, node("Conv", ["r", "k"], ["y"])), ["Conv", "/y/Conv", "its input must have the shape"]),
        (image(node("AveragePool", ["x"], ["y"], kernel_shape=[2, 2], ceil_mode=1)),
         ["AveragePool", "ceil_mode is not 0"]),
        (image(node("MaxPool", ["x"], ["y"], kernel_shape=[3, 3])), ["MaxPool", "its window is larger than its input"]),
        (image(node("Conv", ["x", "k"], ["y"], group=2)), ["Conv", "fit its"]),
        (image(node("BatchNormalization", ["x", "zero", "zero", "zero", "zero"], ["y"], training_mode=1)),
         ["BatchNormalization", "training mode", "model.eval()"]),
        (image(node("Reshape", ["x", "three"], ["y"]), size), ["Reshape", "its shape does not fit"]),
        (row(layer, node("Clip", ["h"], ["y"], min=2.0, max=1.0)), ["Clip", "its minimum is above its maximum"]),
        (row(layer, node("Dropout", [], ["y"])), ["Dropout", "does not use the output of the preceding node"]),
    ]
