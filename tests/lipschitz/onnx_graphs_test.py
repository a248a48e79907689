#!/usr/bin/env python3
"""The second checker reads ONNX models as the functions that they are: its chain of layers has the outputs of random
graphs, evaluated operator by operator, and what it does not read it refuses by operator and node, with a remedy."""
import math
import random
import re
import tempfile
from pathlib import Path

import check_certificate as second
import exporter_models
import onnx_models


def outputs_of(weights, values):
    """Evaluates the layers in floats."""
    functions = {"relu": lambda t: max(t, 0.0), "tanh": math.tanh, "sigmoid": lambda t: 1 / (1 + math.exp(-t)),
                 "elu": lambda t: max(t, math.expm1(min(t, 0))), "silu": lambda t: t / (1 + math.exp(-t))}
    for k, layer in enumerate(weights.layers):
        rows = [layer.weights[i * layer.inputs:(i + 1) * layer.inputs] for i in range(layer.outputs)]
        values = [sum(w * x for w, x in zip(row, values)) + b for row, b in zip(rows, layer.biases)]
        if k + 1 == len(weights.layers):
            return values
        op, changed = weights.activations[k], layer.outputs - layer.kept
        if op in functions:
            values = list(map(functions[op], values[:changed])) + values[changed:]
        elif op == "maxmin:halves":
            half = len(values) // 2
            values = [f(a, b) for f in (max, min) for a, b in zip(values, values[half:])]
        else:
            size = int(op.split(":")[1])
            values = [x for first in range(0, len(values), size) for x in sorted(values[first:first + size])]
    return None


def random_graphs_have_their_outputs(folder, count):
    path, read, kept, kinds = folder / "random.onnx", 0, 0, set()
    for seed in range(count):
        found = onnx_models.RandomModel(seed)
        path.write_bytes(found.bytes())
        try:
            weights = second.read_weights(path)
        except second.BadInput as refused:
            assert "more than 8 numbers beside a skip connection" in str(refused), f"{seed}: {refused}"
            continue
        read += 1
        kept += any(layer.kept for layer in weights.layers)
        kinds |= set(re.findall(rb"/[abc][0-9]+/([A-Z][A-Za-z]+)", found.bytes()))
        outputs = outputs_of(weights, found.values["x"].numbers)
        size = 1 + max(map(abs, found.outputs))
        assert all(abs(a - b) <= 1e-9 * size for a, b in zip(outputs, found.outputs)), (
            f"{seed}: {outputs}, not {found.outputs}")
    assert read > 0.8 * count and kept > 0.05 * count and len(kinds) >= 32, (read, kept, len(kinds))
    return read, len(kinds)


def refusals_name_operator_and_node(folder):
    path = folder / "refused.onnx"
    for data, words in onnx_models.unread_models():
        path.write_bytes(data)
        try:
            second.read_weights(path)
        except second.BadInput as refused:
            assert all(word in str(refused) for word in words), f"{words}: {refused}"
        else:
            raise SystemExit(f"{words} is read")


def models_of_exporters_are_decided(folder):
    path, counts = folder / "exported.onnx", [0, 0]
    for name, data, decision in exporter_models.exporter_models():
        path.write_bytes(data)
        is_refused = bool(decision) and isinstance(decision[0], str)
        try:
            weights = second.read_weights(path)
        except second.BadInput as refused:
            assert is_refused and all(word in str(refused) for word in decision), f"{name}: {decision}: {refused}"
        else:
            assert not is_refused, f"{name} is read"
            found = [x for layer in weights.layers for x in (*layer.weights, *layer.biases)]
            assert decision in (None, found), f"{name}: {found}"
        counts[is_refused] += 1
    return counts


def damaged_files_are_refused(folder):
    path, generator = folder / "damaged.onnx", random.Random(3)
    good = onnx_models.RandomModel(3).bytes()
    refused = 0
    for _ in range(300):
        data = bytearray(good)
        data[generator.randrange(len(data))] = generator.randrange(256)
        path.write_bytes(data[:generator.randrange(1, len(data))] if generator.random() < 0.3 else data)
        try:
            weights = second.read_weights(path)
            assert all(a.outputs == b.inputs for a, b in zip(weights.layers, weights.layers[1:]))
        except Exception:  # any exception means that the file cannot be read
            refused += 1
    assert refused > 100, refused


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        refusals_name_operator_and_node(Path(name))
        damaged_files_are_refused(Path(name))
        print("{} models of exporters are read, {} are refused".format(*models_of_exporters_are_decided(Path(name))))
        print("{} random graphs of {} operators are read as what they compute".format(
            *random_graphs_have_their_outputs(Path(name), 300)))
