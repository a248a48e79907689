#!/usr/bin/env python3
"""Runs both checkers on the same certificates: valid ones, and mutations of every part with a forged content hash.
They must agree on each certificate and reject each mutation that makes a statement false.

    check_certificate_test.py SWARMCERT SOURCE_DIR [MUTATIONS]
"""
import json
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from struct import pack

import check_certificate as second
import onnx_models

SWARMCERT, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
MUTATIONS = int(sys.argv[3]) if len(sys.argv) > 3 else 100
QUICKLY = ["--range-nodes", "50", "-q"]  # of `certify`: less search for the printed values, which no certificate holds


def safetensors(sizes, generator, names=()):
    """A network with random weights in float64, as safetensors."""
    header, data = {}, b""
    for k, (inputs, outputs) in enumerate(zip(sizes, sizes[1:])):
        for part, shape in ("weight", [outputs, inputs]), ("bias", [outputs]):
            count = outputs * inputs if part == "weight" else outputs
            numbers = pack(f"<{count}d", *(generator.uniform(-1, 1) for _ in range(count)))
            header[f"{names[k] if names else f'fc{k + 1}'}.{part}"] = {"dtype": "F64", "shape": shape,
                                           "data_offsets": [len(data), len(data) + len(numbers)]}
            data += numbers
    text = json.dumps(header).encode()
    return pack("<Q", len(text)) + text + data


def onnx(nodes, sizes, generator):
    """An ONNX model: layers w1, w2, ... of these sizes, numbers "one", "half" and "root" of 2, and `nodes` as (type,
    inputs, output)."""
    def varint(value):
        return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + varint(value >> 7)

    def field(number, value):
        if isinstance(value, int):
            return varint(number << 3) + varint(value)
        value = value.encode() if isinstance(value, str) else value
        return varint(number << 3 | 2) + varint(len(value)) + value

    graph = b""
    for kind, inputs, output in nodes:
        graph += field(1, b"".join(field(1, name) for name in inputs) + field(2, output) + field(4, kind))
    for k, shape in enumerate(zip(sizes, sizes[1:])):
        numbers = pack(f"<{shape[0] * shape[1]}f", *(generator.uniform(-1, 1) for _ in range(shape[0] * shape[1])))
        graph += field(5, b"".join(field(1, size) for size in shape) + field(2, 1) + field(8, f"w{k + 1}")
                       + field(9, numbers))
    for name, number in ("one", 1.0), ("half", 0.5), ("root", 2 ** 0.5):
        graph += field(5, field(2, 1) + field(8, name) + field(9, pack("<f", number)))
    graph += field(11, field(1, "x")) + field(12, field(1, "y"))
    return field(1, 8) + field(2, "test") + field(7, graph)


def smooth_models(folder, generator):
    """ONNX models with activations: final activations, SiLU as exported by PyTorch, several activations in one
    model."""
    layer = lambda k, x, y: ("MatMul", [x, f"w{k}"], y)
    models = {
        "tanh": ([layer(1, "x", "a"), ("Tanh", ["a"], "b"), layer(2, "b", "c"), ("Tanh", ["c"], "y")], [3, 5, 2]),
        "silu": ([layer(1, "x", "a"), ("Sigmoid", ["a"], "s"), ("Mul", ["a", "s"], "b"), layer(2, "b", "y")],
                 [3, 5, 2]),
        "sigmoid": ([layer(1, "x", "a"), ("Sigmoid", ["a"], "b"), layer(2, "b", "y")], [3, 5, 2]),
        "actor": ([layer(1, "x", "a"), ("Relu", ["a"], "b"), layer(2, "b", "c"), ("Tanh", ["c"], "y")], [3, 5, 2]),
        "several": ([layer(1, "x", "a"), ("Sigmoid", ["a"], "s"), ("Mul", ["a", "s"], "b"), layer(2, "b", "c"),
                     ("Relu", ["c"], "d"), layer(3, "d", "e"), ("Sigmoid", ["e"], "y")], [3, 5, 4, 2]),
        "gelu": ([layer(1, "x", "a"), *gelu_nodes("a", "b"), layer(2, "b", "y")], [3, 5, 2]),
        "elu": ([layer(1, "x", "a"), ("Celu", ["a"], "b"), layer(2, "b", "y")], [3, 5, 2]),
        "swish": ([layer(1, "x", "a"), ("Swish", ["a"], "b"), layer(2, "b", "y")], [3, 5, 2])}
    for name, (nodes, sizes) in models.items():
        (folder / f"{name}.onnx").write_bytes(onnx(nodes, sizes, generator))
        yield [str(folder / f"{name}.onnx")]


