#!/usr/bin/env python3
"""A second checker of certificates of tracking gains, written in another language from the mathematics, with integers
and fractions and only the standard library. It shares no code with the C++ checker and must accept and reject the same
certificates.

    check_tracking.py CERTIFICATE [--gains FILE] [--model FILE]

Exit status: 0 accepted; 1 rejected, with the reason; 2 usage error; 3 unreadable file, or not JSON of this kind.

Along one axis, let y be the response of e to an impulse of the input. It solves a linear differential equation with the
numbers of the loop. With x the vector of y and its derivatives, in the certificate's unit of time, x' = A x. The
certificate gives P with A'P + PA + 2 decay P < 0, so sqrt(x'Px) decays at least like e^(-decay t). The step response
minus its limit is also a linear form of x. Four numbers follow: the integrals and the largest values of both.

The state of a sampled loop maps from one period to the next by a matrix M, enclosed in intervals of integers over
2^128; P with M P M' < contraction^2 P bounds the rows that give e some periods later. The same four numbers are sums
over the periods.
"""
import hashlib
import json
import re
import struct
import sys
import tomllib
from fractions import Fraction
from math import factorial, isqrt
from operator import mul
from pathlib import Path

STATEMENT = (
    "For each loop listed, with its numbers taken exactly as they stand: along one axis m e'' = u + f, e, e', the "
    "integral of e and the lags start at zero, and u is -m (Kp (e + p) + Kd (e' + v) + Ki int (e + p)) + c behind a "
    "delay of delay_s and first-order lags of the time constants listed, in continuous time and without limits. The "
    "input w is f (force), c (command), v (velocity, an error of that estimate) or p (position); the others are zero. "
    "Then at all times, in exact arithmetic, |e| <= rate sup |w'| where w starts at zero, |e| <= amplitude sup |w|, "
    "|e| <= edge times the total variation of w, its first jump included, and |e| <= impulse int |w| dt. Where rate is "
    "null, none is stated. For each sampled loop the same, but every period_s the law reads e + p and e' + v, adds "
    "integrator_step_s (e + p) to I, which starts at zero, and holds the command -m (Kp (e + p) + Kd (e' + v) + Ki I) "
    "+ c until the next one, behind the delay and the lags; f is a function of time, and c, v and p are one number per "
    "period, whose rate is the difference to the one before over period_s, the one before the first being zero, and "
    "whose integral of |w| is the sum of |w| period_s. Lengths are in m, forces in N, masses in kg, times in s. "
    "gains_sha256 and model_sha256 name the files from which the loops were derived; where both are given, checking "
    "compares the hashes and derives the loops anew, up to a relative 1e-12 for rounding. What is listed under "
    "left_out, and every bound made from these gains, is not certified here.")

BITS = 128  # number of fractional bits of a fixed-point number
DEEPEST = 64
HEX_FLOAT = re.compile(r"(-?)0[xX](?=\.?[0-9a-fA-F])([0-9a-fA-F]{0,40})(?:\.([0-9a-fA-F]{0,40}))?[pP]([+-]?[0-9]{1,5})")


class Rejected(Exception):
    pass


class Unreadable(Exception):
    pass


def require(condition, reason):
    if not condition:
        raise Rejected(reason)


# --- the file ------------------------------------------------------------------------------------------------------

def read_json(text):
    depth = deepest = 0
    for bracket in re.sub(r'"(?:[^"\\]|\\.)*"', "", text):
        depth += (bracket in "[{") - (bracket in "]}")
        deepest = max(deepest, depth)
    if deepest > DEEPEST:
        raise Unreadable("nested too deeply")

    def unique(pairs):
        members = dict(pairs)
        if len(members) != len(pairs):
            raise Unreadable("a key appears twice")
        return members

    def integer(digits):
        return int(digits) if len(digits) < 20 else finite(digits)

    def finite(digits):
        value = float(digits)
        if value - value != 0:
            raise Unreadable("a number is not finite")
        return value

    def constant(name):
        raise Unreadable(f"{name} is not JSON")

    try:
        return json.loads(text, object_pairs_hook=unique, parse_int=integer, parse_float=finite,
                          parse_constant=constant)
    except ValueError as fault:
        raise Unreadable(str(fault)) from fault


