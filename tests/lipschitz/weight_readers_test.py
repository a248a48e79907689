#!/usr/bin/env python3
"""The second checker reads from every weight file, written by other programs or damaged, the numbers that the first one
reads, bit for bit, or refuses it.

    weight_readers_test.py PRINT_LAYERS SOURCE_DIR [MUTATIONS]
"""
import collections
import io
import json
import random
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import check_certificate as second
import written_files

PRINT_LAYERS, SOURCE = sys.argv[1], Path(sys.argv[2])
MUTATIONS = int(sys.argv[3]) if len(sys.argv) > 3 else 25
NOT_READ = "HDF5"  # what the second checker says of files that only the first one reads
COMPRESSED = "the entry is compressed or encrypted"


class First:
    """The readers of `swarmcert check`, in one process."""

    def __init__(self):
        self.process = subprocess.Popen([PRINT_LAYERS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, path):
        self.process.stdin.write(f"{path}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        assert line, f"the first reader ended at {path}"
        return json.loads(line)


def read_by_second(path):
    try:
        weights = second.read_weights(path)
    except Exception as fault:  # any exception means that the file cannot be read: exit code 3
        return {"refused": f"{type(fault).__name__} {fault}"}
    stated = [f"{op}:{layer.outputs - layer.kept}" if layer.kept else op
              for layer, op in zip(weights.layers, weights.between() + ["relu"])]
    return {"precision": weights.precision,
            "layers": [[layer.name, layer.outputs, layer.inputs, layer.weights, layer.biases, op]
                       for layer, op in zip(weights.layers, stated)]}


def with_numbers(found):
    """Zeros have no sign: it changes no product or sum but that of another zero."""
    for layer in found.get("layers", []):
        for k in 3, 4:
            layer[k] = [x + 0.0 for x in map(float.fromhex, layer[k])]
    return found


def without_signs_of_zeros(found):
    for layer in found.get("layers", []):
        for k in 3, 4:
            layer[k] = [x + 0.0 for x in layer[k]]
    return found


def compare(first, path):
    one, two = with_numbers(first(path)), without_signs_of_zeros(read_by_second(path))
    if "refused" in one or "refused" in two:
        return one.get("refused", ""), two.get("refused", "")
    assert one == two, f"{path}:\n{one}\n{two}"
    return "", ""


def mutated(data, generator):
    """Of most zip archives, mutates an entry and writes the archive again, because its checksum protects it."""
    if data[:2] == b"PK" and generator.random() < 0.8:
        out, source = io.BytesIO(), zipfile.ZipFile(io.BytesIO(data))
        chosen = generator.choice(source.namelist())
        with zipfile.ZipFile(out, "w") as archive:
            for name in source.namelist():
                contents = source.read(name)
                archive.writestr(name, mutated(contents, generator) if name == chosen and contents else contents)
        return out.getvalue()
    data, is_text = bytearray(data), data[:1] == b"/"
    if generator.random() < 0.15:
        return bytes(data[:generator.randrange(len(data))])
    for _ in range(generator.choice([1, 1, 2, 4])):
        at = generator.randrange(len(data))
        data[at] = generator.choice(b"0123456789,.-+e /\n" if is_text else [
            generator.randrange(256), data[at] ^ 1 << generator.randrange(8), 0, 255])
    return bytes(data)


def run():
    first, counts, generator = First(), collections.Counter(), random.Random(5)
    with tempfile.TemporaryDirectory() as folder:
        foreign = [path for path in sorted((SOURCE / "tests/nn/files").iterdir())
                   if path.suffix in (".pth", ".onnx", ".npz", ".mat")]
        written = written_files.write(folder)
        for path in foreign + written:
            one, two = compare(first, path)
            counts["files"] += 1
            if "packed" in path.name:
                assert COMPRESSED in one and COMPRESSED in two, f"{path}: {one} | {two}"
            if path.name.startswith("h5py"):
                assert not one and NOT_READ in two, f"{path}: {one} | {two}"
            if two:
                assert "packed" in path.name or path.name.startswith("h5py"), f"{path}: {two}"
                continue
            assert not one, f"{path}: {one}"
            target, data = Path(folder) / f"mutated{path.suffix}", path.read_bytes()
            for _ in range(MUTATIONS):
                target.write_bytes(mutated(data, generator))
                one, two = compare(first, target)
                counts[bool(one), bool(two)] += 1
    print(f"{counts['files']} files and {sum(counts.values()) - counts['files']} damaged ones: "
          f"{counts[False, False]} read alike, {counts[True, True]} refused by both, {counts[True, False]} refused by "
          f"the first only, {counts[False, True]} by the second only")


if __name__ == "__main__":
    run()