def gelu_nodes(x, y):
    """As PyTorch exports it."""
    return [("Div", [x, "root"], f"{y}q"), ("Erf", [f"{y}q"], f"{y}e"), ("Add", [f"{y}e", "one"], f"{y}s"),
            ("Mul", [x, f"{y}s"], f"{y}p"), ("Mul", [f"{y}p", "half"], y)]


def onnx_layer(k, x, y):
    return ("MatMul", [x, f"w{k}"], y)


def residual_block(k, x, y, *nodes):
    """y = x + the layers k and k + 1 of x, with `nodes` from ya to yb between them."""
    return [onnx_layer(k, x, f"{y}a"), *nodes, onnx_layer(k + 1, f"{y}b", f"{y}c"), ("Add", [x, f"{y}c"], y)]


def skip_models(folder, generator):
    """ONNX models with skip connections past smooth activations: residual blocks, parallel branches, also with ReLU
    blocks; some fold two layers into one whose weights are not doubles."""
    layer, block = onnx_layer, residual_block
    silu = [("Sigmoid", ["ra"], "rs"), ("Mul", ["ra", "rs"], "rb")]
    models = {
        "residual": ([layer(1, "x", "h"), *block(2, "h", "r", ("Tanh", ["ra"], "rb")), layer(4, "r", "y")],
                     [3, 4, 4, 4, 2]),
        "around": (block(1, "x", "r", *silu) + block(3, "r", "y", ("Tanh", ["ya"], "yb")), [3, 4, 3, 5, 3]),
        "branches": ([layer(1, "x", "h"), ("Tanh", ["h"], "t"), ("Sigmoid", ["h"], "s"), ("Sub", ["t", "s"], "d"),
                      layer(2, "d", "e"), ("Softplus", ["e"], "y")], [3, 4, 2]),
        "with_relu": ([layer(1, "x", "h"), *block(2, "h", "r", ("Relu", ["ra"], "rb")),
                       *block(4, "r", "q", *gelu_nodes("qa", "qb")), ("Relu", ["q"], "p"), ("Add", ["p", "h"], "y")],
                      [3, 3, 4, 3, 4, 3])}
    for name, (nodes, sizes) in models.items():
        (folder / f"{name}.onnx").write_bytes(onnx(nodes, sizes, generator))
        yield [str(folder / f"{name}.onnx")]


def relu_skip_model(folder, generator):
    """An ONNX model of two residual blocks, ReLU in each and between them."""
    nodes = [onnx_layer(1, "x", "h"), *residual_block(2, "h", "r", ("Relu", ["ra"], "rb")), ("Relu", ["r"], "q"),
             *residual_block(4, "q", "s", ("Relu", ["sa"], "sb")), onnx_layer(6, "s", "y")]
    path = folder / "resnet.onnx"
    path.write_bytes(onnx(nodes, [3, 3, 4, 3, 4, 3, 2], generator))
    return path


def heterogeneous(folder, generator):
    """A network.toml with two kinds, ground, clamp and units."""
    for name, sizes in (("small", [6, 5, 4]), ("large", [6, 4, 4, 4]), ("ground", [4, 5, 4]), ("rho", [4, 5, 1])):
        (folder / f"{name}.safetensors").write_bytes(safetensors(sizes, generator))
    (folder / "box.toml").write_text('schema = "swarmcert/box/1"\nlower = [-1,-1,-1,-2,-2,-2]\nupper = [1,1,1,2,2,2]\n')
    (folder / "part.toml").write_text(
        'schema = "swarmcert/box/1"\nlower = [0,-0.3,-0.2,0,0.1,0]\nupper = [0.4,0.1,0.3,3,0.5,0.6]\n')
    net = folder / "network.toml"
    net.write_text("""schema = "swarmcert/network/1"
output = { quantity = "force_z", unit = "gf" }
[input]
order = ["dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"]
clamp = { lower = [-1,-1,-1,-2,-2,-2], upper = [1,1,1,2,2,2] }
[phi.small]
weights = "small.safetensors"
[phi.large]
weights = "large.safetensors"
[phi.ground]
weights = "ground.safetensors"
[rho.small]
weights = "rho.safetensors"
""")
    return net