def encode(value):
    """Returns the bytes that content_sha256 hashes: independent of white space and of the order of members."""
    if value is None:
        return b"n"
    if isinstance(value, bool):
        return b"t" if value else b"f"
    if isinstance(value, (int, float)):
        return b"d%016x" % struct.unpack("<Q", struct.pack("<d", float(value)))[0]
    if isinstance(value, str):
        raw = value.encode()
        return b"s%d:" % len(raw) + raw
    if isinstance(value, list):
        return b"[" + b"".join(map(encode, value)) + b"]"
    members = sorted((key.encode(), member) for key, member in value.items())
    return b"{" + b"".join(b"s%d:" % len(k) + k + encode(m) for k, m in members) + b"}"


def content_sha256(document):
    return hashlib.sha256(encode({k: v for k, v in document.items() if k != "content_sha256"})).hexdigest()


def require_keys(value, keys, where):
    require(isinstance(value, dict) and set(value) == set(keys.split()), f"{where} has other fields than {keys}")


def exact(text):
    """Returns the number of a hex float that is exactly representable as a double."""
    match = HEX_FLOAT.fullmatch(text) if isinstance(text, str) else None
    require(match is not None, f"{str(text)[:60]!r} is not a hex float")
    sign, whole, fraction, exponent = match.groups()
    mantissa = int(whole + (fraction or ""), 16)
    power = int(exponent) - 4 * len(fraction or "")
    while mantissa and mantissa % 2 == 0:
        mantissa, power = mantissa // 2, power + 1
    require(mantissa < 2 ** 53 and (mantissa == 0 or power >= -1074 and mantissa.bit_length() + power <= 1024),
            f"{text!r} is not a double")
    value = Fraction(mantissa) * two_to(power) if mantissa else Fraction(0)
    return -value if sign else value


def whole(entry, key, low, high):
    value = entry[key]
    require(isinstance(value, int) and not isinstance(value, bool) and low <= value <= high, f"{key} is out of range")
    return value


# --- mathematics ---------------------------------------------------------------------------------------------------

def two_to(exponent):
    return Fraction(2) ** exponent


def polynomial_product(a, b):
    result = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            result[i + j] += x * y
    return result


def times(row, matrix):
    return [sum(x * column[j] for x, column in zip(row, matrix)) for j in range(len(matrix))]


def inverse_form(matrix, vector):
    """Returns vector' matrix^-1 vector, for a symmetric matrix; None unless it is positive definite."""
    m, v, total = [list(row) for row in matrix], list(vector), Fraction(0)
    for k in range(len(m)):
        if m[k][k] <= 0:
            return None
        total += v[k] ** 2 / m[k][k]
        for i in range(k + 1, len(m)):
            ratio = m[i][k] / m[k][k]
            m[i] = [x - ratio * y for x, y in zip(m[i], m[k])]
            v[i] -= ratio * v[k]
    return total


def fixed_below(x):
    return (x.numerator << BITS) // x.denominator


def fixed_above(x):
    return -fixed_below(-x)


def product_above(a, b):
    return (a * b >> BITS) + 1


def root_above(x):
    return isqrt(x) + 1


class Derived:
    """Returns the loops of gains.toml and model.toml."""

    def __init__(self, gains, model):
        self.mass = model["vehicle"]["mass_kg"]
        lag = gains.get("lag", {})
        self.attitude, motor, delay, ratio = lag.get("attitude_s", 0), lag.get("motor_s", 0), lag.get("delay_s", 0), 1
        for effect in model.get("effect", []):
            values = effect.get("parameters", {})
            if effect.get("name") == "motor_lag" and motor == 0:
                motor = values.get("tau_s", 1 / 17.4)
            elif effect.get("name") == "thrust_ratio":
                ratio = 1 + values.get("ratio", 0)
            elif effect.get("name") == "delay":
                delay = delay or values.get("delay_s", 0.01)
        self.motor, self.delay, self.ratio, self.position = motor, delay, ratio, gains["position"]

    def matrix(self, key):
        value = self.position[key]
        if not isinstance(value, list):
            value = [value] * 3
        if not isinstance(value[0], list):
            value = [[value[i] if i == j else 0 for j in range(3)] for i in range(3)]
        return value

    def gains(self, axis):
        if "Kp" in self.position:
            return [self.position[key][axis] if isinstance(self.position[key], list) else self.position[key]
                    for key in ("Kp", "Kd", "Ki")]
        both = self.matrix("Lambda"), self.matrix("K")
        for m in both:
            require(all(m[axis][j] == 0 and m[j][axis] == 0 for j in range(3) if j != axis),
                    "the files couple the axes")
        l, a = both[0][axis][axis], both[1][axis][axis] / self.mass
        return [2 * a * l + l * l, a + 2 * l, a * l * l]

    def compare(self, entry):
        axis = "xyz".index(entry["axis"])
        keys, sampling = ["mass_kg", "Kp", "Kd", "Ki", "delay_s"], []
        kp, kd, ki = self.gains(axis)
        rate = self.position.get("rate_hz", 0)
        step = self.position.get("integrator_step_s", 1 / rate) if rate > 0 else 0
        if "period_s" in entry:
            require(rate > 0, "the loop of the files is not sampled")
            keys = keys + ["period_s", "integrator_step_s"]
            sampling = [1 / rate, step]
        elif rate > 0:  # in continuous time, the integral grows by as much per second of error as the sampled sum does
            ki *= step * rate
        stated = [exact(entry[key]) for key in keys] + sorted(map(exact, entry["lags_s"]))
        lags = sorted(x for x in (self.motor, self.attitude if axis < 2 else 0) if x > 0)
        derived = [self.mass] + [self.ratio * x for x in (kp, kd, ki)] + [self.delay] + sampling + lags
        require(len(stated) == len(derived) and
                all(abs(x - Fraction(y)) <= Fraction(1, 10 ** 12) * abs(Fraction(y)) for x, y in zip(stated, derived)),
                f"the loop of axis {entry['axis']} is not that of the files")


