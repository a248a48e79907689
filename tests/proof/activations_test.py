#!/usr/bin/env python3
"""The proved checker on networks with activations other than ReLU. A smooth certificate is derived from two
certificates of ReLU networks: with slopes in [0, b], the matrix inequality is that of the ReLU network whose later
matrices are multiplied by b.

    activations_test.py SWARMCERT SOURCE_DIR 0 CHECKER
"""
import copy
import hashlib
import json
import math
import random
import struct
import subprocess
import sys
import tempfile
from collections import Counter
from fractions import Fraction
from pathlib import Path

SWARMCERT, SOURCE, CHECKER = Path(sys.argv[1]).resolve(), Path(sys.argv[2]), Path(sys.argv[4]).resolve()
sys.path.insert(0, str(SOURCE / "tests/lipschitz"))
import canonical  # noqa: E402
import weight_files  # noqa: E402
from certificates import as_safetensors, is_of_files, QUICKLY, sealed  # noqa: E402

LARGEST_SLOPE = {"relu": 1.0, "tanh": 1.0, "sigmoid": 0.25, "softplus": 1.0, "elu": 1.0,
                 "selu": float.fromhex("0x1.c212cc640f031p+0"),
                 # for silu and gelu of the absolute value
                 "silu": float.fromhex("0x1.1999p+0"), "gelu": float.fromhex("0x1.211p+0")}


ANOTHER_OPERATION = " holds another operation of the chain after it"  # said by the checker that reads the files


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=60)


def written(certificate, net):
    path = Path(net).parent / "checked.json"
    path.write_text(json.dumps(sealed(certificate)))
    return path


def check(certificate, net, *options):
    """The proved checker, which reads the network in the certificate only."""
    return run(CHECKER, *options, written(certificate, net), net)


def check_files(certificate, net, *options):
    """The checker of the tool, which reads the files again, as the options say or else as the certificate does."""
    return run(SWARMCERT, "check", written(certificate, net), net, *options)


def refused(certificate, net, reason):
    done = check(certificate, net)
    assert done.returncode == 1 and reason in done.stdout, f"expected {reason!r}: {done}"


def layers(sizes, generator):
    """Weights are powers of two, so that products with a slope are exact."""
    def number():
        return generator.choice((-1, 1)) * 2.0 ** generator.randrange(-3, 1)
    return [([[number() for _ in range(n)] for _ in range(m)], [number() for _ in range(m)])
            for n, m in zip(sizes, sizes[1:])]


def folded(network, b):
    return network[:1] + [([[b * w for w in row] for row in rows], biases) for rows, biases in network[1:]]


def certify(net, *options, rounds=0):
    """Without lower bounds, unless search rounds are requested."""
    path = Path(net).parent / "certificate.json"
    done = run(SWARMCERT, "certify", net, *options, "--nodes", rounds, *QUICKLY, "--force", "-o", path)
    assert done.returncode == 0, done
    return json.loads(path.read_text())


def networks_of(function):
    kind, _, rest = function.partition(":")
    return [function] if kind != "set" else ["phi:" + rest.split(":")[0], "rho:" + rest.split(":")[1]]


def with_activations(certificate, ops):
    """Sets the activations of the chains, by part; statements that only ReLU networks may have are omitted."""
    changed = copy.deepcopy(certificate)
    for part, entry in changed["network"]["weights"].items():
        for step in entry["chain"]:
            step["op"] = ops[part] if step["op"] == "relu" else step["op"]
    for bound in changed["bounds"]:
        if any(ops[part] != "relu" for part in networks_of(bound["function"])):
            bound.update(lower=None, lower_hex=None, lower_witness=None)
    return changed


def with_upper(bound, upper):
    bound.update(upper=upper, upper_hex=upper.hex())


def least_double(exact):
    near = float(exact)
    return near if Fraction(near) >= exact else math.nextafter(near, math.inf)


def one_network(folder, op, generator):
    """A plain network and its smooth certificate by a matrix inequality."""
    network = layers([3, 4, 3, 2], generator)
    net, relu = folder / f"{op}.safetensors", folder / f"{op}_folded.safetensors"
    net.write_bytes(as_safetensors(network))
    relu.write_bytes(as_safetensors(folded(network, LARGEST_SLOPE[op])))
    certificate = certify(net, "--method", "sdp")
    certificate["bounds"] = certify(relu, "--method", "sdp")["bounds"]
    assert certificate["bounds"][0]["upper_method"] == "sdp"
    return net, with_activations(certificate, {"network": op})


def accepted_at_the_bound_that_the_proof_shows(folder, op, generator):
    net, certificate = one_network(folder, op, generator)
    bound = certificate["bounds"][0]
    rho = Fraction(float.fromhex(bound["proof"]["rho"]))
    upper = math.sqrt(float(rho))
    while Fraction(upper) ** 2 < rho:
        upper = math.nextafter(upper, math.inf)
    while Fraction(math.nextafter(upper, 0)) ** 2 >= rho:
        upper = math.nextafter(upper, 0)
    with_upper(bound, upper)
    done = check(certificate, net)
    assert done.returncode == 0 and "accepted: every statement" in done.stdout, f"{op}: {done}"
    words = {"relu": "ReLU", "elu": "ELU", "selu": "SELU"}.get(op, op)
    assert f"for fc1 - {words} - fc2 - {words} - fc3" in done.stdout, done
    with_upper(bound, math.nextafter(upper, 0))
    refused(certificate, net, "claims less than sqrt(rho)")
    with_upper(bound, upper)
    bound["proof"]["rho"] = (0.999 * float(rho)).hex()
    refused(certificate, net, "the factor does not show")