def smooth(folder):
    """A network.toml with the parts of heterogeneous(), each with different activations."""
    net, text = folder / "smooth.toml", (folder / "network.toml").read_text()
    for part, activation in (("small", '["tanh", "sigmoid"]'), ("large", '["relu", "sigmoid"]'),
                             ("ground", '"softplus"'), ("rho", '"selu"')):
        text = text.replace(f'weights = "{part}.safetensors"',
                            f'weights = "{part}.safetensors"\nactivation = {activation}')
    net.write_text(text)
    return net


def with_skips(folder, generator):
    """The network.toml of heterogeneous(), with skip connections in both phi and in rho."""
    layer, block = onnx_layer, residual_block
    models = {
        "small": ([layer(1, "x", "h"), *block(2, "h", "r", ("Sigmoid", ["ra"], "rb")), layer(4, "r", "y")],
                  [6, 3, 4, 3, 4]),
        "large": ([layer(1, "x", "h"), ("Relu", ["h"], "p"), ("Sub", ["p", "h"], "q"), layer(2, "q", "y")], [6, 4, 4]),
        "rho": ([*block(1, "x", "r", ("Elu", ["ra"], "rb")), ("Sigmoid", ["r"], "s"),
                 ("Add", ["s", "x"], "t"), layer(3, "t", "y")], [4, 3, 4, 1])}
    net, text = folder / "skips.toml", (folder / "network.toml").read_text()
    for name, (nodes, sizes) in models.items():
        (folder / f"skips_{name}.onnx").write_bytes(onnx(nodes, sizes, generator))
        text = text.replace(f'"{name}.safetensors"', f'"skips_{name}.onnx"')
    net.write_text(text)
    return net


def of_invariants(folder, generator):
    """A network.toml with two kinds and ground, whose phi take rotation invariants."""
    for name, sizes in (("five", [5, 5, 4]), ("more", [5, 4, 4, 4]), ("three", [3, 5, 4])):
        (folder / f"{name}.safetensors").write_bytes(safetensors(sizes, generator))
    net, text = folder / "invariants.toml", (folder / "network.toml").read_text()
    text = text.replace("clamp = { lower = [-1,-1,-1,-2,-2,-2], upper = [1,1,1,2,2,2] }",
                        'invariants = "rotation"\nclamp = { lower = [0,-1,0,-2,0], upper = [1,1,1,2,2] }')
    for old, new in (("small", "five"), ("large", "more"), ("ground", "three")):
        text = text.replace(f'"{old}.safetensors"', f'"{new}.safetensors"')
    net.write_text(text)
    return net


def silent(folder):
    """The network of heterogeneous(), silent next to a small neighbour, alone or together with a large one."""
    net = folder / "silent.toml"
    net.write_text((folder / "network.toml").read_text().replace(
        "[input]", 'silent = ["large+small>small", "small>small"]\n[input]', 1))
    return net


def check_silent(certificate, net, folder):
    """A function that is 0 in some compositions has no witness there, 0 in its range, and another statement."""
    def said_of(change):
        changed = json.loads(json.dumps(certificate))
        change(changed)
        changed["content_sha256"] = second.content_sha256(changed)
        accepted, said = first_checker(changed, net, folder, 0)
        reason = second.check(changed, second.Network(**arguments(net)))
        assert accepted == (not reason), f"first says {said!r}, second says {reason!r}"
        return reason

    assert any(bound["lower"] for bound in certificate["bounds"] if bound["function"].startswith("set:"))
    assert said_of(lambda changed: changed.update(statement=second.STATEMENT))
    other_names = certificate["statement"].replace(", small>small", "")
    assert other_names != certificate["statement"] and said_of(lambda changed: changed.update(statement=other_names))
    point = ["0x0p+0"] * 6
    ground = {"network": "phi:ground", "x": point[:4]}
    for i, bound in enumerate(certificate["bounds"]):
        if bound["function"] not in ("set:small:small", "set:large:small"):
            continue
        own = bound["function"].split(":")[1]
        other = {"network": "phi:large" if own == "small" else "phi:small", "x": point}
        for others, is_silent in (([ground], own == "small"), ([ground, other], True), ([ground, other, other], False)):
            witness = {"x": point, "y": ["0x1p+0"] + point[1:], "others": others}
            reason = said_of(lambda changed: changed["bounds"][i].update(
                lower=0.0, lower_hex="0x0p+0", lower_witness=witness))
            assert is_silent == ("0 among these neighbours" in reason), reason
    for i, entry in enumerate(certificate["values"]):
        if entry["function"] == "set:small:small":
            assert "lacks a 0" in said_of(lambda changed: changed["values"][i].update(lower=["0x1p-1000"]))