def read_form(rows, n):
    require(isinstance(rows, list) and len(rows) == n, "the size of P does not match the loop")
    require(all(isinstance(row, list) and len(row) == n for row in rows), "the size of P does not match the loop")
    form = [[exact(x) for x in row] for row in rows]
    for i in range(n):
        for j in range(n):
            x = form[i][j]
            require(abs(x) <= 2 ** 64 and x.denominator <= 2 ** 96, "P has an entry out of range")
            require(x == form[j][i], "P is not symmetric")
    return form


class Loop:
    def __init__(self, entry):
        require_keys(entry, "axis input mass_kg Kp Kd Ki lags_s delay_s delay_order time_exponent step_exponent steps "
                     "decay P gains", "loop")
        require(entry["axis"] in ("x", "y", "z"), "axis is unknown")
        self.input = entry["input"]
        require(self.input in ("force", "command", "velocity", "position"), "input is unknown")
        mass, kp, kd, self.ki = (exact(entry[key]) for key in ("mass_kg", "Kp", "Kd", "Ki"))
        require(isinstance(entry["lags_s"], list), "lags_s is not an array")
        lags = [exact(x) for x in entry["lags_s"]]
        self.decay = exact(entry["decay"])
        for x in (mass, kp, kd, self.decay, *lags, *([self.ki] if self.ki else [])):
            require(two_to(-40) <= x <= two_to(40), "a number of the loop is out of range")
        require(len(lags) <= 4, "more than four lags")
        self.delay = exact(entry["delay_s"])
        require(self.delay == 0 or two_to(-40) <= self.delay <= two_to(40), "delay_s is out of range")
        self.delay_order = whole(entry, "delay_order", 0, len(lags) if self.delay else 0)
        self.time = whole(entry, "time_exponent", -64, 64)
        self.cell = whole(entry, "step_exponent", 0, 64)
        self.steps = whole(entry, "steps", 1, 2 ** 18)
        self.P = read_form(entry["P"], len(lags) + (3 if self.ki else 2))
        self.build(mass, kp, kd, lags)

    def build(self, mass, kp, kd, lags):
        lag = [Fraction(1)]
        for tau in lags:
            lag = polynomial_product(lag, [Fraction(1), tau])
        integral = [self.ki] if self.ki else []
        back = integral + [kp, kd]
        d = [Fraction(0)] * (len(integral) + 2) + lag
        expansion = [(-self.delay) ** j / factorial(j) for j in range(self.delay_order + 1)]
        for k, x in enumerate(polynomial_product(back, expansion)):
            d[k] += x
        if self.input == "position":
            top = integral + [kp]
        else:
            over = {"force": [x / mass for x in lag], "command": [1 / mass], "velocity": [kd]}[self.input]
            top = [Fraction(0)] * len(integral) + over
        n = len(self.P)
        unit = two_to(-self.time)  # of time, in seconds
        a = [d[k] / d[n] * unit ** (n - k) for k in range(n + 1)]
        self.A = [[Fraction(int(j == k + 1)) for j in range(n)] for k in range(n - 1)] + [[-x for x in a[:n]]]

        def initial(numerator):
            start = []
            for k in range(n):
                x = numerator[n - 1 - k] / d[n] * unit ** k if n - 1 - k < len(numerator) else Fraction(0)
                start.append(x - sum(a[n - k + j] * start[j] for j in range(k)))
            return start

        self.start = initial(top)
        # e^(-Ts) minus its expansion is (-s)^(order + 1) times a kernel of one sign whose integral is this weight.
        self.rest_weight = self.delay ** (self.delay_order + 1) / factorial(self.delay_order + 1)
        rest = [Fraction(0)] * (self.delay_order + 1) + back
        rest += [Fraction(0)] * (n + 1 - len(rest))
        self.rest_jump = rest[n] / d[n]
        self.rest_start = initial([x - self.rest_jump * y for x, y in zip(rest, d)][:n])
        self.limit = top[0] / d[0] / unit
        self.rows = [[-x / a[0] for x in a[1:]], [Fraction(int(k == 0)) for k in range(n)]]
        for _ in range(3):
            self.rows.append(times(self.rows[-1], self.A))

    def check_decay(self):
        n, A, P = len(self.A), self.A, self.P
        nothing = [Fraction(0)] * n
        require(inverse_form(P, nothing) is not None, "P is not positive definite")
        falls = [[-2 * self.decay * P[i][j] - sum(A[k][i] * P[k][j] + P[i][k] * A[k][j] for k in range(n))
                  for j in range(n)] for i in range(n)]
        require(inverse_form(falls, nothing) is not None, "P does not prove that the loop decays at the stated rate")

    def transition(self):
        """Returns exp(A cell) in fixed point, and an upper bound on its error in the maximum norm."""
        n, cell = len(self.A), two_to(-self.cell)
        require(max([1] + [sum(map(abs, row)) for row in self.A]) * cell <= Fraction(1, 2), "the cells are too long")
        power = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
        total = [list(row) for row in power]
        for k in range(1, 25):
            power = [[x * cell / k for x in times(row, self.A)] for row in power]
            total = [[x + y for x, y in zip(r, s)] for r, s in zip(total, power)]
        return [[fixed_below(x) for x in row] for row in total], fixed_above(two_to(-24) / factorial(25)) + n

    def gains(self):
        """Returns upper bounds on rate (None if there is none), amplitude, edge and impulse."""
        self.check_decay()
        missed = 0
        if self.delay:
            missed = self.rest_weight * (abs(self.rest_jump) + self.norms(self.rest_start)["amplitude"])
            require(missed < 1, "the expansion of the delay is too inaccurate")
        return {name: x and x / (1 - missed) for name, x in self.norms(self.start).items()}

    def norms(self, start):
        step, missed = self.transition()
        n, cell, P = len(self.A), self.cell, [[int(x * 2 ** 96) for x in row] for row in self.P]
        spread = root_above(fixed_above(sum(abs(x) for row in self.P for x in row)) << BITS)  # |u|_P per max |u|
        forms = [([fixed_below(x) for x in row], root_above(fixed_above(inverse_form(self.P, row)) << BITS))
                 for row in self.rows]
        offset = fixed_below(self.limit)
        state, error = [fixed_below(x) for x in start], product_above(spread, 1)

        def size(largest):
            square = sum(x * sum(map(mul, row, state)) for x, row in zip(state, P))
            return root_above((square >> 96) + 1) + error

        def above(form, plus, largest):
            row, norm = form
            value = abs((plus << BITS) + sum(map(mul, row, state)))
            return (value >> BITS) + (n * largest >> BITS) + 3 + product_above(norm, error)

        largest = max(map(abs, state))
        offsets = (offset, 0)
        before = [above(forms[f], offsets[f], largest) for f in (0, 1)]
        ends, curvatures, highest = [0, 0], [0, 0], [0, 0]
        for _ in range(self.steps):
            length = size(largest)
            curved = [above(forms[f + 2], 0, largest) + (product_above(forms[f + 3][1], length) >> cell) + 1
                      for f in (0, 1)]
            error += product_above(spread, product_above(missed, largest) + 1)
            state = [sum(map(mul, row, state)) >> BITS for row in step]
            largest = max(map(abs, state))
            for f in (0, 1):
                now = above(forms[f], offsets[f], largest)
                ends[f] += before[f] + now
                curvatures[f] += curved[f]
                highest[f] = max(highest[f], max(before[f], now) + (curved[f] >> 2 * cell + 3) + 1)
                before[f] = now
        length, d = size(largest), two_to(-cell)
        tails = [product_above(forms[f][1], length) for f in (0, 1)]
        integral = [d / 2 * ends[f] + d ** 3 / 12 * curvatures[f] + tails[f] / self.decay for f in (0, 1)]
        supremum = [max(highest[f], abs(offsets[f]) + 1 + tails[f]) for f in (0, 1)]
        second = two_to(-self.time) / 2 ** BITS
        return {"rate": integral[0] * second * two_to(-self.time) if self.limit == 0 else None,
                "amplitude": integral[1] * second, "edge": supremum[0] * second,
                "impulse": Fraction(supremum[1], 2 ** BITS)}


