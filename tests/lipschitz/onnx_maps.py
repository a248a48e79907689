"""Affine maps of numbers with a bound on their error, for onnx_graphs.py."""
import math

from onnx_file import MOST_PRODUCTS, need, Unread

# --- numbers with a bound on their error ---------------------------------------------------------------------------

ZERO, ONE, MINUS_ONE = (0.0, 0.0), (1.0, 0.0), (-1.0, 0.0)
UNIT, LEAST, TINY, UP = 2.0 ** -53, 2.0 ** -1074, 2.0 ** -960, 1 + 2.0 ** -26


def exactly(value):
    return value, 0.0


def opposite(a):
    return -a[0], a[1]


def dyadic(x):
    """Returns x as an integer times a power of two."""
    need(math.isfinite(x), "its weights, or their folded values, are not finite", "take an earlier checkpoint")
    fraction, exponent = math.frexp(x)
    return int(fraction * 2 ** 53), exponent - 53


class Sum:
    """Sums numbers and products exactly; rounded once, when it is read."""

    def __init__(self):
        self.mantissa, self.exponent, self.radius = 0, 0, 0.0

    def add_exactly(self, mantissa, exponent):
        if mantissa == 0:
            return
        lowest = min(exponent, self.exponent) if self.mantissa else exponent
        self.mantissa = (self.mantissa << (self.exponent - lowest) if self.mantissa else 0) + \
            (mantissa << (exponent - lowest))
        self.exponent = lowest

    def widen(self, radius):
        if radius > 0:
            self.radius = (self.radius + radius) * (1 + 2 * UNIT)

    def plus(self, a):
        self.add_exactly(*dyadic(a[0]))
        self.widen(a[1])
        return self

    def plus_product(self, a, b):
        (m, e), (n, f) = dyadic(a[0]), dyadic(b[0])
        self.add_exactly(m * n, e + f)
        radius = 0.0
        if a[1] > 0 or b[1] > 0:
            radius = (abs(a[0]) * b[1] + abs(b[0]) * a[1] + a[1] * b[1]) * UP + LEAST
        if m != 0 and n != 0 and abs(a[0] * b[0]) < TINY:
            radius += 2 * LEAST
        self.widen(radius)
        return self

    def nearest(self):
        try:
            if self.exponent >= 0:
                return float(self.mantissa << self.exponent)
            return self.mantissa / (1 << -self.exponent)
        except OverflowError:
            raise Unread("its weights, or their folded values, are not finite", "take an earlier checkpoint") from None

    def value(self):
        result = self.nearest()
        rest = Sum()
        rest.mantissa, rest.exponent = self.mantissa, self.exponent
        mantissa, exponent = dyadic(result)
        rest.add_exactly(-mantissa, exponent)
        if rest.mantissa == 0 and self.radius == 0:
            return result, 0.0
        missed = max(LEAST, abs(rest.nearest())) if rest.mantissa else 0.0
        return result, (missed + self.radius) * UP + LEAST


def times(a, b):
    return Sum().plus_product(a, b).value()


def plus(a, b):
    return Sum().plus(a).plus(b).value()


def is_product(x, a, b):
    difference = Sum().plus_product(exactly(a), exactly(b)).plus(exactly(-x))
    return difference.mantissa == 0


def error_of(x):
    return abs(x) * UNIT + LEAST


def divided(a, b):
    quotient = a[0] / b[0]
    is_exact = a[0] == 0 or min(abs(quotient), abs(a[0])) >= TINY and is_product(a[0], quotient, b[0])
    radius = 0.0 if is_exact else error_of(quotient)
    if a[1] > 0 or b[1] > 0:
        divisor = (abs(b[0]) - b[1]) * (1 - 4 * UNIT)
        radius = (radius + (a[1] + (abs(quotient) + error_of(quotient)) * b[1]) / divisor) * UP + LEAST
    return quotient, radius


def square_root(a):
    root = math.sqrt(a[0])
    radius = 0.0 if a[0] >= TINY and is_product(a[0], root, root) else error_of(root)
    if a[1] > 0:
        radius = (radius + a[1] / (root * (1 - UNIT))) * UP + LEAST
    return root, radius


# --- affine maps ---------------------------------------------------------------------------------------------------

class Map:
    """x -> M x + c: `rows` holds {column: number} without exact zeros, `shifts` the numbers of c."""

    def __init__(self, rows, shifts):
        self.rows, self.shifts = rows, shifts

    @staticmethod
    def identity(size):
        return Map([{i: ONE} for i in range(size)], [ZERO] * size)

    def is_identity(self, inputs):
        return len(self.rows) == inputs and all(row == {i: ONE} for i, row in enumerate(self.rows)) and \
            all(shift == ZERO for shift in self.shifts)

    def of(self, first, inputs):
        """Returns x -> self(first(x)); `inputs`: number of inputs of `first`."""
        if first.is_identity(inputs):
            return self
        sizes = [len(row) for row in first.rows]
        if sum(sizes[k] for row in self.rows for k in row) > MOST_PRODUCTS:
            raise Unread("folding these layers takes too long", "certify a smaller network")
        rows, shifts = [], []
        for row, own in zip(self.rows, self.shifts):
            if len(row) == 1:
                ((k, outer),) = row.items()
                rows.append({c: x if outer == ONE else times(outer, x) for c, x in first.rows[k].items()})
            else:
                sums = {}
                for k, outer in row.items():
                    for column, inner in first.rows[k].items():
                        sums.setdefault(column, Sum()).plus_product(outer, inner)
                found = ((column, sums[column].value()) for column in sorted(sums))
                rows.append({column: x for column, x in found if x != ZERO})
            shift = Sum().plus(own)
            for k, outer in row.items():
                shift.plus_product(outer, first.shifts[k])
            shifts.append(shift.value())
        return Map(rows, shifts)

    def plus(self, other, sign=1):
        signed_ = opposite if sign < 0 else lambda x: x
        rows = []
        for a, b in zip(self.rows, other.rows):
            found = ((column, plus(a.get(column, ZERO), signed_(b.get(column, ZERO)))) for column in sorted({**a, **b}))
            rows.append({column: x for column, x in found if x != ZERO})
        return Map(rows, [plus(a, signed_(b)) for a, b in zip(self.shifts, other.shifts)])

    def scaled(self, factors):
        """`factors`: one for each row, or one for all."""
        rows, shifts = [], []
        for row, shift, factor in zip(self.rows, self.shifts, factors * (len(self.rows) if len(factors) == 1 else 1)):
            if factor != ONE:
                row = {} if factor == ZERO else {column: times(factor, x) for column, x in row.items()}
                shift = times(factor, shift)
            rows.append(row)
            shifts.append(shift)
        return Map(rows, shifts)

    def shifted(self, amounts, sign=1):
        return Map(self.rows, [plus(shift, opposite(a) if sign < 0 else a) for shift, a in zip(self.shifts, amounts)])

    def over(self, numbers):
        return Map([{column: divided(x, n) for column, x in row.items()} for row, n in zip(self.rows, numbers)],
                   [divided(shift, n) for shift, n in zip(self.shifts, numbers)])

    def selected(self, which):
        return Map([self.rows[k] for k in which], [self.shifts[k] for k in which])


def stacked(maps):
    return Map([row for one in maps for row in one.rows], [shift for one in maps for shift in one.shifts])


class Value:
    """A tensor that the network computes. `first`: name of its first weights since the last layer; "": none yet."""

    def __init__(self, map_, shape, first=""):
        self.map, self.shape, self.first = map_, shape, first
