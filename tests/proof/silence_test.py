#!/usr/bin/env python3
"""Networks that are silent in some compositions: both checkers agree, each for the correct reason. The
statement names the compositions, lower bounds have no witness among them, ranges contain 0 (and nothing else if
there is no other composition), and jumps cover the steps to and from them.

    silence_test.py SWARMCERT SOURCE_DIR 0 CHECKER [COQC THEORY]
    with COQC, the kernel accepts such a certificate as well
"""
import json
import math
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from struct import pack

SOURCE, CHECKER = Path(sys.argv[2]), Path(sys.argv[4]).resolve()
sys.path.insert(0, str(SOURCE / "tests/lipschitz"))
import certificates as common  # noqa: E402


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=60)


def decided(certificate, net):
    """Returns the reasons of both, "" for one that accepts."""
    path = net.parent / "checked.json"
    path.write_text(json.dumps(common.sealed(certificate)))
    one, three = run(common.SWARMCERT, "check", path, net, "-q"), run(CHECKER, path, net)
    assert one.returncode in (0, 1) and three.returncode == one.returncode, f"{one} {three}"
    if one.returncode == 0:
        assert three.stdout == common.said_by_both(one.stdout), f"{one} {three}"
    return [done.stdout if done.returncode == 1 else "" for done in (one, three)]


def refused(certificate, net, words):
    """`words`: part of the reason of both."""
    reasons = decided(certificate, net)
    assert all(words in reason for reason in reasons), f"{words}: {reasons}"


def accepted(certificate, net):
    reasons = decided(certificate, net)
    assert not any(reasons), reasons


def with_values(certificate, function, **fields):
    changed = json.loads(json.dumps(certificate))
    entries = [entry for entry in changed["values"] if entry["function"] == function]
    assert entries
    for entry in entries:
        entry.update(fields)
    return changed


def network(folder, name, silent):
    """The network of heterogeneous() with a value near 100: a step to 0 is the largest jump."""
    data = (folder / "rho.safetensors").read_bytes()
    (folder / "high.safetensors").write_bytes(data[:-8] + pack("<d", 100.0))  # the last bias
    net = folder / name
    net.write_text((folder / "network.toml").read_text().replace("rho.safetensors", "high.safetensors").replace(
        "[input]", f"silent = {json.dumps(silent)}\n[input]", 1))
    return net


def certify(net, *options):
    path = net.parent / "certificate.json"
    done = run(common.SWARMCERT, "certify", net, *options, "--nodes", "1", *common.QUICKLY, "--force", "-o", path)
    assert done.returncode == 0, done
    return json.loads(path.read_text())


def statement_and_witnesses(folder):
    net = common.silent(folder)
    certificate = certify(net, "--neighbours", "large=2,small=1")
    accepted(certificate, net)
    assert any(bound["lower"] for bound in certificate["bounds"] if bound["function"].startswith("set:"))
    for text in (certificate["statement"].split(" Among these neighbours")[0],
                 certificate["statement"].replace(", small>small", "")):
        assert text != certificate["statement"]
        refused(dict(certificate, statement=text), net, "statement is not the one")
    point = ["0x0p+0"] * 6
    ground = {"network": "phi:ground", "x": point[:4]}
    small, large = ({"network": f"phi:{kind}", "x": point} for kind in ("small", "large"))
    tried = 0
    for i, bound in enumerate(certificate["bounds"]):
        if bound["function"] not in ("set:small:small", "set:large:small"):
            continue
        own = bound["function"].split(":")[1]
        for others in ([ground], [ground, small], [large, ground], [ground, large, small]):
            kinds = sorted([own] + [other["network"][4:] for other in others if other is not ground])
            changed = json.loads(json.dumps(certificate))
            changed["bounds"][i].update(lower=0.0, lower_hex="0x0p+0", lower_witness={
                "x": point, "y": ["0x1p+0"] + point[1:], "others": others})
            if kinds in (["small"], ["large", "small"]):
                refused(changed, net, "is 0 among these neighbours")
                tried += 1
            else:
                accepted(changed, net)
    assert tried == 3, tried


def one_unit_less(number):
    smaller = math.nextafter(number, 0)
    return {"jump": smaller, "jump_hex": smaller.hex()}