# --- sampled loops -------------------------------------------------------------------------------------------------
# An interval is a pair of integers over 2^BITS.

def grid(x):
    return fixed_below(Fraction(x)), fixed_above(Fraction(x))


def interval_product(a, b):
    ends = [x * y for x in a for y in b]
    return min(ends) >> BITS, (max(ends) >> BITS) + 1


def interval_sum(terms):
    terms = list(terms)
    return sum(low for low, _ in terms), sum(high for _, high in terms)


def matrix_product(a, b):
    return [[interval_sum(interval_product(x, y[j]) for x, y in zip(row, b) if x != (0, 0)) for j in range(len(b[0]))]
            for row in a]


def matrix_exponential(generator, t):
    """Returns exp(generator t), t >= 0: the Taylor sum for t / 2^k in fractions, squared k times in intervals."""
    n, halvings = len(generator), 0
    largest = max(sum(map(abs, row)) for row in generator) * t
    while largest > Fraction(2) ** (halvings - 1):
        halvings += 1
        require(halvings <= 12, "a lag is too short compared with the period")
    part = [[x * t / 2 ** halvings for x in row] for row in generator]
    power = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    total = [list(row) for row in power]
    for k in range(1, 25):
        power = [[x / k for x in times(row, part)] for row in power]
        total = [[x + y for x, y in zip(r, s)] for r, s in zip(total, power)]
    missed = Fraction(1, 2 ** 24 * factorial(25))
    result = [[(fixed_below(x - missed), fixed_above(x + missed)) for x in row] for row in total]
    for _ in range(halvings):
        result = matrix_product(result, result)
    return result


