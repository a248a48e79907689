"""Effects of the registry in flights of the foreign simulator: `diagnose` ranks them first, with values inside their
intervals.

Usage: foreign_names.py TOOL MODEL FOLDER [--effects NAME,...]
Prints a line per case; exits with 1 if an effect is not ranked first, a value is outside its interval, or the effect is
reported for a flight without it.
"""

import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import KEYS, argument_parser, asked, model_with_lag  # noqa: E402
from foreign_effects import saturation  # noqa: E402
from foreign_simulator import GRAVITY, MASS_KG, fly  # noqa: E402

FLIGHTS = 3
# from 90 % to 99 % intervals: every value must be inside 99 %, and this many inside 90 %
WIDER = 2.576 / 1.645
LEAST_HELD = 0.8


def com_offset(x, y):
    return lambda s: (-y * s.thrust, x * s.thrust, 0.0)


def tilted(x, y):
    return lambda s: tuple(s.to_world([y * s.thrust, -x * s.thrust, 0.0]))


def late_wake(amplitude, delay, spread, slope, wind=(0.0, 0.0)):
    def force(s):
        total = 0.0
        for other in s.others:
            p = other(delay)
            p = (p[0] + delay * wind[0], p[1] + delay * wind[1], p[2])
            dz = p[2] - s.p[2]
            if dz > 0.12:
                width = spread + slope * dz
                r2 = (p[0] - s.p[0]) ** 2 + (p[1] - s.p[1]) ** 2
                total -= amplitude * (0.3 / dz) ** 0.44 * math.exp(-r2 / (2 * width * width))
        return (0.0, 0.0, total)
    return force


def tether(k, anchor, slack):
    def force(s):
        out = [s.p[i] - anchor[i] for i in range(3)]
        length = math.sqrt(sum(x * x for x in out))
        taut = max(0.0, length - slack)
        return tuple(-k * taut * x / max(length, 1e-9) for x in out)
    return force


# truth: as accepted by foreign_simulator.fly(); effect: its name in the registry, if different from the case's; values:
# observable parameters; rivals: effects that must or must not be one.
NAMED = {
    "com_offset": dict(truth=dict(torque=com_offset(0.004, -0.002)), values={"offset_x_m": 0.004, "offset_y_m": -0.002},
                       not_rivals=["torque_bias"], is_added=True, is_added_by_auto=True),
    "imu_tilt": dict(truth=dict(force=tilted(0.03, -0.04), yaw_reach=3.0),
                     values={"tilt_x_rad": 0.03, "tilt_y_rad": -0.04}, not_rivals=["constant_force"], is_added=True,
                     of_sensor=True),
    "accelerometer_scale": dict(truth=dict(accelerometer_scale=1.08), values={"scale": 1.08},
                                not_rivals=["thrust_ratio", "constant_force"], is_added=True, of_sensor=True),
    "wake_delay": dict(truth=dict(force=late_wake(0.09, 0.25, 0.06, 0.06)), vehicles=2, values={"delay_s": 0.25}),
    "wake in wind": dict(effect="wake_delay", truth=dict(force=late_wake(0.09, 0.2, 0.06, 0.06, (0.9, -0.6))),
                         vehicles=2, values={"delay_s": 0.2, "wind_x_m_s": 0.9, "wind_y_m_s": -0.6}),
    "wake in a strong wind": dict(effect="wake_delay", flights=6, vehicles=2,
                                  truth=dict(force=late_wake(0.12, 0.2, 0.06, 0.06, (-2.4, 0.0))),
                                  values={"delay_s": 0.2, "wind_x_m_s": -2.4}),
    "saturation close to hovering": dict(effect="thrust_saturation", truth=dict(rotor=saturation(0.0855), speed=0.8),
                                         values={"knee_weights": 4 * 0.0855 / (MASS_KG * GRAVITY), "loss": 0.9}),
    "tether": dict(truth=dict(force=tether(0.15, (0.1, -0.1, 0.0), 0.9)),
                   values={"stiffness_N_m": 0.15, "slack_m": 0.9}),
    "torque_bias": dict(truth=dict(torque=lambda s: (8e-4, 1.2e-3, 0.0)),
                        values={"torque_x_Nm": 8e-4, "torque_y_Nm": 1.2e-3}),
    "slight torque_bias": dict(effect="torque_bias", truth=dict(torque=lambda s: (4e-4, -3e-4, 0.0)),
                               values={"torque_x_Nm": 4e-4, "torque_y_Nm": -3e-4}),
    "rotor_thrust": dict(truth=dict(rotor=lambda s, k, f: 0.85 * f if k == 2 else f), values={"rotor_3": 0.85},
                         rivals=["thrust_ratio"]),
}


