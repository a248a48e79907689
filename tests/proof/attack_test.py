#!/usr/bin/env python3
"""Networks of all kinds, each attacked: no printed norm, bound, witness or range is exceeded by slopes and values that
an evaluation here finds, both checkers accept the certificate, and they decide alike on it after mutations.

    attack_test.py SWARMCERT SOURCE_DIR NETWORKS MUTATIONS CHECKER CHECK_MANY

NETWORKS: how many; MUTATIONS: of all certificates together.
"""
import json
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import certificates as common

sys.path.insert(0, str(common.SOURCE / "tests" / "lipschitz"))
import canonical  # noqa: E402

COUNT, MUTATIONS, CHECKER, CHECK_MANY = int(sys.argv[3]), int(sys.argv[4]), sys.argv[5], sys.argv[6]
#: Names of --activation, between all layers or layer by layer; their values are those of FUNCTIONS.
KINDS = ["relu", "tanh", "maxmin:pairs", "leaky_relu:0.2", "silu", "groupsort:4", "hardtanh", "gelu", "maxmin:halves",
         "relu6", "softplus", "groupsort:3", "elu", "relu,tanh", "selu", "sigmoid", "groupsort:2,relu",
         "relu,maxmin:pairs"]
FUNCTIONS = {**canonical.FUNCTIONS, "leaky_relu:0.2": lambda t: max(t, 0.0) + 0.2 * min(t, 0.0),
             "hardtanh": lambda t: min(max(t, -1.0), 1.0), "relu6": lambda t: min(max(t, 0.0), 6.0)}


def activated(op, values):
    return list(map(FUNCTIONS[op], values)) if op in FUNCTIONS else canonical.activated(op, values)