def check_invariants(certificate, net, folder):
    """Bounds of set functions need the slope of the map to invariants and hold only for all inputs together."""
    def refused(i, **fields):
        changed = json.loads(json.dumps(certificate))
        changed["bounds"][i].update(fields)
        changed["content_sha256"] = second.content_sha256(changed)
        accepted, said = first_checker(changed, net, folder, 0)
        reason = second.check(changed, second.Network(**arguments(net)))
        assert not accepted and reason, f"{fields}: first says {said!r}, second says {reason!r}"

    # Refused even for a part, which is a function of invariants, however large the claim.
    part = next(i for i, bound in enumerate(certificate["bounds"]) if bound["function"] == "phi:small")
    changed = json.loads(json.dumps(certificate))
    changed["box"] = {"phi:small": {"lower": ["0x0p+0"] * 5, "upper": ["0x1p+0"] * 5}}
    changed["bounds"] = [dict(changed["bounds"][part], domain="box", upper=1e9, upper_hex=(1e9).hex(), proof=None,
                              upper_method="local_product")]
    changed["laws"] = []
    changed["content_sha256"] = second.content_sha256(changed)
    accepted, said = first_checker(changed, net, folder, 0)
    reason = second.check(changed, second.Network(**arguments(net)))
    assert not accepted, said
    assert "slopes on a box of a network of rotation invariants" in reason, reason
    changed = json.loads(json.dumps(certificate))
    changed["statement"] = second.STATEMENT
    changed["content_sha256"] = second.content_sha256(changed)
    assert not first_checker(changed, net, folder, 0)[0] and second.check(changed, second.Network(**arguments(net)))
    sets = [i for i, bound in enumerate(certificate["bounds"]) if bound["function"].startswith("set:")]
    assert len(sets) == 3
    norms = {}
    for layer in certificate["layers"]:
        norms[layer["network"]] = norms.get(layer["network"], 1.0) * layer["spectral_norm"][1]
    for i in sets:
        bound = certificate["bounds"][i]
        assert bound["unit"] == "gf/(m, m/s)" and bound["lower"] is None, bound
        phi, rho = second.networks_of(bound["function"])
        of_network = norms[phi] * norms[rho]  # without the slope of the map
        slope = 1 if phi == "phi:ground" else 1.5
        for product in (of_network * slope * 0.999,) + (of_network,) * (slope > 1):
            refused(i, upper=product, upper_hex=product.hex(), upper_method="product", proof=None)
        less = bound["upper"] / 1.01
        refused(i, upper=less, upper_hex=less.hex())
        refused(i, block="position")
        refused(i, scale=["0x1p+0"] * 6, norm="weighted_l2")
        point = ["0x0p+0"] * 5
        refused(i, lower=0.0, lower_hex="0x0p+0",
                lower_witness={"x": point, "y": ["0x1p+0"] + point[1:], "others": []})


def beside(folder):
    """The network.toml of heterogeneous(), with another activation in the ground only."""
    net = folder / "beside.toml"
    net.write_text((folder / "network.toml").read_text().replace('"ground.safetensors"',
                                                                 '"ground.safetensors"\nactivation = "tanh"'))
    return net


def recorded(network, generator):
    """Samples of a plain network as JSON, evaluated here in double."""
    inputs = [[generator.uniform(-1, 1) for _ in range(network.layers[0].inputs)] for _ in range(30)]
    outputs = []
    for x in inputs:
        for layer in network.layers:
            rows = [layer.weights[i:i + layer.inputs] for i in range(0, len(layer.weights), layer.inputs)]
            x = [sum(map(float.__mul__, row, x)) + b for row, b in zip(rows, layer.biases)]
            if layer is not network.layers[-1]:
                x = [max(0.0, value) for value in x]
        outputs.append(x)
    return json.dumps({"inputs": inputs, "outputs": outputs})


def without_decisions(tree):
    return [word for word in tree.split() if word[0] != "d"]


def leaves(value, path=()):
    if isinstance(value, (dict, list)) and value:
        for key, member in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(member, path + (key,))
    else:
        yield path


def is_tree(value):
    return isinstance(value, str) and value[:1] == "d" and value[1:2].isdigit() and " t" in value


def with_other_decisions(tree, generator):
    """Changes a decision of a tree to the other state, another corner or another neuron, or removes all decisions."""
    words = tree.split()
    decided = [i for i, word in enumerate(words) if word[0] == "d"]
    if not decided:
        return []
    at = generator.choice(decided)
    word = words[at]
    changed = [word.translate(str.maketrans("+-", "-+")), word + "1", "d9" + word[1:], word[:-1]]
    return [" ".join(words[:at] + [other] + words[at + 1:]) for other in changed] + \
        [" ".join(without_decisions(tree))]