def solve(matrix, right):
    rows = [list(row) + [x] for row, x in zip(matrix, right)]
    n = len(rows)
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k] != 0), None)
        require(pivot is not None, "the loop has no limit under a constant input")
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(n):
            if i != k and rows[i][k] != 0:
                ratio = rows[i][k] / rows[k][k]
                rows[i] = [x - ratio * y for x, y in zip(rows[i], rows[k])]
    return [row[n] / row[i] for i, row in enumerate(rows)]


class Sampled:
    """One axis. States before a control: e, e', lag outputs, the integral, past commands; after the control, the new
    command precedes the past ones."""
    INPUTS = ("force", "command", "velocity", "position")

    def __init__(self, entry):
        require_keys(entry, "axis mass_kg Kp Kd Ki lags_s delay_s period_s integrator_step_s steps contraction P gains",
                     "sampled loop")
        require(entry["axis"] in ("x", "y", "z"), "axis is unknown")
        self.mass, self.kp, self.kd, self.ki, self.period, self.increment = (
            exact(entry[key]) for key in ("mass_kg", "Kp", "Kd", "Ki", "period_s", "integrator_step_s"))
        require(isinstance(entry["lags_s"], list), "lags_s is not an array")
        self.lags, self.delay = [exact(x) for x in entry["lags_s"]], exact(entry["delay_s"])
        usual = [self.mass, self.kp, self.kd, self.period, self.increment, *self.lags]
        usual += [x for x in (self.ki, self.delay) if x]
        require(all(two_to(-40) <= x <= two_to(40) for x in usual), "a number of the loop is out of range")
        require(len(self.lags) <= 4, "more than four lags")
        self.steps, self.factor = whole(entry, "steps", 1, 2 ** 18), exact(entry["contraction"])
        require(two_to(-10) <= self.factor <= 1 - two_to(-40), "contraction is out of range")
        self.plant = 2 + len(self.lags)
        self.command = self.plant + (1 if self.ki else 0)
        self.newest = self.delay // self.period
        require(self.newest < 8, "delay_s is too long")
        self.shift = self.delay - self.newest * self.period
        self.past = self.newest + (1 if self.shift else 0)
        self.n = self.command + self.past
        self.P = read_form(entry["P"], self.n)

    def after_control(self):
        n, c = self.n, self.command
        rows = [[Fraction(int(i == j)) for j in range(n)] for i in range(c)]
        law = [Fraction(0)] * n
        law[0], law[1] = -self.kp - self.ki * self.increment, -self.kd
        if self.ki:
            rows[self.plant][0], law[self.plant] = self.increment, -self.ki
        return rows + [law] + [[Fraction(int(j == c + i)) for j in range(n)] for i in range(self.past)]

    def next_period(self):
        """Returns the map from the state after a control to the state before the next control, in intervals."""
        n, plant, unit = self.n, self.plant, (1 << BITS, 1 << BITS)
        g = [[Fraction(0)] * (plant + 1) for _ in range(plant + 1)]
        g[0][1] = g[1][2] = Fraction(1)
        for i, tau in enumerate(self.lags):
            g[2 + i][2 + i], g[2 + i][3 + i] = -1 / tau, 1 / tau
        moved = [[unit if i == j else (0, 0) for j in range(n + 1)] for i in range(plant)]
        stretches = [(self.shift, self.newest + 1)] if self.shift else []
        for duration, command in stretches + [(self.period - self.shift, self.newest)]:
            e = matrix_exponential(g, duration)
            moved = matrix_product([row[:plant] for row in e[:plant]], moved)
            for i in range(plant):
                moved[i][self.command + command] = interval_sum((moved[i][self.command + command], e[i][plant]))
        kept = ([self.plant] if self.ki else []) + [self.command + i for i in range(self.past)]
        return moved + [[unit if j == k else (0, 0) for j in range(n + 1)] for k in kept]

    def build(self):
        n = self.n
        control, hold = self.after_control(), self.next_period()
        self.M = matrix_product(hold, [[grid(x) for x in row] for row in control])
        self.middle = [[(low + high) >> 1 for low, high in row] for row in self.M]
        self.spread = max(high - low + 1 for row in self.M for low, high in row)
        self.columns = list(zip(*self.middle))
        self.scaled = [[int(x * 2 ** 96) for x in row] for row in self.P]
        self.widest = root_above(fixed_above(sum(abs(x) for row in self.P for x in row)) << BITS)
        self.reach = []  # |r_i| <= reach_i |r|
        for i in range(n):
            form = inverse_form(self.P, [Fraction(int(i == j)) for j in range(n)])
            require(form is not None, "P is not positive definite")
            self.reach.append(root_above(fixed_above(form) << BITS))
        m = [[Fraction(x, 2 ** BITS) for x in row] for row in self.middle]
        factor = self.factor - two_to(-60)
        half = [times(row, self.P) for row in m]
        falls = [[factor ** 2 * self.P[i][j] - sum(x * y for x, y in zip(half[i], m[j])) for j in range(n)]
                 for i in range(n)]
        require(inverse_form(falls, [Fraction(0)] * n) is not None,
                "P does not prove that the loop contracts as stated")
        unknown = product_above(self.widest, product_above(n * self.spread, max(self.reach)))
        require(unknown <= 1 << (BITS - 60), "P has an entry out of range")
        return control, hold

    def column(self, intervals):
        """Returns the midpoint, its norm, and a bound on its distance from the true column."""
        unknown = sum(product_above(high - low + 1, reach) for (low, high), reach in zip(intervals, self.reach))
        return self.finished([(low + high) >> 1 for low, high in intervals], unknown)

    def finished(self, middle, unknown):
        norm = root_above(fixed_above(inverse_form(self.P, [Fraction(x, 2 ** BITS) for x in middle])) << BITS)
        return middle, norm, unknown

    def summed(self, effect):
        """Returns (I - M)^-1 effect."""
        n = self.n
        left = [[int(i == j) - Fraction(self.middle[i][j], 2 ** BITS) for j in range(n)] for i in range(n)]
        x = [fixed_below(v) for v in solve(left, [Fraction(low + high >> 1, 2 ** BITS) for low, high in effect])]
        wrong = 0
        for i in range(n):
            low, high = interval_sum([effect[i], (-x[i], -x[i])]
                                     + [interval_product(a, (v, v)) for a, v in zip(self.M[i], x)])
            wrong += product_above(max(abs(low), abs(high)), self.reach[i])
        return self.finished(x, fixed_above(Fraction(wrong, 2 ** BITS) / (1 - self.factor)))

    def run(self, output, effects, own, limits):
        """Returns the gains from the four inputs to one output. `effects`: columns of all inputs but the force."""
        T, n, fixed = self.period, self.n, 2 ** BITS
        bow = T * T / 8
        rest_of_row = [(0, 0)] * (n - 2)
        force = [self.column([grid(a), grid(b)] + rest_of_row) for a, b in ((0, 1), (T, 1), (1, 0))]
        columns = [self.column(effect) for effect in effects]
        lefts = [self.summed([grid(T * T / 2), grid(T)] + rest_of_row)] + [self.summed(effect) for effect in effects]
        offsets = [fixed_below(x) for x in limits]
        own = [fixed_above(abs(x)) for x in own]
        row = [fixed_below(x) for x in output]
        error = product_above(self.widest, 1)
        spread, length = n * self.spread, 0

        def measure():
            square = sum(x * sum(p * y for p, y in zip(line, row)) for x, line in zip(row, self.scaled))
            return root_above((square >> 96) + 1) + error

        def above(column, offset=0):
            middle, norm, unknown = column
            value = abs((offset << BITS) - sum(c * x for c, x in zip(middle, row)))
            return (value >> BITS) + 2 + product_above(norm, error) + product_above(unknown, length)

        length = measure()
        ends = bends = halves = force_peak = 0
        force_highest, force_left = 0, above(lefts[0], offsets[0])
        effect_sum, left_sum = [0] * 3, [0] * 3
        effect_peak, left_peak = list(own), list(own)
        for _ in range(self.steps):
            for k in range(3):
                effect, left = above(columns[k]), above(lefts[k + 1], offsets[k + 1])
                effect_sum[k] += effect
                left_sum[k] += left
                effect_peak[k] = max(effect_peak[k], effect)
                left_peak[k] = max(left_peak[k], left)
            late, early, bend = map(above, force)
            ends += late + early
            bends += bend
            force_peak = max(force_peak, late, early)
            largest = max(map(abs, row))
            row = [sum(x * m for x, m in zip(row, line)) >> BITS for line in self.columns]
            error += product_above(self.widest, product_above(spread, largest) + 1)
            length = measure()
            left = above(lefts[0], offsets[0])
            halves += force_left + left
            force_highest = max(force_highest, max(force_left, left) * bow.denominator + bend * bow.numerator)
            force_left = left
        size = Fraction(length, fixed)
        tail = size / (1 - self.factor)
        most = [Fraction(norm + unknown, fixed) for _, norm, unknown in force + columns + lefts]
        force_most, bend_most, columns_most, lefts_most = max(most[:2]), most[2], most[3:6], most[6:]
        bent = T ** 3 / 12
        gains = [{
            "rate": None if limits[0] else Fraction(halves, fixed) * T / 2 + bent * Fraction(bends, fixed) +
            (T * lefts_most[0] + bent * bend_most) * tail,
            "amplitude": T / 2 * Fraction(ends, fixed) + T * force_most * tail,
            "edge": max(Fraction(force_highest, fixed * bow.denominator),
                        abs(limits[0]) + (lefts_most[0] + T * T / 8 * bend_most) * size),
            "impulse": max(Fraction(force_peak, fixed), force_most * size)}]
        for k in range(3):
            gains.append({
                "rate": None if limits[k + 1] else T * (Fraction(left_sum[k], fixed) + lefts_most[k + 1] * tail),
                "amplitude": Fraction(own[k] + effect_sum[k], fixed) + columns_most[k] * tail,
                "edge": max(Fraction(left_peak[k], fixed), abs(limits[k + 1]) + lefts_most[k + 1] * size),
                "impulse": max(Fraction(effect_peak[k], fixed), columns_most[k] * size) / T})
        return gains

    def gains(self):
        control, hold = self.build()
        n, c, zero = self.n, self.command, Fraction(0)
        inputs = [[Fraction(int(i == c)) for i in range(n + 1)]] + [
            [control[i][k] - int(i == k) for i in range(n + 1)] for k in (1, 0)]
        effects = [[row[0] for row in matrix_product(hold, [[grid(x)] for x in column])] for column in inputs]
        limits = [zero, zero, zero, Fraction(-1)]
        if not self.ki:
            limits[:3] = 1 / self.kp, 1 / self.kp, -self.kd / self.kp
        error = self.run([Fraction(int(i == 0)) for i in range(n)], effects, [zero] * 3, limits)
        command = self.run(control[c], effects, [column[c] for column in inputs], [zero] * 4)
        bend, age = self.period ** 2 / 8, sum(self.lags) + self.delay + self.period
        for k, (here, of_command) in enumerate(zip(error, command)):
            acting = 1 if k == 0 else 0
            if here["rate"] is not None:
                here["rate"] += bend * (of_command["rate"] + acting * age)
            here["edge"] += bend * (of_command["amplitude"] + acting)
            here["amplitude"] += bend * (of_command["amplitude"] + acting)
            here["impulse"] += bend * of_command["impulse"]
        error[0]["impulse"] = max(error[0]["impulse"], self.period)
        for here in error[:2]:
            for name in here:
                here[name] = None if here[name] is None else here[name] / self.mass
        return dict(zip(self.INPUTS, error))


