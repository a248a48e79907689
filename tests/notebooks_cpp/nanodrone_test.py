"""Held-out kinds of NanoDrone flights are predicted as the guide says.

nanodrone_test.py TOOL SCRIPT GUIDE FLIGHTS FOLDER
"""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

SKIPPED, TOLERANCE = 77, 0.03


def rows_of(lines, separator):
    """Returns the four numbers of each row by its first words."""
    rows = {}
    for line in lines:
        cells = [cell.strip() for cell in re.split(separator, line.strip().strip("|"))]
        if len(cells) == 5 and re.fullmatch(r"[\d.]+", cells[1]):
            rows[cells[0].replace(" held out", "")] = [float(cell) for cell in cells[1:]]
    return rows


def main():
    tool, script, guide, flights, folder = sys.argv[1:]
    if not os.path.isdir(flights):
        print(f"skipped: {flights} is absent")
        return SKIPPED
    shutil.rmtree(folder, ignore_errors=True)
    environment = dict(os.environ, PATH=f"{Path(tool).parent}:{os.environ['PATH']}")
    run = subprocess.run([sys.executable, script, flights, "-o", folder], env=environment, check=True,
                         capture_output=True, text=True)
    print(run.stdout)
    measured = rows_of(run.stdout.splitlines(), r"\s{2,}")
    stated = rows_of(Path(guide).read_text().splitlines(), r"\|")
    assert len(measured) == 5, measured
    for name, numbers in measured.items():
        for number, wanted in zip(numbers, stated[name]):
            assert abs(number - wanted) <= TOLERANCE * wanted, (name, numbers, stated[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