def mutated(value, generator):
    """Returns another value: close to the original, of the same type, or of another type."""
    if isinstance(value, str) and value.startswith(("0x", "-0x")) and " " not in value:
        number = second.hex_float(value)
        return generator.choice([(number * (1 - 2 ** -20)).hex(), (-number).hex(), (0.0).hex(), "0x1p5000", "1.5", ""])
    if isinstance(value, str) and value[:2] in ("s0", "s1", "s2", "s3", "s4", "s5", "q0") or is_tree(value):
        return generator.choice(with_other_decisions(value, generator)
                                + [value.replace("q", "q9"), " ".join(w for w in value.split() if w[0] != "q") + " q0",
                                 value + " t0", value[:-3], value.replace("s", "t"), value.replace("t", "s"),
                                 "s9 t0 t0", " ".join(value.split()[1:]), ""])
    if isinstance(value, str) and " 0x" in value:  # multipliers, or a row of a form
        words = value.split()
        at = generator.randrange(len(words))
        if words[at][-1] in "+-":  # a neuron of a conflict
            words[at] = generator.choice(["x", words[at][:-1], "99999+", words[at][:-1] + "+-"[words[at][-1] == "+"]])
            return " ".join(words)
        words[at] = generator.choice([(second.hex_float(words[at]) * generator.choice([0.5, 1.001])).hex(),
                                      "-0x1p0", "x"])
        return " ".join(words)
    if isinstance(value, str) and len(value) > 200:  # a row of a factor
        return generator.choice([value + "7", value + " 1", value[:-2], "x" + value])
    if isinstance(value, str):
        return generator.choice([value + "x", value[1:], None, 3, []])
    if isinstance(value, bool) or value is None:
        return generator.choice([1, "text", {}, []])
    if isinstance(value, (int, float)):
        return generator.choice([value - 1, value + 1, value * (1 - 1e-6), -value - 1, None, "1", 10 ** 9])
    return generator.choice([None, 1, "text"])


def decided_otherwise(certificate, changed, path):
    """Returns whether only the decisions of a tree were changed."""
    if path[-1] != "tree":
        return False
    for key in path:
        if not isinstance(changed, (dict, list)) or isinstance(changed, dict) and key not in changed:
            return False
        certificate, changed = certificate[key], changed[key]
    return isinstance(changed, str) and without_decisions(certificate) == without_decisions(changed)


def forged(certificate, path, generator):
    """Returns the mutated certificate, and whether an array was only extended: unused entries state nothing."""
    is_longer = False
    changed = json.loads(json.dumps(certificate))
    place = changed
    for key in path[:-1]:
        place = place[key]
    how = generator.random()
    if how < 0.8:
        place[path[-1]] = mutated(place[path[-1]], generator)
    elif how < 0.9:
        del place[path[-1]]
    elif isinstance(place, dict):
        place["extra"] = 1
    else:
        place.append(place[path[-1]])
        is_longer = True
    if path[0] != "content_sha256":
        changed["content_sha256"] = second.content_sha256(changed)
    return changed, is_longer


def first_checker(certificate, net, folder, number):
    path = folder / f"mutation{number}.json"
    path.write_text(json.dumps(certificate))
    done = subprocess.run([SWARMCERT, "check", path, *net, "-q"], capture_output=True, text=True)
    path.unlink()
    assert done.returncode in (0, 1, 3), f"exit {done.returncode}: {done.stderr}"
    if done.returncode == 3:
        assert "schema" in done.stderr, done.stderr  # the file has another schema
    return done.returncode == 0, done.stdout + done.stderr


def arguments(net):
    """Returns the arguments of second.Network()."""
    if net[0].startswith("--"):
        return dict(zip((a[2:] for a in net[::2]), net[1::2]))
    return {"net": net[0], "orders": {"network": net[2].split(",")} if "--order" in net else {},
            "activation": net[2] if "--activation" in net else None}


def check_orders(folder, square, order):
    """A certificate for one order of the layers is refused for another, and a file that allows several is refused."""
    certificate = folder / "certificate0.json"
    assert second.parse(certificate.read_text())["network"]["weights"]["network"]["samples"]["count"] == 30
    other = [str(square), "--order", "after,first,last"]
    for net, code, words in ([str(square), *order], 0, "accepted"), (other, 1, "chain"), ([str(square)], 3, "--order"):
        done = subprocess.run([SWARMCERT, "check", certificate, *net, "-q"], capture_output=True, text=True)
        assert done.returncode == code and words in done.stdout + done.stderr, done
        checker = [sys.executable, SOURCE / "tests/lipschitz/check_certificate.py", certificate, *net]
        assert subprocess.run(checker, capture_output=True).returncode == code


