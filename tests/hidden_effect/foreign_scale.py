"""Checks that the thrust scale of `diagnose` holds in its interval: alone, beside effects that are found, and beside
forces that nothing explains, where none may be stated.

Usage: foreign_scale.py TOOL MODEL FOLDER
Prints a line per case; exits with 1 if a stated 99 % interval misses the truth, or if none is stated beside a found
effect or where nothing is missing.
"""

import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import argument_parser, asked, model_with_lag  # noqa: E402
from foreign_effects import EFFECTS  # noqa: E402
from foreign_names import is_inside, WIDER  # noqa: E402
from foreign_simulator import fly  # noqa: E402

FLIGHTS, SEED = 3, 901

# truth: as accepted by foreign_simulator.fly(); scale: the true one; is_explained: whether the tool knows the effect
CASES = {
    "nothing": dict(truth={}, scale=1, is_explained=True),
    "ratio": dict(truth=dict(rotor=lambda s, k, f: 0.93 * f), scale=0.93, is_explained=True),
    "drag": dict(truth=dict(force=lambda s: tuple(-0.03 * v for v in s.v)), scale=1, is_explained=True),
    "thermal": dict(truth=dict(force=EFFECTS["thermal"]["force"]), scale=1, is_explained=True),
    "suction": dict(truth=dict(force=lambda s: (0, 0, -0.05 * math.exp(-s.p[2] / 0.3))), scale=1),
    "lift of speed": dict(truth=dict(force=EFFECTS["lift of speed"]["force"]), scale=1),
}


def stated_scale(options, name, truth):
    folder = os.path.join(options.folder, name.replace(" ", "_"))
    shutil.rmtree(folder, ignore_errors=True)
    flights = os.path.join(folder, "flights")
    for run in range(FLIGHTS):
        fly(truth, SEED, flights, run)
    result = asked(options.tool, ["diagnose", model_with_lag(options.model, folder), flights],
                   os.path.join(folder, "diagnose.json"))
    if not options.keep:
        shutil.rmtree(folder)
    return next((kind["thrust_scale"] for kind in result["kinds"] if "thrust_scale" in kind), None)


def main():
    options = argument_parser().parse_args()
    failed = 0
    for name, case in CASES.items():
        stated = stated_scale(options, name, case["truth"])
        holds = is_inside(stated, case["scale"], WIDER) if stated else not case.get("is_explained", False)
        failed += not holds
        print(("  " if holds else "! ") + json.dumps({"case": name, "stated": stated}), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
