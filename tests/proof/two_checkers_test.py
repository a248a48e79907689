#!/usr/bin/env python3
"""The checker that is proved and the one of the tool on the same certificates, of networks of every kind and of random
ones. What certify writes both accept, with nothing left unchecked; they decide alike on mutations of each field and of
the network itself; what states something false both reject; malformed files both refuse.

    two_checkers_test.py SWARMCERT SOURCE_DIR MUTATIONS CHECKER CHECK_MANY
    MUTATIONS: 0, one for every kind of field that no certificate before had, and for a third of the others
"""
import json
import math
import random
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

SOURCE, MUTATIONS = Path(sys.argv[2]), int(sys.argv[3])
CHECKER, MANY = (Path(word).resolve() for word in sys.argv[4:6])
sys.path.insert(0, str(SOURCE / "tests/lipschitz"))
import certificates as common  # noqa: E402
import onnx_models  # noqa: E402
import weight_files  # noqa: E402

SECONDS = 60  # until a checker is considered hung; the actual times are printed


def run(command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, errors="replace",
                          timeout=SECONDS)


def first(certificate, net):
    """Its output is what the proved checker must print as well."""
    done = run([common.SWARMCERT, "check", certificate, *net, "-q"])
    done.stdout = common.said_by_both(done.stdout)
    return done


def files_of(net):
    """NET without the options on how to read it, which the certificate states."""
    return net[:4] if net[0] == "--phi" else net[:1]


def proved(certificate, net):
    return run([CHECKER, certificate, *files_of(net)])


def copy(certificate):
    return json.loads(json.dumps(certificate))


def read(path):
    return json.loads(path.read_text())


def both(changed, net, folder):
    """Writes the certificate with a fresh hash; returns what the two checkers say."""
    path = folder / "changed.json"
    path.write_text(json.dumps(common.sealed(changed)))
    return first(path, net), proved(path, net)


class Server:
    """A checker that decides many certificates of one NET in a single process."""

    def __init__(self, command):
        self.process = subprocess.Popen(list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        text=True, errors="replace")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait(SECONDS)
        self.process.stdout.close()

    def ask(self, path):
        print(path, file=self.process.stdin, flush=True)

    def answer(self):
        """Returns exit code and reason."""
        ready, _, _ = select.select([self.process.stdout], [], [], SECONDS)
        if not ready:
            self.process.kill()
            raise TimeoutError(self.process.args)
        code, _, reason = self.process.stdout.readline().rstrip("\n").partition("\t")
        return int(code), reason


def pattern(path):
    return tuple("*" if isinstance(key, int) else key for key in path)