def the_inequality_is_that_of_the_activation(folder, generator):
    """The same proof does not hold for a function that is steeper or less steep."""
    net, certificate = one_network(folder, "sigmoid", generator)
    for op in "tanh", "relu", "softplus", "elu", "selu":
        refused(with_activations_again(certificate, op), net, "the factor does not show")
    for op in "silu", "gelu":  # the inputs are in their matrix
        refused(with_activations_again(certificate, op), net, "the factor does not show")
    refused(with_activations_again(certificate, "mish"), net, "chain: unknown operation mish")


def functions_that_are_not_monotone_have_an_inequality_of_their_own(folder, generator):
    """Accepted as certified, and nothing stronger: neither a smaller bound nor a function with a larger range of
    slopes."""
    net = folder / "bent.safetensors"
    net.write_bytes(as_safetensors(layers([3, 4, 3, 2], generator)))
    for op in "silu", "gelu":
        certificate = certify(net, "--activation", op)
        bound = certificate["bounds"][0]
        assert bound["upper_method"] == "sdp" and bound["upper"] < math.prod(
            layer["spectral_norm"][1] for layer in certificate["layers"]) * LARGEST_SLOPE[op] ** 2
        done = check(certificate, net)
        assert done.returncode == 0 and "accepted: every statement" in done.stdout, done
        assert "0 not checked" in done.stdout or "not checked" not in done.stdout, done
        rho, t = bound["proof"]["rho"], bound["proof"]["t"]
        bound["proof"]["rho"] = (0.999 * float.fromhex(rho)).hex()
        refused(certificate, net, "the factor does not show")
        bound["proof"]["rho"] = rho
        bound["proof"]["t"] = [(1.01 * float.fromhex(x)).hex() for x in t]
        refused(certificate, net, "the factor does not show")
        bound["proof"]["t"] = t
        for other in {"silu": ("gelu", "selu"), "gelu": ("selu",)}[op]:
            refused(with_activations_again(certificate, other), net, "the factor does not show")
        with_upper(bound, 0.999 * bound["upper"])
        refused(certificate, net, "claims less than sqrt(rho)")


def with_activations_again(certificate, op):
    changed = copy.deepcopy(certificate)
    for step in changed["network"]["weights"]["network"]["chain"]:
        step["op"] = op if step["op"] != "linear" else "linear"
    return changed


def refuses_what_only_relu_has(folder, generator):
    net, certificate = one_network(folder, "tanh", generator)
    lower = certify(net, "--method", "sdp", rounds=1)
    assert check(lower, net).returncode == 0 and lower["bounds"][0]["lower_witness"]
    lower = certify(net, "--activation", "tanh", rounds=1)
    assert check(lower, net).returncode == 0 and lower["bounds"][0]["lower_witness"]
    for keys, reason in ((["lower_witness"], "lower: expected text"),
                         (["lower", "lower_hex"], "lower has no witness")):
        changed = copy.deepcopy(lower)
        for key in {"lower", "lower_hex", "lower_witness"} - set(keys):
            changed["bounds"][0][key] = None
        refused(changed, net, reason)
    box = folder / "box.toml"
    box.write_text('schema = "swarmcert/box/1"\nlower = [-1, -1, -1]\nupper = [1, 1, 1]\n')
    on_box = certify(net, "--domain", box, "--range", "--method", "sdp")
    assert on_box["values"]
    refused(with_activations(on_box, {"network": "softplus"}), net, "the values leave the bounds")
    local = certify(net, "--activation", "tanh", "--domain", box, "--method", "sdp")
    assert local["bounds"][0]["upper_method"] == "local_sdp" and check(local, net).returncode == 0
    local["bounds"][0]["domain"] = "global"
    refused(local, net, "slopes on a box of a bound without one")
    assert decided(certificate, net, "--activation", "tanh") == 0
    for options in [], ["--activation", "relu"]:  # the file does not state its activation
        done = check_files(certificate, net, *options)
        assert done.returncode == 1 and "layers fc1" in done.stdout and ANOTHER_OPERATION in done.stdout, done
    done = check_files(certificate, net, "--activation", "mish")
    assert done.returncode == 2 and '"mish" is not an activation' in done.stderr, done
    done = check(certificate, net, "--activation", "tanh")
    assert done.returncode == 2 and "unknown option" in done.stderr, done
    mixed = copy.deepcopy(certificate)
    next(s for s in mixed["network"]["weights"]["network"]["chain"] if s["op"] == "tanh")["op"] = "sigmoid"
    refused(mixed, net, "the factor does not show")  # it makes a claim about another network


def products_count_the_activations(folder, generator):
    """For a network with three layers the product contains the largest slope twice."""
    network = layers([3, 4, 3, 2], generator)
    net = folder / "product.safetensors"
    net.write_bytes(as_safetensors(network))
    relu = certify(net, "--method", "product")
    norms = [Fraction(float.fromhex(layer["spectral_norm_hex"][1])) for layer in relu["layers"]]
    for op, slope in LARGEST_SLOPE.items():
        certificate = with_activations(relu, {"network": op})
        bound = certificate["bounds"][0]
        assert bound["upper_method"] == "product"
        upper = least_double(math.prod(norms) * Fraction(slope) ** 2)
        with_upper(bound, upper)
        done = check(certificate, net)
        assert done.returncode == 0, done
        with_upper(bound, math.nextafter(upper, 0))
        refused(certificate, net, "claims less than the product of the norms")


