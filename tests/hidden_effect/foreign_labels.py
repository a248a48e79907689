"""Logs of two vehicles with the setpoints, path, sensors or name of the other one, and wrong kinds.

Usage: foreign_labels.py TOOL MODEL FOLDER [--effects CASE,...] [--seeds FROM:TO]
Exits with 1 if a mislabelled stream is not found, is found in another log or as something else, or if a thrust scale
would explain it equally well and no rival is listed; and if anything is found in correctly labelled flights.
"""

import json
import math
import os
import shutil
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from foreign_campaign import argument_parser, asked, model_with_lag  # noqa: E402
from foreign_names import late_wake  # noqa: E402
from foreign_simulator import GRAVITY, MASS_KG, RECORD, VARIABLES, fly, rotor_N, usd_file  # noqa: E402
import foreign_simulator as light  # noqa: E402

FLIGHTS = 3
SET_POINTS = [name for name in VARIABLES if name.startswith("ctrltarget")]
PATH = [f"stateEstimateZ.{axis}(h)" for axis in ("x", "y", "z", "vx", "vy", "vz")]
SENSORS = [name for name in VARIABLES
           if name.startswith(("stateEstimateZ.a", "stateEstimateZ.q", "stateEstimateZ.rate", "pwm", "pm"))]
# The other kind hovers at another duty: its mass, and its thrust map in gram-force. One has the curve of the light
# vehicle's map at another scale; one depends only on the duty.
HEAVY_KG = 0.05
MAP = {name.lower(): getattr(light, name) for name in ("C00", "C10", "C01", "C20", "C11")}
SCALED_MAP = {name: 2.6 * value for name, value in MAP.items()}
OTHER_MAP = {"c00": 0.0, "c10": 0.0, "c01": 0.0, "c20": 70.0, "c11": 0.0}


def duty_of(thrust_map, force_N, battery_V):
    v = battery_V / 4.2
    a, b = thrust_map["c20"], thrust_map["c10"] + thrust_map["c11"] * v
    c = thrust_map["c00"] + thrust_map["c01"] * v - force_N / (1e-3 * GRAVITY)
    return max(0.0, (-b + math.sqrt(max(b * b - 4 * a * c, 0.0))) / (2 * a))


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    at = 1
    for _ in VARIABLES:
        at = data.index(b",", at) + 1
    at += 4
    records = []
    while at < len(data):
        for k in range(data[at]):
            records.append(list(struct.unpack_from(RECORD, data, at + 1 + k * struct.calcsize(RECORD))))
        at += 1 + data[at] * struct.calcsize(RECORD) + 4
    return records


def write(path, records):
    with open(path, "wb") as file:
        file.write(usd_file([struct.pack(RECORD, *record) for record in records]))


def exchange(flights, run, names):
    """Returns the columns `names` of the logs of both vehicles."""
    paths = [os.path.join(flights, f"cf{k}_{run:02d}") for k in (1, 2)]
    first, second = (read(path) for path in paths)
    for one, other in zip(first, second):
        for k in (VARIABLES.index(name) for name in names):
            one[k], other[k] = other[k], one[k]
    for path, records in zip(paths, (first, second)):
        write(path, records)


def exchange_names(flights, run):
    first, second = (os.path.join(flights, f"cf{k}_{run:02d}") for k in (1, 2))
    os.rename(first, first + ".other")
    os.rename(second, first)
    os.rename(first + ".other", second)


def make_heavy(flights, run, thrust_map):
    """Makes the second vehicle, with the same motion, heavier, with rotors of this map."""
    path = os.path.join(flights, f"cf2_{run:02d}")
    records = read(path)
    battery = VARIABLES.index("pm.vbatMV(H)")
    for record in records:
        battery_V = 1e-3 * record[battery]
        for k in (VARIABLES.index(f"pwm.m{motor}_pwm(I)") for motor in (1, 2, 3, 4)):
            force_N = rotor_N(record[k] / 65535, battery_V)
            record[k] = int(65535 * duty_of(thrust_map, force_N * HEAVY_KG / MASS_KG, battery_V) + 0.5)
    write(path, records)


def heavy_model(model, folder, thrust_map):
    """Like `model`, for the kind "heavy"."""
    with open(model) as file:
        lines = file.read().split("\n")
    for i, line in enumerate(lines):
        name = line.split(" = ")[0]
        if name == "kind":
            lines[i] = 'kind = "heavy"'
        if name == "mass_kg":
            lines[i] = f"mass_kg = {HEAVY_KG}"
        if name in thrust_map:
            lines[i] = f"{name} = {thrust_map[name]}"
    path = os.path.join(folder, "heavy.toml")
    with open(path, "w") as file:
        file.write("\n".join(lines))
    return path


def fleet(folder, model_of):
    path = os.path.join(folder, "flights.toml")
    with open(path, "w") as file:
        file.write('schema = "swarmcert/flights/1"\n')
        for vehicle, model in model_of.items():
            file.write(f'[vehicle.{vehicle}]\nmodel = "{model}"\n')
    return path