def check_fixed(certificate, net, folder):
    """Fields that are only checked for their format are refused by both if malformed, with a reason that names them."""
    def refused(changed, word):
        changed["content_sha256"] = second.content_sha256(changed)
        accepted, said = first_checker(changed, net, folder, 0)
        reason = second.check(changed, second.Network(**arguments(net)))
        assert not accepted and reason, f"{word}: first says {said!r}, second says {reason!r}"
        assert word in said and word in reason, f"{word!r} is not in {said!r} and {reason!r}"

    def copy():
        return json.loads(json.dumps(certificate))

    part = next(iter(certificate["network"]["weights"]))
    for box in (0, "x", [], {}, {"phi:none": {"lower": [], "upper": []}}, {part: {"lower": ["0x0p+0"], "upper": []}},
                {part: {}}, {part: 0}, {"rho:small": {"lower": ["0x0p+0"], "upper": ["0x0p+0"]}}):
        changed = copy()
        changed["box"] = box
        refused(changed, "box")
    changed = copy()
    changed["tool"] = 1
    refused(changed, "tool")
    for law in certificate["laws"][:1]:
        changed = copy()
        function = f"set:{next(iter(law['neighbours']))}:{law['rho']}"
        changed["bounds"] = [bound for bound in changed["bounds"] if bound["function"] != function]
        refused(changed, function)

    text = b"\xef\xbb\xbf" + json.dumps(certificate).encode()
    path = folder / "mark.json"
    path.write_bytes(text)
    done = subprocess.run([SWARMCERT, "check", path, *net, "-q"], capture_output=True, text=True)
    assert done.returncode == 3 and "byte order mark" in done.stderr, done.stderr
    positional = [str(path), *net]
    assert second.main(positional) == 3


def is_in_box(box, point):
    return all(a <= x <= b for a, x, b in zip(*map(second.hex_floats, (box["lower"], point, box["upper"]))))


def check_activations(certificate, net, folder, generator):
    """Three other activations in a chain, with lower bounds or boxes, and smaller claims: the checkers agree on
    each."""
    def both(changed):
        changed["content_sha256"] = second.content_sha256(changed)
        accepted, said = first_checker(changed, net, folder, 0)
        reason = second.check(changed, second.Network(**arguments(net)))
        assert accepted == (not reason), f"first says {said!r}, second says {reason!r}"
        return accepted

    def copy():
        return json.loads(json.dumps(certificate))

    stated = {part for part, weights in second.Network(**arguments(net)).parts.items() if weights.activations}
    for part, entry in certificate["network"]["weights"].items():
        own = {step["op"] for step in entry["chain"]} - {"linear", "clamp"}
        for op in generator.sample(sorted(set(second.STEEPEST) - own), 3):
            changed = copy()
            for step in changed["network"]["weights"][part]["chain"]:
                step["op"] = op if step["op"] in own else step["op"]
            assert not (both(changed) and part in stated), f"{part}: {op} instead of {own} is accepted"
        changed = copy()
        changed["network"]["weights"][part]["chain"][1]["op"] = "identity"
        assert not both(changed)
    point = lambda part: ["0x0p+0"] * second.Network(**arguments(net)).parts[part].layers[0].inputs
    for i, bound in enumerate(certificate["bounds"]):
        changed = copy()
        names = second.networks_of(bound["function"])
        others = ([{"network": "phi:ground", "x": point("phi:ground")}]
                  if len(names) == 2 and names[0] != "phi:ground" else [])
        unit = ["0x1p+0"] + point(names[0])[1:]
        changed["bounds"][i].update(lower=0.0, lower_hex="0x0p+0", lower_witness={
            "x": point(names[0]), "y": unit, "others": others})
        used = [(names[0], point(names[0])), (names[0], unit)] + [(other["network"], other["x"]) for other in others]
        fits = bound["domain"] != "box" or all(is_in_box(certificate["box"][part], x) for part, x in used)
        assert both(changed) == fits, f"{bound['function']}: a lower bound"
        tried = [("block", "ll"), ("upper", second.math.nextafter(bound["upper"], 0)), ("upper_method", "branch"),
                 ("upper_method", "sdp")]
        if any(step["op"] not in ("clamp", "linear", "relu") for name in names
               for step in certificate["network"]["weights"][name]["chain"]):
            tried += [("upper_method", "local_sdp"), ("lower", 1.00000001 * bound["lower"])]
        for key, value in tried:
            changed = copy()
            changed["bounds"][i][key] = value
            if key in ("upper", "lower"):
                changed["bounds"][i][key + "_hex"] = value.hex()
            assert not both(changed) or bound[key] == value, f"{bound['function']}: {key} = {value} is accepted"