def products_of_sorting_layers(folder, generator):
    """MaxMin and GroupSort: both checkers agree on certificates as written and on changed ones."""
    net = folder / "sorting.safetensors"
    net.write_bytes(as_safetensors(layers([3, 4, 8, 2], generator)))
    relu, tried, accepted, proved = certify(net, "--method", "sdp"), 0, 0, 0
    def smaller(certificate):
        with_upper(certificate["bounds"][0], math.nextafter(certificate["bounds"][0]["upper"], 0))
    def of_relu(certificate):
        certificate["bounds"] = copy.deepcopy(relu["bounds"])
        certificate["bounds"][0].update(lower=None, lower_hex=None, lower_witness=None)
    def with_other(key, value):
        return lambda certificate: certificate["bounds"][0].update({key: value})
    changes = [lambda certificate: None, smaller, of_relu, with_other("upper_method", "sdp"),
               with_other("upper_method", "branch"), with_other("lower", 0.5), with_other("domain", "box"),
               lambda certificate: certificate.update(statement=relu["statement"])]
    ops = ["groupsort:2", "groupsort:4", "maxmin:halves", "maxmin:pairs"]
    changes += [lambda certificate, op=op: certificate.update(with_activations_again(certificate, op))
                for op in ops + ["relu", "tanh", "groupsort:1", "groupsort:3", "groupsort:02", "groupsort:65",
                                 "maxmin"]]
    for op in ops:
        certificate = certify(net, "--activation", op, "--method", "product")
        assert certificate["bounds"][0]["upper_method"] == "product"
        for number, change in enumerate(changes):
            changed = copy.deepcopy(certificate)
            change(changed)
            code = decided(changed, net)
            assert code in (0, 1), (op, number)
            tried, accepted = tried + 1, accepted + (code == 0)
            proved += check(changed, net).returncode == 0
        # Each of the four is accepted for any other: the file does not state which it is, and the bound is the same.
        for other in ops:
            assert decided(with_activations_again(certificate, other), net, "--activation", other) == 0, (op, other)
    # If nothing else is stated, the file is read with the activation that the certificate was made for.
    assert (tried, accepted) == (len(ops) * len(changes), 2 * len(ops)), (tried, accepted)
    assert proved == len(ops) * (1 + len(ops)), proved
    for op in "groupsort:3", "maxmin", "groupsort:65":
        done = check_files(certificate, net, "--activation", op)
        assert done.returncode in (2, 3) and f"--activation {op}: " in done.stderr.replace(" = ", " "), done
    done = check(certificate, net, "--coq")
    assert "[(Sorted Pairs);(Sorted Pairs)]" in done.stdout, done


def groups_keep_their_sum_and_come_no_further_apart(folder, generator):
    """Matrix inequalities of sorted layers, alone and beside others: below the product of the norms, accepted by both
    checkers; refused with a smaller claim, another multiplier, another group, and without the sums."""
    net = folder / "groups.safetensors"
    net.write_bytes(as_safetensors(layers([3, 12, 12, 2], generator)))
    ops = ["groupsort:2", "groupsort:3", "groupsort:4", "groupsort:12", "maxmin:halves", "maxmin:pairs",
           "maxmin:pairs,silu", "relu,groupsort:3", "maxmin:halves,groupsort:4"]
    def with_other_multiplier(bound, place):
        t = bound["proof"]["t"].split(" ") if isinstance(bound["proof"]["t"], str) else bound["proof"]["t"]
        t[place] = (float.fromhex(t[place]) * 1.5 + 1).hex()
        bound["proof"]["t"] = " ".join(t) if isinstance(bound["proof"]["t"], str) else t
    for op in ops:
        certificate = certify(net, "--activation", op)
        bound = certificate["bounds"][0]
        product = certify(net, "--activation", op, "--method", "product")["bounds"][0]["upper"]
        assert bound["upper_method"] == "sdp" and bound["upper"] < product, (op, bound["upper"], product)
        assert decided(certificate, net) == 0, op
        changes = [lambda b: with_upper(b, b["upper"] * 0.99), lambda b: with_other_multiplier(b, 0),
                   lambda b: with_other_multiplier(b, -1), lambda b: b.update(upper_method="eclipse_fast"),
                   lambda b: b.update(upper_method="product")]
        for number, change in enumerate(changes):
            changed = copy.deepcopy(certificate)
            change(changed["bounds"][0])
            assert decided(changed, net) == 1, (op, number)
        for other in ops:
            if "," not in op + other and other != op:
                changed = with_activations_again(certificate, other)
                assert decided(changed, net, "--activation", other) == 1, (op, other)


def decided(certificate, net, *options):
    """Returns the exit code of both checkers, which must agree on what is claimed. That another function is stated than
    the files hold, only the one that reads them can tell."""
    first, done = check_files(certificate, net, *options), check(certificate, net)
    assert first.returncode == done.returncode or is_of_files(first.stdout), f"{first}, {done}"
    assert "not checked" not in done.stdout.replace("0 not checked", ""), done
    return first.returncode


