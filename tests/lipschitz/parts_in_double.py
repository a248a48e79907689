"""Proofs by parts for check_certificate.py in double precision with numpy, many parts at a time. Proofs accepted by
`holds` are valid in exact arithmetic, because every round-off error is bounded; others must be decided in fractions.

The error bounds hold for sums and products in any order (Higham 2002, sections 3.1 and 4.2): a sum of n products
differs from the exact one by at most n u / (1 - n u) times the sum of their absolute values. A matrix of n rows is
positive definite if a Cholesky factorization succeeds after gamma_(n+1) times its trace is subtracted from the diagonal
(Rump 2006, BIT 46).
"""
import re
from collections import namedtuple

import numpy as np

U = 2.0 ** -53
TINY = 2.0 ** -900
CORNER = 2.0 ** -30
MOST_AT_ONCE = 1 << 22  # largest number of entries of an array of forms
WORD = re.compile(r"(s|t)([0-9]{1,9})|d([0-9]{1,9})([+-])([0-9]{1,15})")


def gamma(n):
    return 1.01 * n * U


class Layer:
    def __init__(self, weights, biases, without_relu):
        self.w, self.b = np.array(weights, dtype=float), np.array(biases, dtype=float)
        self.outputs, self.inputs = self.w.shape
        self.relu = np.arange(self.outputs) < self.outputs - without_relu


class Tree:
    """The nodes of a tree of words in their order: parent, coordinate, side, depth; leaf number or -1; decisions."""

    def __init__(self, text, roots):
        self.parent, self.coordinate, self.upper, self.depth, self.leaf = [], [], [], [], []
        self.decisions = []  # (node, neuron, is on, corner)
        pending = [(-1, root, False, 0) for root in reversed(range(roots))]
        told = []
        for word in text.split(" "):
            match = WORD.fullmatch(word)
            if match is None or not pending:
                raise ValueError("another kind of tree")
            kind, index, neuron, sign, corner = match.groups()
            if kind is None:
                told.append((int(neuron), sign == "+", int(corner)))
                continue
            node, (parent, coordinate, upper, depth) = len(self.parent), pending.pop()
            self.parent.append(parent)
            self.coordinate.append(coordinate)
            self.upper.append(upper)
            self.depth.append(depth)
            self.leaf.append(int(index) if kind == "t" else -1)
            if told:
                self.decisions += [(node, *one) for one in told]
                told = []
            if kind == "s":
                pending += [(node, int(index), True, depth + 1), (node, int(index), False, depth + 1)]
                if len(pending) > 2000 + roots:
                    raise ValueError("too deep")
        if pending or told:
            raise ValueError("the tree ends early")


