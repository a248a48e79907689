"""Signals of one log that contradict each other: `diagnose` says so with the size, names no effect, and does not say
that nothing is missing, unless the model corrects a sensor.

Usage: foreign_signals.py TOOL MODEL FOLDER
Prints a line per case; exits with 1 if an effect is named, or if the words or the verdict are wrong.
"""

import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import argument_parser, asked, model_with_lag  # noqa: E402
from foreign_simulator import fly  # noqa: E402

FLIGHTS = 5
SAYS = "signals contradict each other: "

# truth: as accepted by foreign_simulator.fly(); words: how the only contradiction begins; effect: of the model
SIGNALS = {
    "nothing": dict(truth={}, words=None),
    "scaled velocity": dict(truth=dict(velocity_scale=1.05), words="velocities are 1.05"),
    "turned attitude": dict(truth=dict(heading_rad=math.radians(8)), words="attitudes are turned by 8."),
    "scale beside a corrected sensor": dict(
        truth=dict(velocity_scale=1.05), words="velocities are 1.05",
        effect='[[effect]]\nname = "imu_tilt"\nparameters = { tilt_x_rad = 0, tilt_y_rad = 0 }\n'),
}


def diagnosed(options, name, truth, effect):
    folder = os.path.join(options.folder, name.replace(" ", "_"))
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    for run in range(FLIGHTS):
        fly(truth, 61, flights, run)
    model = model_with_lag(options.model, folder, effect)
    return asked(options.tool, ["diagnose", model, flights], os.path.join(folder, "diagnose.json"))


def main():
    options = argument_parser().parse_args()
    chosen = [name for name in options.effects.split(",") if name] or list(SIGNALS)
    failed = 0
    for name in chosen:
        words, effect = SIGNALS[name]["words"], SIGNALS[name].get("effect", "")
        result = diagnosed(options, name, SIGNALS[name]["truth"], effect)
        said = [problem.split(SAYS)[1] for problem in result["problems"] if SAYS in problem]
        right = said == [] if words is None else len(said) == 1 and said[0].startswith(words)
        faults = [] if right else [f"says {said}"]
        faults += [f"named {entry['effect']}" for entry in result["ranking"]]
        if result["verdict"] != ("nothing_missing" if words is None or effect else "unexplained"):
            faults.append(f"verdict {result['verdict']}")
        failed += bool(faults)
        print(("! " if faults else "  ") + json.dumps({"case": name, "faults": faults, "said": said}), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