def several_activations_in_one_network(folder, generator):
    """Accepted with each activation in its place. With another one anywhere, with two exchanged, with one missing, and
    with a smaller claim both checkers agree."""
    net = folder / "several.safetensors"
    net.write_bytes(as_safetensors(layers([3, 4, 6, 2], generator)))
    tried = accepted = 0
    for ops in "tanh,relu", "relu,silu", "sigmoid,selu", "relu,tanh,sigmoid", "gelu,relu,silu", "maxmin:pairs,sigmoid":
        certificate = certify(net, "--activation", ops)
        assert certificate["bounds"][0]["upper_method"] == "sdp"
        assert decided(certificate, net) == decided(certificate, net, "--activation", ops) == 0
        exchanged = ",".join(reversed(ops.split(",")))
        assert decided(certificate, net, "--activation", exchanged) == 1
        first = check_files(certificate, net, "--activation", ops + ",relu,relu")
        assert first.returncode == 3, first
        steps = certificate["network"]["weights"]["network"]["chain"]
        places = [k for k, step in enumerate(steps) if step["op"] != "linear"]
        assert [steps[k]["op"] for k in places] == ops.split(",")
        for place in places:
            for op in "relu", "sigmoid", "selu", "gelu", "maxmin:halves", "mish":
                changed = copy.deepcopy(certificate)
                changed["network"]["weights"]["network"]["chain"][place]["op"] = op
                done = check(changed, net)
                assert decided(changed, net) == int(op != ops.split(",")[places.index(place)])
                assert done.returncode == 1 or op != "mish"
                tried, accepted = tried + 1, accepted + (done.returncode == 0)
        shorter = copy.deepcopy(certificate)
        del shorter["network"]["weights"]["network"]["chain"][places[-1]:places[-1] + 2]
        assert decided(shorter, net) == 1
        smaller = copy.deepcopy(certificate)
        with_upper(smaller["bounds"][0], 0.999 * smaller["bounds"][0]["upper"])
        assert decided(smaller, net) == 1
        product = certify(net, "--activation", ops, "--method", "product")
        norms = [Fraction(float.fromhex(layer["spectral_norm_hex"][1])) for layer in product["layers"]]
        upper = least_double(math.prod(norms) * math.prod(Fraction(LARGEST_SLOPE.get(op, 1)) for op in ops.split(",")))
        with_upper(product["bounds"][0], upper)
        assert decided(product, net) == 0
        with_upper(product["bounds"][0], math.nextafter(upper, 0))
        assert decided(product, net) == 1
    assert accepted < tried / 2, (accepted, tried)  # claims about networks with smaller slopes hold


def onnx_files_state_each_activation(folder, generator):
    net = folder / "several.onnx"
    network = weight_files.layers([3, 4, 3, 2], generator)
    net.write_bytes(weight_files.onnx(network, "Tanh", first="Relu"))
    certificate = certify(net)
    ops = [step["op"] for step in certificate["network"]["weights"]["network"]["chain"]]
    assert ops == ["linear", "relu", "linear", "tanh", "linear"] and decided(certificate, net) == 0
    for other in "tanh", "relu":
        assert decided(with_activations_again(certificate, other), net) == 1


PARTS = {"phi:small": [6, 3, 2], "phi:large": [6, 2, 3, 2], "phi:ground": [4, 3, 2], "rho:small": [2, 3, 1]}


def network_toml(folder, networks, ops):
    """`ops`: its stated activations, by part."""
    folder.mkdir(exist_ok=True)
    text = 'schema = "swarmcert/network/1"\n[input]\nclamp = { lower = [-1,-1,-1,-2,-2,-2], upper = [1,1,1,2,2,2] }\n'
    for part, network in networks.items():
        file = part.replace(":", "_") + ".safetensors"
        (folder / file).write_bytes(as_safetensors(network))
        text += f'[{part.replace(":", ".")}]\nweights = "{file}"\n'
        if part in ops:
            text += f'activation = "{ops[part]}"\n'
    (folder / "network.toml").write_text(text)
    return folder / "network.toml"


def each_part_has_its_own_activation(folder, generator):
    """Blocks, scales, sums and laws of a network.toml, in which only some parts state their activation."""
    ops = {"phi:small": "tanh", "phi:large": "sigmoid", "phi:ground": "selu", "rho:small": "sigmoid"}
    networks = {part: layers(sizes, generator) for part, sizes in PARTS.items()}
    stored = network_toml(folder / "stored", networks, {})
    relu = network_toml(folder / "folded", {part: folded(n, LARGEST_SLOPE[ops[part]]) for part, n in networks.items()},
                        {})
    options = ["--neighbours", "large=2,small=1", "--blocks=velocity", "--scale", "1,1,1,2,2,2", "--method", "sdp"]
    certificate, of_folded = certify(stored, *options), certify(relu, *options)
    certificate.update(bounds=of_folded["bounds"], laws=of_folded["laws"])
    certificate = with_activations(certificate, ops)
    assert certificate["laws"] and {"set:small:small", "set:large:small", "set:ground:small"} <= {
        b["function"] for b in certificate["bounds"]}
    for stated in [], ["phi:large"], list(ops):
        net = network_toml(folder / "stored", networks, {part: ops[part] for part in stated})
        certificate["network"]["description_sha256"] = hashlib.sha256(net.read_bytes()).hexdigest()
        done = check(certificate, net)
        assert done.returncode == 0, done
        of_files = check_files(certificate, net)
        assert of_files.returncode == int(stated != list(ops)), of_files
        assert of_files.returncode == 0 or ANOTHER_OPERATION in of_files.stdout, of_files
    done = check(certificate, net, "--coq")
    for word in ("Part", " [Tanh].\n", " [Sigmoid;Sigmoid].\n", " [Selu].\n"):
        assert word in done.stdout, done.stdout[:1000]
    for part, other in ("phi:small", "relu"), ("phi:large", "tanh"), ("rho:small", "elu"):
        changed = with_op(certificate, part, other)
        assert decided(changed, net) == 1
        done = check_files(changed, net)
        assert f"network.weights.{part}.layers fc1" in done.stdout and ANOTHER_OPERATION in done.stdout, done
    # Without a stated activation, other activations make other claims, which the proofs do not show.
    net = network_toml(folder / "stored", networks, {})
    certificate["network"]["description_sha256"] = hashlib.sha256(net.read_bytes()).hexdigest()
    assert check(with_op(certificate, "phi:small", "elu"), net).returncode == 0
    for part, other in ("phi:small", "sigmoid"), ("phi:large", "tanh"), ("phi:ground", "elu"), ("rho:small", "tanh"):
        refused(with_op(certificate, part, other), net, "the factor does not show")
    law = copy.deepcopy(certificate)
    with_upper(law["laws"][0], math.nextafter(law["laws"][0]["upper"], 0))
    refused(law, net, "claims less than the law gives")
    done = check_files(certificate, network_toml(folder / "stored", networks, ops), "--activation", "tanh")
    assert done.returncode == 3 and "network.toml states selu between its layers" in done.stderr, done
    for op in "mish", "Tanh":
        done = check_files(certificate, network_toml(folder / "stored", networks, {"phi:small": op}))
        assert done.returncode == 3 and f'activation = "{op}": must be one of' in done.stderr, done


