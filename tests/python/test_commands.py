"""Compares each command in process with the command line, byte by byte."""

import ast
import inspect
import json
import pathlib
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas
import pytest
from conftest import COMPOSITE, GAINS, MODEL, NETWORK, SOURCE, TOOL, TRUTH, tool

import swarmcert

LOOP = {"gains": GAINS, "model": MODEL}


def same_as_the_command_line(result, folder, *outputs):
    """Runs the recorded command line; the result must be the same text."""
    target = folder / "result.json"
    words = [TOOL, *result.command_line[1:], "--json", str(target), *map(str, outputs), "-q", "--force"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True)
    assert done.returncode == result.code, done.stderr
    assert target.read_text() == result.text


def calls(folder, flights):
    """By command: a call, and the outputs that its command line needs."""
    one = flights / "1"
    yield "certify", lambda: swarmcert.certify(NETWORK, max_lipschitz=500, nodes=2, blocks=True), ()
    yield "check", lambda: swarmcert.check(folder / "cert.json", NETWORK), ()
    yield "inspect", lambda: swarmcert.run("inspect", NETWORK, MODEL, flights), ()
    yield "compare", lambda: swarmcert.compare(MODEL, flights, gains=GAINS), ()
    yield "diagnose", lambda: swarmcert.diagnose(MODEL, flights), ()
    add = lambda: swarmcert.add(["downwash"], MODEL, flights, folder / "fitted.toml")
    yield "add", add, ("-o", folder / "fitted2.toml")
    yield "study", lambda: swarmcert.study(MODEL, flights, folder / "study"), ("-o", folder / "study")
    model = lambda: swarmcert.run("model", "draft", flights, output=folder / "draft.toml")
    yield "model", model, ("-o", folder / "draft2.toml")
    train = lambda: swarmcert.run(
        "train", MODEL, flights, phi=4, rho=4, features=2, epochs=1, output=folder / "trained"
    )
    yield "train", train, ("-o", folder / "trained2")
    fly = lambda: swarmcert.simulate("swap", folder / "swap", vehicles=2, duration=4, seed=3, **LOOP)
    yield "simulate", fly, ("-o", folder / "swap2")
    yield "bound", lambda: swarmcert.bound(COMPOSITE, MODEL, rate=0.3, amplitude=0.1), ()
    yield "spacing", lambda: swarmcert.run("spacing", gains=GAINS, model=TRUTH, max_error=0.1), ()
    sweep = lambda: swarmcert.run("sweep", folder / "grid.toml", output=folder / "sweep")
    yield "sweep", sweep, ("-o", folder / "sweep2")
    yield "merge", lambda: swarmcert.run("merge", folder / "sweep"), ()
    yield "tune", lambda: swarmcert.run("tune", nodes=60, **LOOP), ()
    yield "iss-check", lambda: swarmcert.run("iss-check", gains=COMPOSITE, model=MODEL, runs=5), ()
    yield "identify-thrust", lambda: swarmcert.run("identify-thrust", folder / "thrust.csv"), ()
    yield "export", lambda: swarmcert.export(NETWORK, folder / "code"), ("-o", folder / "code2")
    yield "match", lambda: swarmcert.match(NETWORK, folder / "code"), ()
    yield "gate", lambda: swarmcert.run("gate", folder / "policy.toml", bundle=folder / "evidence"), ()
    yield "verify-bundle", lambda: swarmcert.run("verify-bundle", folder / "evidence"), ()
    yield "explain", lambda: swarmcert.run("explain", "downwash"), ()
    yield "schema", lambda: swarmcert.run("schema", "gains"), ()
    yield "demo", lambda: swarmcert.run("demo", output=folder / "demo"), ("-o", folder / "demo2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    import shutil

    path = tmp_path_factory.mktemp("commands")
    tool("certify", NETWORK, "--nodes", 2, "-o", path / "cert.json", "-q")
    shutil.copytree(NETWORK.parent, path / "network")
    (path / "grid.toml").write_text(
        f'schema = "swarmcert/grid/1"\ngains = "{GAINS}"\nmodel = "{MODEL}"\ncompute = ["amplitude"]\n'
        "[axes]\nKp = { from = 5, to = 10, steps = 2 }\n"
    )
    (path / "policy.toml").write_text(
        'schema = "swarmcert/policy/1"\n[release]\nnetwork = "network/network.toml"\ncertificate = "cert.json"\n'
        "[certificate]\n[lipschitz]\nmax_joint_gf = 500\n"
    )
    rows = ["pwm,vbat,thrust_gf"]
    for k in range(60):
        p, volts = (10000 + 900 * k) / 65536, 3.2 + 0.1 * (k % 10)
        thrust = 11.09 - 39.08 * p - 9.53 * volts / 4.2 + 20.57 * p * p + 38.43 * p * volts / 4.2
        rows.append(f"{10000 + 900 * k},{volts:.2f},{thrust:.4f}")
    (path / "thrust.csv").write_text("\n".join(rows) + "\n")
    return path


def test_every_command_gives_the_bytes_of_the_command_line(folder, flights, capfd):
    seen = set()
    for name, call, outputs in calls(folder, flights):
        result = call()
        assert result.command == name
        same_as_the_command_line(result, folder, *outputs)
        seen.add(name)
    from swarmcert._commands import _OPTIONS

    assert seen == set(_OPTIONS) - {"reproduce"}  # its smallest experiment takes minutes
    assert capfd.readouterr() == ("", "")


def test_commands_without_searches_end_where_progress_raises(flights):
    class Enough(Exception):
        pass

    def progress(done, total, what):
        raise Enough

    for call in (swarmcert.compare, swarmcert.diagnose):
        with pytest.raises(Enough):
            call(MODEL, flights, progress=progress)
    assert swarmcert.compare(MODEL, flights).holds


def test_threads_do_not_disturb_one_another(flights):
    with ThreadPoolExecutor(4) as pool:
        jobs = [pool.submit(swarmcert.compare, MODEL, flights / run) for run in "1231"]
        jobs += [pool.submit(swarmcert.certify, NETWORK, nodes=0, seed=seed) for seed in (1, 2)]
        results = [job.result() for job in jobs]
    for run, result in zip("123", results):
        assert result.text == swarmcert.compare(MODEL, flights / run).text
    assert results[0].text == results[3].text
    assert [result.command_line[-1] for result in results[4:]] == ["1", "2"]


def test_notes_hold_what_the_command_line_says_on_standard_error(flights, tmp_path):
    result = swarmcert.run("inspect", MODEL, tmp_path / "missing")
    assert result.code == 3 and "missing" in result.notes[0]


def test_tables_go_into_pandas(flights):
    result = swarmcert.compare(MODEL, flights)
    frame = pandas.DataFrame(result.table("flights"))
    assert len(frame) == len(result.flights) == 6
    assert frame["rmse.z"].dtype == np.float64 and frame["vehicle"].tolist()[:2] == ["cf1", "cf2"]
    assert frame["rmse.z"][0] == result.flights[0]["rmse"]["z"]
    by_vehicle = pandas.DataFrame(result.table("vehicles"))
    assert sorted(by_vehicle["name"]) == ["cf1", "cf2"]
    for name in result.tables():
        pandas.DataFrame(result.table(name))
    assert {"flights", "regions", "moments"} <= set(result.tables())


def test_null_is_nan_in_a_column_of_numbers():
    result = swarmcert.Result(0, json.dumps({"schema": "swarmcert/x/1", "rows": [{"a": 1.5}, {"a": None}]}), [])
    column = result.table("rows")["a"]
    assert column[0] == 1.5 and np.isnan(column[1])
    with pytest.raises(AttributeError, match="rows"):
        result.nothing


def test_schemas_come_along():
    assert {"certify", "compare", "gains"} <= set(swarmcert.schema())
    assert swarmcert.schema("gains")["properties"]["schema"]["const"] == "swarmcert/gains/1"


def test_every_public_name_is_documented_and_every_function_has_types():
    for name in swarmcert.__all__:
        thing = getattr(swarmcert, name)
        assert inspect.getdoc(thing), name
        if inspect.isfunction(thing):
            signature = inspect.signature(thing)
            assert signature.return_annotation is not inspect.Signature.empty, name
            for parameter in signature.parameters.values():
                assert parameter.annotation is not inspect.Parameter.empty, f"{name}({parameter.name})"


def test_the_stub_names_what_the_module_has():
    stub = ast.parse((SOURCE / "analysis/python/swarmcert/_core.pyi").read_text())
    declared = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
    from swarmcert import _core

    defined = {name for name in dir(_core) if callable(getattr(_core, name))}
    assert declared == defined
    assert (pathlib.Path(swarmcert.__file__).parent / "py.typed").exists()