def ranges_and_jumps(folder):
    net = network(folder, "high.toml", ["large+small>small", "small>small"])
    certificate = certify(net, "--domain", folder / "box.toml", "--neighbours", "1")
    accepted(certificate, net)
    for function in "set:small:small", "set:large:small":
        jump = max(entry["jump"] for entry in certificate["values"] if entry["function"] == function)
        assert jump > 90, jump  # the step
        refused(with_values(certificate, function, **one_unit_less(jump)), net,
                "less than the step to neighbours for which")
    refused(with_values(certificate, "set:small:small", lower=["0x1p-1000"]), net,
            "lacks 0, the output for neighbours")
    # With only large neighbours there is no 0, only values near 100.
    accepted(with_values(certificate, "set:large:small", lower=["-0x1p+8"]), net)
    lower = {entry["function"]: float.fromhex(entry["lower"][0]) for entry in certificate["values"]}
    assert lower["set:large:small"] > 50 and lower["set:small:small"] == 0, lower
    # The other kind has no box, so nothing is known about the steps beside it.
    changed = json.loads(json.dumps(certificate))
    changed["values"] = [entry for entry in changed["values"] if entry["function"] == "set:small:small"]
    accepted(changed, net)
    del changed["box"]["phi:large"]
    changed["bounds"] = [b for b in changed["bounds"] if b["domain"] == "global" and "large" not in b["function"]]
    changed["laws"] = []
    assert all(decided(changed, net))
    return net, certificate


def always_silent(folder):
    """With up to one neighbour of its kind the range is 0."""
    net = network(folder, "always.toml", [">small", "small>small"])
    certificate = certify(net, "--domain", folder / "box.toml", "--neighbours", "1")
    zero = {"lower": ["0x0p+0"], "upper": ["0x0p+0"]}
    accepted(with_values(certificate, "set:small:small", **zero), net)
    refused(with_values(certificate, "set:large:small", **zero), net, "leave the range")
    net = network(folder, "sometimes.toml", ["small>small", "small+small>small"])
    certificate = certify(net, "--domain", folder / "box.toml", "--neighbours", "1")
    refused(with_values(certificate, "set:small:small", **zero), net, "leave the range")


def compositions_of_kinds_that_are_not_there(folder):
    """Refused by both as they stand in the network of a certificate."""
    net = network(folder, "right.toml", ["small>small"])
    certificate = certify(net)
    for silent, reason in ((["small"], "is not a composition"), (["tiny>small"], "there is no phi of tiny"),
                           (["ground>small"], "there is no phi of ground"), (["+small>small"], "there is no phi of "),
                           (["small+large>small"], "kinds are not sorted"), (["small>small"] * 2, "twice")):
        changed = json.loads(json.dumps(certificate))
        changed["network"]["silent"] = silent
        refused(changed, net, reason)


def smooth_neighbours(folder):
    """Beside neighbours with tanh or GELU the step is proved as well, and all refuse a smaller one."""
    for activation in "tanh", "gelu":
        net = network(folder, "beside.toml", ["large+small>small"])
        stated = f'"large.safetensors"\nactivation = "{activation}"'
        net.write_text(net.read_text().replace('"large.safetensors"', stated))
        certificate = certify(net, "--domain", folder / "box.toml", "--neighbours", "1", "--method", "product")
        certificate["values"] = [entry for entry in certificate["values"] if entry["function"] == "set:small:small"]
        accepted(certificate, net)
        jump = certificate["values"][-1]["jump"]
        assert all(decided(with_values(certificate, "set:small:small", **one_unit_less(jump)), net))


def kernel(net, certificate, coqc, theory):
    path = net.parent / "Silent.json"
    path.write_text(json.dumps(common.sealed(certificate)))
    text = run(CHECKER, "--coq", path, net).stdout
    source = net.parent / "Silent.v"

    def accepts(words):
        source.write_text(words)
        return run(coqc, "-q", "-R", theory, "Swarmcert", source).returncode == 0

    assert accepts(text)
    steps = re.findall(r"(claim := Step_at_most .*)\((\d+),(-?\d+)\)\.", text)
    assert len(steps) == len(certificate["values"])
    for head, mantissa, exponent in steps[:1]:
        false = text.replace(f"{head}({mantissa},{exponent}).", f"{head}({int(mantissa) - 1},{exponent}).")
        assert false != text and not accepts(false)
    # Silent without neighbours, when the only term is the ground's, network 0: the range of large ones lacks that 0.
    others = re.sub(r"claim := Sum_within \[\[.*?\]\] ", "claim := Sum_within [[0%nat]] ", text)
    assert others != text and not accepts(others)


def main():
    generator = random.Random(29)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        common.heterogeneous(folder, generator)
        statement_and_witnesses(folder)
        net, certificate = ranges_and_jumps(folder)
        if len(sys.argv) > 5:
            kernel(net, certificate, *sys.argv[5:7])
        always_silent(folder)
        compositions_of_kinds_that_are_not_there(folder)
        smooth_neighbours(folder)


if __name__ == "__main__":
    main()