def with_op(certificate, part, op):
    changed = copy.deepcopy(certificate)
    for step in changed["network"]["weights"][part]["chain"]:
        step["op"] = step["op"] if step["op"] in ("linear", "clamp") else op
    return changed


def sums_with_smooth_terms_have_lower_bounds(folder, generator):
    """Terms of several activations, including constant ones, the ground and rho: accepted as found, and no checker
    accepts a step more."""
    networks = {part: layers(sizes, generator) for part, sizes in PARTS.items()}
    ops = {"phi:small": "silu", "phi:large": "softplus", "phi:ground": "tanh", "rho:small": "selu"}
    net = network_toml(folder / "smooth", networks, ops)
    certificate = certify(net, "--neighbours", "1", "--method", "product", rounds=1)
    sums = [b for b in certificate["bounds"] if b["lower_witness"] and b["lower_witness"]["others"]]
    assert sums and decided(certificate, net) == 0
    for bound in sums[:2]:
        lower = bound["lower"]
        with_lower(bound, math.nextafter(lower, math.inf))
        assert decided(certificate, net) == 1
        with_lower(bound, lower)
    net = network_toml(folder / "smooth", networks, {**ops, "phi:ground": "gelu"})
    certificate = certify(net, "--neighbours", "1", "--method", "product", rounds=1)
    done = check(certificate, net)
    assert done.returncode == 0, done


def with_lower(bound, lower):
    bound.update(lower=lower, lower_hex=lower.hex())


FUNCTIONS = {"tanh": math.tanh, "sigmoid": lambda t: 1 / (1 + math.exp(-t)),
             "softplus": lambda t: max(t, 0) + math.log1p(math.exp(-abs(t))),
             "elu": lambda t: max(t, math.expm1(min(t, 0))),
             "selu": lambda t: 1.0507009873554805 * (t if t > 0 else 1.6732632423543772 * math.expm1(t)),
             "silu": lambda t: t / (1 + math.exp(-t)),
             "gelu": lambda t: t * math.erfc(-t / math.sqrt(2)) / 2}


def values_of_activations_are_those_of_the_functions(folder, generator):
    """The slope between f(t) and f(u) of one neuron: less 2^-40 it is accepted, plus 2^-40 it is not."""
    net, decided_by_all = folder / "value.safetensors", 0
    net.write_bytes(as_safetensors([([[1.0]], [0.0]), ([[1.0]], [0.0])]))
    points = [(-1.2784, -1.2785), (0.0, 2.0 ** -20), (-3.0, 0.5), (-40.0, 2.0), (1.5, 190.0), (-1000.0, -0.75)]
    for op, function in FUNCTIONS.items():
        certificate = certify(net, "--activation", op, rounds=1)
        bound = certificate["bounds"][0]
        for t, u in points:
            t, u = struct.unpack("<2f", struct.pack("<2f", t, u))
            if max(abs(t), abs(u)) > 700 and op != "tanh":
                t = -650.0
            bound["lower_witness"] = {"x": [t.hex()], "y": [u.hex()], "others": []}
            slope = abs(function(t) - function(u)) / abs(t - u)
            with_upper(bound, 2.0)
            bound["upper_method"], bound["proof"] = "product", None
            tolerance = 2.0 ** -40 + 2.0 ** -50 / abs(function(t) - function(u))  # error of the functions of Python
            for factor, code in (1 - tolerance, 0), (1 + tolerance, 1):
                with_lower(bound, factor * slope)
                if generator.random() < 0.25:
                    decided_by_all += 1
                    assert decided(certificate, net) == code, (op, t, u, factor)
                else:
                    assert check(certificate, net).returncode == code, (op, t, u, factor)
    assert decided_by_all > 9