def shows_norm(entry, net):
    """Returns whether |W v| >= norm |v| for the vector of a layer. Many vectors satisfy this if the layer passes
    several values unchanged, as behind a final activation or beside a skip connection."""
    layer = next(layer for layer in second.Network(**arguments(net)).parts[entry["network"]].layers
                 if layer.name == entry["name"])
    v = [second.Fraction(x) for x in second.hex_floats(entry["proof"]["lower_vector"])]
    rows = [layer.weights[i * layer.inputs:(i + 1) * layer.inputs] for i in range(layer.outputs)]
    image = [sum(second.Fraction(w) * x for w, x in zip(row, v)) for row in rows]
    norm = second.Fraction(float.fromhex(entry["spectral_norm_hex"][0]))
    return sum(y * y for y in image) >= norm ** 2 * sum(x * x for x in v) > 0


def check_enclosures():
    """Softplus near 0, where the terms of its series are halved: the series ends with an enclosure of ln 2."""
    for t in 0.0, 5e-324, -5e-324, 2.0 ** -80:
        low, high = second.values_between("softplus", second.Fraction(t), second.Fraction(t))
        assert low <= second.Fraction("0.693147180559945309417232121458") <= high <= low + 2 * second.VALUE_UNIT, t


def run():
    check_enclosures()
    generator = random.Random(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        demo = SOURCE / "nn/networks/demo"
        hetero = str(heterogeneous(folder, generator))
        tiny = folder / "tiny.safetensors"
        tiny.write_bytes(safetensors([2, 5, 4, 1], generator))
        square = folder / "square.safetensors"
        square.write_bytes(safetensors([3, 3, 3, 2], generator, ["first", "after", "last"]))
        order = ["--order", "first,after,last"]
        network = second.Network(**arguments([str(square), *order])).parts["network"]
        (folder / "square.json").write_text(recorded(network, generator))
        nets = [([str(square), *order], ["--samples", str(folder / "square.json")]),
                ([hetero], ["--blocks", "--neighbours", "large=2,small=1", "--scale", "1,1,1,2,2,2", "--domain",
                            str(folder / "box.toml")]),
                ([hetero], ["--neighbours", "2", "--domain", str(folder / "part.toml"), "--method", "branch",
                            "--cuts", "20"]),
                ([str(tiny)], ["--method", "branch", "--cuts", "20"]),
                ([hetero], ["--as", "float32", "--neighbours", "2", "--method", "product"]),
                ([str(demo / "network.toml")], ["--blocks=position"]),
                ([str(demo / "network.toml")],
                 ["--as", "float32", "--neighbours", "2", "--domain", str(folder / "box.toml")]),
                (["--phi", str(demo / "phi.safetensors"), "--rho", str(demo / "rho.safetensors")],
                 ["--blocks=velocity"])]
        smooth_net = str(smooth(folder))
        try:
            second.Network(smooth_net, activation="silu")
            raise SystemExit("an activation beside another one in network.toml is taken")
        except second.BadInput as refusal:
            assert "others are stated already" in str(refusal), refusal
        nets += [([smooth_net], ["--blocks=position", "--neighbours", "large=2,small=1", "--scale", "1,1,1,2,2,2"]),
                 ([smooth_net], ["--blocks=position", "--neighbours", "2", "--method", "sdp", "--domain",
                                 str(folder / "part.toml")])]
        beside_net = str(beside(folder))
        nets += [([beside_net], ["--method", "product"])]
        invariant_net = str(of_invariants(folder, generator))
        nets += [([invariant_net], ["--blocks", "--neighbours", "large=2,small=1"])]
        silent_net = str(silent(folder))
        nets += [([silent_net], ["--neighbours", "large=2,small=1"]),
                 ([silent_net], ["--domain", str(folder / "box.toml"), "--neighbours", "2"])]
        nets += [(net, []) for net in smooth_models(folder, generator)]
        nets += [(net, options) for net in skip_models(folder, generator)
                 for options in ([], ["--method", "sdp", "--domain", str(folder / "cube.toml")])]
        nets += [([str(folder / "around.onnx")], ["--method", "product"])]
        nets += [([str(tiny)], ["--activation", ops])
                 for ops in ("silu", "gelu", "sigmoid", "tanh,relu", "relu,silu,sigmoid", "elu,relu,relu")]
        (folder / "plane.toml").write_text('schema = "swarmcert/box/1"\nlower = [-0.5, 0.25]\nupper = [1, 0.75]\n')
        nets += [([str(tiny)], ["--activation", ops, "--method", "sdp", "--domain", str(folder / "plane.toml"), *options])
                 for ops, *options in (("tanh",), ("sigmoid", "--method", "product"), ("softplus",), ("elu",),
                                       ("selu",), ("silu",), ("gelu",), ("tanh,relu",), ("relu,silu,sigmoid",),
                                       ("selu,gelu,relu", "--method", "product"))]
        nets += [([str(square), *order], ["--activation", "groupsort:3", "--domain", str(folder / "cube.toml")])]
        nets += [([str(tiny), "--activation", "leaky_relu:0.25,hardtanh"], [])]
        for name, make, options in (("image", onnx_models.image_model, []),
                                    ("series", onnx_models.series_model, ["--method", "sdp", "--domain", str(folder / "cube.toml")])):
            (folder / f"{name}.onnx").write_bytes(make(random.Random(37)))
            nets.append(([str(folder / f"{name}.onnx")], options))
        (folder / "cube.toml").write_text('schema = "swarmcert/box/1"\nlower = [-1, -1, 0]\nupper = [1, 0, 0.5]\n')
        tried = rejected = 0
        fixed = set()
        for index, (net, options) in enumerate(nets):
            path = folder / f"certificate{index}.json"
            subprocess.run([SWARMCERT, "certify", *net, *options, "--nodes", "8" if "branch" in options else "1",
                            *QUICKLY, "-o", path], check=True, capture_output=True)
            certificate = second.parse(path.read_text())
            assert first_checker(certificate, net, folder, 0)[0]
            reason = second.check(certificate, second.Network(**arguments(net)))
            assert not reason, f"the second checker rejects a sound certificate: {reason}"
            fields = (*certificate, *certificate["network"]["weights"], bool(certificate["laws"]))
            if fields not in fixed:
                fixed.add(fields)
                check_fixed(certificate, net, folder)
            if net[0] in (smooth_net, beside_net) or net[0].endswith(".onnx") or "--activation" in options:
                check_activations(certificate, net, folder, generator)
            if net[0] == invariant_net:
                check_invariants(certificate, net, folder)
            if net[0] == silent_net:
                check_silent(certificate, net, folder)
            paths = list(leaves(certificate))
            chosen = [generator.choice(paths) for _ in range(MUTATIONS if index == 1 else MUTATIONS // 10)]
            changed, longer = zip(*(forged(certificate, p, generator) for p in chosen))
            with ThreadPoolExecutor(2) as pool:
                first = list(pool.map(lambda i: first_checker(changed[i], net, folder, i), range(len(changed))))
            for where, mutation, is_longer, (accepted, said) in zip(chosen, changed, longer, first):
                other = second.check(mutation, second.Network(**arguments(net)))
                assert accepted == (not other), f"{where}: first says {said!r}, second says {other!r}"
                # If the slack of a proof allows it, another factor or multiplier also proves the bound; a law that
                # holds for two neighbours holds for one. Another pair of points may be just as steep. Wider bounds on
                # values are also valid, as are bounds for fewer neighbours or smaller input errors.
                wider = ("networks", "sum", "lower", "upper", "neighbours", "input_error")
                # Another corner may also decide a neuron, and the part may be proved without the decision.
                harmless = mutation == certificate or is_longer or decided_otherwise(certificate, mutation, where) or \
                    where[0] in ("tool", "box") or \
                    any(key in where for key in ("factor", "t", "q", "multipliers", "conflicts", "least", "most",
                                                 "radius", "law", "neighbours", "samples")) or \
                    ("lower_witness" in where and ("x" in where or "y" in where)) or \
                    (where[0] == "values" and len(where) > 2 and where[2] in wider) or \
                    ("lower_vector" in where and accepted and shows_norm(mutation["layers"][where[1]], net))
                assert harmless or not accepted, f"{where} was changed and both accept"
                tried += 1
                rejected += not accepted
        check_orders(folder, square, order)
        print(f"{tried} mutated certificates: the checkers agree on each and reject {rejected}")
        assert rejected > 0.9 * tried


if __name__ == "__main__":
    run()
