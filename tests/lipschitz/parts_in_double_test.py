#!/usr/bin/env python3
"""Compares decisions on trees of parts in double precision (parts_in_double.py) with decisions in fractions.

    parts_in_double_test.py SWARMCERT
"""
import json
import random
import struct
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import check_certificate as checker
import parts_in_double

SWARMCERT = Path(sys.argv[1]).resolve()


def safetensors(sizes, generator):
    tensors, data = {}, b""
    for k, (inputs, outputs) in enumerate(zip(sizes, sizes[1:]), 1):
        for name, shape in ((f"fc{k}.weight", [outputs, inputs]), (f"fc{k}.bias", [outputs])):
            count = shape[0] * (shape[1] if len(shape) > 1 else 1)
            numbers = [generator.gauss(0, 1) / inputs ** 0.5 for _ in range(count)]
            tensors[name] = {"dtype": "F64", "shape": shape, "data_offsets": [len(data), len(data) + 8 * count]}
            data += struct.pack(f"<{count}d", *numbers)
    header = json.dumps(tensors).encode()
    return struct.pack("<Q", len(header)) + header + data


def certified(folder, name, net, *options):
    path = folder / f"{name}.json"
    done = subprocess.run([SWARMCERT, "certify", *map(str, net), "--method", "branch", *map(str, options),
                           "--range-nodes", "50", "-q", "-o", path], capture_output=True, text=True)
    assert done.returncode == 0, done
    return json.loads(path.read_text())


def network_of(net):
    return checker.Network(**({"phi": str(net[1]), "rho": str(net[3])} if net[0] == "--phi" else {"net": str(net[0])}))


def calls_of(certificate, net):
    """Returns the arguments of all calls of parts_in_double.holds, which must accept without resorting to fractions."""
    asked, holds, in_fractions = [], parts_in_double.holds, checker.tree_fails

    def spy(*arguments):
        asked.append((arguments, holds(*arguments)))
        return asked[-1][1]

    parts_in_double.holds = spy
    checker.tree_fails = lambda *arguments: (_ for _ in ()).throw(AssertionError("fractions were asked"))
    try:
        assert checker.check(certificate, network_of(net)) == ""
    finally:
        parts_in_double.holds, checker.tree_fails = holds, in_fractions
    assert asked and all(answer for _, answer in asked)
    return [arguments for arguments, _ in asked]


def holds_in_fractions(layers, boxes, text, gram, moving, weight, rho, multipliers, conflicts):
    """Decides the same in fractions, for a Gram matrix of doubles."""
    hidden = []
    for w, b, without_relu in layers:
        layer = checker.Hidden.__new__(checker.Hidden)
        layer.weights = [[Fraction(x) for x in row] for row in w]
        layer.biases, layer.without_relu, layer.least, layer.most = [Fraction(x) for x in b], without_relu, None, None
        hidden.append(layer)
    g = [[Fraction(x) for x in row] for row in gram[0].tolist()]
    fractions = [([Fraction(x) for x in low], [Fraction(x) for x in high]) for low, high in boxes]
    square = checker.scaled_identity(rho, len(moving))
    exact = [[(*c[:4], Fraction(c[4]), Fraction(c[5])) for c in some] for some in conflicts]
    proves = lambda part, index: checker.part_holds(hidden, g, moving, [Fraction(x) for x in weight], part.bounds,
                                                    square, [Fraction(x) for x in multipliers[index].tolist()],
                                                    checker.shown(
                                                        hidden, part.low, part.high, part.bounds, exact[index]))
    return checker.tree_fails(hidden, fractions, text, proves) == ""


def refuses_conflicts_that_are_no_text():
    """Conflicts that are not text are refused as by fractions, which then decide: an empty list is not empty text."""
    assert checker.conflicts_in_double("") == []
    for no_text in ([], {}, None, 0, ["0+ 1- 0x1p-1 0x1p-1"]):
        try:
            checker.conflicts_in_double(no_text)
        except ValueError:
            continue
        raise AssertionError(f"{no_text!r} was taken for conflicts")


def with_rho(arguments, rho):
    return (*arguments[:6], rho, *arguments[7:])


def least_accepted(arguments):
    """Returns the least rho that double precision accepts, and one just below it."""
    low, high = 0.0, arguments[6]
    while high - low > 1e-9 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if parts_in_double.holds(*with_rho(arguments, middle)) else (middle, high)
    return low, high


def accepts_no_less_than_fractions(arguments, witnessed):
    below, least = least_accepted(arguments)
    assert holds_in_fractions(*with_rho(arguments, least)), "double precision accepts what is not shown"
    assert not parts_in_double.holds(*with_rho(arguments, below))
    assert least >= witnessed ** 2, (least, witnessed)
    return least