def products_of_slopes_on_a_box_are_decided_alike(folder, generator):
    """As certified; for a network, no checker accepts a step less; for sums, with the laws that depend on them."""
    net, box, tried = folder / "local.safetensors", folder / "local.toml", 0
    net.write_bytes(as_safetensors(layers([3, 6, 4, 2], generator)))
    box.write_text('schema = "swarmcert/box/1"\nlower = [1.9, -1.1, 1.4]\nupper = [2.1, -0.9, 1.5]\n')
    for ops in "tanh", "sigmoid", "softplus", "elu", "selu,silu", "silu", "gelu", "maxmin:pairs,tanh":
        certificate = certify(net, "--activation", ops, "--domain", box, "--method", "product")
        bound = certificate["bounds"][0]
        if bound["upper_method"] != "local_product":
            continue
        tried += 1
        assert decided(certificate, net) == 0, ops
        with_upper(bound, math.nextafter(bound["upper"], 0))
        smaller = decided(certificate, net)
        with_upper(bound, 0.999 * bound["upper"])
        assert smaller in (0, 1) and decided(certificate, net) == 1, ops
    assert tried > 3, tried
    networks = {part: layers(sizes, generator) for part, sizes in PARTS.items()}
    ops = {"phi:small": "softplus", "phi:large": "elu", "phi:ground": "silu", "rho:small": "tanh"}
    net = network_toml(folder / "locals", networks, ops)
    box.write_text('schema = "swarmcert/box/1"\nlower = [-0.5, -0.5, -0.5, -0.5, -0.5, -0.5]\n'
                   'upper = [-0.25, -0.25, 0.25, 0.5, -0.25, -0.25]\n')
    certificate = certify(net, "--domain", box, "--method", "product", "--neighbours", "large=2,small=1")
    methods = Counter(bound["upper_method"] for bound in certificate["bounds"])
    assert methods["local_product"] > 2 and certificate["laws"] and decided(certificate, net) == 0, methods
    with_upper(certificate["laws"][0], 0.999 * certificate["laws"][0]["upper"])
    assert decided(certificate, net) == 1


def inequalities_of_slopes_on_a_box_are_decided_alike(folder, generator):
    """As certified, and no step less; with numbers of the proof, the box, or the activation changed; of sums, whose rho
    has the slopes that it has anywhere, with laws that rest on them; with the factor left out; where a neuron is
    decided, and where none is, so that the inputs are not in the matrix."""
    net, box, codes = folder / "inequality.safetensors", folder / "inequality.toml", Counter()
    net.write_bytes(as_safetensors(layers([3, 6, 4, 2], generator)))
    every = "tanh", "softplus", "elu,sigmoid", "selu,silu", "relu,tanh", "gelu"
    for ops in every:
        box.write_text('schema = "swarmcert/box/1"\nlower = [1.9, -1.1, 1.4]\nupper = [2.1, -0.9, 1.5]\n')
        certificate = certify(net, "--activation", ops, "--domain", box, "--method", "sdp", rounds=1)
        assert certificate["bounds"][0]["upper_method"] == "local_sdp" and decided(certificate, net) == 0, ops
        for changed in changed_inequalities(certificate, generator):
            codes[decided(changed, net)] += 1
    assert codes[1] > 4 * len(every) and codes[0] and set(codes) <= {0, 1}, codes
    net.write_bytes(as_safetensors(layers([3, 34, 34, 2], generator)))
    for ops in "silu", "tanh,gelu":
        certificate = certify(net, "--activation", ops, "--domain", box, "--method", "sdp")
        bound = certificate["bounds"][0]
        assert bound["upper_method"] == "local_sdp" and bound["proof"]["factor"] is None
        assert decided(certificate, net) == 0, ops
        bound["proof"]["rho"] = (0.99 * float.fromhex(bound["proof"]["rho"])).hex()
        assert decided(certificate, net) == 1, ops
    network = layers([3, 6, 4, 2], generator)
    for row in network[1][0]:  # of both signs, so that over a wide box no ReLU neuron is decided
        row[:2] = [abs(row[0]), -abs(row[1])]
    net.write_bytes(as_safetensors(network))
    box.write_text('schema = "swarmcert/box/1"\nlower = [-9, -9, -9]\nupper = [9, 9, 9]\n')
    undecided = certify(net, "--activation", "relu", "--method", "sdp")
    undecided["box"] = certify(net, "--activation", "tanh", "--domain", box, "--method", "sdp")["box"]
    undecided["bounds"][0].update(domain="box", upper_method="local_sdp")
    assert decided(undecided, net) == 0
    undecided["box"]["network"]["upper"] = [(-8.5).hex()] * 3  # some neuron is decided: another matrix
    assert decided(undecided, net) == 1
    networks = {part: layers(sizes, generator) for part, sizes in PARTS.items()}
    net = network_toml(folder / "inequalities", networks,
                       {"phi:small": "softplus", "phi:large": "elu", "phi:ground": "gelu", "rho:small": "silu"})
    box.write_text('schema = "swarmcert/box/1"\nlower = [-0.5, -0.5, -0.5, -0.5, -0.5, -0.5]\n'
                   'upper = [-0.25, -0.25, 0.25, 0.5, -0.25, -0.25]\n')
    certificate = certify(net, "--domain", box, "--neighbours", "large=2,small=1", "--blocks=velocity", "--scale",
                          "1,1,1,2,2,2", "--method", "sdp", rounds=1)
    methods = Counter(bound["upper_method"] for bound in certificate["bounds"])
    assert methods["local_sdp"] > 2 and certificate["laws"] and decided(certificate, net) == 0, methods
    with_upper(certificate["laws"][0], 0.999 * certificate["laws"][0]["upper"])
    assert decided(certificate, net) == 1
    with_upper(certificate["laws"][0], 2 * certificate["laws"][0]["upper"])
    assert decided(certificate, net) == 0
    for part, other in ("rho:small", "tanh"), ("phi:small", "elu"), ("phi:ground", "tanh"):
        stated = network_toml(folder / "inequalities", networks, {part: other})
        certificate["network"]["description_sha256"] = hashlib.sha256(stated.read_bytes()).hexdigest()
        assert decided(with_op(certificate, part, other), stated) in (0, 1)


