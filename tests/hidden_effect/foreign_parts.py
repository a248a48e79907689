"""Forces whose mean resembles an effect of the registry: `diagnose` does not give them its name, and says what they
depend on. The effects themselves, of the same size, keep their names, and so does a ratio with a sag.

Usage: foreign_parts.py TOOL MODEL FOLDER [--effects NAME,...] [--seeds FROM:TO]
Prints a line per case; exits with 1 if a name, the verdict, or what the remainder depends on is wrong.
"""

import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import FLIGHTS, argument_parser, asked, model_with_lag  # noqa: E402
from foreign_simulator import GRAVITY, MASS_KG, fly  # noqa: E402

WEIGHT_N = MASS_KG * GRAVITY


def suction(a=0.04, reach=0.3):
    return lambda s: (0, 0, -a * math.exp(-s.p[2] / reach))


def spin_loss(k=0.015):
    return lambda s, rotor, f: f * (1 - k * abs(s.w[2]))


def ratio_and_sag(ratio, sag):
    def thrust(s, rotor, f):
        return f * (ratio - sag * ((max(sum(s.rotors), 0.0) / WEIGHT_N) ** 1.5 - 1))
    return thrust


def dropped(at, a=0.0167):
    return lambda s: (0, 0, -a if s.t < at else 0)


# truth: of each flight from the seed; names: in the ranking; depends: any of these variables or words is right
PARTS = {
    "suction near the floor": dict(truth=lambda seed, run: dict(force=suction()), depends={"z"}),
    "thrust lost with the yaw rate": dict(truth=lambda seed, run: dict(rotor=spin_loss(), yaw_reach=3.0),
                                          depends={"rate_z"}),
    "ratio with a sag": dict(truth=lambda seed, run: dict(rotor=ratio_and_sag(0.9, 0.1), speed=1.4),
                             names=["thrust_ratio", "voltage_sag"]),
    "payload dropped at one time": dict(truth=lambda seed, run: dict(force=dropped(14.0, 0.04)),
                                        names=["payload_step"]),
    "ratio near one": dict(truth=lambda seed, run: dict(rotor=lambda s, k, f: 0.99 * f), names=["thrust_ratio"]),
    "ordinary error of the accelerometer": dict(truth=lambda seed, run: dict(accelerometer_scale=0.97),
                                                names=["accelerometer_scale"]),
    "ratio beside an accurate accelerometer": dict(truth=lambda seed, run: dict(rotor=lambda s, k, f: 0.97 * f),
                                                   names=["thrust_ratio"]),
}


def diagnosed(options, name, seed):
    folder = os.path.join(options.folder, f"{name.replace(' ', '_')}_{seed}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    for run in range(FLIGHTS):
        fly(PARTS[name]["truth"](seed, run), seed, flights, run)
    result = asked(options.tool, ["diagnose", model_with_lag(options.model, folder), flights],
                   os.path.join(folder, "diagnose.json"))
    if not options.keep:
        shutil.rmtree(folder)
    return result


def faults_of(case, result):
    names = [entry["effect"] for entry in result["ranking"]]
    faults = [] if names == case.get("names", []) else [f"named {names}"]
    if result["verdict"] != ("missing_effect" if "names" in case else "unexplained"):
        faults.append(f"verdict {result['verdict']}")
    said = {entry["variable"] for entry in result["remainder"][:1]} | set(result["unexplained"]["depends_on"][:1])
    if "depends" in case and not said & case["depends"]:
        faults.append(f"depends on {sorted(said)}")
    return faults


def main():
    parser = argument_parser()
    parser.add_argument("--seeds", default="81:82")
    options = parser.parse_args()
    first, last = (int(x) for x in options.seeds.split(":"))
    chosen = [name for name in options.effects.split(",") if name] or list(PARTS)
    failed = 0
    for name in chosen:
        for seed in range(first, last):
            faults = faults_of(PARTS[name], diagnosed(options, name, seed))
            failed += bool(faults)
            print(("! " if faults else "  ") + json.dumps({"case": name, "seed": seed, "faults": faults}), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
