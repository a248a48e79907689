#!/usr/bin/env python3
"""Invalid or contradictory input is refused by the Python checker with exit code 3, also under `python3 -O`, which
removes every assert; the C++ checker refuses the same input with the same code.

    optimized_python_test.py SWARMCERT SOURCE_DIR
"""
import ast
import math
import random
import subprocess
import sys
import tempfile
import zipfile
from io import BytesIO
from pathlib import Path

import check_certificate_test as common

CHECKER = common.SOURCE / "tests/lipschitz/check_certificate.py"


def code_and_words(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def optimized(path, net):
    return code_and_words([sys.executable, "-B", "-O", CHECKER, path, *net])


def certified(net, path):
    """Returns a certificate of the network that python -O accepts, so that a later refusal is not due to it."""
    code, words = code_and_words([common.SWARMCERT, "certify", *net, "--method", "product", "-q", "-o", path])
    assert code == 0, words
    code, words = optimized(path, net)
    assert code == 0, words
    return path


def written(path, data):
    path.write_bytes(data)
    return path


def contradictory_inputs(folder, generator):
    """Returns networks with a valid certificate, arguments that are refused, and a word of the reason."""
    def network(name, sizes, names=()):
        return written(folder / name, common.safetensors(sizes, generator, names))

    common.heterogeneous(folder, generator)
    smooth, plain = common.smooth(folder), network("plain.safetensors", [2, 5, 4, 1])
    square = network("square.safetensors", [3, 3, 3, 2], ["first", "after", "last"])
    ordered = [square, "--order", "first,after,last"]
    model = next(net for net in common.smooth_models(folder, generator) if Path(net[0]).stem == "elu")
    unknown = written(folder / "unknown.toml", smooth.read_bytes().replace(b'"tanh"', b'"mish"'))
    yield [smooth], [smooth, "--activation", "silu"], "others are stated already"
    yield [smooth], [unknown], "is unknown"
    yield model, [*model, "--activation", "tanh"], "others are stated already"
    yield model, [*model, "--order", "layer3_w2,w1"], "order"
    yield ordered, [square], "order of the layers is not stated"
    yield ordered, [square, "--order", "first,last"], "does not name every layer once"
    yield [plain], [plain, "--order", "fc2,fc1,fc3"], "does not take what the one before gives"

    first, second = common.safetensors([2, 3], generator, ["a"]), common.safetensors([5, 1], generator, ["b"])
    yield [plain], [written(folder / "apart.safetensors", joined(first, second))], "no order of the layers fits"
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w") as other:
        other.writestr("a.txt", "not written by torch.save")
    yield [plain], [written(folder / "archive.pth", archive.getvalue())], "torch.save"
    data = plain.read_bytes()
    yield [plain], [written(folder / "nan.safetensors", data[:-8] + common.pack("<d", math.nan))], "not finite"
    yield [plain], [written(folder / "none.safetensors", data.replace(b".weight", b".wait__"))], "no layer"


def joined(*files):
    """Returns one safetensors file with the tensors of all files."""
    header, data = {}, b""
    for file in files:
        size = int.from_bytes(file[:8], "little")
        for name, entry in common.json.loads(file[8:8 + size]).items():
            header[name] = {**entry, "data_offsets": [len(data) + at for at in entry["data_offsets"]]}
        data += file[8 + size:]
    text = common.json.dumps(header).encode()
    return common.pack("<Q", len(text)) + text + data


def refuses_contradictory_input(folder):
    refused, certificates = 0, {}
    for net, arguments, reason in contradictory_inputs(folder, random.Random(7)):
        if str(net) not in certificates:
            certificates[str(net)] = certified(net, folder / f"certificate{len(certificates)}.json")
        path = certificates[str(net)]
        code, words = optimized(path, arguments)
        assert code == 3 and reason in words, f"{arguments}: exit {code}, {words}"
        code, words = code_and_words([common.SWARMCERT, "check", path, *arguments, "-q"])
        assert code == 3, f"{arguments}: exit {code}, {words}"
        refused += 1
    assert refused == 11


def refuses_files_of_another_kind(folder):
    """JSON that is no certificate is bad input (3) and not a rejected certificate (1), for either checker."""
    net = written(folder / "any.safetensors", common.safetensors([2, 3, 1], random.Random(8)))
    text = certified([net], folder / "any.json").read_text()
    newer = text.replace('"swarmcert/certificate/1"', '"swarmcert/certificate/9"')
    for other in "[]", "3", "{}", '{"schema": 5}', newer:
        path = written(folder / "other.json", other.encode())
        for code, words in (optimized(path, [net]),
                            code_and_words([common.SWARMCERT, "check", path, net, "-q"])):
            assert code == 3 and ("schema" in words or "JSON object" in words), f"{other[:50]}: exit {code}, {words}"


def no_checker_rests_on_assert():
    sources = [path for folder in ("lipschitz", "stability")
               for path in sorted((common.SOURCE / "tests" / folder).glob("*.py"))
               if not path.stem.endswith("_test")]
    assert {"check_certificate", "check_tracking"} <= {path.stem for path in sources}
    for path in sources:
        lines = [node.lineno for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Assert)]
        assert not lines, f"{path.name} asserts in lines {lines}: python -O would drop that"


if __name__ == "__main__":
    no_checker_rests_on_assert()
    with tempfile.TemporaryDirectory() as name:
        refuses_contradictory_input(Path(name))
        refuses_files_of_another_kind(Path(name))
