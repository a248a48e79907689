"""Logs and residuals as arrays."""

import gc

import numpy as np
import pandas
import pytest
from conftest import MODEL

import swarmcert


def test_a_log_has_arrays_with_units_and_sources(flights):
    path = flights / "1/cf1_00"
    log = swarmcert.read(path)
    (described,) = swarmcert.run("inspect", path).files
    n = described["records"]
    assert log["time_s"].shape == (n,) and log["position_m"].shape == (n, 3) and log["attitude"].shape == (n, 4)
    assert log["time_s"][0] == described["t0_s"] and log["time_s"][-1] == described["t1_s"]
    assert log.units["velocity_m_s"] == "m/s" and set(log.units) == set(log)
    assert [s.name for s in log.sources] == [s["name"] for s in described["signals"]]
    assert log.judged_force == described["judged"]["force"]
    assert np.allclose(np.linalg.norm(log["attitude"], axis=1), 1)
    assert len(pandas.DataFrame(log.table())) == n


def test_arrays_outlive_what_they_came_from(flights):
    log = swarmcert.read(flights / "1/cf1_00")
    position = log["position_m"]
    residual = swarmcert.residuals(MODEL, flights / "1")[0].residual_N
    copies = position.copy(), residual.copy()
    assert position.flags.owndata and residual.flags.owndata
    del log
    for _ in range(3):
        swarmcert.read(flights / "2/cf1_00")
        gc.collect()
    assert np.array_equal(position, copies[0]) and np.array_equal(residual, copies[1])
    position[0] = 7  # the arrays belong to the caller
    assert swarmcert.read(flights / "1/cf1_00")["position_m"][0, 0] != 7


def test_residuals_are_those_that_compare_reports(flights):
    result = swarmcert.compare(MODEL, flights)
    tracks = swarmcert.residuals(MODEL, flights)
    assert [(t.flight, t.vehicle) for t in tracks] == [(f["flight"], f["vehicle"]) for f in result.flights]
    for track, reported in zip(tracks, result.flights):
        used = track.residual_N[track.used]
        assert len(used) == reported["samples"]
        # compare keeps its samples in float32.
        rmse = np.sqrt(np.mean(used**2, axis=0))
        assert np.allclose(rmse, [reported["rmse"][axis] for axis in "xyz"], rtol=1e-5)
        assert {reason for reason in track.cut if reason} <= set(result.cut_rules)
        assert len(pandas.DataFrame(track.table())) == len(track.time_s)


def test_flights_given_as_arrays_are_judged_as_their_files(flights):
    logs = [{v: swarmcert.read(flights / run / f"{v}_00") for v in ("cf1", "cf2")} for run in "123"]
    given, files = swarmcert.compare(MODEL, logs), swarmcert.compare(MODEL, flights)
    assert given.overall["samples"] == files.overall["samples"]
    for axis in "xyz":
        assert given.overall["rmse"][axis] == pytest.approx(files.overall["rmse"][axis], rel=1e-6)
    assert len(swarmcert.residuals(MODEL, logs[0])) == 2


def test_flights_of_options_may_be_arrays_too(flights, tmp_path):
    logs = [{v: swarmcert.read(flights / run / f"{v}_00") for v in ("cf1", "cf2")} for run in "123"]
    given = swarmcert.diagnose(MODEL, logs[:2], against=logs[2])
    files = swarmcert.diagnose(MODEL, [flights / "1", flights / "2"], against=flights / "3")
    assert given.code == files.code and len(given.against["vehicles"]) == len(files.against["vehicles"]) > 0
    for ours, theirs in zip(given.against["vehicles"], files.against["vehicles"]):
        assert [h["effect"] for h in ours["held"]] == [h["effect"] for h in theirs["held"]]
    with pytest.raises(swarmcert.UsageError, match="no option select"):
        swarmcert.compare(MODEL, logs[:2], select=logs[2])


def test_arrays_of_another_shape_or_name_are_refused(flights):
    log = dict(swarmcert.read(flights / "1/cf1_00"))
    with pytest.raises(swarmcert.InputError) as caught:
        swarmcert.compare(MODEL, {**log, "position": log["position_m"]})
    assert caught.value.value == "'position'" and "position_m" in caught.value.hint
    with pytest.raises(swarmcert.InputError, match=r"\[n, 3\]"):
        swarmcert.compare(MODEL, {**log, "position_m": log["position_m"][:, :2]})
    with pytest.raises(swarmcert.InputError, match="the same number of records"):
        swarmcert.compare(MODEL, {**log, "battery_V": log["battery_V"][:-1]})


def test_a_file_that_is_no_log_is_refused(tmp_path):
    (tmp_path / "cf1_00").write_bytes(b"\x00" * 10)
    with pytest.raises(swarmcert.InputError) as caught:
        swarmcert.read(tmp_path / "cf1_00")
    assert caught.value.file == str(tmp_path / "cf1_00")
