#!/usr/bin/env python3
"""Runs both checkers of tracking gains on the same certificates: valid ones, mutations of every field under a forged
content hash, and hostile files. They must agree on each, and must not accept a claim below the true gain.

    check_tracking_test.py SWARMCERT SOURCE_DIR
"""
import contextlib
import copy
import json
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import check_tracking as second

SWARMCERT, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
MODEL = SOURCE / "stability/models/crazyflie-small.toml"
LIMIT_S = 20  # for a hostile file on a loaded machine; it takes milliseconds


def certificate(folder, position, lag="", model=MODEL):
    gains = folder / "gains.toml"
    gains.write_text(f'schema = "swarmcert/gains/1"\n[position]\n{position}\n{lag}')
    path = folder / "cert.json"
    subprocess.run([SWARMCERT, "bound", "--gains", gains, "--model", model, "--verified", "-o", path, "--force",
                    "--quiet"],
                   check=True, capture_output=True)
    return json.loads(path.read_text())


def exit_codes(folder, text, *options):
    path = folder / "mutated.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    first = subprocess.run([SWARMCERT, "check", path, *options], capture_output=True, timeout=LIMIT_S).returncode
    with contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
        return [first, second.main([str(path), *options])]


def forged(document):
    document["content_sha256"] = second.content_sha256(document)
    return json.dumps(document)


def places(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, member in items:
        yield from places(member, (*path, key))


def at(document, path):
    for key in path:
        document = document[key]
    return document


def mutations(value):
    """Other values for one field: larger and smaller numbers, other types, missing values."""
    if isinstance(value, str) and value[:3] in ("0x0", "0x1"):
        x = float.fromhex(value)
        yield from (y.hex() for y in (x * 1.25 or 0.5, x * 0.75, -x, math.nextafter(x, math.inf),
                                        math.nextafter(x, -math.inf)))
        yield from ("0x1p+4000", "nan", "0x" + "1" * 1000 + "p+0")
    elif isinstance(value, str):
        yield value + "x"
    elif isinstance(value, (int, float)):
        yield from (value + 1, value - 1, value * 1.5, str(value))
    elif isinstance(value, list):
        yield from (value + value[:1], value[:-1], {})
    elif isinstance(value, dict):
        yield from ({**value, "more": 1}, [])
    yield None
    yield True


def least_gains(loop):
    """Lower bounds on the gains of the loop, by stepping its differential equation. No certificate may claim less."""
    c = {k: float.fromhex(loop[k]) for k in ("mass_kg", "Kp", "Kd", "Ki")}
    lags = [float.fromhex(x) for x in loop["lags_s"]]
    m, kp, kd, ki = c["mass_kg"], c["Kp"], c["Kd"], c["Ki"]
    dt, horizon = 2e-3, 12.0
    late = round(float.fromhex(loop["delay_s"]) / dt)
    past = []  # commands, one per step

    def command_at(x, ahead):
        """The command for this state or, with a delay, for an earlier step."""
        if late == 0:
            return command_of(x)
        k = len(past) - late - 1
        before, after = (past[i] if i >= 0 else 0.0 for i in (k, k + 1))
        return before + ahead * (after - before)

    def command_of(x):
        e, v, q = x[:3]
        return -m * (kp * (e + (loop["input"] == "position")) + kd * (v + (loop["input"] == "velocity")) +
                     ki * (q + (x[-1] if loop["input"] == "position" else 0))) + (loop["input"] == "command")

    def slope(x, ahead):
        e, v = x[:2]
        command = command_at(x, ahead)
        chain, lagged = command, []
        for tau, y in zip(lags, x[3:]):
            lagged.append((chain - y) / tau)
            chain = y
        return [v, (chain + (loop["input"] == "force")) / m, e, *lagged, 1.0]

    x, peak, integral, variation, steepest = [0.0] * (4 + len(lags)), 0.0, 0.0, 0.0, 0.0
    for _ in range(int(horizon / dt)):  # Runge-Kutta, for the response to a unit step
        past.append(command_of(x))
        k1 = slope(x, 0)
        k2 = slope([a + dt / 2 * b for a, b in zip(x, k1)], 0.5)
        k3 = slope([a + dt / 2 * b for a, b in zip(x, k2)], 0.5)
        k4 = slope([a + dt * b for a, b in zip(x, k3)], 1)
        new = [a + dt / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4)]
        peak, integral = max(peak, abs(new[0])), integral + dt * abs(x[0] + new[0]) / 2
        variation, steepest = variation + abs(new[0] - x[0]), max(steepest, abs(new[0] - x[0]) / dt)
        x = new
    return {"rate": integral, "amplitude": variation, "edge": peak, "impulse": steepest}


