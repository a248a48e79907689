"""Checks that 90 % intervals contain the truth in nine of ten cases: thrust ratio, drag and motor lag, fitted together
to flights of the foreign simulator, from still air to gusts as large as the effects.

Usage: foreign_coverage.py TOOL MODEL FOLDER [--cases N] [--gusts N,N,...] [--first-seed N]
Prints the coverage of each parameter and gust. Exits with 1 if the coverage over all quiet flights is outside
LEAST_OF_ALL .. MOST_OF_ALL, or if that of a parameter is below LEAST_HELD for the quiet or for the loud ones.
"""

import argparse
import collections
import math
import os
import random
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import asked  # noqa: E402
from foreign_simulator import ROTOR_LAG_S, STEP_S, fly  # noqa: E402

TRUTHS = {"ratio": 0.95, "drag_N_s_m": 0.02, "tau_s": ROTOR_LAG_S}
EFFECTS = "thrust_ratio,drag_linear,motor_lag"
GUST_S = 1.0  # correlation time of the gusts
MOST_OF_QUIET_N = 0.005
LEAST_HELD, LEAST_OF_ALL, MOST_OF_ALL = 0.8, 0.85, 0.98


def gusty_drag(gust_N, seed):
    """Returns linear drag plus a Gauss-Markov force along each axis."""
    rng = random.Random(seed)
    keep = math.exp(-STEP_S / GUST_S)
    gust = [gust_N * rng.gauss(0, 1) for _ in range(3)]

    def force(s):
        for i in range(3):
            gust[i] = keep * gust[i] + math.sqrt(1 - keep * keep) * gust_N * rng.gauss(0, 1)
        return tuple(gust[i] - TRUTHS["drag_N_s_m"] * s.v[i] for i in range(3))
    return force


def fitted(options, gust_N, seed):
    folder = os.path.join(options.folder, f"{seed}")
    shutil.rmtree(folder, ignore_errors=True)
    flights = os.path.join(folder, "flights")
    truth = dict(force=gusty_drag(gust_N, seed), rotor=lambda s, k, f: TRUTHS["ratio"] * f)
    fly(truth, seed, flights)
    result = asked(options.tool, ["add", EFFECTS, "--keep-anyway", "--model", options.model, flights, "-o",
                                  os.path.join(folder, "fitted.toml")], os.path.join(folder, "add.json"))
    shutil.rmtree(folder)
    return {name: value for effect in result["effects"] for name, value in effect["parameters"].items()}


def share(held):
    return f"{sum(held)} of {len(held)}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("model")
    parser.add_argument("folder")
    parser.add_argument("--cases", type=int, default=12, help="flights for each gust")
    parser.add_argument("--gusts", default="0,0.003,0.005,0.01,0.02")
    parser.add_argument("--first-seed", type=int, default=7000)
    options = parser.parse_args()
    quiet, loud = collections.defaultdict(list), collections.defaultdict(list)
    for number, gust_N in enumerate(float(x) for x in options.gusts.split(",")):
        of_gust = collections.defaultdict(list)
        for case in range(options.cases):
            parameters = fitted(options, gust_N, options.first_seed + number * max(100, options.cases) + case)
            for name, truth in TRUTHS.items():
                lower, upper = parameters[name]["interval_90"]
                of_gust[name].append(lower <= truth <= upper)
        for name, held in of_gust.items():
            print(f"gust {gust_N:.3f} N, {name}: {share(held)}", flush=True)
            (quiet if gust_N <= MOST_OF_QUIET_N else loud)[name] += held
    narrow = [name for of in (quiet, loud) for name, held in of.items() if sum(held) < LEAST_HELD * len(held)]
    for words, of in (("quiet", quiet), ("loud", loud)):
        for name, held in of.items():
            print(f"{words}, {name}: {share(held)}")
    every = [held for name in quiet for held in quiet[name]]
    print(f"quiet, all: {share(every)}; too narrow: {narrow}")
    fits = LEAST_OF_ALL * len(every) <= sum(every) <= MOST_OF_ALL * len(every)
    return 1 if narrow or not fits else 0


if __name__ == "__main__":
    sys.exit(main())
