"""Torques and weak rotors without a form in the registry: `diagnose` finds the axis or the rotor, and the variable.

Usage: foreign_balance.py TOOL MODEL FOLDER [--effects NAME,...] [--seeds FROM:TO] [--nothing N]
Prints a line per case; exits with 1 if the first torque or rotor in remainder[] is a wrong one, or if flights without
any effect have one.
"""

import json
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import KEYS, argument_parser, asked, model_with_lag  # noqa: E402
from foreign_simulator import fly  # noqa: E402

FLIGHTS = 3


def loses_above(rotor, force_N, share):
    """One rotor gives only part of the commanded force above a threshold."""
    return lambda s, k, f: f - share * max(0.0, f - force_N) if k == rotor - 1 else f


# variables: any of these is correct; axis: of the first entry; slope: the true slope of the curve over the variable.
BALANCES = {
    "roll of speed": dict(torque=lambda s: (3e-4 * s.speed, 0.0, 0.0), axis="roll", variables={"speed"}, slope=3e-4),
    "pitch of height": dict(torque=lambda s: (0.0, 4e-4 * s.p[2], 0.0), axis="pitch", variables={"z"}, slope=4e-4),
    "yaw of climb": dict(torque=lambda s: (0.0, 0.0, 1e-4 * s.v[2]), axis="yaw", variables={"vz", "climb"}, slope=1e-4),
    "rotor 2 of its duty": dict(rotor=loses_above(2, 0.078, 0.5), speed=1.6, axis="rotor_2", variables={"duty_2"}),
    "rotor 4 of its duty": dict(rotor=loses_above(4, 0.080, 0.6), speed=1.6, axis="rotor_4", variables={"duty_4"}),
}


def slope_of(curve):
    """Returns the least squares slope over the inner knots."""
    points = [(p["at"][0], p.get("torque_Nm", p.get("force_N"))) for p in curve[1:-1]]
    x0 = sum(x for x, _ in points) / len(points)
    y0 = sum(y for _, y in points) / len(points)
    return sum((x - x0) * (y - y0) for x, y in points) / sum((x - x0) ** 2 for x, _ in points)


def faults_of(case, found):
    if "axis" not in case:
        return [f"{e['axis']} over {e['variable']}" for e in found]
    if not found:
        return ["nothing found"]
    first, faults = found[0], []
    if first["axis"] != case["axis"] or first["variable"] not in case["variables"] or first["frame"] != "body":
        return [f"first is {first['axis']} over {first['variable']}, {first['frame']}"]
    if not 0.3 <= first["share"] <= 1 or not first["share_ci"][0] <= first["share"] <= first["share_ci"][1]:
        faults.append(f"share {first['share']}, {first['share_ci']}")
    if not first["rmse_after"] < 0.85 * first["rmse_before"]:
        faults.append(f"rmse {first['rmse_before']} -> {first['rmse_after']}")
    if "slope" in case:
        slope = slope_of(first["curve"])
        if abs(slope - case["slope"]) > 0.2 * case["slope"]:
            faults.append(f"slope {slope} instead of {case['slope']}")
        if "torque_" not in (first["expression"] or ""):
            faults.append("no expression of a torque")
    return faults


def diagnosed(options, name, case, seed):
    folder = os.path.join(options.folder, f"{name.replace(' ', '_')}_{seed}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    truth = {key: case[key] for key in KEYS if key in case}
    for run in range(FLIGHTS):
        fly(truth, seed, flights, run)
    model = model_with_lag(options.model, folder)
    result = asked(options.tool, ["diagnose", model, flights], os.path.join(folder, "diagnose.json"))
    if not options.keep:
        shutil.rmtree(folder)
    return result


def main():
    parser = argument_parser()
    parser.add_argument("--seeds", default="1:2")
    parser.add_argument("--nothing", type=int, default=1, help="cases without any effect")
    options = parser.parse_args()
    first, last = (int(x) for x in options.seeds.split(":"))
    chosen = [name for name in options.effects.split(",") if name] or list(BALANCES)
    cases = [(name, BALANCES[name], seed) for name in chosen for seed in range(first, last)]
    cases += [("nothing", {}, first + k) for k in range(options.nothing)]
    failed = 0
    for name, case, seed in cases:
        result = diagnosed(options, name, case, seed)
        remainder = result["remainder"]
        found = [entry for entry in remainder if entry["quantity"] != "force"]
        faults = faults_of(case, found)
        if (result["verdict"] == "nothing_missing") != (case == {}):
            faults.append(f"verdict {result['verdict']}")
        failed += bool(faults)
        shown = [f"{e['quantity']} {e['axis']} over {e['variable']} {e['share']:.2f}" for e in remainder[:5]]
        print(("! " if faults else "  ") + json.dumps({"effect": name, "seed": seed, "faults": faults, "first": shown}),
              flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
