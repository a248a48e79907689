"""Networks in the text format .nnet for check_certificate.py. The normalization of inputs and outputs is folded into
the first and the last layer, each number rounded once per operation."""
import math
import re

from named_arrays import need
from onnx_file import MOST_NUMBERS
from onnx_graphs import Layers, layers_of, naming
from onnx_maps import divided, exactly, Map, ONE

NUMBER = re.compile(r"-?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?", re.ASCII)
FORMAT = ("the format: numLayers,inputSize,outputSize,maxLayerSize; the sizes; a flag; minimum and maximum inputs; "
          "means; ranges; then weights and biases, one neuron per line")
MOST_LAYERS, MOST_WIDTH = 4096, 2 ** 20


def looks_like_nnet(data):
    """The first line that is no comment holds four counts."""
    while data[:2] == b"//" or data[:1] in (b"\n", b"\r"):
        data = data.partition(b"\n")[2]
    return re.fullmatch(rb"[, \r]*(?:[0-9]+[, \r]+){3}[0-9]+[, \r]*", data.partition(b"\n")[0]) is not None


class Lines:
    def __init__(self, data):
        self.lines, self.at = data.decode("latin-1").split("\n"), 0

    def need(self, condition, reason):
        need(condition, f"line {self.at}: {reason}; {FORMAT}")

    def next(self):
        """Returns the next line that is no comment."""
        while True:
            self.need(self.at < len(self.lines), "the file ends early")
            line = self.lines[self.at].rstrip("\r ,")
            self.at += 1
            if line and not line.startswith("//"):
                return line

    def numbers(self, wanted):
        line, found = self.next(), []
        while line and len(found) <= wanted:
            line = line.lstrip(" ,\t").removeprefix("+")
            number = NUMBER.match(line)
            self.need(number, "expected a finite number")
            value = float(number[0])
            is_zero = not re.search("[1-9]", re.split("[eE]", number[0])[0])
            self.need(math.isfinite(value) and (value != 0 or is_zero), "expected a finite number")
            line = line[number.end():]
            self.need(not line or line[0] in ", \t", "expected a comma")
            found.append(value)
        self.need(len(found) == wanted, f"expected {wanted} numbers")
        return found

    def counts(self, wanted, most):
        numbers = self.numbers(wanted)
        self.need(all(1 <= n <= limit and n == int(n) for n, limit in zip(numbers, most)), "expected a count")
        return list(map(int, numbers))


def layer(lines, inputs, outputs):
    rows = [{k: exactly(x) for k, x in enumerate(lines.numbers(inputs)) if x != 0} for _ in range(outputs)]
    return Map(rows, [exactly(lines.numbers(1)[0]) for _ in range(outputs)])


def read_nnet(data):
    """Returns what onnx_graphs.read() returns, and the networks are float64."""
    lines = Lines(data)
    count, inputs, outputs = lines.counts(4, [MOST_LAYERS, MOST_WIDTH, MOST_WIDTH])[:3]
    widths = lines.counts(count + 1, [MOST_WIDTH] * (count + 1))
    lines.need((widths[0], widths[-1]) == (inputs, outputs), "the sizes of its layers are inconsistent")
    for _ in ("a flag", "minimum inputs", "maximum inputs"):
        lines.next()
    means, ranges = lines.numbers(inputs + 1), lines.numbers(inputs + 1)
    lines.need(all(ranges), "a range is 0")
    lines.need(sum(a * b for a, b in zip(widths, widths[1:])) <= MOST_NUMBERS, "the network has more than 2^25 numbers")

    def run():
        chain = Layers(inputs)
        current = Map([{i: divided(ONE, exactly(ranges[i]))} for i in range(inputs)],
                      [divided(exactly(-means[i]), exactly(ranges[i])) for i in range(inputs)])
        for k, (width, following) in enumerate(zip(widths, widths[1:])):
            current = layer(lines, width, following).of(current, chain.width)
            if k + 1 < count:
                current, _ = chain.activated("relu", current, f"layer{k + 1}", [])
        current = current.scaled([exactly(ranges[-1])]).shifted([exactly(means[-1])] * outputs)
        lines.need(all(map(math.isfinite, (x for row in current.rows for pair in row.values() for x in pair))) and
                   all(map(math.isfinite, (x for pair in current.shifts for x in pair))),
                   "its numbers exceed the range of double")
        chain.append(f"layer{count}", current.rows, current.shifts, 0)
        return chain
    found, activations, _ = layers_of(naming("the chain of layers", run))
    return found, activations, "float64"