class Attack:
    """A network of three layers and points of steep slopes and large values."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.op = KINDS[seed % len(KINDS)]
        group = 12 if "sort" in self.op or "maxmin" in self.op else 1
        width = lambda: group * self.random.randint(1, 24 // group)
        self.sizes = [self.random.randint(1, 4), width(), width(), self.random.randint(1, 3)]
        gain = 2 ** self.random.uniform(-1, 2)
        self.layers = [([[self.random.gauss(0, gain / math.sqrt(inputs)) for _ in range(inputs)]
                         for _ in range(outputs)], [self.random.gauss(0, 0.5) for _ in range(outputs)])
                       for inputs, outputs in zip(self.sizes, self.sizes[1:])]
        self.radius = 2 ** self.random.uniform(-2, 1) if seed // len(KINDS) % 2 else None
        ops = self.op.split(",")
        self.ops = ops * 2 if len(ops) == 1 else ops

    def value(self, x):
        for (rows, biases), op in zip(self.layers, [*self.ops, None]):
            x = [math.fsum(w * v for w, v in zip(row, x)) + b for row, b in zip(rows, biases)]
            x = activated(op, x) if op else x
        return x

    def inside(self, x):
        return x if self.radius is None else [min(max(v, -self.radius), self.radius) for v in x]

    def point(self):
        size = self.radius or 3.0
        return [self.random.uniform(-size, size) for _ in range(self.sizes[0])]

    def slope(self, x, y):
        distance = math.dist(x, y)
        return math.dist(self.value(x), self.value(y)) / distance if distance > 0 else 0.0

    def climbed(self, height, start, steps=60):
        """The best of random steps of shrinking length, from the best of a few starts."""
        best = max((start() for _ in range(12)), key=height)
        top, length = height(best), (self.radius or 3.0)
        for _ in range(steps):
            moved = [self.inside([v + length * self.random.gauss(0, 1) for v in x]) for x in best]
            found = height(moved)
            best, top = (moved, found) if found > top else (best, top)
            length *= 0.93
        return top

    def steepest(self):
        def near():
            x = self.point()
            return [x, self.inside([v + self.random.gauss(0, 1e-3) for v in x])]
        pairs = lambda: [self.point(), self.point()]
        return max(self.climbed(lambda pair: self.slope(*pair), start) for start in (near, near, pairs))

    def extreme(self, output, sign):
        return sign * self.climbed(lambda x: sign * self.value(x[0])[output], lambda: [self.point()])

    def norm(self, rows):
        v = [self.random.gauss(0, 1) for _ in rows[0]]
        for _ in range(50):
            size = math.hypot(*v) or 1.0
            v = [x / size for x in v]
            w = [math.fsum(a * b for a, b in zip(row, v)) for row in rows]
            v = [math.fsum(row[j] * y for row, y in zip(rows, w)) for j in range(len(v))]
        return math.hypot(*w)


def run(*command):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True)


def judge(attack, result, where):
    """Returns how many printed numbers were tried."""
    tolerance, tried = 1e-7, 0
    bound = next(b for b in result["bounds"] if b["block"] == "all")
    steepest = attack.steepest()
    assert steepest <= bound["upper"] * (1 + tolerance), f"{where}: slope {steepest} above {bound['upper']}"
    assert bound["lower"] is None or bound["lower"] <= bound["upper"], where
    witness = bound.get("lower_witness")
    if witness:
        own = attack.slope(witness["x"], witness["y"])
        assert own >= bound["lower"] * (1 - 1e-6), f"{where}: the witness has the slope {own}, not {bound['lower']}"
    for (rows, _), layer in zip(attack.layers, result["layers"]):
        norm = attack.norm(rows)
        assert norm <= layer["spectral_norm"][1] * (1 + tolerance), f"{where}: {layer['name']} has the norm {norm}"
        tried += 1
    for entry in result["range"]:
        for sign, end in ((1, "upper"), (-1, "lower")):
            value = attack.extreme(entry["output"], sign)
            assert sign * value <= sign * entry[end] + tolerance * (1 + abs(value)), f"{where}: {value} beyond {entry}"
            tried += 1
    return tried + 2


def mutate(original, generator, count, folder, net):
    """Asserts that both checkers give the same verdict on `count` mutations."""
    paths, text = [], original.read_text()
    while len(paths) < count:
        changed = json.loads(text)
        parent, key = leaf_of(changed, generator)
        parent[key] = common.mutated(parent[key], generator)
        paths.append(folder / f"mutated{len(paths)}.json")
        paths[-1].write_text(json.dumps(common.sealed(changed)))
    listed = "\n".join(map(str, paths))
    answers = [subprocess.run([str(part) for part in command], input=listed, capture_output=True, text=True)
               for command in ([CHECK_MANY, net, original], [CHECKER, "--many", net])]
    codes = [[int(line.split("\t")[0]) for line in done.stdout.splitlines()] for done in answers]
    assert len(codes[0]) == len(codes[1]) == count, answers
    for path, line, first, second in zip(paths, answers[0].stdout.splitlines(), *codes):
        assert first == second or common.is_of_files(line.partition("\t")[2]), \
            f"{net}: {first} and {second}: {path.read_text()[:2000]}"


def leaf_of(certificate, generator):
    """Returns the holder and the key of a value below one of the certificate's fields."""
    holder, key = certificate, generator.choice([k for k in certificate if k != "content_sha256"])
    while isinstance(holder[key], (dict, list)) and holder[key]:
        holder = holder[key]
        key = generator.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    return holder, key


def main():
    tried, mutated = 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        net, box, result, path = (folder / file for file in ("net.safetensors", "box.toml", "result.json", "c.json"))
        for seed in range(COUNT):
            attack = Attack(seed)
            net.write_bytes(common.as_safetensors(attack.layers))
            options = ["--activation", attack.op]
            if attack.radius is not None:
                ends = [attack.radius] * attack.sizes[0]
                box.write_text(f'schema = "swarmcert/box/1"\nlower = {[-v for v in ends]}\nupper = {ends}\n')
                options += ["--domain", box]
            done = run(common.SWARMCERT, "certify", net, *options, *common.QUICKLY, "--nodes", 40, "--json", result,
                       "--force", "-o", path)
            where = f"network {seed}, {attack.op}, {attack.sizes}, box {attack.radius}"
            assert done.returncode == 0, f"{where}: {done}"
            tried += judge(attack, json.loads(result.read_text()), where)
            for checker in ([common.SWARMCERT, "check", path, net], [CHECKER, path, net]):
                done = run(*checker)
                assert done.returncode == 0, f"{where}: {done}"
            share = MUTATIONS * (seed + 1) // COUNT - mutated
            mutate(path, attack.random, share, folder, net)
            mutated += share
    print(f"{COUNT} networks, {tried} printed numbers: none exceeded; {mutated} mutations: decided alike")


if __name__ == "__main__":
    main()
