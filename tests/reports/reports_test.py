"""Checks the report of each command in a browser: reports_test.py TOOL SOURCE_FOLDER SCREENSHOTS [AXE]

SCREENSHOTS is a folder for images of the top of each page at three widths. AXE is axe.min.js of the npm package
axe-core; without it only the names of controls and headings are checked.

Exits with 77 (skipped) without Chromium. First, a good report is damaged in each way that the browser must detect.
"""

import base64
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile

import browser

# A folder, a subfolder and a prefix of logs with names chosen by an attacker. `touch` would leave a file behind.
HOSTILE = ["a'b\"c`touch pwned`$(touch pwned)<", "script><script>window.pwned=1<",
           "script><img src=x onerror=alert(1)>"]
HOSTILE_KIND = "k'\\\"`touch pwned`$(touch pwned)</script><script>window.pwned=1</script><!--]]>\\n"


class Reports:
    def __init__(self, tool, source, folder):
        self.tool, self.source, self.folder = tool, source, folder
        self.pages = {}

    def run(self, *words, expect=(0,)):
        words = [self.tool, *map(str, words), "-q"]
        done = subprocess.run(words, cwd=self.folder, capture_output=True, text=True, errors="replace")
        if done.returncode not in expect:
            sys.exit(f"exit code {done.returncode}: {' '.join(words)}\n{done.stdout}{done.stderr}")
        return done

    def report(self, name, *words, expect=(0,)):
        self.run(*words, "--report", f"report {name}", expect=expect)
        self.pages[name] = self.folder / f"report {name}" / "report.html"

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return name


def network_with_hostile_kinds(r):
    """The demo network with a kind whose name is markup, shell and gnuplot code at once."""
    demo = r.source / "nn/networks/demo"
    text = (demo / "network.toml").read_text()
    kind = f'"{HOSTILE_KIND}"'
    for part in ("phi", "rho"):
        text = re.sub(rf"\[{part}\.[a-z]+\]", lambda _: f"[{part}.{kind}]", text)
    text = re.sub(r'weights = "', f'weights = "{demo}/', text)
    return r.write("hostile.toml", text)


def hostile_policy(r):
    """A release that passes one check and fails one, with hostile file names."""
    demo, flights = r.source / "nn/networks/demo", pathlib.Path(*HOSTILE)
    model = r.source / "stability/models/crazyflie-small.toml"
    gains = r.source / "controller/gains/crazyflie-small.toml"
    named = r.folder / "gains'`touch pwned`<img src=x onerror=alert(3)>.toml"
    named.write_text(gains.read_text())
    return r.write("policy.toml", f"""schema = "swarmcert/policy/1"
[release]
network = {json.dumps(str(demo / "network.toml"))}
gains = {json.dumps(str(named))}
model = "{model}"
flights = [{json.dumps(str(flights))}]
logs = 4
[spectral_norms]
[tracking]
over = "corners"
amplitude_N = 0.1
guard_factor = 1
max_error_m = 1e-3
[residual]
max_rmse_N = 1
""")


def thrust_table(r):
    seeded = random.Random(1)
    lines = ["pwm[ratio],vbat[V],thrust_gf"]
    for _ in range(300):
        p, volt = seeded.uniform(0.25, 1), seeded.uniform(3.2, 4.2)
        v = volt / 4.2
        gf = 11.09 - 39.08 * p - 9.53 * v + 20.57 * p * p + 38.43 * p * v
        lines.append(f"{p:.6f},{volt:.5f},{gf + seeded.gauss(0, 0.1):.5f}")
    return r.write("thrust.csv", "\n".join(lines) + "\n")