class Bounds:
    """Bounds on all neurons over a batch of boxes, layer by layer, by linear relaxation of ReLU."""

    def __init__(self, layers, low, high, around, decisions):
        self.layers, self.low, self.high = layers, low, high
        self.lower, self.upper, self.terms, self.above, self.below, self.offset = [], [], [], [], [], []
        self.are_decided = True
        first = 0
        for k, layer in enumerate(layers):
            self.add_terms(k)
            both = np.concatenate([layer.w, -layer.w])[None]
            constant = np.concatenate([layer.b, -layer.b])[None]
            ends = self.largest(*self.in_inputs(k, both, constant, np.s_[:], self.below), np.s_[:])
            lower, upper = -ends[:, layer.outputs:], ends[:, :layer.outputs]
            if around is not None:
                lower, upper = np.maximum(lower, around[0][k]), np.minimum(upper, around[1][k])
            self.lower.append(lower)
            self.upper.append(upper)
            self.decide(k, first, decisions)
            self.relax(k)
            first += layer.outputs

    def add_terms(self, k):
        """Appends an upper bound on |W| |h| + |b|."""
        layer = self.layers[k]
        if k == 0:
            size = np.maximum(abs(self.low), abs(self.high))
        else:
            size = np.where(self.layers[k - 1].relu, np.maximum(0, self.upper[-1]),
                            np.maximum(abs(self.lower[-1]), abs(self.upper[-1])))
        terms = (size @ abs(layer.w).T + abs(layer.b)) * (1 + 2 * gamma(layer.inputs + 4)) + TINY
        self.terms.append(np.where(terms <= 2.0 ** 100, terms, np.inf))

    def relax(self, k):
        lower, upper, relu = self.lower[k], self.upper[k], self.layers[k].relu
        is_off = relu & ~(lower >= 0) & (upper <= 0)
        is_open = relu & (lower < 0) & (upper > 0)
        slope = np.minimum(1, upper / (upper - lower))
        slope = np.where(np.isfinite(slope), slope, 1)
        offset = np.maximum(upper - slope * upper, -slope * lower) + 4 * U * (abs(upper) + abs(lower)) + TINY
        self.above.append(np.where(is_open, slope, np.where(is_off, 0.0, 1.0)))
        self.below.append(np.where(is_open, (upper > -lower) * 1.0, np.where(is_off, 0.0, 1.0)))
        self.offset.append(np.where(is_open, offset, 0.0))

    def in_inputs(self, top, form, constant, which, below):
        """Substitutes forms in the inputs of layer `top`, [1 or parts, forms, inputs], back to forms in x that bound
        them from above over the boxes `which`: (form, constant, sum of the absolute values of the constant's terms,
        bound on the round-off error, number of terms). `below`: lower slopes of ReLUs, one row per box of `which`."""
        absolute, error, terms = abs(constant), np.zeros((1, 1)), 4
        for j in range(top - 1, -1, -1):
            layer, is_positive = self.layers[j], form > 0
            above, offset = self.above[j][which][:, None], self.offset[j][which][:, None]
            reach = np.maximum(abs(self.lower[j][which]), abs(self.upper[j][which]))[:, None]
            positive = np.where(is_positive, form, 0)
            through = np.where(offset > 0, above * reach, 0)
            error = error + 1.01 * 4 * U * np.matmul(positive, through.swapaxes(1, 2))[..., 0]
            added = np.matmul(positive, offset.swapaxes(1, 2))[..., 0]
            form = form * np.where(is_positive, above, below[j][:, None])
            size = abs(form)
            constant = constant + added + form @ layer.b
            absolute = absolute + added + size @ abs(layer.b)
            error = error + gamma(layer.outputs + 2) * 1.01 * np.matmul(size, self.terms[j][which][:, :, None])[..., 0]
            form = form @ layer.w
            terms += 3 * layer.outputs
        return form, constant, absolute, error, terms

    def largest(self, form, constant, absolute, error, terms, which):
        """Returns upper bounds on such forms over the boxes."""
        low, high = self.low[which][:, :, None], self.high[which][:, :, None]
        value = constant + np.matmul(np.maximum(form, 0), high)[..., 0] + np.matmul(np.minimum(form, 0), low)[..., 0]
        absolute = absolute + np.matmul(abs(form), np.maximum(abs(low), abs(high)))[..., 0]
        terms += 2 * low.shape[1] + 16
        result = np.nextafter(value + (2 * terms * U * absolute + 1.01 * error + TINY), np.inf)
        return np.where(np.isfinite(result), result, np.inf)

    def decide(self, k, first, decisions):
        """Verifies the decisions of this layer, given as arrays (row of the batch, neuron, is on, corner)."""
        layer = self.layers[k]
        mine = (decisions[1] >= first) & (decisions[1] < first + layer.outputs)
        row, neuron, is_on, corner = (column[mine] for column in decisions)
        neuron = neuron - first
        if not layer.relu[neuron].all() or (len(row) and self.low.shape[1] > 48):
            self.are_decided = False
            return
        is_open = (self.lower[k][row, neuron] < 0) & (self.upper[k][row, neuron] > 0)
        row, neuron, is_on, corner = row[is_open], neuron[is_open], is_on[is_open], corner[is_open]
        if len(row) == 0:
            return
        sign = np.where(is_on, -1.0, 1.0)
        forms = self.in_inputs(k, (sign[:, None] * layer.w[neuron])[:, None], (sign * layer.b[neuron])[:, None], row,
                               self.slopes_at(k, row, corner))
        ends = self.largest(*forms, row)[:, 0]
        self.are_decided &= bool((ends <= 0).all())
        self.lower[k][row[is_on], neuron[is_on]] = -ends[is_on]
        self.upper[k][row[~is_on], neuron[~is_on]] = ends[~is_on]

    def slopes_at(self, top, row, corner):
        """Returns lower slopes: 1 for open neurons that are on at a corner of the box. Any slopes in [0, 1] are
        valid."""
        bits = corner[:, None] >> np.arange(self.low.shape[1]) & 1
        h = np.where(bits == 1, self.high[row], self.low[row])
        slopes = []
        for j in range(top):
            layer = self.layers[j]
            y = h @ layer.w.T + layer.b
            is_on = y > CORNER * (abs(h) @ abs(layer.w).T + abs(layer.b))
            is_open = layer.relu & (self.lower[j][row] < 0) & (self.upper[j][row] > 0)
            slopes.append(np.where(is_open, is_on * 1.0, self.below[j][row]))
            h = np.where(layer.relu, np.maximum(y, 0), y)
        return slopes


    def side_of(self, row, neuron, is_on):
        """Returns for neurons of the boxes `row`, numbered over all layers, the upper bound on y (on) or -y (off) as a
        form in x, see in_inputs(), and whether the neuron is open."""
        inputs = self.low.shape[1]
        form, (constant, absolute, error) = np.zeros((len(row), 1, inputs)), np.zeros((3, len(row), 1))
        is_open, most, first = np.zeros(len(row), dtype=bool), 0, 0
        for k, layer in enumerate(self.layers):
            mine = np.flatnonzero((neuron >= first) & (neuron < first + layer.outputs))
            at, i = row[mine], neuron[mine] - first
            sign = np.where(is_on[mine], 1.0, -1.0)
            found = self.in_inputs(k, (sign[:, None] * layer.w[i])[:, None], (sign * layer.b[i])[:, None], at,
                                   [slopes[at] for slopes in self.below])
            form[mine], constant[mine], absolute[mine], error[mine] = found[:4]
            is_open[mine] = layer.relu[i] & (self.lower[k][at, i] < 0) & (self.upper[k][at, i] > 0)
            most, first = max(most, found[4]), first + layer.outputs
        return form, constant, absolute, error, most, is_open

    def shown(self, row, first, first_on, second, second_on, weight):
        """Returns which conflicts hold: both neurons are open, and the weighted sum of y, negated if the state is off,
        is nowhere positive. Any two nonnegative weights that are not both zero are valid, so 1 - weight may be
        rounded."""
        one, other, rest = self.side_of(row, first, first_on), self.side_of(row, second, second_on), 1 - weight
        form, constant, absolute, error = (
            a * weight[:, None, None] + b * rest[:, None, None] if a.ndim == 3
            else a * weight[:, None] + b * rest[:, None]
            for a, b in zip(one[:4], other[:4]))
        size = abs(one[0]) * weight[:, None, None] + abs(other[0]) * rest[:, None, None]
        reach = np.maximum(abs(self.low[row]), abs(self.high[row]))
        error = error + 8 * U * (np.matmul(size, reach[:, :, None])[..., 0] + absolute)
        ends = self.largest(form, constant, absolute, error, one[4] + other[4] + 8, row)[:, 0]
        return one[5] & other[5] & (ends <= 0)