def least_sampled_gains(loop, source):
    """Lower bounds on the gains of the sampled loop: sums over the sampling times of the response to a step of one
    input that begins at a sampling time. Held commands pass through the lags by Runge-Kutta in short steps; a delay is
    a whole number of them."""
    m, kp, kd, ki, period, increment, delay = (float.fromhex(loop[k]) for k in (
        "mass_kg", "Kp", "Kd", "Ki", "period_s", "integrator_step_s", "delay_s"))
    lags = [float.fromhex(x) for x in loop["lags_s"]]
    pieces = 8
    dt, late = period / pieces, round(delay / period * pieces)
    assert abs(late * dt - delay) < 1e-9

    def slope(x, command):
        chain, lagged = command, []
        for tau, y in zip(lags, x[2:]):
            lagged.append((chain - y) / tau)
            chain = y
        return [x[1], chain + (1 / m if source == "force" else 0), *lagged]

    x, total, integral, commands, peak = [0.0] * (2 + len(lags)), 0.0, 0.0, [], 0.0
    variation = steepest = 0.0
    for _ in range(int(12 / period)):
        wrong, fast = float(source == "position"), float(source == "velocity")
        total += increment * (x[0] + wrong)
        command = -(kp * (x[0] + wrong) + kd * (x[1] + fast) + ki * total) + (1 / m if source == "command" else 0)
        before = x[0]
        for _ in range(pieces):
            commands.append(command)
            acting = commands[len(commands) - 1 - late] if len(commands) > late else 0.0
            k1 = slope(x, acting)
            k2 = slope([a + dt / 2 * b for a, b in zip(x, k1)], acting)
            k3 = slope([a + dt / 2 * b for a, b in zip(x, k2)], acting)
            k4 = slope([a + dt * b for a, b in zip(x, k3)], acting)
            x = [a + dt / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4)]
        peak, integral = max(peak, abs(x[0])), integral + period * abs(x[0])
        variation, steepest = variation + abs(x[0] - before), max(steepest, abs(x[0] - before) / period)
    return {"rate": integral, "amplitude": variation, "edge": peak, "impulse": steepest}


def agree_on_mutations(folder, document):
    seen = accepted = 0
    loop = document["loops"][0]
    truth = {name: gain * (1 - 1e-4) for name, gain in least_gains(loop).items()}
    document = {**document, "loops": [loop], "left_out": document["left_out"][:1]}
    assert exit_codes(folder, forged(document)) == [0, 0]
    for path in places(document):
        if not path or path[0] == "content_sha256":
            continue
        for value in mutations(at(document, path)):
            mutated = copy.deepcopy(document)
            at(mutated, path[:-1])[path[-1]] = value
            codes = exit_codes(folder, forged(mutated))
            assert codes[0] == codes[1] and codes[0] in (0, 1, 3), (path, value, codes)
            seen += 1
            if codes[0] == 0:
                accepted += 1
                if path[:2] == ("loops", 0) and path[2] in ("mass_kg", "Kp", "Kd", "Ki", "lags_s", "delay_s", "input"):
                    truth_of = least_gains(mutated["loops"][0])
                else:
                    truth_of = truth
                for name, gain in truth_of.items():
                    claimed = mutated["loops"][0]["gains"][name]
                    assert claimed is None or claimed >= gain * (1 - 1e-4), (path, value, name)
    assert seen > 300 and 0 < accepted < seen / 2, (seen, accepted)
    print(f"{seen} mutations decided alike, {accepted} of them accepted")