def make(r):
    """Creates a report of each command that has one."""
    demo = r.source / "nn/networks/demo"
    model = r.source / "stability/models/crazyflie-small.toml"
    gains = r.source / "controller/gains/crazyflie-small.toml"
    composite = r.source / "controller/gains/composite.toml"
    r.report("certify", "certify", demo / "network.toml", "--domain", demo / "box.toml", "--nodes", 1,
             "--range-nodes", 100)
    r.report("certify-hostile", "certify", network_with_hostile_kinds(r), "--nodes", 1, "--method", "product",
             expect=(0, 4))
    r.report("bound", "bound", "--gains", composite, "--model", model, "--amplitude", 0.097, "--impulse", 0.02,
             "--rate", 0.75)
    r.report("bound-sampled", "bound", "--gains", gains, "--model", model, "--amplitude", 0.04)
    r.report("spacing", "spacing", "--gains", gains, "--model", model, "--max-error", 0.1)
    r.report("iss-check", "iss-check", "--gains", composite, "--model", model, "--runs", 10)
    r.report("tune", "tune", "--gains", gains, "--model", model, "--nodes", 50, expect=(0, 4))
    r.report("identify-thrust", "identify-thrust", thrust_table(r))
    grid = r.write("grid.toml", f'''schema = "swarmcert/grid/1"
gains = "{gains}"
model = "{model}"
axis = "z"
compute = ["amplitude", "impulse", "noise_command_m_s2"]
pareto = ["impulse", "noise_command_m_s2"]
[axes]
Kp = {{from = 2, to = 40, steps = 6, scale = "log"}}
Kd = {{from = 0.5, to = 10, steps = 5}}
''')
    r.report("sweep", "sweep", grid, "-o", "sweep")
    flights = pathlib.Path(*HOSTILE)
    for run in range(2):
        r.report(f"simulate-{run}", "simulate", "swap", "--vehicles", 2, "--model", model, "--gains", gains,
                 "--duration", 8, "--seed", run, "--run", run, "-o", r.folder / flights / str(run))
    r.report("compare-hostile", "compare", model, flights)
    r.report("inspect-hostile", "inspect", flights)
    # The same logs with a hostile prefix.
    prefixed = r.folder / "pre\nfixed"
    for log in sorted((r.folder / flights).rglob("cf*")):
        target = prefixed / log.parent.name / ("p`touch pwned`'<img src=x onerror=alert(2)>_" + log.name)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(log.read_bytes())
    r.report("add-hostile", "add", "drag_linear,constant_force", "--model", model, prefixed, "--keep-anyway", "-o",
             "fitted.toml", expect=(0, 4))
    r.report("diagnose-hostile", "diagnose", model, flights, expect=(0, 4))
    r.run("study", model, flights, "-o", "study", expect=(0, 4))
    r.pages["study-hostile"] = r.folder / "study/study.html"
    r.report("train-hostile", "train", model, flights, "--phi", 4, "--rho", 4, "--features", 4, "--epochs", 3, "-o",
             "trained", expect=(0, 4))
    r.report("gate-hostile", "gate", hostile_policy(r), expect=(1,))
    if pwned := [str(p) for p in r.folder.rglob("pwned*")]:
        sys.exit(f"a name ran as a command: {pwned}")


def refuse_full_folders(r):
    """A non-empty folder for a report is refused before anything is read: no input exists here."""
    full = r.folder / "full"
    full.mkdir()
    (full / "thesis.txt").write_text("mine")
    model_and_gains = ["--model", "no.toml", "--gains", "no.toml"]
    for words in (["certify", "no.toml"], ["bound", *model_and_gains], ["spacing", "--max-error", 1, *model_and_gains],
                  ["iss-check", *model_and_gains], ["tune", *model_and_gains], ["identify-thrust", "no.csv"],
                  ["sweep", "no.toml", "-o", "no"], ["merge", "no"], ["compare", "no"], ["diagnose", "no"],
                  ["add", "auto", "--model", "no.toml", "no", "-o", "no.toml"], ["train", "no", "-o", "no"],
                  ["simulate", "hover", "-o", "no", *model_and_gains]):
        done = r.run(*words, "--report", full, expect=(3,))
        if str(full) not in done.stderr or "--force" not in done.stderr:
            sys.exit(f"{words[0]} does not refuse a full report folder before its work: {done.stderr}")
    if os.listdir(full) != ["thesis.txt"]:
        sys.exit("a refused report was written")


