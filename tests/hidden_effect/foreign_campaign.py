"""Simulates hidden effects without a form in the registry, runs the tool, and judges its answers.

Usage: foreign_campaign.py TOOL MODEL FOLDER [--effects NAME,...] [--seeds FROM:TO] [--nothing N] [--add]
Prints a line per case and a summary; exits with 1 if a success rate is below its limit.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_effects import EFFECTS  # noqa: E402
from foreign_simulator import ROTOR_LAG_S, fly  # noqa: E402

FLIGHTS = 4
KEYS = ("force", "torque", "rotor", "discharge_V_s", "accelerometer_scale", "yaw_reach", "speed", "apart_m")


def model_with_lag(path, folder, extra="", name="model.toml"):
    with open(path) as file:
        text = file.read()
    text += f'\n[[effect]]\nname = "motor_lag"\nparameters = {{ tau_s = {ROTOR_LAG_S} }}\n' + extra
    to = os.path.join(folder, name)
    with open(to, "w") as file:
        file.write(text)
    return to


def argument_parser():
    """Returns the parser of the arguments common to all campaigns."""
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("model")
    parser.add_argument("folder")
    parser.add_argument("--effects", default="")
    parser.add_argument("--keep", action="store_true")
    return parser


def asked(tool, words, result):
    done = subprocess.run([tool] + words + ["-q", "--force", "--json", result], capture_output=True, text=True)
    if done.returncode == 4:
        return None
    if done.returncode != 0:
        raise RuntimeError(f"{words}: exit {done.returncode}: {done.stderr}")
    with open(result) as file:
        return json.load(file)


def case(options, name, effect, seed):
    folder = os.path.join(options.folder, f"{name.replace(' ', '_')}_{seed}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    truth = {key: effect[key] for key in KEYS if key in effect}
    flights = os.path.join(folder, "flights")
    for run in range(FLIGHTS):
        fly(truth, seed, flights, run, effect.get("vehicles", 1))
    model = model_with_lag(options.model, folder)
    result = asked(options.tool, ["diagnose", model, flights], os.path.join(folder, "diagnose.json"))
    if result is None:
        return {"name": name, "seed": seed, "named": [], "wrong": [], "right": False, "first": [], "reason": "too poor"}
    named = [entry["effect"] for entry in result["ranking"]]
    remainder = result["remainder"]
    first = [entry["variable"] for entry in remainder[:2]]
    wrong = [n for n in named if n not in effect.get("names", set())]
    right_name = any(n in effect.get("names", set()) for n in named)
    said = bool(set(result["unexplained"]["depends_on"]) & effect.get("left", set()))
    right = bool(set(first) & effect.get("variables", set())) or right_name or said
    answer = {"name": name, "seed": seed, "named": named, "wrong": wrong, "right": right,
              "first": [f"{e['variable']}/{e['frame']}.{e['axis']} {e['share']:.2f}" for e in remainder[:4]]}
    if options.add and (effect.get("variables") or options.nothing):
        answer.update(held_out(options, folder, flights, model, effect))
    if not options.keep:
        shutil.rmtree(folder)
    return answer


def held_out(options, folder, flights, model, effect):
    """Returns the errors on the test flight of what `study` adds, and of the true formula with its true values."""
    studied = asked(options.tool, ["study", model, flights, "-o", os.path.join(folder, "study")],
                    os.path.join(folder, "study.json"))
    if studied is None:
        return {}
    errors = [row["test_rmse"] for row in studied["ladder"] if row["accepted"]]
    answer = {"causes": [cause["name"] for cause in studied["causes"]], "before": errors[0], "after": errors[-1]}
    if "formula" in effect:
        truth = model_with_lag(options.model, folder, effect["formula"], "truth.toml")
        test = [f for f in sorted(os.listdir(flights)) if f.endswith(f"_{FLIGHTS - 1:02d}")]
        result = asked(options.tool, ["compare", truth] + [os.path.join(flights, f) for f in test],
                       os.path.join(folder, "compare.json"))
        answer["of_truth"] = result["overall"]["rmse"]["total"]
    return answer


def main():
    parser = argument_parser()
    parser.add_argument("--seeds", default="1:4")
    parser.add_argument("--nothing", type=int, default=0, help="cases without any effect, instead of the effects")
    parser.add_argument("--add", action="store_true", help="also run `study`, and judge its held-out error")
    options = parser.parse_args()
    first, last = (int(x) for x in options.seeds.split(":"))
    chosen = [n for n in options.effects.split(",") if n] or list(EFFECTS)
    cases = [(n, EFFECTS[n], s) for n in chosen for s in range(first, last)]
    if options.nothing:
        cases = [("nothing", {}, first + k) for k in range(options.nothing)]
    right = wrong = close = judged = claims = rises = 0
    for name, effect, seed in cases:
        answer = case(options, name, effect, seed)
        right += answer["right"]
        wrong += bool(answer["wrong"])
        claims += bool(answer["named"] or answer["first"] or answer.get("causes"))
        rises += answer.get("after", 0) > 1.01 * answer.get("before", 0)
        if "of_truth" in answer:
            judged += 1
            close += answer["after"] <= 1.2 * answer["of_truth"]
        print(("  " if answer["right"] and not answer["wrong"] else "! ") + json.dumps(answer), flush=True)
    print(f"cases {len(cases)}: right variable or name {right}, wrong names {wrong}, claims {claims}, "
          f"held-out error within 1.2 of the truth's {close} of {judged}, raised in {rises}")
    if options.nothing:
        return 0 if claims <= 0.02 * len(cases) else 1
    return 0 if right >= 0.9 * len(cases) and wrong == 0 and close >= 0.8 * judged and rises == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