@contextlib.contextmanager
def gains_computed_once():
    """Lets the second checker compute the gains of a witness only once, since most mutations change only a claim."""
    originals = {kind: kind.gains for kind in (second.Loop, second.Sampled)}

    def once(compute):
        known = {}

        def gains(loop):
            witness = str(sorted(vars(loop).items()))
            if witness not in known:
                known[witness] = compute(loop)
            return known[witness]
        return gains

    for kind, compute in originals.items():
        kind.gains = once(compute)
    yield
    for kind, compute in originals.items():
        kind.gains = compute


def agree_on_sampled_mutations(folder, document):
    """Mutates every field of a sampled loop with a past command; of P, which has the same form as in the other loops,
    only the diagonal and one other entry."""
    seen = accepted = 0
    loop = document["sampled_loops"][0]
    witness = ("axis", "steps", "contraction", "P", "gains")  # these do not affect the truth of the claims
    truth = {source: least_sampled_gains(loop, source) for source in loop["gains"]}
    assert [exit_codes(folder, forged({**document, "loops": [], "sampled_loops": some}))
            for some in ([loop], [])] == [[0, 0], [1, 1]]
    for path in places(loop):
        if path[:1] == ("P",) and len(path) == 3 and path[1] != path[2] and path != ("P", 0, 1):
            continue
        for value in mutations(at(loop, path)) if path else ({}, [], None):
            mutated = {**document, "loops": [], "sampled_loops": [copy.deepcopy(loop)]}
            full = ("sampled_loops", 0, *path)
            at(mutated, full[:-1])[full[-1]] = value
            codes = exit_codes(folder, forged(mutated))
            assert codes[0] == codes[1] and codes[0] in (0, 1, 3), (path, value, codes)
            seen += 1
            if codes[0] == 0:
                accepted += 1
                hold_from_below(mutated["sampled_loops"][0], 2e-2, truth if path and path[0] in witness else None)
    assert seen > 200 and 0 < accepted < seen / 2, (seen, accepted)
    print(f"{seen} mutations of a sampled loop decided alike, {accepted} of them accepted")


def hold_from_below(loop, rate_slack, truth=None):
    """No certified gain is below the one found by stepping; the integral over sampling times is a sum with an error of
    `rate_slack`."""
    compared = 0
    for source, claims in loop["gains"].items():
        for name, least in (truth[source] if truth else least_sampled_gains(loop, source)).items():
            slack = rate_slack if name == "rate" and source == "force" else 1e-4
            if claims[name] is not None:
                assert least * (1 - slack) <= claims[name], (loop, source, name, least)
                compared += 1
    return compared


def refuse_low_claims(folder, document):
    """A gain 6 % lower is below the true one, since certified gains are at most 5 % above."""
    for k, loop in enumerate(document["loops"][:4]):
        for name in ("rate", "amplitude", "edge", "impulse"):
            if loop["gains"][name] is None:
                continue
            mutated = copy.deepcopy(document)
            low = loop["gains"][name] * 0.94
            mutated["loops"][k]["gains"].update({name: low, name + "_hex": low.hex()})
            assert exit_codes(folder, forged(mutated)) == [1, 1], (k, name)


def refuse_hostile_files(folder, document):
    good = forged(document)
    deep = "[" * 100000 + "]" * 100000
    for text in ("", "{", deep, good.replace('"left_out": [', '"left_out": [' + deep + ", ", 1), good + "x",
                 good.replace('"time_exponent": ', '"time_exponent": 1' + "0" * 100000, 1),
                 good.replace("null", "NaN", 1),
                 good.replace('"steps": ', '"steps": 1e', 1), b"\xff" + good.encode(), b"\xef\xbb\xbf" + good.encode(),
                 good.replace('"steps"', '"axis"', 1)):
        codes = exit_codes(folder, text)
        assert codes[0] in (1, 3) and codes[1] in (1, 3), (text[:80], codes)


