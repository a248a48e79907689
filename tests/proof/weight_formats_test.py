#!/usr/bin/env python3
"""The checker proved in Coq reads from weight files of every kind, and from damaged ones, the numbers that the other
checkers read: those that it writes for the kernel of Coq. What it does not read it refuses with a remedy.

    weight_formats_test.py SWARMCERT SOURCE_DIR MUTATIONS CHECKER
"""
import collections
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SWARMCERT, SOURCE, MUTATIONS, CHECKER = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
sys.argv[1:] = ["", str(SOURCE)]
sys.path.insert(0, str(SOURCE / "tests" / "lipschitz"))
import check_certificate as second  # noqa: E402
import exporter_models  # noqa: E402
import weight_readers_test as readers  # noqa: E402
import written_files  # noqa: E402

REFUSED = re.compile(r"\.mat: is a \.mat file of version 7\.3.*scipy\.io\.savemat", re.DOTALL)


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, errors="replace", timeout=60)


def numbers_for_the_kernel(certificate, path):
    """Returns the numbers of all layers, weights before biases, or what is said instead."""
    said = run(CHECKER, "--coq", certificate, path)
    found = re.search(r"Definition network0 : part := Part (.*?)\.\n", said.stdout)
    if said.returncode or not found:
        return said.stderr
    layers = re.sub(r"\) \[[^()]*\] \[[^()]*\]$", ")", found[1])  # without clamp and activations
    return [int(m, 0) * 2.0 ** int(e) if int(e) > -1000 else int(m, 0) * 2.0 ** -900 * 2.0 ** (int(e) + 900)
            for m, e in re.findall(r"\((-?(?:0x)?[0-9a-f]+),(-?[0-9]+)\)", layers)]


def numbers_of(weights):
    return [x for layer in weights.layers for x in (*layer.weights, *layer.biases)]


def is_read_alike(path, certificate):
    """Certifies the file and compares; returns whether the third checker reads it, accepts it, and says what else."""
    written = run(SWARMCERT, "certify", path, "--nodes", "0", "-q", "--force", "-o", certificate)
    if written.returncode:
        said = run(CHECKER, certificate, path)
        return "", said.returncode in (1, 3), said
    said = run(CHECKER, certificate, path)
    if said.returncode == 3:
        return said.stderr, True, said
    found, expected = numbers_for_the_kernel(certificate, path), numbers_of(second.read_weights(path))
    return "", said.returncode == 0 and found == expected, (said, found, expected)


def models_of_exporters_are_decided_alike(folder):
    """Counts models that all three read with the same numbers, and that all three refuse, for the same reason."""
    path, some, counts = folder / "exported.onnx", folder / "some.json", [0, 0]
    path.write_bytes(exporter_models.on_row(exporter_models.LAYER, exporter_models.node("Neg", ["h"], ["y"])))
    written = run(SWARMCERT, "certify", path, "--nodes", "0", "-q", "-o", some)
    assert written.returncode == 0, written
    for name, data, decision in exporter_models.exporter_models():
        path.write_bytes(data)
        if is_refused := bool(decision) and isinstance(decision[0], str):
            for said in (run(SWARMCERT, "certify", path, "--nodes", "0", "-q", "-o", folder / "none.json"),
                         run(CHECKER, some, path)):
                assert said.returncode == 3 and decision[0] in said.stderr, f"{name}: {said}"
        else:
            refused, is_alike, said = is_read_alike(path, folder / "exported.json")
            is_read = not refused and is_alike and isinstance(said, tuple) and said[0].returncode == 0
            assert is_read, f"{name}: {refused} {said}"
        counts[is_refused] += 1
    return counts


def run_all():
    generator, counts = random.Random(11), collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "written").mkdir()
        files = written_files.write(Path(folder) / "written")
        files += [path for path in sorted((SOURCE / "tests/nn/files").iterdir())
                  if path.suffix in (".pth", ".onnx", ".npz", ".mat")]
        for path in files:
            if "packed" in path.name:
                continue
            certificate = Path(folder) / "certificate.json"
            refused, is_alike, said = is_read_alike(path, certificate)
            assert is_alike, f"{path}: {said}"
            assert not refused or REFUSED.search(refused), f"{path}: {refused}"
            counts["refused" if refused else "read"] += 1
            target, data = Path(folder) / f"damaged{path.suffix}", path.read_bytes()
            for _ in range(0 if refused else MUTATIONS):
                target.write_bytes(readers.mutated(data, generator))
                try:
                    second.read_weights(target)
                except second.BadInput:  # then no certificate of another network is accepted
                    said = run(CHECKER, certificate, target)
                    assert said.returncode in (1, 3), f"{path}: {said}"
                    counts["damaged, refused"] += 1
                    continue
                refused, is_alike, said = is_read_alike(target, Path(folder) / "damaged.json")
                assert is_alike, f"{path}: {said}"
                counts["damaged, refused" if refused else "damaged, read"] += 1
        counts["models of exporters, read"], counts["models of exporters, refused"] = (
            models_of_exporters_are_decided_alike(Path(folder)))
    print(", ".join(f"{what}: {count}" for what, count in counts.items()))
    assert counts["read"] > 5 * counts["refused"], counts


if __name__ == "__main__":
    run_all()
