"""Two vehicles disturb each other; the logs' clocks differ, and no start of a set point tells by how much.

Usage: foreign_clocks.py TOOL MODEL FOLDER [--seeds FROM:TO]
Exits 1 where an offset is not found within its interval (widened by half, as the test is of few cases), or one is
claimed where there is none or only a wake that arrives late, or a lag of the thrust is named, which no flight has.
"""

import json
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import argument_parser, asked, model_with_lag  # noqa: E402
from foreign_names import is_inside, late_wake  # noqa: E402
from foreign_simulator import fly  # noqa: E402

# By how much the second clock is ahead, and how late wakes arrive, s.
CASES = [(0.15, 0.0), (-0.1, 0.0), (0.2, 0.15), (0.0, 0.2), (0.0, 0.0)]
# Flights that begin in mid air: seed, when the logs begin, s. Thrust that answers the wakes looks like a lag.
MID_AIR = [(922, 5.0), (929, 6.0)]
LAGS = {"delay", "motor_lag", "sensor_delay"}
LEAST_OFFSET_S = 0.06  # below it the interval may hold zero


def case(options, seed, ahead_s, delay_s, from_s=4.0):
    folder = os.path.join(options.folder, f"{seed}_{ahead_s}_{delay_s}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    truth = dict(force=late_wake(0.09, delay_s, 0.06, 0.06), clocks_s=(0.0, ahead_s), from_s=from_s)
    first_s, second_s = fly(truth, seed, flights, vehicles=2, duration_s=45.0)
    result = asked(options.tool, ["diagnose", model_with_lag(options.model, folder), flights],
                   os.path.join(folder, "result.json"))
    offset_s = second_s - first_s
    found = [entry["parameters"]["offset_s"] for entry in result["ranking"] if entry["effect"] == "clock_offset"]
    lags = [entry["effect"] for entry in result["ranking"] if entry["effect"] in LAGS]
    inside = all(is_inside(one, offset_s, 1.5) for one in found)
    right = not lags and inside and len(found) <= 1 and (found or abs(offset_s) < LEAST_OFFSET_S)
    print(json.dumps({"seed": seed, "offset_s": offset_s, "delay_s": delay_s, "found": found,
                      "lags": lags, "right": bool(right)}))
    return right


def main():
    parser = argument_parser()
    parser.add_argument("--seeds", default="1:2")
    options = parser.parse_args()
    first, last = (int(seed) for seed in options.seeds.split(":"))
    right = [case(options, 100 * seed + k, *one) for seed in range(first, last) for k, one in enumerate(CASES)]
    right += [case(options, seed, 0.0, 0.2, from_s) for seed, from_s in MID_AIR]
    if not options.keep:
        shutil.rmtree(options.folder, ignore_errors=True)
    print(f"{sum(map(bool, right))} of {len(right)} right")
    return 0 if all(right) else 1


if __name__ == "__main__":
    sys.exit(main())