def hold_for_random_loops(folder):
    """Gains found by stepping never exceed the certified ones, which are only slightly larger."""
    generator, compared, delayed = random.Random(23), 0, 0
    for run in range(6):
        kp, kd = generator.uniform(6, 30), generator.uniform(5, 12)
        ki = generator.uniform(0.2, 0.4) * kp * kd if run % 3 else 0
        lag = f"[lag]\nmotor_s = {generator.uniform(0.01, 0.04)}\n" if run % 2 else ""
        if run == 3:
            lag += "delay_s = 0.004\n"
        document = certificate(folder, f"Kp = {kp}\nKd = {kd}\nKi = {ki}", lag)
        assert exit_codes(folder, forged(document)) == [0, 0]
        for loop in document["loops"]:
            if loop["axis"] != "z":
                continue
            for name, least in least_gains(loop).items():
                claimed = loop["gains"][name]
                if claimed is None:
                    continue
                assert least * (1 - 1e-4) <= claimed <= 1.06 * least, (kp, kd, ki, lag, loop["input"], name, least,
                                                                       claimed)
                compared += 1
                delayed += loop["delay_s"] != "0x0p+0"
    assert compared > 60 and delayed > 8, (compared, delayed)
    print(f"{compared} gains of random loops compared")


def integral_that_acts(folder, of_gains, kp, kd, ki, rate, lag):
    """A sampled loop states the Ki of gains.toml and the integrator's step; a continuous one the Ki that acts. True
    certificates of the same loop with the one in place of the other are refused for these files."""
    written, acting = f"Kp = {kp}\nKd = {kd}\nKi = {ki}\n", f"Kp = {kp}\nKd = {kd}\nKi = {0.8 * ki}\n"
    continuous = certificate(folder, f"{written}rate_hz = {rate}", lag)["loops"]
    sampled = certificate(folder, f"{acting}rate_hz = {rate}\nintegrator_step_s = {0.8 / rate}", lag)["sampled_loops"]
    document = of_gains()
    own = ["--gains", str(folder / "gains.toml"), "--model", str(MODEL)]
    assert {float.fromhex(loop["Ki"]) for loop in document["sampled_loops"]} == {ki}
    assert all(math.isclose(float.fromhex(loop["Ki"]), 0.8 * ki, rel_tol=1e-12) for loop in document["loops"])
    assert continuous and sampled and document["loops"]
    for others in {"loops": continuous}, {"sampled_loops": sampled}:
        other = {**document, **others}
        assert [exit_codes(folder, forged(other)), exit_codes(folder, forged(other), *own)] == [[0, 0], [1, 1]], others


