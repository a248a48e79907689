"""Vehicles disturb one another; the clocks of their logs differ, and no common start of a setpoint shows by how much.

Usage: foreign_clocks.py TOOL MODEL FOLDER [--seeds FROM:TO] [--fleets]
Exits with 1 if an offset is not found within its interval (widened by half, because there are few cases), if one is
claimed although there is none or only a delayed wake, or if a lag of the thrust is reported, which no flight has.
--fleets: three and four vehicles with random clocks instead of two. --add: also checks that `add` and `study` read
three logs with corrected clocks: a fitted wake then leaves as little as with equal clocks.
"""

import json
import os
import random
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import argument_parser, asked, model_with_lag  # noqa: E402
from foreign_names import is_inside, late_wake  # noqa: E402
from foreign_simulator import fly  # noqa: E402

# How far the second clock is ahead, and the delay of wakes, s.
CASES = [(0.15, 0.0), (-0.1, 0.0), (0.2, 0.15), (0.0, 0.2), (0.0, 0.0)]
# Flights that begin in the air: seed, start of the logs, s. Thrust that reacts to wakes looks like a lag.
MID_AIR = [(922, 5.0), (929, 6.0)]
# Fleets in which two clocks are on either side of the middle one, or in which delayed wakes looked like a small delay:
# seed from which the clocks are drawn (None: all equal), vehicles, delay of the wakes, s.
FLEETS = [(215, 204, 4, 0.15), (113, None, 3, 0.2)]
# Clocks that differ by more than the range of the search: seed, clocks, s, whether the offsets must be found.
FAR = [(1003, (0.0, -2.81), True), (1010, (0.0, 2.81, -4.11), True), (1008, (0.0, 2.07, -3.37, 4.67), False)]
LAGS = {"delay", "motor_lag", "sensor_delay"}
LEAST_OFFSET_S = 0.06  # below this the interval may contain zero


def right_offset(entry, ahead_s):
    """Returns whether the interval contains the offset relative to the clock named in the entry."""
    offset_s = ahead_s[entry["vehicle"]] - ahead_s[entry["against"]]
    return is_inside(entry["parameters"]["offset_s"], offset_s, 1.5)


def missed(found, ahead_s):
    """Returns vehicles whose clock differs detectably from the middle one and is not found."""
    middle = found[0]["against"] if found else sorted(ahead_s, key=ahead_s.get)[(len(ahead_s) - 1) // 2]
    named = [entry["vehicle"] for entry in found]
    return [v for v in ahead_s if v not in named and abs(ahead_s[v] - ahead_s[middle]) >= LEAST_OFFSET_S]


def case(options, seed, clocks_s, delay_s, from_s=4.0, must_be_found=True):
    folder = os.path.join(options.folder, f"{seed}_{len(clocks_s)}_{delay_s}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    truth = dict(force=late_wake(0.09, delay_s, 0.06, 0.06), clocks_s=clocks_s, from_s=from_s)
    offsets_s = fly(truth, seed, flights, vehicles=len(clocks_s), duration_s=45.0)
    ahead_s = {f"cf{k + 1}": offset_s for k, offset_s in enumerate(offsets_s)}
    result = asked(options.tool, ["diagnose", model_with_lag(options.model, folder), flights],
                   os.path.join(folder, "result.json"))
    found = [entry for entry in result["ranking"] if entry["effect"] == "clock_offset"]
    lags = [entry["effect"] for entry in result["ranking"] if entry["effect"] in LAGS]
    inside = all(right_offset(entry, ahead_s) for entry in found)
    lost = missed(found, ahead_s)
    right = not lags and inside and not (must_be_found and lost)
    print(json.dumps({"seed": seed, "ahead_s": ahead_s, "delay_s": delay_s, "found": [e["statement"] for e in found],
                      "inside": inside, "missed": lost, "lags": lags, "right": right}), flush=True)
    return right


def random_clocks(seed, vehicles, largest_s=0.2):
    """Draws clocks whose differences are within the range of the search."""
    rng = random.Random(seed)
    return tuple(rng.uniform(-largest_s / 2, largest_s / 2) for _ in range(vehicles))


def fleets(options, seed):
    cases = []
    for vehicles in (3, 4):
        clocks_s = random_clocks(100 * seed + vehicles, vehicles)
        cases += [(clocks_s, 0.0), (clocks_s, 0.15), ((0.0,) * vehicles, 0.0), ((0.0,) * vehicles, 0.2)]
    return [case(options, 100 * seed + 10 + k, *one) for k, one in enumerate(cases)]


def added(options, name, seed, clocks_s):
    """Returns the clock offsets found by `add`, the remainder after the fitted wake, and the offsets found by
    `study`."""
    folder = os.path.join(options.folder, name)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights, model = os.path.join(folder, "flights"), model_with_lag(options.model, folder)
    fly(dict(force=late_wake(0.09, 0.0, 0.06, 0.06), clocks_s=clocks_s, from_s=4.0), seed, flights,
        vehicles=len(clocks_s), duration_s=45.0)
    result = asked(options.tool, ["add", "downwash", "--model", model, flights, "-o", os.path.join(folder, "new.toml")],
                   os.path.join(folder, "add.json"))
    study = asked(options.tool, ["study", model, flights, "-o", os.path.join(folder, "study")],
                  os.path.join(folder, "study.json"))
    of_study = [entry["statement"] for entry in study["ranking"] if entry["effect"] == "clock_offset"]
    return [entry["statement"] for entry in result["clock_offsets"]], of_study, result["ladder"][-1]["fit_rmse"]


def adds_with_clocks_corrected(options, seed):
    alike = added(options, "alike", seed, (0.0, 0.0, 0.0))
    apart = added(options, "apart", seed, (0.0, 0.12, -0.05))
    right = not alike[0] and len(apart[0]) > 0 and apart[0] == apart[1] and apart[2] < 1.1 * alike[2]
    print(json.dumps({"seed": seed, "alike": alike, "apart": apart, "right": right}), flush=True)
    return right


def main():
    parser = argument_parser()
    parser.add_argument("--seeds", default="1:2")
    parser.add_argument("--fleets", action="store_true")
    parser.add_argument("--add", action="store_true")
    options = parser.parse_args()
    first, last = (int(seed) for seed in options.seeds.split(":"))
    right = []
    for seed in range(first, last):
        if options.add:
            right.append(adds_with_clocks_corrected(options, 100 * seed + 30))
        elif options.fleets:
            right += fleets(options, seed)
        else:
            right += [case(options, 100 * seed + k, (0.0, ahead_s), delay_s)
                      for k, (ahead_s, delay_s) in enumerate(CASES)]
    if not options.fleets and not options.add:
        right += [case(options, seed, (0.0, 0.0), 0.2, from_s) for seed, from_s in MID_AIR]
        right += [case(options, seed, random_clocks(clocks, vehicles) if clocks else (0.0,) * vehicles, delay_s)
                  for seed, clocks, vehicles, delay_s in FLEETS]
        right += [case(options, seed, clocks_s, 0.0, must_be_found=must) for seed, clocks_s, must in FAR]
    if not options.keep:
        shutil.rmtree(options.folder, ignore_errors=True)
    print(f"{sum(map(bool, right))} of {len(right)} right")
    return 0 if all(right) else 1


if __name__ == "__main__":
    sys.exit(main())