def refuses_what_lacks_a_part(arguments):
    layers, boxes, text, gram, moving, weight, rho, multipliers, conflicts = arguments
    words = text.split(" ")
    leaves = [k for k, word in enumerate(words) if word[0] == "t"]
    splits = [k for k, word in enumerate(words) if word[0] == "s"]
    decisions = [k for k, word in enumerate(words) if word[0] == "d"]
    changed = [words[:leaves[-1]], words + ["t0"], words[:leaves[0]] + ["t999999"] + words[leaves[0] + 1:],
               *(words[:k] + ["s9"] + words[k + 1:] for k in splits[:1]), ["d9999+0"] + words, words + ["d0+0"],
               ["r"] + words]
    for k in decisions[:5]:  # the opposite of the proved state
        changed.append(words[:k] + [words[k].translate(str.maketrans("+-", "-+"))] + words[k + 1:])
    for some in changed:
        assert not parts_in_double.holds(layers, boxes, " ".join(some), gram, moving, weight, rho, multipliers,
                                         conflicts), some[:3]
    assert not parts_in_double.holds(layers, boxes, text, gram, moving, weight, rho, 0 * multipliers, conflicts)
    return len(decisions)


def bounds_contain_the_neurons(generator):
    """Bounds contain the exact values of all neurons at points of random boxes, for small and large weights."""
    checked = 0
    for size in (1.0, 1e-12, 1e8):
        weights = [[[generator.gauss(0, size) for _ in range(n)] for _ in range(m)]
                   for n, m in ((3, 6), (6, 5), (5, 4))]
        layers = [parts_in_double.Layer(w, [generator.gauss(0, size) for _ in w], k == 1)
                  for k, w in enumerate(weights)]
        middle = [[generator.uniform(-1, 1) for _ in range(3)] for _ in range(8)]
        half = [[10 ** generator.uniform(-9, 0) for _ in range(3)] for _ in range(8)]
        low = parts_in_double.np.array([[m - h for m, h in zip(*row)] for row in zip(middle, half)])
        high = parts_in_double.np.array([[m + h for m, h in zip(*row)] for row in zip(middle, half)])
        none = tuple(parts_in_double.np.array([], dtype=int) for _ in range(4))
        bounds = parts_in_double.Bounds(layers, low, high, None, none)
        for row in range(8):
            for corner in range(12):
                x = [Fraction(generator.choice((l, h)) if corner < 8 else generator.uniform(l, h))
                     for l, h in zip(low[row].tolist(), high[row].tolist())]
                for k, layer in enumerate(layers):
                    y = [sum(Fraction(w) * v for w, v in zip(ws, x)) + Fraction(b)
                         for ws, b in zip(layer.w.tolist(), layer.b.tolist())]
                    for i, value in enumerate(y):
                        least, most = (Fraction(float(ends[k][row, i])) for ends in (bounds.lower, bounds.upper))
                        assert least <= value <= most
                        checked += 1
                    x = [max(v, Fraction(0)) if relu else v for v, relu in zip(y, layer.relu)]
    assert checked > 3000, checked


def main():
    generator = random.Random(31)
    refuses_conflicts_that_are_no_text()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, sizes in (("cube", [3, 8, 8, 2]), ("tiny", [2, 5, 4, 1]), ("phi", [3, 8, 6, 2]), ("rho", [2, 6, 1])):
            (folder / f"{file}.safetensors").write_bytes(safetensors(sizes, generator))
        (folder / "cube.toml").write_text('schema = "swarmcert/box/1"\nlower = [-1, -1, -1]\nupper = [1, 1, 1]\n')
        (folder / "part.toml").write_text(
            'schema = "swarmcert/box/1"\nlower = [-0.1, -0.8, 0.1]\nupper = [1.2, 0.4, 1.5]\n')
        cube, tiny = [folder / "cube.safetensors"], [folder / "tiny.safetensors"]
        pair = ["--phi", folder / "phi.safetensors", "--rho", folder / "rho.safetensors"]
        decisions = cuts = 0
        for kind, net, options in (("box", cube, ["--domain", folder / "cube.toml"]), ("cover", tiny, []),
                                   ("set", pair, ["--domain", folder / "part.toml"])):
            certificate = certified(folder, kind, net, "--nodes", "60", *options)
            bound = next(b for b in certificate["bounds"] if b["upper_method"] == "branch")
            # for a set function, rho is that of phi in front of a form
            witnessed = bound["lower"] if len(net) == 1 else 0
            arguments = calls_of(certificate, net)[0]
            least = accepts_no_less_than_fractions(arguments, witnessed)
            cuts += sum(map(len, arguments[8]))
            decisions += refuses_what_lacks_a_part(arguments)
            print(f"{kind}: {len(arguments[7])} multipliers, slopes from {least ** 0.5:.6g} on are accepted, "
                  f"{bound['lower']:.6g} is witnessed")
        assert decisions > 0 and cuts > 0, (decisions, cuts)
    bounds_contain_the_neurons(generator)


if __name__ == "__main__":
    main()