def two_kinds(options, folder, wrong, thrust_map):
    """`wrong`: vehicles with a wrong kind in flights.toml."""
    small = model_with_lag(options.model, folder)
    heavy = heavy_model(small, folder, thrust_map)
    models = {"cf1": small, "cf2": heavy}
    for vehicle in wrong:
        models[vehicle] = heavy if models[vehicle] == small else small
    return [small, heavy, "--flights", fleet(folder, models)]


def streams(names, runs):
    def prepare(options, folder, flights):
        for run in runs:
            exchange(flights, run, names)
        return [model_with_lag(options.model, folder)]
    return prepare


def names_of_one_kind(options, folder, flights):
    exchange_names(flights, 1)
    return [model_with_lag(options.model, folder)]


def kinds(names_of_runs=(), wrong=(), thrust_map=None, stronger=1.0):
    """`stronger`: ratio of the rotor thrust to the map of the model."""
    of_model = thrust_map or SCALED_MAP

    def prepare(options, folder, flights):
        for run in range(FLIGHTS):
            make_heavy(flights, run, {name: stronger * value for name, value in of_model.items()})
        for run in names_of_runs:
            exchange_names(flights, run)
        return two_kinds(options, folder, wrong, of_model)
    return prepare


# How flights are corrupted; found: vehicle, owner of the stream, a word of the finding; affected flights; rivals.
CASES = {
    "set points": dict(prepare=streams(SET_POINTS, [1]),
                       found=[("cf1", "cf2", "set points"), ("cf2", "cf1", "set points")]),
    "path": dict(prepare=streams(PATH, [1]), found=[("cf1", "cf2", "path in"), ("cf2", "cf1", "path in")]),
    "sensors": dict(prepare=streams(SENSORS, [1]), found=[("cf1", "cf2", "sensors"), ("cf2", "cf1", "sensors")]),
    "names of one kind": dict(prepare=names_of_one_kind, found=[]),  # not detectable
    "names of two kinds": dict(prepare=kinds(names_of_runs=[1]),
                               found=[("cf1", "cf2", "log of"), ("cf2", "cf1", "log of")], no_names=["thrust_ratio"]),
    "kind": dict(prepare=kinds(wrong=["cf1"]), found=[("cf1", "small", "flies as")], rivals=["thrust_ratio"]),
    # Without wakes the curve shows that no scale can explain it.
    "kind of another curve": dict(calm=True, prepare=kinds(wrong=["cf2"], thrust_map=OTHER_MAP),
                                  found=[("cf2", "heavy", "flies as")], no_names=["thrust_ratio"]),
    "two kinds labelled well": dict(prepare=kinds(), found=[]),
    # Not the other kind: rotors that give a third more than in their model.
    "stronger rotors": dict(prepare=kinds(stronger=1.35), found=[], names=["thrust_ratio"]),
}


def case(options, name, seed):
    folder = os.path.join(options.folder, f"{name.replace(' ', '_')}_{seed}")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    flights = os.path.join(folder, "flights")
    expected = CASES[name]
    truth = {} if "calm" in expected else dict(force=late_wake(0.05, 0.1, 0.06, 0.06))
    for run in range(FLIGHTS):
        fly(truth, seed, flights, run, vehicles=2)
    words = expected["prepare"](options, folder, flights)
    result = asked(options.tool, ["diagnose", *words, flights], os.path.join(folder, "result.json"))
    found = [entry for entry in result["ranking"] if entry["effect"] == "mislabelled"]
    others = [entry["effect"] for entry in result["ranking"] if entry["effect"] != "mislabelled"]
    told = sorted((entry["vehicle"], entry["against"]) for entry in found)
    right = told == sorted((vehicle, against) for vehicle, against, _ in expected["found"])
    right = right and all(any(word in entry["statement"] for entry in found) for *_, word in expected["found"])
    right = right and all(entry["confounded_with"][:1] == expected.get("rivals", []) for entry in found)
    right = right and not set(others) & set(expected.get("no_names", []))
    right = right and set(expected.get("names", [])) <= set(others)
    print(("  " if right else "! ") + json.dumps(
        {"case": name, "seed": seed, "found": [entry["statement"] for entry in found], "others": others}), flush=True)
    if not options.keep:
        shutil.rmtree(folder)
    return right


def main():
    parser = argument_parser()
    parser.add_argument("--seeds", default="1:2")
    options = parser.parse_args()
    first, last = (int(seed) for seed in options.seeds.split(":"))
    chosen = [name for name in options.effects.split(",") if name] or list(CASES)
    right = [case(options, name, seed) for name in chosen for seed in range(first, last)]
    print(f"{sum(right)} of {len(right)} right")
    return 0 if all(right) else 1


if __name__ == "__main__":
    sys.exit(main())