def in_drawings(text, change):
    """Returns the page with the source of each figure changed."""
    def changed(match):
        drawing = base64.b64decode(match.group(1)).decode()
        return "data:image/svg+xml;base64," + base64.b64encode(change(drawing).encode()).decode()

    return re.sub(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", changed, text)


def planted(good):
    """Yields a good page damaged in one way, with the kind of fault that must be detected."""
    text = good.read_text()
    policy = re.search(r'<meta http-equiv="Content-Security-Policy"[^>]*>', text).group()
    lax = text.replace(policy, "")
    end = "</body>"
    assert text.count(end) == 1
    drawing = re.search(r"<picture>.*?</picture>", text, re.S).group()
    yield "console", lax.replace(end, "<script>console.error('planted')</script>" + end)
    yield "console", lax.replace(end, "<script>undefined.planted</script>" + end)
    yield "policy", text.replace(end, "<p style='color:red'>planted</p>" + end)
    yield "policy", text.replace(end, "<script>1</script>" + end)
    yield "network", lax.replace(end, "<img src='http://127.0.0.1:9/planted.png'>" + end)
    yield "wide table", re.sub(r'<div class="scroll"[^>]*>', "<div>", text)
    yield "overflow", text.replace(end, "<canvas width='2000'></canvas>" + end)
    yield "missing plot", text.replace(drawing, "")
    yield "empty plot", in_drawings(text, lambda d: d.replace('id="gnuplot_plot_', 'id="gnuplot_other_'))
    yield "small text", in_drawings(text, lambda d: d.replace('font-size="1', 'font-size="0'))
    yield "raw unit", in_drawings(text, lambda d: d.replace("time [s]", "time [m_s]"))
    yield "cut text", in_drawings(text, lambda d: d.replace("<text> 0</text>", f"<text> {80 * 'm'}</text>"))
    label = r'translate\(([0-9.]+),[0-9.]+\)(?=" stroke="none" fill="black" font-family)'
    yield "overlapping text", in_drawings(text, lambda d: re.sub(label, r"translate(\1,200)", d))
    yield "contrast", in_drawings(text, lambda d: d.replace('fill="black"', 'fill="#888888"'))
    yield "no caption", re.sub(r"<figcaption>.*?</figcaption>", "", text, flags=re.S)
    yield "no name", text.replace(end, "<button type='button'></button>" + end)
    yield "no result", text.replace('id="result"', 'id="other"')
    yield "no command", text.replace('id="command"', 'id="other"')
    yield "injection", lax.replace(end, "<script>window.pwned = 1</script>" + end)
    yield "injection", lax.replace(end, "<script>alert(1)</script>" + end)


def main():
    tool, source = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    shots = pathlib.Path(sys.argv[3])
    shutil.rmtree(shots, ignore_errors=True)
    shots.mkdir(parents=True)
    axe = pathlib.Path(sys.argv[4]).read_text() if len(sys.argv) > 4 else None
    chromium = browser.find()
    if chromium is None:
        print("skipped: no Chromium here (package chromium); reports were not looked at")
        return 77
    faults = 0
    with tempfile.TemporaryDirectory(prefix="swarmcert-reports-") as folder:
        reports = Reports(tool, source, pathlib.Path(folder))
        refuse_full_folders(reports)
        make(reports)
        with browser.Browser(chromium) as tab:
            page = reports.folder / "planted.html"
            for kind, text in planted(reports.pages["bound"]):
                page.write_text(text)
                seen = {fault[0] for fault in tab.faults(page, widths=(390,), schemes=())}
                if kind not in seen:
                    print(f"not seen: a planted fault of kind '{kind}' (seen: {sorted(seen)})")
                    faults += 1
            if axe:
                page.write_text(reports.pages["bound"].read_text().replace("</main>", "<img src='data:,'></main>"))
                if "image-alt" not in {fault[1] for fault in tab.accessibility(page, axe)}:
                    print("not seen: a planted picture without a text")
                    faults += 1
            for name, page in reports.pages.items():
                found = tab.faults(page, pictures=shots / name) + (tab.accessibility(page, axe) if axe else [])
                faults += len(found)
                print(f"{name}: {len(found)} faults, {page.stat().st_size // 1024} kB")
                for fault in found:
                    print("   ", json.dumps(fault))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
