"""Networks of every kind in the formats of weight files, certificates of them, and mutations of certificates.

The importing test is called with SWARMCERT SOURCE_DIR ...
"""
import json
import sys
from pathlib import Path
from struct import pack

from weight_files import field, flat

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stability"))
from check_tracking import content_sha256  # noqa: E402

SWARMCERT, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
QUICKLY = ["--range-nodes", "50", "-q"]  # of `certify`: less search for the printed values, which no certificate holds


# --- networks --------------------------------------------------------------------------------------------------------

def as_safetensors(network, names=()):
    """Layers of (rows, biases) in float64; their names are fc1, fc2, ... unless given."""
    header, data = {}, b""
    for k, (rows, biases) in enumerate(network):
        for part, shape, numbers in (("weight", [len(rows), len(rows[0])], flat(rows)),
                                     ("bias", [len(biases)], biases)):
            stored = pack(f"<{len(numbers)}d", *numbers)
            header[f"{names[k] if names else f'fc{k + 1}'}.{part}"] = {
                "dtype": "F64", "shape": shape, "data_offsets": [len(data), len(data) + len(stored)]}
            data += stored
    text = json.dumps(header).encode()
    return pack("<Q", len(text)) + text + data


def safetensors(sizes, generator, names=()):
    """A network with random weights in float64, as safetensors."""
    numbers = lambda count: [generator.uniform(-1, 1) for _ in range(count)]
    return as_safetensors([([numbers(inputs) for _ in range(outputs)], numbers(outputs))
                           for inputs, outputs in zip(sizes, sizes[1:])], names)


def onnx(nodes, sizes, generator):
    """An ONNX model: layers w1, w2, ... of these sizes, numbers "one", "half" and "root" of 2, and `nodes` as (type,
    inputs, output)."""
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


def silent(folder):
    """The network of heterogeneous(), silent next to a small neighbour, alone or together with a large one."""
    net = folder / "silent.toml"
    net.write_text((folder / "network.toml").read_text().replace(
        "[input]", 'silent = ["large+small>small", "small>small"]\n[input]', 1))
    return net


def beside(folder):
    """The network.toml of heterogeneous(), with another activation in the ground only."""
    net = folder / "beside.toml"
    net.write_text((folder / "network.toml").read_text().replace('"ground.safetensors"',
                                                                 '"ground.safetensors"\nactivation = "tanh"'))
    return net


def recorded(certificate, generator):
    """Samples of the plain ReLU network in a certificate as JSON, evaluated here in double."""
    layers = certificate["network"]["weights"]["network"]["layers"]
    numbers = lambda text: list(map(float.fromhex, text.split()))
    inputs = [[generator.uniform(-1, 1) for _ in numbers(layers[0]["weights"][0])] for _ in range(30)]
    outputs = []
    for x in inputs:
        for layer in layers:
            x = [sum(map(float.__mul__, numbers(row), x)) + b
                 for row, b in zip(layer["weights"], numbers(layer["biases"]))]
            if layer is not layers[-1]:
                x = [max(0.0, value) for value in x]
        outputs.append(x)
    return json.dumps({"inputs": inputs, "outputs": outputs})


# --- certificates ----------------------------------------------------------------------------------------------------

ONLY_FIRST = (  # said by the tool's checker of what it accepts
    ", those by parts of boxes in double with every rounding accounted for",  # the proved one is exact
    "the files hold this network: read again and compared tensor by tensor\n")  # the proved one compares hashes


def said_by_both(first):
    """Returns what the proved checker must print where the tool's one printed `first`, which must state on acceptance
    that the files were compared. Indented lines are on how the files were read, the last one is the next command."""
    assert first.startswith("accepted: ") == (ONLY_FIRST[1] in first), first
    for words in ONLY_FIRST:
        first = first.replace(words, "")
    return "".join(line for line in first.splitlines(keepends=True) if not line.startswith(("  ", "Next: ")))


def is_of_files(reason):
    """Returns whether a reason is that the files hold another network: only a checker that reads them can tell."""
    return reason.startswith(("network", "rejected: network")) and (" holds " in reason or " differ" in reason)


def sealed(certificate):
    """The certificate with the hash of what it says now."""
    certificate["content_sha256"] = content_sha256(certificate)
    return certificate


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
        number = float.fromhex(value)
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
        words[at] = generator.choice([(float.fromhex(words[at]) * generator.choice([0.5, 1.001])).hex(),
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
    """Returns the mutated certificate."""
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
    if path[0] != "content_sha256":
        changed["content_sha256"] = content_sha256(changed)
    return changed


def is_slightly_less(certificate, changed, path):
    """Returns whether only the rho of a proof by parts was changed, by mutated(), to a number just below, which its
    multipliers may show as well; the bound that is claimed is the same."""
    if path[:1] + path[2:] != ("bounds", "proof", "rho") or "tree" not in certificate["bounds"][path[1]]["proof"]:
        return False
    before, after = (c["bounds"][path[1]]["proof"].get("rho") for c in (certificate, changed))
    return after == (float.fromhex(before) * (1 - 2 ** -20)).hex()


def is_harmless(certificate, changed, path):
    """Returns whether a change may leave every statement true: of a proof with slack, another factor or multiplier also
    proves the bound; a law for two neighbours holds for one; another pair of points may be as steep; wider bounds on
    values are valid, as are bounds for fewer neighbours or smaller input errors; an array that is longer than needed
    states nothing; and the network's files, options and assumptions are for the reader of files."""
    wider = ("networks", "sum", "lower", "upper", "neighbours", "input_error")
    proofs = ("factor", "t", "q", "multipliers", "conflicts", "least", "most", "radius", "law", "neighbours", "samples",
              "lower_vector")
    return changed == certificate or decided_otherwise(certificate, changed, path) or \
        is_slightly_less(certificate, changed, path) or \
        path[0] in ("tool", "box", "network") or any(key in path for key in proofs) or \
        ("lower_witness" in path and ("x" in path or "y" in path)) or \
        (path[0] == "values" and len(path) > 2 and path[2] in wider) or is_only_longer(certificate, changed)


def is_only_longer(before, after):
    """Returns whether `after` has more elements in an array, and nothing else."""
    if isinstance(before, dict) and isinstance(after, dict) and before.keys() == after.keys():
        return all(key == "content_sha256" or is_only_longer(before[key], after[key]) for key in before)
    if isinstance(before, list) and isinstance(after, list):
        return len(after) >= len(before) and all(map(is_only_longer, before, after))
    return before == after