def kinds(folder, generator):
    """(name, NET, options of certify, share of the mutations) for every kind of certificate."""
    hetero = [common.heterogeneous(folder, generator)]
    tiny, square, line = (folder / f"{name}.safetensors" for name in ("tiny", "square", "line"))
    tiny.write_bytes(common.safetensors([2, 5, 4, 1], generator))
    square.write_bytes(common.safetensors([3, 3, 3, 2], generator, ["first", "after", "last"]))
    line.write_bytes(common.safetensors([3, 2], generator))
    cube = folder / "cube.safetensors"
    cube.write_bytes(common.safetensors([3, 8, 8, 2], generator))
    deep = folder / "deep.safetensors"  # more than 64 neurons
    deep.write_bytes(common.safetensors([3, 22, 22, 22, 2], generator))
    (folder / "cube.toml").write_text('schema = "swarmcert/box/1"\nlower = [-1, -1, -1]\nupper = [1, 1, 1]\n')
    ordered = [square, "--order", "first,after,last"]
    samples, unsampled = folder / "square.json", folder / "unsampled.json"
    run([common.SWARMCERT, "certify", *ordered, "--nodes", "0", "-q", "-o", unsampled])
    samples.write_text(common.recorded(read(unsampled), generator))
    (folder / "plane.toml").write_text('schema = "swarmcert/box/1"\nlower = [-1, 0.5]\nupper = [1, 0.75]\n')
    clamped = folder / "clamped.toml"  # the clamp bounds all inputs of the neighbours, and there is no ground
    text = hetero[0].read_text()
    clamped.write_text(text.replace('[phi.ground]\nweights = "ground.safetensors"\n', ""))
    float32 = ["--as", "float32"]
    pair = ["--phi", folder / "small.safetensors", "--rho", folder / "rho.safetensors"]
    parts, whole, few = ["--method", "branch", "--cuts", "20"], ["--method", "sdp"], ["--nodes", "7"]
    skips, cubed = [common.with_skips(folder, generator)], ["--domain", folder / "cube.toml"]
    residual, around, _, with_relu = common.skip_models(folder, generator)
    relu_skips = [common.relu_skip_model(folder, generator)]
    image, series = ([folder / f"{name}.onnx"] for name in ("image", "series"))
    image[0].write_bytes(onnx_models.image_model(random.Random(37)))
    series[0].write_bytes(onnx_models.series_model(random.Random(41)))
    return [
        ("plain", [tiny], [], 0.16),
        ("one layer", [line], ["--blocks"], 0.2),
        ("factors left out", [deep], [], 0.01),
        ("order and samples", ordered, ["--samples", samples], 0.2),
        ("kinds, blocks, laws, scale", hetero,
         ["--blocks", "--neighbours", "large=2,small=1", "--scale", "1,1,1,2,2,2"], 0.05),
        ("float32 and products", hetero, ["--as", "float32", "--neighbours", "2", "--method", "product"], 0.1),
        ("kinds and values on a box", hetero, [*float32, "--neighbours", "small=3", "--domain", folder / "box.toml",
                                               "--method", "sdp"], 0.05),
        ("silent compositions", [common.silent(folder)], ["--blocks", "--neighbours", "large=2,small=1"], 0.03),
        ("silent compositions and values on a box", [common.silent(folder)],
         [*float32, "--neighbours", "small=3", "--domain", folder / "box.toml"], 0.03),
        ("pair", pair, ["--blocks=velocity"], 0.1),
        ("values of a network", [tiny], [*float32, "--domain", folder / "plane.toml"], 0.1),
        ("values on a clamp", [clamped], [*float32, "--range", "--neighbours", "2", "--input-step", "0.001"], 0.05),
        ("parts of a box", [cube], ["--method", "branch", "--domain", folder / "cube.toml"], 0.02),
        ("pair and parts of a box", pair, ["--method", "branch", "--domain", folder / "part.toml"], 0.02),
        ("tanh", [tiny], ["--activation", "tanh"], 0.05),
        ("silu", [tiny], ["--activation", "silu", "--blocks"], 0.05),
        ("gelu, factors left out", [deep], ["--activation", "gelu"], 0.01),
        ("tanh, relu, sigmoid", [tiny], ["--activation", "tanh,relu,sigmoid"], 0.05),
        ("relu, silu", [tiny], ["--activation", "relu,silu"], 0.05),
        ("activations of parts", [common.smooth(folder)], ["--blocks=position", "--neighbours", "large=2,small=1"],
         0.03),
        ("silu, values on a box", [tiny], ["--activation", "silu", "--domain", folder / "plane.toml", "--range",
                                           "--method", "product"], 0.03),
        ("activations of parts, values on a box", [common.smooth(folder)],
         ["--neighbours", "small=2", "--domain", folder / "part.toml", "--range", "--method", "product"], 0.02),
        ("activations of parts, slopes on a box", [common.smooth(folder)],
         ["--neighbours", "large=2,small=1", "--domain", folder / "part.toml", "--blocks=position", *whole], 0.02),
        ("activations of parts, slopes on parts of a box", [common.smooth(folder)],
         ["--neighbours", "2", "--domain", folder / "part.toml", *few], 0.01),
        ("gelu, slopes on parts of a box", [tiny],
         ["--activation", "gelu", "--domain", folder / "plane.toml", *few], 0.03),
        ("relu, silu, slopes on a box", [tiny],
         ["--activation", "relu,silu", "--domain", folder / "plane.toml", *whole], 0.03),
        ("skip connections past tanh", residual, ["--blocks", "--scale", "1,2,4"], 0.03),
        ("skip connections past silu and tanh, values on a box", around, [*cubed, *few, "--range"], 0.02),
        ("skip connections past silu and tanh, products on a box", around, [*cubed, "--method", "product"], 0.02),
        ("skip connections past relu and gelu, slopes on a box", with_relu, [*cubed, *whole], 0.02),
        ("skip connections past relu, values on a box", relu_skips, [*float32, *cubed, "--range"], 0.02),
        ("skip connections past relu and parts of a box", relu_skips, ["--method", "branch", *cubed], 0.01),
        ("convolutions, LeakyRelu, ReLU6, averages beside a skip connection", image, [], 0.01),
        ("convolution, tanh, the largest of pairs beside skip connections, on a box", series, [*cubed, *few], 0.02),
        ("skip connections of parts, laws", skips, ["--blocks=position", "--neighbours", "large=2,small=1"], 0.02),
        ("skip connections of parts, products", skips, ["--neighbours", "2", "--method", "product"], 0.02),
        ("skip connections of parts, slopes on a box", skips,
         ["--neighbours", "large=2,small=1", "--domain", folder / "part.toml", "--blocks=position", *whole], 0.02),
        ("skip connections of parts, values on a box", skips,
         ["--neighbours", "small=2", "--domain", folder / "part.toml", "--range", "--method", "product"], 0.02),
        ("cover by parts", [tiny], parts, 0.03),
        ("pair and cover by parts", pair, parts, 0.02),
        ("kinds by parts for a number of neighbours", hetero,
         ["--neighbours", "large=2,small=1", "--domain", folder / "part.toml", *parts],
         0.01),
    ]


