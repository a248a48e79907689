"""Effects of the registry, flown by the foreign simulator: `diagnose` names them first, with values inside their intervals.

Usage: foreign_names.py TOOL MODEL FOLDER [--effects NAME,...]
Prints a line per case; exits 1 where a name is not first, a value is outside, or a flight without the effect has the name.
"""

import argparse
import json
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import KEYS, asked, model_with_lag  # noqa: E402
from foreign_simulator import fly  # noqa: E402

FLIGHTS = 3
WIDER = 2.576 / 1.645  # from intervals of 90 % to 99 %: of ten values one lies outside of 90 %


def com_offset(x, y):
    return lambda s: (-y * s.thrust, x * s.thrust, 0.0)


# truth: as foreign_simulator.fly() takes it; values: parameters that flights show; rivals: what must or must not be one.
NAMED = {
    "com_offset": dict(truth=dict(torque=com_offset(0.004, -0.002)), values={"offset_x_m": 0.004, "offset_y_m": -0.002},
                       not_rivals=["torque_bias"], is_added=True),
    "accelerometer_scale": dict(truth=dict(accelerometer_scale=1.08), values={"scale": 1.08},
                                not_rivals=["thrust_ratio", "constant_force"]),
    "torque_bias": dict(truth=dict(torque=lambda s: (8e-4, 1.2e-3, 0.0)),
                        values={"torque_x_Nm": 8e-4, "torque_y_Nm": 1.2e-3}),
}


def is_inside(fitted, value):
    lower, upper = fitted["interval_90"]
    more = 0.5 * (upper - lower) * (WIDER - 1)
    return lower - more <= value <= upper + more


def faults_of(effect, case, ranking):
    if not ranking or ranking[0]["effect"] != effect:
        return [f"named {[entry['effect'] for entry in ranking]}"]
    faults = []
    for name, value in case["values"].items():
        fitted = ranking[0]["parameters"][name]
        if not is_inside(fitted, value):
            faults.append(f"{name}: {value} is outside of {fitted}")
        if abs(fitted["value"] - value) > 0.2 * abs(value):
            faults.append(f"{name}: {fitted['value']} instead of {value}")
    rivals = ranking[0]["confounded_with"]
    faults += [f"no rival {name}" for name in case.get("rivals", []) if name not in rivals]
    faults += [f"rival {name}" for name in case.get("not_rivals", []) if name in rivals]
    return faults


def diagnosed(options, name, case):
    folder = os.path.join(options.folder, name)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    truth = {key: case["truth"][key] for key in KEYS if key in case["truth"]}
    for run in range(FLIGHTS):
        fly(truth, 5, flights, run, case.get("vehicles", 1))
    model = model_with_lag(options.model, folder)
    if case.get("is_added"):  # what `add` writes must leave nothing to name
        fitted = os.path.join(folder, "fitted.toml")
        asked(options.tool, ["add", name, "--model", model, flights, "-o", fitted], os.path.join(folder, "add.json"))
        rest = asked(options.tool, ["diagnose", fitted, flights], os.path.join(folder, "rest.json"))
        if rest["ranking"]:
            raise RuntimeError(f"beside the {name} that add fitted: {rest['ranking']}")
    result = asked(options.tool, ["diagnose", model, flights], os.path.join(folder, "diagnose.json"))
    if not options.keep:
        shutil.rmtree(folder)
    return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("model")
    parser.add_argument("folder")
    parser.add_argument("--effects", default="")
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args()
    chosen = [name for name in options.effects.split(",") if name] or list(NAMED)
    failed = 0
    for name in chosen:
        faults = faults_of(name, NAMED[name], diagnosed(options, name, NAMED[name])["ranking"])
        failed += bool(faults)
        print(("! " if faults else "  ") + json.dumps({"effect": name, "faults": faults}), flush=True)
    ranking = diagnosed(options, "nothing", dict(truth={}))["ranking"]
    failed += bool(ranking)
    print(("! " if ranking else "  ") + json.dumps({"effect": "nothing", "named": [e["effect"] for e in ranking]}))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