def changed_inequalities(certificate, generator):
    """Changes one number of the proof, an end of the box, or the activations; none of these claims less than before."""
    def copy_and_bound():
        changed = copy.deepcopy(certificate)
        return changed, changed["bounds"][0]
    changed, bound = copy_and_bound()
    bound["proof"]["rho"] = (0.999 * float.fromhex(bound["proof"]["rho"])).hex()
    yield changed
    for factor in 0.5, 1 + 2.0 ** -50, 1.5:
        changed, bound = copy_and_bound()
        place = generator.randrange(len(bound["proof"]["t"]))
        bound["proof"]["t"][place] = (factor * float.fromhex(bound["proof"]["t"][place])).hex()
        yield changed
    changed, bound = copy_and_bound()
    bound["proof"]["t"].pop()
    yield changed
    changed, bound = copy_and_bound()
    with_upper(bound, math.nextafter(math.sqrt(float.fromhex(bound["proof"]["rho"])), 0) * (1 - 2.0 ** -40))
    yield changed
    for key, step in ("lower", -0.5), ("upper", 0.5), ("lower", 2.0 ** -30):
        changed, bound = copy_and_bound()
        ends = changed["box"]["network"][key]
        place = generator.randrange(len(ends))
        ends[place] = (float.fromhex(ends[place]) + step).hex()
        bound.update(lower=None, lower_hex=None, lower_witness=None)
        yield changed
    for op in "relu", "tanh", "silu", "selu", "gelu":
        yield with_activations_again(certificate, op)
    for domain, method in ("global", "local_sdp"), ("box", "sdp"), ("box", "eclipse_fast"), ("box", "local_product"):
        changed, bound = copy_and_bound()
        bound.update(domain=domain, upper_method=method)
        yield changed


def values_over_a_box_are_decided_alike(folder, generator):
    """Ranges as certified, with one end of a layer or of the range moved to the next double, and over another box.
    Boxes include minima, kinks and saturation, and shrink to points."""
    net, box, codes = folder / "range.safetensors", folder / "range.toml", Counter()
    net.write_bytes(as_safetensors(layers([3, 6, 4, 2], generator)))
    boxes = ([-1, -0.5, 0.25], [1, 0.5, 0.5]), ([-40, 0, -3], [90, 0, 1000]), ([0.25, -0.125, 2], [0.25, -0.125, 2])
    every = ("tanh", "sigmoid", "softplus", "elu", "selu", "silu", "groupsort:2", "maxmin:halves,silu", "relu,selu",
             "gelu", "gelu", "gelu")
    for number, ops in enumerate(every):
        lower, upper = boxes[number % len(boxes)]
        box.write_text(f'schema = "swarmcert/box/1"\nlower = {lower}\nupper = {upper}\n')
        certificate = certify(net, "--activation", ops, "--domain", box, "--range")
        certificate["bounds"] = certify(net, "--activation", ops, "--method", "product")["bounds"]
        certificate["bounds"][0]["domain"] = "box"
        assert certificate["values"] and decided(certificate, net) == 0, ops
        for key, towards in ("lower", math.inf), ("upper", -math.inf):
            changed = copy.deepcopy(certificate)
            layer = changed["values"][0]["networks"]["network"][generator.randrange(3)]
            words = layer[key].split()
            place = generator.randrange(len(words))
            words[place] = math.nextafter(float.fromhex(words[place]), towards).hex()
            layer[key] = " ".join(words)
            codes[decided(changed, net)] += 1
        changed = copy.deepcopy(certificate)
        changed["box"]["network"]["upper"][0] = (upper[0] + 2.0 ** -20).hex()
        codes[decided(changed, net)] += 1
    assert codes[1] > 2 * len(every) and set(codes) <= {0, 1}, codes


def witnesses_of_any_activation_are_decided_alike(folder, generator):
    """Lower bounds as found, at other points, and with other claims."""
    net, codes = folder / "witness.safetensors", Counter()
    net.write_bytes(as_safetensors(layers([3, 4, 8, 2], generator)))
    for ops in "tanh", "silu", "softplus,elu", "groupsort:4", "maxmin:halves", "maxmin:pairs,selu", "gelu":
        certificate = certify(net, "--activation", ops, "--method", "product", rounds=1)
        assert decided(certificate, net) == 0
        bound = certificate["bounds"][0]
        lower = bound["lower"]
        with_lower(bound, math.nextafter(lower, math.inf))
        assert decided(certificate, net) == 1
        for _ in range(4):
            changed = copy.deepcopy(certificate)
            bound = changed["bounds"][0]
            point = bound["lower_witness"][generator.choice("xy")]
            k = generator.randrange(len(point))
            point[k] = (float.fromhex(point[k]) + generator.choice((-0.125, 0.5, 64.0))).hex()
            with_lower(bound, generator.choice((0.01, 0.5, 0.95)) * lower)
            codes[decided(changed, net)] += 1
    assert codes[0] > 2 and codes[1] > 2 and set(codes) == {0, 1}, codes


def onnx_files_state_their_activation(folder, generator):
    """The chain in the certificate is the one of the file, also where the same proof would hold for another one."""
    network = weight_files.layers([3, 4, 3, 2], generator)
    net = folder / "net.onnx"
    for node, op in (("Relu", "relu"), ("Tanh", "tanh"), ("Softplus", "softplus"), ("Elu", "elu"), ("Celu", "elu"),
                     ("Sigmoid", "sigmoid"), ("SiLU", "silu"), ("Swish", "silu"), ("Gelu", "gelu"), ("Selu", "selu")):
        net.write_bytes(weight_files.onnx(network, node))
        certificate = certify(net, "--method", "product")
        chain = certificate["network"]["weights"]["network"]["chain"]
        assert [step["op"] for step in chain] == ["linear", op, "linear", op, "linear"], (node, chain)
        assert decided(certificate, net) == 0
        with_upper(certificate["bounds"][0], 2.0 ** 20)
        for other in {"relu", "tanh", "sigmoid", "gelu"} - {op}:
            assert decided(with_activations_again(certificate, other), net) == 1, (node, other)

    def attribute(name, value):
        return weight_files.field(5, weight_files.field(1, name) + value)
    half = b"\x15" + struct.pack("<f", 0.5) + weight_files.field(20, 1)
    in_words = weight_files.field(4, "tanh") + weight_files.field(20, 3)
    for node, attributes, words in (("Mish", b"", "is not one of the supported operators"),
                                    ("Selu", attribute("alpha", half), "alpha is not 1.673263"),
                                    ("Elu", attribute("alpha", half), "alpha is not 1.000000"),
                                    ("Swish", attribute("alpha", half), "alpha is not 1.000000"),
                                    ("Gelu", attribute("approximate", in_words), "approximate is not none")):
        net.write_bytes(weight_files.onnx(network, node, attributes=attributes))
        done = run(SWARMCERT, "certify", net, "--nodes", "0", "-q")
        assert done.returncode == 3 and f"{node}: {words}" in done.stderr, done


