"""A load on a string in flights of the foreign simulator: `diagnose` ranks it first, `add pendulum` fits it; it is
never reported for a rigid load or without a load.

Usage: foreign_pendulum.py TOOL MODEL FOLDER [--effects LENGTH,...]
Prints a line per case; exits with 1 if another effect is reported, a value is outside its interval, or the error on
held-out flights is more than 1.2 times that of the true load.
"""

import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import argument_parser, asked, model_with_lag  # noqa: E402
from foreign_simulator import GRAVITY, MASS_KG, STEP_S, fly  # noqa: E402

FLIGHTS = 4
SPEED = 1.4  # of the paths: a load swings only if turns are close to its period
LOADS = [dict(mass_kg=0.006, length_m=0.35, damping_1_s=0.25), dict(mass_kg=0.004, length_m=0.2, damping_1_s=0.5),
         dict(mass_kg=0.010, length_m=0.6, damping_1_s=0.15)]
WIDER = 2.576 / 1.645  # from 90 % to 99 % intervals


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def hanging(mass_kg, length_m, damping_1_s):
    """The full pendulum: a point mass on a taut string of fixed length with friction against its swing, at any angle.
    The tension follows from the length of the string and from the masses at its two ends."""
    def force(s):
        r, dr = s.memory.setdefault("load", ([0.0, 0.0, -length_m], [0.0, 0.0, 0.0]))
        n = [x / length_m for x in r]
        vehicle = [s.thrust * s.R[i][2] / MASS_KG for i in range(3)]
        vehicle[2] -= GRAVITY
        friction_N = [mass_kg * damping_1_s * x for x in dr]
        vehicle = [vehicle[i] + friction_N[i] / MASS_KG for i in range(3)]
        load = [-x / mass_kg for x in friction_N]
        load[2] -= GRAVITY
        apart = [load[i] - vehicle[i] for i in range(3)]
        tension_N = (dot(n, apart) + dot(dr, dr) / length_m) / (1 / mass_kg + 1 / MASS_KG)
        for i in range(3):
            dr[i] += STEP_S * (apart[i] - tension_N * n[i] * (1 / mass_kg + 1 / MASS_KG))
            r[i] += STEP_S * dr[i]
        scale = length_m / math.sqrt(dot(r, r))
        r[:] = [x * scale for x in r]
        along = dot(r, dr) / length_m ** 2
        dr[:] = [dr[i] - along * r[i] for i in range(3)]
        return tuple(tension_N * n[i] + friction_N[i] for i in range(3))
    return force


def fixed(mass_kg):
    """A rigid load takes up part of the thrust."""
    share = mass_kg / (MASS_KG + mass_kg)
    return lambda s: tuple(-share * s.thrust * s.R[i][2] for i in range(3))


def flown(options, name, truth, seed):
    folder = os.path.join(options.folder, name)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    for run in range(FLIGHTS):
        fly(truth, seed, flights, run)
    model = model_with_lag(options.model, folder)
    result = asked(options.tool, ["diagnose", model, flights], os.path.join(folder, "diagnose.json"))
    return folder, flights, model, result["ranking"]


def is_inside(fitted, value, wider=1):
    lower, upper = fitted["interval_90"]
    more = 0.5 * (upper - lower) * (wider - 1)
    return lower - more <= value <= upper + more


def faults_of(load, ranking, held):
    if not ranking or ranking[0]["effect"] != "pendulum":
        return [f"named {[entry['effect'] for entry in ranking]}"]
    faults = [f"also named {entry['effect']}" for entry in ranking[1:]]
    for name, most in (("mass_kg", 0.01), ("length_m", 0.03)):
        fitted = ranking[0]["parameters"][name]
        held.append(is_inside(fitted, load[name]))
        if not is_inside(fitted, load[name], WIDER):
            faults.append(f"{name}: {load[name]} is outside of {fitted}")
        if abs(fitted["value"] - load[name]) > most * load[name]:
            faults.append(f"{name}: {fitted['value']} instead of {load[name]}")
    return faults


def faults_of_add(options, folder, flights, model, load):
    """Returns the errors on the held-out flight of the load fitted by `add`, and of the true load."""
    added = asked(options.tool, ["add", "pendulum", "--model", model, flights, "-o", os.path.join(folder, "new.toml")],
                  os.path.join(folder, "add.json"))
    before, after = added["ladder"][0]["test_rmse"], added["ladder"][-1]["test_rmse"]
    numbers = ", ".join(f"{name} = {value}" for name, value in load.items())
    truth = model_with_lag(options.model, folder, f'[[effect]]\nname = "pendulum"\nparameters = {{ {numbers} }}\n',
                           "truth.toml")
    test = [os.path.join(flights, f) for f in sorted(os.listdir(flights)) if f.endswith(f"_{FLIGHTS - 1:02d}")]
    of_truth = asked(options.tool, ["compare", truth] + test, os.path.join(folder, "compare.json"))
    of_truth = of_truth["overall"]["rmse"]["total"]
    if after > 1.2 * of_truth or not after < 0.5 * before:
        return [f"add pendulum: the error goes from {before} to {after} N; that of the true load is {of_truth} N"]
    rest = asked(options.tool, ["diagnose", os.path.join(folder, "new.toml"), flights],
                 os.path.join(folder, "rest.json"))
    return [f"beside the load that add fitted: {entry['effect']}" for entry in rest["ranking"]]


def main():
    options = argument_parser().parse_args()
    failed, held = 0, []

    def report(name, faults, ranking):
        print(("! " if faults else "  ") + json.dumps(
            {"case": name, "faults": faults,
             "named": [{e["effect"]: {n: p["value"] for n, p in e["parameters"].items()}}
                                                       for e in ranking]}), flush=True)
        return bool(faults)

    for seed, load in enumerate(LOADS, 11):
        name = f"load_{load['length_m']}"
        folder, flights, model, ranking = flown(options, name, dict(force=hanging(**load), speed=SPEED), seed)
        faults = faults_of(load, ranking, held) + faults_of_add(options, folder, flights, model, load)
        failed += report(name, faults, ranking)
    calm = dict(force=hanging(**LOADS[1]), speed=0.7)
    for name, truth, right in (("never_swings", calm, ["thrust_ratio"]),
                               ("fixed_light", dict(force=fixed(0.003), speed=SPEED), ["thrust_ratio"]),
                               ("fixed_heavy", dict(force=fixed(0.010), speed=SPEED), ["thrust_ratio"]),
                               ("nothing", dict(speed=SPEED), [])):
        ranking = flown(options, name, truth, 14)[3]
        named = [entry["effect"] for entry in ranking]
        failed += report(name, [] if named == right else [f"named {named}"], ranking)
    print(f"intervals of 90 % that hold the truth: {sum(held)} of {len(held)}")
    return 1 if failed or sum(held) < 0.6 * len(held) else 0


if __name__ == "__main__":
    sys.exit(main())
