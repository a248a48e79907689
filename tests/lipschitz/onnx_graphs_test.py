#!/usr/bin/env python3
"""ONNX models are read as the functions that they are: the network in the certificate has the outputs of random graphs,
evaluated operator by operator, and what is not read is refused by operator and node, with a remedy.

    onnx_graphs_test.py SWARMCERT
"""
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import canonical
import exporter_models
import onnx_models


def certify(path):
    """Returns the plain network in the certificate, or why the file is refused."""
    certificate = path.with_suffix(".json")
    done = subprocess.run([sys.argv[1], "certify", path, "--method", "product", "--nodes", "0", "-q", "--force", "-o",
                           certificate], capture_output=True, text=True, timeout=60)
    assert done.returncode in (0, 3), done
    if done.returncode != 0:
        return None, done.stderr
    return canonical.networks(canonical.read(certificate))["network"], ""


def random_graphs_have_their_outputs(folder, count):
    path, read, kept, kinds = folder / "random.onnx", 0, 0, set()
    for seed in range(count):
        found = onnx_models.RandomModel(seed)
        path.write_bytes(found.bytes())
        layers, refused = certify(path)
        if refused:
            assert "more than 8 numbers beside a skip connection" in refused, f"{seed}: {refused}"
            continue
        read += 1
        kept += any(op and op.split(":")[0] in canonical.FUNCTIONS and ":" in op for _, _, op in layers)
        kinds |= set(re.findall(rb"/[abc][0-9]+/([A-Z][A-Za-z]+)", found.bytes()))
        outputs = canonical.value(layers, found.values["x"].numbers)
        size = 1 + max(map(abs, found.outputs))
        assert all(abs(a - b) <= 1e-9 * size for a, b in zip(outputs, found.outputs)), (
            f"{seed}: {outputs}, not {found.outputs}")
    assert read > 0.8 * count and kept > 0.05 * count and len(kinds) >= 30, (read, kept, len(kinds))
    return read, len(kinds)


def batches_of_normalization_have_their_outputs(folder):
    """Batch normalization over the second axis, with a fixed batch of one, two and three."""
    generator = random.Random(5)
    number = lambda: onnx_models.f32(generator.uniform(0.5, 2))
    for batch in 1, 2, 3:
        shape, channels = [batch, 3, 2], 3
        scale, shift, mean, variance = ([number() for _ in range(channels)] for _ in range(4))
        stored = [onnx_models.tensor(name, [channels], values) for name, values in
                  (("s", scale), ("b", shift), ("m", mean), ("v", variance))]
        parts = [onnx_models.node("BatchNormalization", ["x", "s", "b", "m", "v"], ["n"]),
                 onnx_models.node("Relu", ["n"], ["y"]), *stored]
        path = folder / "batch.onnx"
        path.write_bytes(onnx_models.model(parts, shape))
        layers, refused = certify(path)
        assert not refused, refused
        x = [generator.uniform(-2, 2) for _ in range(batch * channels * 2)]
        channel = lambda i: i // 2 % channels
        expected = [max(0.0, scale[channel(i)] * (t - mean[channel(i)])
                        / (variance[channel(i)] + onnx_models.f32(1e-5)) ** 0.5 + shift[channel(i)])
                    for i, t in enumerate(x)]
        found = canonical.value(layers, x)
        assert all(abs(a - b) <= 1e-9 for a, b in zip(found, expected)), f"{batch}: {found}, not {expected}"


def an_unknown_attribute_is_refused(folder):
    path = folder / "attribute.onnx"
    for unknown in {}, {"unheard_of": 1}:
        parts = [onnx_models.node("MatMul", ["x", "w"], ["h"], **unknown), onnx_models.node("Relu", ["h"], ["y"]),
                 onnx_models.tensor("w", [2, 2], [1.0, 2.0, 3.0, 4.0])]
        path.write_bytes(onnx_models.model(parts, [1, 2]))
        _, refused = certify(path)
        assert ("unheard_of" in refused) == bool(unknown), refused


def refusals_name_operator_and_node(folder):
    path = folder / "refused.onnx"
    for data, words in onnx_models.unread_models():
        path.write_bytes(data)
        _, refused = certify(path)
        assert refused and all(word in refused for word in words), f"{words}: {refused}"


def models_of_exporters_are_decided(folder):
    path, counts = folder / "exported.onnx", [0, 0]
    for name, data, decision in exporter_models.exporter_models():
        path.write_bytes(data)
        is_refused = bool(decision) and isinstance(decision[0], str)
        layers, refused = certify(path)
        assert bool(refused) == is_refused, f"{name}: {refused}"
        if is_refused:
            assert all(word in refused for word in decision), f"{name}: {decision}: {refused}"
        else:
            found = [x for rows, biases, _ in layers for x in (*sum(rows, []), *biases)]
            assert decision in (None, found), f"{name}: {found}"
        counts[is_refused] += 1
    return counts


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        refusals_name_operator_and_node(Path(name))
        batches_of_normalization_have_their_outputs(Path(name))
        an_unknown_attribute_is_refused(Path(name))
        print("{} models of exporters are read, {} are refused".format(*models_of_exporters_are_decided(Path(name))))
        print("{} random graphs of {} operators are read as what they compute".format(
            *random_graphs_have_their_outputs(Path(name), 200)))