def is_inside(fitted, value, wider=1):
    lower, upper = fitted["interval_90"]
    more = 0.5 * (upper - lower) * (wider - 1)
    return lower - more <= value <= upper + more


def faults_of(effect, case, ranking):
    if not ranking or ranking[0]["effect"] != effect:
        return [f"named {[entry['effect'] for entry in ranking]}"]
    faults = []
    for name, value in case["values"].items():
        fitted = ranking[0]["parameters"][name]
        if not is_inside(fitted, value, WIDER):
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
    for run in range(case.get("flights", FLIGHTS)):
        fly(truth, 5, flights, run, case.get("vehicles", 1))
    model = model_with_lag(options.model, folder)
    if case.get("is_added"):  # the result of `add` must reduce the error on held-out flights, and leave nothing to find
        fitted = os.path.join(folder, "fitted.toml")
        added = asked(options.tool, ["add", name, "--model", model, flights, "-o", fitted],
                      os.path.join(folder, "add.json"))
        before, after = added["ladder"][0]["test_rmse"], added["ladder"][-1]["test_rmse"]
        if not after < 0.9 * before:
            raise RuntimeError(f"add {name}: the held-out error goes from {before} to {after} N")
        with open(fitted) as file:
            states_sensor = f"# {name} is an error of a sensor" in file.read()
        is_of_sensor = [effect.get("sensor", False) for effect in added["effects"] if effect["effect"] == name]
        if is_of_sensor != [case.get("of_sensor", False)] or states_sensor != case.get("of_sensor", False):
            raise RuntimeError(f"add {name}: stated as of a sensor: {is_of_sensor}, in the file: {states_sensor}")
        rest = asked(options.tool, ["diagnose", fitted, flights], os.path.join(folder, "rest.json"))
        if rest["ranking"]:
            raise RuntimeError(f"beside the {name} that add fitted: {rest['ranking']}")
    if case.get("is_added_by_auto"):
        added = asked(options.tool, ["add", "auto", "--model", model, flights, "-o",
                                     os.path.join(folder, "auto.toml")], os.path.join(folder, "auto.json"))
        ladder = added["ladder"]
        row = next((row for row in ladder if row["effect"] == name and row["accepted"]), None)
        if row is None or not row["measure"]["test"][1] < 0.9 * row["measure"]["test"][0]:
            raise RuntimeError(f"add auto does not add {name}: {ladder}")
    result = asked(options.tool, ["diagnose", model, flights], os.path.join(folder, "diagnose.json"))
    if not options.keep:
        shutil.rmtree(folder)
    return result


def main():
    parser = argument_parser()
    options = parser.parse_args()
    chosen = [name for name in options.effects.split(",") if name] or list(NAMED)
    failed = held = judged = 0
    for name in chosen:
        effect = NAMED[name].get("effect", name)
        ranking = diagnosed(options, name, NAMED[name])["ranking"]
        faults = faults_of(effect, NAMED[name], ranking)
        failed += bool(faults)
        if ranking and ranking[0]["effect"] == effect:
            values = NAMED[name]["values"].items()
            judged += len(values)
            held += sum(is_inside(ranking[0]["parameters"][of], value) for of, value in values)
        print(("! " if faults else "  ") + json.dumps({"case": name, "faults": faults}), flush=True)
    ranking = diagnosed(options, "nothing", dict(truth={}))["ranking"]
    failed += bool(ranking)
    print(("! " if ranking else "  ") + json.dumps({"case": "nothing", "named": [e["effect"] for e in ranking]}))
    print(f"intervals of 90 % that hold the truth: {held} of {judged}")
    return 1 if failed or held < LEAST_HELD * judged else 0


if __name__ == "__main__":
    sys.exit(main())
