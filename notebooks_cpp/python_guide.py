"""Runs a guide in percent format and renders it to .ipynb.

    python_guide.py check GUIDE.py GUIDE.ipynb SOURCE_FOLDER    a fresh run must print what is committed
    python_guide.py update GUIDE.py GUIDE.ipynb SOURCE_FOLDER   writes the notebook

Exit code 77, which ctest takes as skipped, where matplotlib or pandas is missing.
"""

import ast
import base64
import contextlib
import io
import json
import os
import re
import sys
import tempfile

try:
    import matplotlib
    import pandas  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

#: Numbers agree to this much; the last digits depend on the processor's linear algebra.
TOLERANCE = 0.05


def cells_of(text):
    """("markdown" or "code", lines) of each cell."""
    cells = []
    for line in text.splitlines():
        if line.startswith("# %%"):
            cells.append(("markdown" if "[markdown]" in line else "code", []))
        else:
            cells[-1][1].append(line)
    for kind, lines in cells:
        while lines and not lines[-1]:
            lines.pop()
        yield kind, [re.sub("^# ?", "", line) for line in lines] if kind == "markdown" else lines


def pictures():
    """PNG of each open figure."""
    for number in plt.get_fignums():
        file = io.BytesIO()
        plt.figure(number).savefig(file, format="png", dpi=80, bbox_inches="tight", metadata={"Software": None})
        yield base64.b64encode(file.getvalue()).decode()
    plt.close("all")


def run(lines, names):
    """Standard output of a cell."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.parse("\n".join(lines)), "cell", "exec"), names)
    return printed.getvalue()


def with_ends(lines):
    return [line + "\n" for line in lines[:-1]] + lines[-1:]


def notebook_of(text):
    names = {}
    cells = []
    for kind, lines in cells_of(text):
        cell = {"cell_type": kind, "id": f"cell-{len(cells)}", "metadata": {}, "source": with_ends(lines)}
        if kind == "code":
            printed = run(lines, names)
            outputs = []
            if printed:
                outputs.append({"name": "stdout", "output_type": "stream", "text": printed.splitlines(keepends=True)})
            for png in pictures():
                outputs.append(
                    {"data": {"image/png": png}, "metadata": {}, "output_type": "display_data"}
                )
            cell.update(execution_count=sum(c["cell_type"] == "code" for c in cells) + 1, outputs=outputs)
        cells.append(cell)
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"file_extension": ".py", "name": "python"}}
    return {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def same(a, b):
    """Equal texts, where numbers may differ by TOLERANCE."""
    number = r"-?\d+(?:\.\d+)?"
    if re.sub(r"\s+", " ", re.sub(number, "#", a)) != re.sub(r"\s+", " ", re.sub(number, "#", b)):
        return False
    pairs = zip(map(float, re.findall(number, a)), map(float, re.findall(number, b)))
    return all(abs(x - y) <= TOLERANCE * max(abs(x), abs(y), 1) for x, y in pairs)


def differences(fresh, committed):
    if len(fresh["cells"]) != len(committed["cells"]):
        yield "another number of cells"
    for new, old in zip(fresh["cells"], committed["cells"]):
        if new["source"] != old["source"]:
            yield f"{new['id']}: another source:\n{''.join(new['source'])}"
            continue
        texts = ["".join("".join(o.get("text", [])) for o in cell.get("outputs", [])) for cell in (new, old)]
        if not same(*texts):
            yield f"{new['id']} prints\n{texts[0]}\nand is committed with\n{texts[1]}"
        counts = [sum("data" in o for o in cell.get("outputs", [])) for cell in (new, old)]
        if counts[0] != counts[1]:
            yield f"{new['id']} has {counts[0]} pictures, committed {counts[1]}"


def main():
    verb, guide, notebook, source = sys.argv[1], *map(os.path.abspath, sys.argv[2:5])
    with tempfile.TemporaryDirectory(prefix="swarmcert-guide-") as folder:
        os.chdir(folder)
        for name in ("nn", "controller", "stability"):
            os.symlink(os.path.join(source, name), name)
        with open(guide, encoding="utf-8") as file:
            fresh = notebook_of(file.read())
        os.chdir("/")
    if verb == "update":
        with open(notebook, "w", encoding="utf-8") as file:
            json.dump(fresh, file, indent=1, ensure_ascii=False)
            file.write("\n")
        return 0
    with open(notebook, encoding="utf-8") as file:
        found = list(differences(fresh, json.load(file)))
    print("\n".join(found))
    return 1 if found else 0


sys.exit(main())