def onnx_files_state_what_they_sort(folder, generator):
    """MaxMin and GroupSort as groups of nodes: the certificates of certify are accepted by all; other chains, weights
    and smaller bounds are refused by all; groups that compute something else cannot be read by any."""
    network = weight_files.layers([3, 4, 8, 2], generator)
    net = folder / "sorting.onnx"
    ops = "maxmin:halves", "maxmin:pairs", "groupsort:2", "groupsort:4", "descending:4"
    forms = Counter()
    for op in ops:
        net.write_bytes(weight_files.onnx(network, op))
        certificate, stated = certify(net), op.replace("descending", "groupsort")
        chain = [step["op"] for step in certificate["network"]["weights"]["network"]["chain"]]
        assert chain == ["linear", stated, "linear", stated, "linear"], chain
        assert decided(certificate, net) == 0
        for other in {*ops[:4], "relu", "tanh"} - {stated}:
            forms[decided(with_activations_again(certificate, other), net)] += 1
        smaller = copy.deepcopy(certificate)
        with_upper(smaller["bounds"][0], math.nextafter(smaller["bounds"][0]["upper"], 0))
        forms[decided(smaller, net)] += 1
        changed = [(name, [list(row) for row in rows], biases) for name, rows, biases in network]
        changed[1][1][0][0] *= 1.5
        net.write_bytes(weight_files.onnx(changed, op))
        forms[decided(certificate, net)] += 1
    assert forms == {1: 7 * len(ops)}, forms

    def with_(kind, inputs=None, **others):
        return {kind: lambda old, attributes: (inputs or old, {**attributes, **others})}
    for op, change in (
            ("maxmin:halves", with_("Split", axis=0)), ("maxmin:halves", with_("Concat", axis=0)),
            ("maxmin:halves", with_("Concat", ["d0", "c0"])), ("maxmin:halves", with_("Min", ["p0", "p0"])),
            ("maxmin:pairs", with_("ReduceMax", keepdims=1)), ("maxmin:pairs", with_("ReduceMin", axes=[1])),
            ("maxmin:pairs", with_("Concat", axis=0)), ("groupsort:4", with_("TopK", axis=1)),
            ("groupsort:4", with_("TopK", sorted=0)), ("groupsort:4", with_("TopK", ["r0", "size1"], k=3))):
        net.write_bytes(weight_files.onnx(network, op, change=change))
        assert run(SWARMCERT, "certify", net, "--nodes", "0", "-q").returncode == 3, (op, change)


def weights_behind_a_descending_sort_are_those_behind_an_ascending_one(folder, generator):
    """Which takes them in another order."""
    network = weight_files.layers([3, 4, 8, 2], generator)
    turned = network[:1] + [(name, [[row[k - k % 4 + 3 - k % 4] for k in range(len(row))] for row in rows], biases)
                            for name, rows, biases in network[1:]]
    net, terms = folder / "order.onnx", []
    for op, layers_ in ("descending:4", network), ("groupsort:4", turned):
        net.write_bytes(weight_files.onnx(layers_, op))
        certificate = certify(net)
        read = canonical.networks(certificate)["network"]
        assert [rows for rows, _, _ in read] == [rows for _, rows, _ in turned]
        text = check(certificate, net, "--coq").stdout
        terms.append([line for line in text.splitlines() if hashlib.sha256(net.read_bytes()).hexdigest() not in line])
    assert terms[0] == terms[1] and len(terms[0]) > 10


def main():
    generator = random.Random(11)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for op in LARGEST_SLOPE:
            if op not in ("silu", "gelu"):
                accepted_at_the_bound_that_the_proof_shows(folder, op, generator)
        for claim in (the_inequality_is_that_of_the_activation,
                      functions_that_are_not_monotone_have_an_inequality_of_their_own, refuses_what_only_relu_has,
                      products_count_the_activations, products_of_sorting_layers,
                      groups_keep_their_sum_and_come_no_further_apart,
                      each_part_has_its_own_activation,
                      sums_with_smooth_terms_have_lower_bounds, values_of_activations_are_those_of_the_functions,
                      products_of_slopes_on_a_box_are_decided_alike, values_over_a_box_are_decided_alike,
                      witnesses_of_any_activation_are_decided_alike, onnx_files_state_their_activation,
                      onnx_files_state_what_they_sort,
                      weights_behind_a_descending_sort_are_those_behind_an_ascending_one,
                      several_activations_in_one_network, onnx_files_state_each_activation,
                      inequalities_of_slopes_on_a_box_are_decided_alike):
            claim(folder, generator)
            print(claim.__name__.replace("_", " "))


if __name__ == "__main__":
    main()