class Conflicts:
    """Columns first, is on, second, is on, weight, multiplier of the conflicts of all leaf numbers, concatenated."""

    def __init__(self, by_leaf):
        counts = np.array([len(some) for some in by_leaf])
        self.counts, self.start = counts, np.concatenate([[0], np.cumsum(counts)[:-1]])
        flat = np.array([one for some in by_leaf for one in some], dtype=float).reshape(-1, 6)
        self.first, self.second = flat[:, 0].astype(np.int64), flat[:, 2].astype(np.int64)
        self.first_on, self.second_on = flat[:, 1] == 1, flat[:, 3] == 1
        self.weight, self.multiplier = flat[:, 4], flat[:, 5]

    def of(self, leaves):
        """Returns (index in `leaves`, number) of each conflict of these leaves."""
        counts = self.counts[leaves]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return np.repeat(np.arange(len(leaves)), counts), np.repeat(self.start[leaves], counts) + within


class Inequality:
    """The matrix S of a batch of parts for |df|^2 <= rho |dx|^2, in the moving inputs and the increments of open
    neurons; rows of other neurons are those of the identity."""

    def __init__(self, layers, gram, gram_error, moving, weight, rho):
        self.layers, self.gram, self.gram_error, self.rho, self.moving = layers, gram, gram_error, rho, len(moving)
        self.inputs = np.zeros((layers[0].inputs, len(moving)))
        self.inputs[moving, np.arange(len(moving))] = weight
        self.size = len(moving) + sum(layer.outputs for layer in layers)

    def are_positive_definite(self, bounds, t, conflicts):
        """Returns whether all S are positive definite. `bounds`: bounds of the parts; `conflicts`: (part, neuron, is
        on, neuron, is on, multiplier) of the conflicts that hold."""
        parts, n, p = len(t), self.size, self.moving
        s = np.zeros((parts, n, n))
        s[:, range(p), range(p)] = self.rho
        z, first, rows = np.zeros((1, self.layers[0].inputs, n)), p, []
        z[0, :, :p] = self.inputs
        for k, layer in enumerate(self.layers):
            y = np.matmul(layer.w, z)
            is_open = layer.relu & (bounds.lower[k] < 0) & (bounds.upper[k] > 0)
            is_off = layer.relu & ~is_open & ~(bounds.lower[k] >= 0)
            own, last = np.arange(first, first + layer.outputs), first + layer.outputs
            times = np.where(is_open, t[:, first - p:last - p], 0)
            part = times[:, :, None] * y
            s[:, first:last] -= part
            s[:, :, first:last] -= part.swapaxes(1, 2)
            s[:, own, own] += np.where(is_open, 2 * times, 1)
            rows.append((y, times, is_open, is_off))
            z = np.where((is_open | is_off)[:, :, None], 0, y)
            z[:, np.arange(layer.outputs), own] += is_open
            first = last
        s -= np.matmul(z.swapaxes(1, 2), np.matmul(self.gram, z))
        if len(conflicts[0]):
            self.subtract(conflicts, rows, s)
        diagonal = s[:, range(n), range(n)]
        if not (np.isfinite(s).all() and (diagonal > 0).all()):
            return False
        d = np.ldexp(1.0, -(np.frexp(diagonal)[1] // 2))
        if d.max() > 2.0 ** 300:  # underflow would matter
            return False
        s *= d[:, :, None] * d[:, None]
        shift = self.error(rows, abs(z), d, conflicts) * 1.01
        shift = shift + 1.1 * gamma(n + 2) * s[:, range(n), range(n)].sum(1) + 16 * U
        s[:, range(n), range(n)] -= shift[:, None]
        try:
            return bool(np.isfinite(np.linalg.cholesky(s)).all())
        except np.linalg.LinAlgError:
            return False

    def subtract(self, conflicts, rows, s):
        """Subtracts the terms of conflicts: u_1 u_2 = 0, u = dz (on) or dy - dz (off), times any multiplier."""
        part, first, first_on, second, second_on, multiplier = conflicts
        for start in range(0, len(part), 512):
            some = slice(start, start + 512)
            p = self.factors(part[some], first[some], first_on[some], rows)
            q = self.factors(part[some], second[some], second_on[some], rows) * multiplier[some, None]
            both = p[:, :, None] * q[:, None]
            np.subtract.at(s, part[some], both + both.swapaxes(1, 2))

    def factors(self, part, neuron, is_on, rows):
        result = np.zeros((len(part), self.size))
        first = 0
        for layer, (y, _, _, _) in zip(self.layers, rows):
            mine = np.flatnonzero(~is_on & (neuron >= first) & (neuron < first + layer.outputs))
            at = part[mine] if len(y) > 1 else np.zeros(len(mine), dtype=int)
            result[mine] = y[at, neuron[mine] - first]
            first += layer.outputs
        result[np.arange(len(part)), self.moving + neuron] += np.where(is_on, 1.0, -1.0)
        return result

    def error(self, rows, z, d, conflicts):
        """Returns an upper bound on the norm of D (S - true S) D. For the errors R of the increments as forms, only R d
        is computed: the sum of all entries of a nonnegative matrix bounds its norm, and so does the largest row sum of
        a symmetric one."""
        radius, squares, first = np.zeros((1, self.layers[0].inputs)), 0, self.moving
        here, radii, sizes = d[:, :first] @ abs(self.inputs).T, [], []  # here: |what enters the layer| d
        for layer, (y, times, is_open, is_off) in zip(self.layers, rows):
            last = first + layer.outputs
            radius = (radius @ abs(layer.w).T + gamma(layer.inputs + 2) * (here @ abs(layer.w).T)) * 1.01
            size = np.matmul(abs(y), d[:, :, None])[..., 0]
            wrong = d[:, first:last] * times * (radius + 8 * U * (size + 2 * d[:, first:last]))
            squares = squares + (wrong ** 2).sum(1)
            radii.append(radius)
            sizes.append(size)
            radius = np.where(is_open | is_off, 0, radius)
            here = np.where(is_open, d[:, first:last], np.where(is_off, 0, size))
            first = last
        n = len(self.gram)
        whole = abs(self.gram) + self.gram_error
        loose = self.gram_error + gamma(6 * n + 20) * whole
        along = np.matmul(z, d[:, :, None])[..., 0]
        out = (np.matmul((along @ loose)[:, None], z)[:, 0] * d).max(1)
        cross = ((along @ whole) * radius).sum(1) * 2 + ((radius @ whole) * radius).sum(1)
        total = 2 * np.sqrt(squares) * 1.01 + 1.01 * (out + cross) + 8 * U * self.rho * (d[:, :self.moving] ** 2).max(1)
        if len(conflicts[0]):
            self.add_error_of(conflicts, np.concatenate(radii, 1), np.concatenate(sizes, 1), d, total)
        return total

    def add_error_of(self, conflicts, radii, sizes, d, total):
        part, first, first_on, second, second_on, multiplier = conflicts
        wrong, size = ([np.where(is_on, 0, radii[part, neuron])
                        for neuron, is_on in ((first, first_on), (second, second_on))],
                       [np.where(is_on, 0, sizes[part, neuron]) + d[part, self.moving + neuron]
                        for neuron, is_on in ((first, first_on), (second, second_on))])
        each = wrong[0] * size[1] + size[0] * wrong[1] + wrong[0] * wrong[1] + 16 * U * size[0] * size[1]
        # Sums of the previous entry and several conflicts: the error of each addition is at most U times the sum of all
        # absolute values.
        counts = np.bincount(part, minlength=len(total))[part]
        each += 2 * U * counts * size[0] * size[1]
        np.add.at(total, part, 2.02 * abs(multiplier) * each)


class Walk:
    """The parts of a tree, level by level: their boxes and bounds on their neurons, which stay within those of the
    parent part."""

    def __init__(self, layers, boxes, tree, inequality, multipliers, conflicts):
        self.layers, self.inequality, self.multipliers, self.conflicts = layers, inequality, multipliers, conflicts
        self.parent, self.depth, self.leaf = np.array(tree.parent), np.array(tree.depth), np.array(tree.leaf)
        self.coordinate, self.upper = np.array(tree.coordinate), np.array(tree.upper)
        self.decisions = np.array(tree.decisions, dtype=np.int64).reshape(-1, 4)
        self.low, self.high = (np.array([box[side] for box in boxes], dtype=float) for side in (0, 1))
        widest = 2 * max(layer.outputs for layer in layers) ** 2
        self.at_once = max(1, min(1024, MOST_AT_ONCE // max(inequality.size ** 2, widest)))

    def names_what_exists(self):
        splits = self.coordinate[self.depth > 0]
        neurons = sum(layer.outputs for layer in self.layers)
        return (self.leaf.max() < len(self.multipliers) and (len(splits) == 0 or splits.max() < self.layers[0].inputs)
                and (len(self.decisions) == 0 or self.decisions[:, 1].max() < neurons))

    def halve(self, nodes, position):
        """Computes the boxes of `nodes` from those of their parents; returns False if that fails."""
        self.low, self.high = self.low[position], self.high[position]
        row, k, is_upper = np.arange(len(nodes)), self.coordinate[nodes], self.upper[nodes]
        low, high = self.low[row, k], self.high[row, k]
        middle = low + (high - low) / 2
        self.low[row, k] = np.where(is_upper, middle, low)
        self.high[row, k] = np.where(is_upper, high, middle)
        return ((low <= middle) & (middle <= high)).all()

    def holds(self):
        before, around = None, None
        for level in range(self.depth.max() + 1):
            nodes = np.flatnonzero(self.depth == level)
            position = self.coordinate[nodes] if level == 0 else np.searchsorted(before, self.parent[nodes])
            if level == 0:
                self.low, self.high = self.low[position], self.high[position]
            elif not self.halve(nodes, position):
                return False
            if around is not None:
                around = [[ends[position] for ends in side] for side in around]
            around = self.bounds_of(nodes, around)
            if around is None:
                return False
            before = nodes
        return True

    def bounds_of(self, nodes, around):
        """Returns the bounds of all nodes of a level, or None if a decision or the claim of a leaf does not hold."""
        found = [[np.empty((len(nodes), layer.outputs)) for layer in self.layers] for _ in range(2)]
        told = self.decisions[np.isin(self.decisions[:, 0], nodes)]
        told_row = np.searchsorted(nodes, told[:, 0])
        for start in range(0, len(nodes), self.at_once):
            chunk = slice(start, min(start + self.at_once, len(nodes)))
            mine = (told_row >= chunk.start) & (told_row < chunk.stop)
            bounds = Bounds(self.layers, self.low[chunk], self.high[chunk],
                            around and [[ends[chunk] for ends in side] for side in around],
                            (told_row[mine] - chunk.start, told[mine, 1], told[mine, 2] == 1, told[mine, 3]))
            if not bounds.are_decided or not self.leaves_hold(bounds, self.leaf[nodes[chunk]]):
                return None
            for side, ends in zip(found, (bounds.lower, bounds.upper)):
                for k, of_layer in enumerate(ends):
                    side[k][chunk] = of_layer
        return found

    def leaves_hold(self, bounds, leaf):
        rows = np.flatnonzero(leaf >= 0)
        if len(rows) == 0:
            return True
        c, (part, number) = self.conflicts, self.conflicts.of(leaf[rows])
        if len(part):
            is_shown = bounds.shown(rows[part], c.first[number], c.first_on[number], c.second[number],
                                    c.second_on[number], c.weight[number])
            part, number = part[is_shown], number[is_shown]
        of_leaves = Leaves([ends[rows] for ends in bounds.lower], [ends[rows] for ends in bounds.upper])
        return self.inequality.are_positive_definite(of_leaves, self.multipliers[leaf[rows]], (
            part, c.first[number], c.first_on[number], c.second[number], c.second_on[number], c.multiplier[number]))


Leaves = namedtuple("Leaves", "lower upper")


@np.errstate(all="ignore")  # values that are not finite are treated as unbounded
def holds(layers, boxes, text, gram, moving, weight, rho, multipliers, conflicts):
    """Returns whether a tree of splits, leaves and decisions proves its parts.

    layers: (W, b, outputs without ReLU); boxes: (low, high); gram: (G, error of its entries); multipliers: one row per
    number of a leaf; conflicts: (neuron, is on, neuron, is on, weight, multiplier) for each such number. All numbers
    are doubles and exact except for G."""
    layers = [Layer(*layer) for layer in layers]
    try:
        tree = Tree(text, len(boxes))
    except ValueError:
        return False
    walk = Walk(layers, boxes, tree, Inequality(layers, *gram, moving, weight, rho), multipliers, Conflicts(conflicts))
    return walk.names_what_exists() and walk.holds()
