"""The network in a certificate, evaluated in double: an independent reading of what every bound speaks of."""
import json
import math


def numbers(text):
    return list(map(float.fromhex, text.split()))


def networks(certificate):
    """The stored networks by name, each a list of (rows, biases, operation after it or None)."""
    found = {}
    for name, entry in certificate["network"]["weights"].items():
        ops = [step["op"] for step in entry["chain"] if step["op"] not in ("linear", "clamp")]
        layers = [(list(map(numbers, layer["weights"])), numbers(layer["biases"])) for layer in entry["layers"]]
        found[name] = [(*layer, op) for layer, op in zip(layers, [*ops, None])]
    return found


FUNCTIONS = {
    "relu": lambda t: max(t, 0.0), "tanh": math.tanh, "softplus": lambda t: max(t, 0.0) + math.log1p(math.exp(-abs(t))),
    "sigmoid": lambda t: 0.5 + 0.5 * math.tanh(t / 2), "elu": lambda t: max(t, 0.0) + math.expm1(min(t, 0.0)),
    "selu": lambda t: 1.0507009873554805 * (max(t, 0.0) + 1.6732632423543772 * math.expm1(min(t, 0.0))),
    "silu": lambda t: t * (0.5 + 0.5 * math.tanh(t / 2)), "gelu": lambda t: t / 2 * (1 + math.erf(t / math.sqrt(2)))}


def activated(op, values):
    if op in FUNCTIONS:
        return list(map(FUNCTIONS[op], values))
    kind, _, which = op.partition(":")
    if kind in FUNCTIONS:  # of the first numbers only
        return list(map(FUNCTIONS[kind], values[:int(which)])) + values[int(which):]
    half = len(values) // 2
    if which == "halves":
        return [f(a, b) for f in (max, min) for a, b in zip(values, values[half:])]
    if which == "pairs":
        return [f(a, b) for f in (max, min) for a, b in zip(values[::2], values[1::2])]
    size = int(which)
    return [x for first in range(0, len(values), size) for x in sorted(values[first:first + size])]


def value(layers, x):
    """f(x) of one stored network, without the clamp."""
    x = list(x)
    for rows, biases, op in layers:
        x = [math.fsum(w * v for w, v in zip(row, x)) + b for row, b in zip(rows, biases)]
        x = activated(op, x) if op else x
    return x


def read(path):
    with open(path) as file:
        return json.load(file)
