"""Scores `study` on the NanoDrone benchmark, and writes its predictions.

nanodrone.py TRAINING [TEST] -o FOLDER [--mass KG]

TRAINING and TEST are folders of the benchmark's CSV files. A model is drafted from the training flights and given to
`study`; with the fitted model every test flight is predicted from each of its records over 50 steps, with the rotor
speeds that the log holds: FOLDER/predictions/FLIGHT.npy, float32, [starts x 50 x 13], x y z vx vy vz qx qy qz qw wx wy
wz. Without TEST, each kind of flight (the name up to the first underscore) is held out in turn.

Printed are the means over flights of the errors summed over the steps: position in m, velocity in m/s, rotation in rad,
body rate in rad/s.
"""
import argparse
import json
import subprocess
from pathlib import Path

ERRORS = ("position_m", "velocity_m_s", "rotation_rad", "rate_rad_s")


def swarmcert(*words):
    subprocess.run(["swarmcert", *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def predict(training, test, mass_kg, folder):
    """Fits a model to the flights `training`, predicts the flights `test`, and returns their errors by flight."""
    folder.mkdir(parents=True)
    model, fitted, result = folder / "draft.toml", folder / "study" / "fitted.toml", folder / "errors.json"
    swarmcert("model", "draft", *training, "--mass", mass_kg, "-o", model)
    swarmcert("study", model, *training, "-o", folder / "study")
    swarmcert("compare", fitted if fitted.exists() else model, *test, "--horizon", 0.5,
              "--predictions", folder / "predictions", "--json", result)
    return json.loads(result.read_text())["prediction"]["flights"]


def print_row(name, flights):
    means = [sum(flight[key]["sum"] for flight in flights) / len(flights) for key in ERRORS]
    print(f"{name:24s}" + "".join(f"{mean:10.3f}" for mean in means), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("training", type=Path)
    parser.add_argument("test", type=Path, nargs="?")
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    parser.add_argument("--mass", type=float, default=0.045, help="kg, as published")
    arguments = parser.parse_args()
    if arguments.folder.exists():
        parser.error(f"{arguments.folder} exists; name a new folder")
    flights = sorted(arguments.training.glob("*.csv"))
    if not flights:
        parser.error(f"{arguments.training} has no CSV files")
    print(f"{'':24s}" + "".join(f"{name.split('_')[0]:>10s}" for name in ERRORS))
    if arguments.test:
        test = sorted(arguments.test.glob("*.csv"))
        print_row("test flights", predict(flights, test, arguments.mass, arguments.folder))
        return
    everything = []
    for kind in sorted({flight.name.split("_")[0] for flight in flights}):
        held_out = [flight for flight in flights if flight.name.startswith(kind + "_")]
        others = [flight for flight in flights if flight not in held_out]
        errors = predict(others, held_out, arguments.mass, arguments.folder / kind)
        print_row(f"{kind} held out", errors)
        everything += errors
    print_row("mean over flights", everything)


if __name__ == "__main__":
    main()