def chosen_places(certificate, mutated, generator, count):
    """Returns places to mutate, and the number of kinds of fields among them. Without `count`: one of each kind that is
    not in `mutated` yet, to which the kinds are added, and one of every third other kind. Otherwise one of each kind,
    then random ones until there are `count`."""
    by_pattern = {}
    for path in common.leaves(certificate):
        by_pattern.setdefault(pattern(path), []).append(path)
    if count:
        patterns = list(by_pattern)
        patterns += generator.choices(patterns, k=max(0, count - len(patterns)))
    else:
        known = [p for p in by_pattern if p in mutated]
        patterns = [p for p in by_pattern if p not in mutated] + generator.sample(known, (len(known) + 2) // 3)
        mutated.update(by_pattern)
    return [generator.choice(by_pattern[p]) for p in patterns], len(set(patterns))


def mutate(name, net, certificate, folder, generator, mutated, count):
    """Decides mutations at chosen_places() by the two checkers; returns their number."""
    chosen, num_kinds = chosen_places(certificate, mutated, generator, count)
    words = list(map(str, files_of(net)))
    pair = words[:1] == ["--phi"]
    one_command = [MANY, words[1], words[3], "--pair"] if pair else [MANY, *words]
    original = folder / "original.json"
    original.write_text(json.dumps(certificate))  # states how NET was read
    table, path = Counter(), folder / "mutation.json"
    with Server([*one_command, original]) as one, Server([CHECKER, "--many", *words]) as three:
        for place in chosen:
            mutation = common.forged(certificate, place, generator)
            path.write_text(json.dumps(mutation))
            one.ask(path)
            three.ask(path)
            (code, words_of_one), (code_of_three, words_of_three) = one.answer(), three.answer()
            if place[0] == "network" and code == 1 and code_of_three == 0:  # the proved one compares hashes only
                assert common.is_of_files(words_of_one), words_of_one
                table["another network, held by no file"] += 1
                continue
            assert code in (0, 1, 3) and code_of_three in (0, 1, 3), (words_of_one, words_of_three)
            if place[-1] == "file" and (code, code_of_three) == (0, 3):  # the first one reads what network.toml names
                assert "No such file" in words_of_three or "is a folder" in words_of_three, words_of_three
                table["a file that is not there"] += 1
                continue
            assert (code == 0) == (code_of_three == 0), (
                f"{name}, {place}: first {code} {words_of_one}, proved {code_of_three} {words_of_three}")
            assert code != 0 or common.is_harmless(certificate, mutation, place), f"{name}: {place}: both accept"
            table["accepted" if code == 0 else "rejected"] += 1
    assert table["rejected"] > 0.5 * len(chosen), table
    print(f"{name:28} {num_kinds:4} kinds of fields {len(chosen):7} mutations: "
          f"{table['rejected']:7} rejected by both, {table['accepted']:6} accepted by both")
    return len(chosen)


def layer_by_layer(certificate, net, folder):
    """The method that replaces sdp if its search is cut short is proved by the same inequality."""
    changed = json.loads(json.dumps(certificate).replace('"upper_method": "sdp"', '"upper_method": "eclipse_fast"'))
    assert changed != certificate
    one, three = both(changed, net, folder)
    assert one.returncode == three.returncode == 0, f"{one} {three}"


def a_smaller_bound(certificate, net, folder):
    """A changed proof by parts of a box is refused by all at the same word of the tree."""
    changed = copy(certificate)
    bound = changed["bounds"][0]
    assert len(bound["proof"]["tree"].split()) > 10
    smaller = 0.9 * bound["upper"]
    bound.update(upper=smaller, upper_hex=smaller.hex())
    bound["proof"]["rho"] = (0.99 * smaller ** 2).hex()
    one, three = both(changed, net, folder)
    assert one.returncode == three.returncode == 1 and "of the tree" in one.stdout, f"{one} {three}"
    assert three.stdout == one.stdout, f"{one} {three}"


def laws_in_a_box(folder, pair):
    """A law based on bounds in a box for any number of neighbours is accepted by all; one that claims a smaller bound,
    or validity outside the box, is refused by all."""
    path = folder / "laws.json"
    run([common.SWARMCERT, "certify", *pair, "--neighbours", "2", "--domain", folder / "part.toml",
         "--method", "branch", "--nodes", "1", *common.QUICKLY, "-o", path])
    certificate = read(path)
    certificate["bounds"] = [b for b in certificate["bounds"] if "neighbours" not in b]
    assert [law["domain"] for law in certificate["laws"]] == 3 * ["box"], "the laws must depend on bounds on the box"
    for factor, domain, said in (
            (2, "box", "accepted"), (0.9, "box", "less than the law gives"), (2, "global", "box only")):
        changed = copy(certificate)
        for law in changed["laws"]:
            upper = factor * law["upper"]
            law.update(upper=upper, upper_hex=upper.hex(), domain=domain)
        one, three = both(changed, pair, folder)
        assert said in one.stdout and said in three.stdout, f"{one} {three}"
        assert one.returncode == three.returncode == (0 if said == "accepted" else 1)


def among_neighbours(certificate, net, folder):
    """Bounds for a number of neighbours, and laws: slightly stronger claims are refused by all; so are a form or a
    range of the others that is too small, a proof for other kinds of neighbours, and a leaf without a valid form."""
    def refused(change, *words):
        changed = copy(certificate)
        change(changed)
        assert changed != certificate
        one, three = both(changed, net, folder)
        assert one.returncode == three.returncode == 1, f"{words}: {one} {three}"
        assert any(word in three.stdout for word in words), f"{words}: {three}"

    places = [k for k, b in enumerate(certificate["bounds"]) if "others" in (b["proof"] or {})]
    assert len(places) >= 2 and len(certificate["laws"]) == 3
    for k in places:
        def smaller(changed):
            bound = changed["bounds"][k]
            upper = 0.9 * bound["upper"]
            bound.update(upper=upper, upper_hex=upper.hex())
            bound["proof"]["rho"] = (0.99 * upper ** 2).hex()
        refused(smaller, "of the tree")

        def smaller_form(changed):
            form = changed["bounds"][k]["proof"]["forms"][0]
            words = [0.5 * float.fromhex(word) for word in form["q"].split()]
            form["q"] = " ".join(word.hex() for word in words)
        refused(smaller_form, "do not show the form")

        def no_form(changed):
            proof = changed["bounds"][k]["proof"]
            # nor decisions, which only the matrix of a form can use
            proof["tree"] = " ".join(word for word in proof["tree"].split() if word[0] not in "qrd")
        refused(no_form, "there is no form yet")

        def smaller_range(changed):
            ranges = changed["bounds"][k]["proof"]["others"]
            name = sorted(ranges)[-1]
            most = ranges[name]["most"]
            most[0] = (float.fromhex(most[0]) - 0.01).hex()
        refused(smaller_range, "the range is larger there")
    moved = certificate["bounds"][places[-1]]["function"].split(":")[1]

    def without_a_kind(changed):
        neighbours = changed["bounds"][places[-1]]["neighbours"]
        del neighbours[next(kind for kind in neighbours if kind != moved)]
    refused(without_a_kind, "others does not list the kinds of the other neighbours")
    for k in range(3):
        def less(changed):
            law = changed["laws"][k]
            upper = math.nextafter(law["upper"], 0)
            law.update(upper=upper, upper_hex=upper.hex())
        refused(less, "less than the law gives")
    without = copy(certificate)  # laws based only on the bounds for any number are larger
    without["bounds"] = [b for k, b in enumerate(certificate["bounds"]) if k not in places]
    refused(lambda changed: changed.update(bounds=without["bounds"]), "less than the law gives")


def short_scale(certificate, net, folder):
    """Also for a product of norms, whose proof does not use single inputs."""
    bound = next(b for b in certificate["bounds"] if b["scale"])
    bound.update(scale=bound["scale"][:-1], upper_method="product", proof=None, lower=None, lower_hex=None,
                 lower_witness=None, upper=2.0 ** 90, upper_hex="0x1p+90")
    for said in both(certificate, net, folder):
        assert "scale has another size" in said.stdout, said


def values_are_tight(certificate, net, folder):
    """Each bound on values is refused by all, for its own reason, if it is reduced by a unit in the last place."""
    entry, ends = certificate["values"][-1], [("lower", False), ("upper", True)]
    if entry["float32_error"] is not None:
        assert entry["float32_error"] > 0
        ends += [("error", True), ("error_in_order", True)]
    tried = Counter()
    for name in entry["networks"]:
        for k in range(len(entry["networks"][name])):
            for key, down in ends:
                tried[key] += refused_one_unit_less(certificate, net, folder, ["networks", name, k, key], down)
    if entry["sum"]:
        for key, down in ends:
            tried[key] += refused_one_unit_less(certificate, net, folder, ["sum", key], down)
    for key in [key for key in ("jump", "float32_error", "float32_error_in_order") if entry[key] is not None]:
        changed = copy(certificate)
        smaller = math.nextafter(entry[key], 0)
        changed["values"][-1].update({key: smaller, key + "_hex": smaller.hex()})
        refused_by_all(changed, net, folder, key)
    assert min(tried.values()) >= 2 and len(tried) == len(ends), tried


def refused_one_unit_less(certificate, net, folder, path, down):
    """Changes the first number of a list."""
    changed = copy(certificate)
    place = changed["values"][-1]
    for key in path[:-1]:
        place = place[key]
    words = place[path[-1]].split()
    words[0] = math.nextafter(float.fromhex(words[0]), -math.inf if down else math.inf).hex()
    place[path[-1]] = " ".join(words)
    refused_by_all(changed, net, folder, path)
    return 1


def refused_by_all(changed, net, folder, what):
    one, three = both(changed, net, folder)
    for said in one.stdout, three.stdout:
        assert "values" in said and ("bounds" in said or "range" in said or "less than" in said), f"{what}: {said}"
    assert one.returncode == three.returncode == 1, f"{what}: {one} {three}"


def malformed(certificate, net, folder):
    """Files that no checker may accept or crash on."""
    text = json.dumps(certificate)
    bound = next(k for k, b in enumerate(certificate["bounds"]) if b["upper_method"] == "sdp")

    def with_bound(change):
        changed = json.loads(text)
        change(changed["bounds"][bound])
        return json.dumps(common.sealed(changed))

    def ragged(b):
        b["proof"]["factor"]["rows"][0] += " 1 2 3"

    def one_row_less(b):
        b["proof"]["factor"]["rows"].pop()

    def set_(key, value):
        def change(b):
            b["proof"]["factor"][key] = value
        return change

    def with_number(number, key="upper"):
        return text.replace(f'"{key}": {json.dumps(certificate["bounds"][0][key])}', f'"{key}": {number}', 1)

    def hex_upper(word):
        def change(b):
            b["upper_hex"] = word
        return with_bound(change)

    def long_word(b):
        b["proof"]["factor"]["rows"][0] = "9" * 100000
    scale = certificate["bounds"][bound]["proof"]["factor"]["scale"]
    cases = {
        "empty": b"", "no JSON": b"{", "an array": b"[]", "NaN": with_number("NaN"),
        "Infinity": with_number("-Infinity"),
        "exponent of nine digits": with_number("1e999999999"), "number of 10^5 digits": with_number("9" * 100000),
        "fraction of 10^5 digits": with_number("0." + "3" * 100000),
        "nested 10^5 deep": b"[" * 100000 + b"]" * 100000,
        "nested 65 deep": b'{"schema":' + b"[" * 65 + b"]" * 65 + b"}",
        "byte order mark": b"\xef\xbb\xbf" + text.encode(), "two documents": text + text,
        "not UTF-8": text.encode() + b"\xff",
        "key twice": text[:-1] + ', "tool": "x"}', "half a surrogate": text.replace('"tool": "', '"tool": "\\ud800', 1),
        "control character": text.replace('"tool": "', '"tool": "\x01', 1), "comment": "// x\n" + text,
        "trailing comma": text[:-1] + ",}", "leading zero": with_number("01"), "plus sign": with_number("+1"),
        "ragged factor": with_bound(ragged), "a row less": with_bound(one_row_less),
        "long integer": with_bound(long_word),
        "huge unit": with_bound(set_("unit_exponent", 10 ** 18)),
        "huge scale": with_bound(set_("scale", [10 ** 9] * len(scale))),
        "scale is text": with_bound(set_("scale", "1")),
        "factor is text": with_bound(lambda b: b["proof"].update(factor="null")),
        "hex exponent": hex_upper("0x1p999999999"), "long hex": hex_upper("0x" + "1" * 100000 + "p0"),
        "hex nan": hex_upper("nan"), "hex inf": hex_upper("inf"), "hex blank": hex_upper(" 0x1p0"),
        "hex plus": hex_upper("+0x1p0"), "more bits than a double": hex_upper("0x1.000000000000001p3"),
        "scale of another size": with_bound(lambda b: b.update(scale=["0x1p+0"], norm="weighted_l2")),
    }
    longest = {}
    for name, data in cases.items():
        path = folder / "malformed.json"
        path.write_bytes(data if isinstance(data, bytes) else data.encode("utf-8", "surrogatepass"))
        codes = []
        for which, command in (("first", [common.SWARMCERT, "check", path, *net, "-q"]),
                               ("proved", [CHECKER, path, *files_of(net)])):
            start = time.monotonic()
            codes.append(run(command).returncode)
            longest[which] = max(longest.get(which, 0), time.monotonic() - start)
        assert all(code in (1, 3) for code in codes), f"{name}: {codes}"
    print(f"{len(cases)} malformed files refused by all; longest: " +
          ", ".join(f"{which} {1000 * seconds:.0f} ms" for which, seconds in longest.items()))


def skips_past(certificate, net, folder):
    """How many numbers an activation changes, and that others stay, is part of what is stated."""
    keeping = " tanh:n, and so" + certificate["statement"].split(" tanh:n, and so")[1]

    def refused(change, by_both=True):
        changed = copy(certificate)
        change(changed)
        assert changed != certificate
        one, three = both(changed, net, folder)
        assert one.returncode == 1 and (not by_both or three.returncode == 1), f"{one} {three}"

    (name,) = certificate["network"]["weights"]
    step = next(k for k, s in enumerate(certificate["network"]["weights"][name]["chain"]) if ":" in s["op"])
    op, kept = certificate["network"]["weights"][name]["chain"][step]["op"].split(":")
    for other in op, f"{op}:{int(kept) + 1}", f"{op}:{int(kept) - 1}", f"{op}:{kept}:{kept}":
        refused(lambda changed: changed["network"]["weights"][name]["chain"][step].update(op=other))
    refused(lambda changed: changed.update(statement=certificate["statement"].replace(keeping, "")))


def folded_numbers(folder, generator):
    """Thousands of numbers that folding rounds, some from within 2^-53 of the middle between two doubles: the readers
    have the same ones, since what one certifies all accept."""
    model, path = folder / "folded.onnx", folder / "folded.json"
    block = common.residual_block
    for kind in "Relu", "Tanh":
        nodes = [common.onnx_layer(1, "x", "h"), *block(2, "h", "r", (kind, ["ra"], "rb")),
                 *block(4, "r", "s", (kind, ["sa"], "sb")), common.onnx_layer(6, "s", "y")]
        model.write_bytes(common.onnx(nodes, [6, 40, 40, 40, 40, 40, 1], generator))
        options = ["--method", "product", "--nodes", "0", "-q", "--force", "-o", path]
        assert run([common.SWARMCERT, "certify", model, *options]).returncode == 0
        one, three = first(path, [model]), proved(path, [model])
        assert one.returncode == three.returncode == 0 and one.stdout == three.stdout, f"{kind}: {one} {three}"


def random_graphs(folder, count):
    """Convolutions, pooling, normalization, constants and activations of any kind beside skip connections: what one
    certifies all accept."""
    model, path, accepted = folder / "random.onnx", folder / "random.json", 0
    for seed in range(count):
        model.write_bytes(onnx_models.RandomModel(seed).bytes())
        options = ["--method", "product", "--nodes", "0", "-q", "--force", "-o", path]
        written = run([common.SWARMCERT, "certify", model, *options])
        if written.returncode == 3:
            assert "more than 8 numbers beside a skip connection" in written.stderr, f"{seed}: {written}"
            continue
        one, three = first(path, [model]), proved(path, [model])
        assert one.returncode == three.returncode == 0 and one.stdout == three.stdout, f"{seed}: {one} {three}"
        accepted += 1
    assert accepted > 0.8 * count, accepted
    print(f"{accepted} random graphs read alike")


def piecewise_activations(folder, generator):
    """Piecewise linear activations that --activation states are written with ReLU, of a file and of the parts of a
    network.toml; both checkers accept the certificates without being told again."""
    net, path = folder / "piecewise.safetensors", folder / "piecewise.json"
    net.write_bytes(common.safetensors([2, 5, 4, 1], generator))
    nets = [[net, "--activation", name] for name in
            ("leaky_relu", "relu6", "hardtanh,tanh", "silu,relu6,relu6", "relu,leaky_relu:0.25")]
    nets.append([common.heterogeneous(folder, generator), "--activation", "leaky_relu:-0.3"])
    for given in nets:
        run([common.SWARMCERT, "certify", *given, "--nodes", "1", "-q", "--force", "-o", path])
        one, three = first(path, files_of(given)), proved(path, given)
        assert one.returncode == three.returncode == 0 and one.stdout == three.stdout, f"{given}: {one} {three}"


def main():
    generator = random.Random(23)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folded_numbers(folder, random.Random(31))
        random_graphs(folder, 20 + MUTATIONS // 100)
        piecewise_activations(folder, random.Random(43))
        everything = kinds(folder, generator)
        laws_in_a_box(folder, next(net for name, net, _, _ in everything if name == "pair"))
        total, mutated = 0, set()
        for index, (name, net, options, share) in enumerate(everything):
            path = folder / f"certificate{index}.json"
            nodes = [] if "--nodes" in options else ["--nodes", "12" if "parts" in name else "1"]
            done = run([common.SWARMCERT, "certify", *net, *options, *nodes, *common.QUICKLY, "-o", path])
            assert done.returncode == 0, f"{name}: {done}"
            certificate = read(path)
            one, three = first(path, net), proved(path, net)
            assert one.returncode == 0, one
            assert three.returncode == 0 and three.stdout == one.stdout, f"{one} {three}"
            if name == "skip connections past tanh":
                skips_past(certificate, net, folder)
            if name == "parts of a box":
                a_smaller_bound(certificate, net, folder)
            if index == 0:
                malformed(certificate, net, folder)
                layer_by_layer(certificate, net, folder)
            if "number of neighbours" in name:
                among_neighbours(certificate, net, folder)
            if "values" in name:
                values_are_tight(certificate, net, folder)
            if "scale" in name:
                short_scale(copy(certificate), net, folder)
            total += mutate(name, net, certificate, folder, generator, mutated, int(share * MUTATIONS))
        print(f"{total} mutated certificates of {len(everything)} kinds: the two checkers decide alike on each")


if __name__ == "__main__":
    main()