GAINS = "rate rate_hex amplitude amplitude_hex edge edge_hex impulse impulse_hex"


def check_sampled(loops, derived):
    require(isinstance(loops, list) and len(loops) <= 3, "more than 3 sampled loops")
    seen, known = set(), {}
    for entry in loops:
        loop = Sampled(entry)
        require(entry["axis"] not in seen, "a sampled loop appears twice")
        seen.add(entry["axis"])
        require_keys(entry["gains"], " ".join(Sampled.INPUTS), "gains")
        for name in Sampled.INPUTS:
            require_keys(entry["gains"][name], GAINS, "gains")
        if derived is not None:
            derived.compare(entry)
        same = json.dumps({k: v for k, v in entry.items() if k not in ("axis", "gains")}, sort_keys=True)
        if same not in known:
            known[same] = loop.gains()
        for name in Sampled.INPUTS:
            for gain, proved in known[same][name].items():
                check_gain(entry["gains"][name], gain, proved)


def check_gain(claims, name, proved):
    decimal, text = claims[name], claims[name + "_hex"]
    if decimal is None and text is None:
        require(name == "rate" and proved is None, f"gains.{name} is missing")
        return
    claimed = exact(text)
    require(isinstance(decimal, (int, float)) and not isinstance(decimal, bool) and Fraction(float(decimal)) == claimed,
            f"gains.{name}: decimal and hex notation differ")
    require(proved is not None, f"gains.{name} is claimed, but a constant input leaves a steady-state error")
    require(claimed >= proved, f"gains.{name} is below what the witness proves")