def hold_for_random_sampled_loops(folder):
    """The same for sampled loops: with and without integral, lags, delays of a fraction of a period and of several."""
    generator, compared = random.Random(29), 0
    for run, delay_periods in enumerate((0, 0.5, 2, 1.25)):
        kp, kd, rate = generator.uniform(6, 20), generator.uniform(5, 8), (50, 100, 200, 100)[run]
        ki = 0.3 * kp * kd if run % 2 else 0
        lag = f"[lag]\nmotor_s = {generator.uniform(0.01, 0.04)}\ndelay_s = {delay_periods / rate}\n"
        def of_gains():
            return certificate(folder, f"Kp = {kp}\nKd = {kd}\nKi = {ki}\nrate_hz = {rate}\n"
                                       f"integrator_step_s = {0.8 / rate}", lag)
        if run == 1:
            integral_that_acts(folder, of_gains, kp, kd, ki, rate, lag)
        document = of_gains()
        own = ["--gains", str(folder / "gains.toml"), "--model", str(MODEL)]
        assert exit_codes(folder, forged(document), *own) == [0, 0]
        assert [loop["axis"] for loop in document["sampled_loops"]] == ["x", "y", "z"], document["left_out"]
        loop = document["sampled_loops"][2]
        compared += hold_from_below(loop, 2e-2)
        for source, claims in loop["gains"].items():
            least = least_sampled_gains(loop, source)
            for name in ("amplitude", "edge", "impulse"):  # a force causes slightly more between the samples
                assert claims[name] <= 1.1 * least[name], (run, source, name, claims[name], least[name])
    assert compared > 50, compared
    print(f"{compared} gains of sampled random loops compared")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        hold_for_random_loops(folder)
        hold_for_random_sampled_loops(folder)
        document = certificate(folder, "Kp = 12\nKd = 7\nKi = 20", "[lag]\nmotor_s = 0.03\n")
        own = ["--gains", str(folder / "gains.toml"), "--model", str(MODEL)]
        assert exit_codes(folder, forged(document), *own) == [0, 0]
        assert exit_codes(folder, forged(document), "--gains", str(MODEL)) == [1, 1]
        for number in ("Kp", "mass_kg"):  # all claims are true, but of another loop than that of the files
            other = copy.deepcopy(document)
            for loop in other["loops"]:
                loop[number] = (float.fromhex(loop[number]) * (1 + 1e-9)).hex()
                for name in ("rate", "amplitude", "edge", "impulse"):
                    if loop["gains"][name] is not None:
                        loop["gains"].update({name: loop["gains"][name] * 1.1,
                                              name + "_hex": (loop["gains"][name] * 1.1).hex()})
            assert exit_codes(folder, forged(other)) == [0, 0]
            assert exit_codes(folder, forged(other), *own) == [1, 1]
        late = certificate(folder, "Kp = 12\nKd = 7\nKi = 20", "[lag]\nmotor_s = 0.03\ndelay_s = 0.004\n")
        assert exit_codes(folder, forged(late), *own) == [0, 0]
        for field, value in (("delay_s", "0x0p+0"), ("delay_s", "0x1p-4"), ("delay_s", "-0x1p-8"), ("delay_order", 0),
                             ("delay_order", 2), ("delay_order", -1), ("delay_order", None)):
            other = copy.deepcopy(late)
            other["loops"][0][field] = value
            assert exit_codes(folder, forged(other)) == [1, 1], (field, value)
        composite = certificate(folder, "Lambda = [4, 4, 3]\nK = 0.136", "[lag]\nmotor_s = 0.01\nattitude_s = 0.02\n")
        assert {loop["axis"] for loop in composite["loops"]} == {"x", "y", "z"}
        assert exit_codes(folder, forged(composite), *own) == [0, 0]
        changed_model = folder / "model.toml"
        changed_model.write_text(MODEL.read_text() + '[[effect]]\nname = "motor_lag"\nparameters = { tau_s = 0.04 }\n'
                                 '[[effect]]\nname = "thrust_ratio"\nparameters = { ratio = 0.125 }\n')
        scaled = certificate(folder, "Kp = 12\nKd = 7\nKi = 20", model=changed_model)
        assert {float.fromhex(x) for loop in scaled["loops"] for x in loop["lags_s"]} == {0.04}
        assert float.fromhex(scaled["loops"][0]["Kp"]) == 13.5
        both = ["--gains", str(folder / "gains.toml"), "--model", str(changed_model)]
        assert exit_codes(folder, forged(scaled), *both) == [0, 0]
        assert certificate(folder, "Kp = 12\nKd = 7\nKi = 20", "[lag]\nmotor_s = 0.03\n") == document
        changed = copy.deepcopy(document)
        changed["tool"] = "another"
        assert exit_codes(folder, json.dumps(changed)) == [1, 1]  # the content hash is that of the original
        sampled = certificate(folder, "Kp = 12\nKd = 7\nKi = 20\nrate_hz = 50",
                              "[lag]\nmotor_s = 0.03\ndelay_s = 0.005\n")
        assert exit_codes(folder, forged(sampled), *own) == [0, 0]
        for number in ("period_s", "integrator_step_s"):
            other = copy.deepcopy(sampled)
            for loop in other["sampled_loops"]:
                loop[number] = (float.fromhex(loop[number]) * (1 - 1e-9)).hex()
                for claims in loop["gains"].values():
                    for name in ("rate", "amplitude", "edge", "impulse"):
                        if claims[name] is not None:
                            claims.update({name: claims[name] * 1.1, name + "_hex": (claims[name] * 1.1).hex()})
            assert exit_codes(folder, forged(other)) == [0, 0]
            assert exit_codes(folder, forged(other), *own) == [1, 1]
        document["sampled_loops"] = []
        with gains_computed_once():
            refuse_low_claims(folder, late)
            refuse_low_claims(folder, document)
            agree_on_sampled_mutations(folder, sampled)
            agree_on_mutations(folder, document)
        refuse_hostile_files(folder, document)


if __name__ == "__main__":
    main()