def check(c, hashes, derived):
    require_keys(c, "schema tool statement gains_sha256 model_sha256 loops sampled_loops left_out content_sha256",
                 "certificate")
    require(c["statement"] == STATEMENT, "another statement")
    require(c["content_sha256"] == content_sha256(c), "content_sha256 does not match")
    for key in ("tool", "gains_sha256", "model_sha256"):
        require(isinstance(c[key], str), f"{key} is not text")
    for key, expected in hashes.items():
        require(c[key] == expected, f"{key} belongs to another file")
    require(isinstance(c["left_out"], list), "left_out is not an array")
    for entry in c["left_out"]:
        require_keys(entry, "axis input loop why", "left_out")
        require(entry["axis"] in ("x", "y", "z") and all(isinstance(x, str) for x in entry.values()), "left_out")
    loops = c["loops"]
    require(isinstance(loops, list) and len(loops) <= 12, "more than 12 loops")
    require(loops or c["sampled_loops"], "there is no loop")
    seen, known = set(), {}
    for entry in loops:
        loop = Loop(entry)
        require((entry["axis"], loop.input) not in seen, "a loop appears twice")
        seen.add((entry["axis"], loop.input))
        require_keys(entry["gains"], GAINS, "gains")
        if derived is not None:
            derived.compare(entry)
        same = json.dumps({k: v for k, v in entry.items() if k not in ("axis", "gains")}, sort_keys=True)
        if same not in known:
            known[same] = loop.gains()
        for name, proved in known[same].items():
            check_gain(entry["gains"], name, proved)
    check_sampled(c["sampled_loops"], derived)
    return len(loops) + len(c["sampled_loops"])


def main(words):
    paths, hashes, files = [], {}, {}
    try:
        while words:
            word = words.pop(0)
            if word in ("--gains", "--model"):
                files[word[2:]] = raw = Path(words.pop(0)).read_bytes()
                hashes[word[2:] + "_sha256"] = hashlib.sha256(raw).hexdigest()
            else:
                paths.append(word)
        if len(paths) != 1:
            raise IndexError
        document = read_json(Path(paths[0]).read_text(encoding="utf-8"))
        if not isinstance(document, dict) or document.get("schema") != "swarmcert/tracking-certificate/1":
            raise Unreadable("is no certificate of tracking gains")
        derived = None
        if len(files) == 2:
            derived = Derived(*(tomllib.loads(files[name].decode()) for name in ("gains", "model")))
        print(f"accepted: the gains of {check(document, hashes, derived)} loops")
        return 0
    except IndexError:
        print(__doc__, file=sys.stderr)
        return 2
    except (OSError, UnicodeDecodeError, RecursionError, tomllib.TOMLDecodeError, KeyError, Unreadable) as fault:
        print(f"cannot be read: {fault}", file=sys.stderr)
        return 3
    except Rejected as reason:
        print(f"rejected: {reason}")
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
