"""Proofs by parts for check_certificate.py in double precision, many parts at once, with numpy. What `holds` accepts holds in
exact arithmetic, as every rounding error is bounded; what it does not accept has to be decided in fractions.

Error bounds are those of sums and products in any order (Higham 2002, sections 3.1 and 4.2): a sum of n products differs
from the exact one by at most n u / (1 - n u) times the sum of their absolute values. A Cholesky factorization that runs to
its end shows that a matrix of n rows, less gamma_(n+1) times its trace, is positive definite (Rump 2006, BIT 46).
"""
import re

import numpy as np

U = 2.0 ** -53
TINY = 2.0 ** -900
CORNER = 2.0 ** -30
MOST_AT_ONCE = 1 << 22  # numbers of an array of forms
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
    """Of all neurons over a batch of boxes, layer by layer, by linear relaxation of ReLU."""

    def __init__(self, layers, low, high, around, decisions):
        self.layers, self.low, self.high = layers, low, high
        self.lower, self.upper, self.terms, self.above, self.below, self.offset = [], [], [], [], [], []
        self.are_decided = True
        first = 0
        for k, layer in enumerate(layers):
            self.add_terms(k)
            both = np.concatenate([layer.w, -layer.w])[None]
            constant = np.concatenate([layer.b, -layer.b])[None]
            ends = self.largest(k, both, constant, slice(None), self.below)
            lower, upper = -ends[:, layer.outputs:], ends[:, :layer.outputs]
            if around is not None:
                lower, upper = np.maximum(lower, around[0][k]), np.minimum(upper, around[1][k])
            self.lower.append(lower)
            self.upper.append(upper)
            self.decide(k, first, decisions)
            self.relax(k)
            first += layer.outputs

    def add_terms(self, k):
        """At least |W| |h| + |b|."""
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

    def largest(self, top, form, constant, which, below):
        """Of forms in the inputs of layer `top`, [1 or parts, forms, inputs], over the boxes `which`: upper bounds. `below`:
        slopes below ReLU, one row per box of `which`."""
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
        low, high = self.low[which][:, :, None], self.high[which][:, :, None]
        value = constant + np.matmul(np.maximum(form, 0), high)[..., 0] + np.matmul(np.minimum(form, 0), low)[..., 0]
        absolute = absolute + np.matmul(abs(form), np.maximum(abs(low), abs(high)))[..., 0]
        terms += 2 * low.shape[1] + 16
        result = value + (2 * terms * U * absolute + 1.01 * error + TINY)
        result = np.nextafter(result, np.inf)
        return np.where(np.isfinite(result), result, np.inf)

    def decide(self, k, first, decisions):
        """Those of this layer, (row of the batch, neuron, is on, corner) as arrays."""
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
        ends = self.largest(k, (sign[:, None] * layer.w[neuron])[:, None], (sign * layer.b[neuron])[:, None], row,
                            self.slopes_at(k, row, corner))[:, 0]
        self.are_decided &= bool((ends <= 0).all())
        self.lower[k][row[is_on], neuron[is_on]] = -ends[is_on]
        self.upper[k][row[~is_on], neuron[~is_on]] = ends[~is_on]

    def slopes_at(self, top, row, corner):
        """Lower slopes: of open neurons, which are on at a corner of the box. Any in [0, 1] hold."""
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


class Inequality:
    """S of a batch of parts: |df|^2 <= rho |dx|^2 in the moving inputs and the increments of open neurons; rows of other
    neurons are those of the identity."""

    def __init__(self, layers, gram, gram_error, moving, weight, rho):
        self.layers, self.gram, self.gram_error, self.rho, self.moving = layers, gram, gram_error, rho, len(moving)
        self.inputs = np.zeros((layers[0].inputs, len(moving)))
        self.inputs[moving, np.arange(len(moving))] = weight
        self.size = len(moving) + sum(layer.outputs for layer in layers)

    def are_positive_definite(self, bounds, t):
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
            rows.append((abs(y), times, is_open, is_off))
            z = np.where((is_open | is_off)[:, :, None], 0, y)
            z[:, np.arange(layer.outputs), own] += is_open
            first = last
        s -= np.matmul(z.swapaxes(1, 2), np.matmul(self.gram, z))
        diagonal = s[:, range(n), range(n)]
        if not (np.isfinite(s).all() and (diagonal > 0).all()):
            return False
        d = np.ldexp(1.0, -(np.frexp(diagonal)[1] // 2))
        if d.max() > 2.0 ** 300:  # what underflows would matter
            return False
        s *= d[:, :, None] * d[:, None]
        shift = self.error(rows, abs(z), d) * 1.01 + 1.1 * gamma(n + 2) * s[:, range(n), range(n)].sum(1) + 16 * U
        s[:, range(n), range(n)] -= shift[:, None]
        try:
            return bool(np.isfinite(np.linalg.cholesky(s)).all())
        except np.linalg.LinAlgError:
            return False

    def error(self, rows, z, d):
        """At least the norm of D (S - true S) D. With R the error of increments as forms, only R d is followed: the sum of
        all entries of a matrix of no negative ones bounds its norm, and so does the largest sum of a row of a symmetric one."""
        radius, squares = np.zeros((1, self.layers[0].inputs)), 0
        before = np.zeros((1, self.layers[0].inputs, d.shape[1]))
        before[0, :, :self.moving] = abs(self.inputs)
        first = self.moving
        for layer, (y, times, is_open, is_off) in zip(self.layers, rows):
            last = first + layer.outputs
            here = np.matmul(before, d[:, :, None])[..., 0]
            radius = (radius @ abs(layer.w).T + gamma(layer.inputs + 2) * (here @ abs(layer.w).T)) * 1.01
            size = np.matmul(y, d[:, :, None])[..., 0]
            wrong = d[:, first:last] * times * (radius + 8 * U * (size + 2 * d[:, first:last]))
            squares = squares + (wrong ** 2).sum(1)
            radius = np.where(is_open | is_off, 0, radius)
            before = np.where((is_open | is_off)[:, :, None], 0, y)
            before[:, np.arange(layer.outputs), np.arange(first, last)] += is_open
            first = last
        n = len(self.gram)
        whole = abs(self.gram) + self.gram_error
        loose = self.gram_error + gamma(6 * n + 20) * whole
        along = np.matmul(z, d[:, :, None])[..., 0]
        out = (np.matmul((along @ loose)[:, None], z)[:, 0] * d).max(1)
        cross = ((along @ whole) * radius).sum(1) * 2 + ((radius @ whole) * radius).sum(1)
        return 2 * np.sqrt(squares) * 1.01 + 1.01 * (out + cross) + 8 * U * self.rho * (d[:, :self.moving] ** 2).max(1)


@np.errstate(all="ignore")  # what is not finite is taken for unbounded
def holds(layers, boxes, text, gram, moving, weight, rho, multipliers):
    """Whether a tree of splits, leaves and decisions proves its parts.

    layers: (W, b, outputs without ReLU); boxes: (low, high); gram: (G, error of its entries); multipliers: one row per
    number of a leaf. All numbers are doubles, and exact but for G."""
    layers = [Layer(*layer) for layer in layers]
    try:
        tree = Tree(text, len(boxes))
    except ValueError:
        return False
    parent, depth, leaf = np.array(tree.parent), np.array(tree.depth), np.array(tree.leaf)
    coordinate, upper = np.array(tree.coordinate), np.array(tree.upper)
    inputs = layers[0].inputs
    if leaf.max() >= len(multipliers) or (depth.max() > 0 and coordinate[depth > 0].max() >= inputs):
        return False
    decisions = np.array(tree.decisions, dtype=np.int64).reshape(-1, 4)
    neurons = sum(layer.outputs for layer in layers)
    if len(decisions) and decisions[:, 1].max() >= neurons:
        return False
    inequality = Inequality(layers, *gram, moving, weight, rho)
    at_once = max(1, min(1024, MOST_AT_ONCE // max(inequality.size ** 2, 2 * max(l.outputs for l in layers) ** 2)))
    low, high = np.array([box[0] for box in boxes], dtype=float), np.array([box[1] for box in boxes], dtype=float)
    before, around = None, None
    for level in range(depth.max() + 1):
        nodes = np.flatnonzero(depth == level)
        if level == 0:
            low, high = low[coordinate[nodes]], high[coordinate[nodes]]
        else:
            position = np.searchsorted(before, parent[nodes])
            low, high = low[position], high[position]
            row, k = np.arange(len(nodes)), coordinate[nodes]
            middle = low[row, k] + (high[row, k] - low[row, k]) / 2
            if not ((low[row, k] <= middle) & (middle <= high[row, k])).all():
                return False
            low[row, k] = np.where(upper[nodes], middle, low[row, k])
            high[row, k] = np.where(upper[nodes], high[row, k], middle)
        found = ([np.empty((len(nodes), l.outputs)) for l in layers], [np.empty((len(nodes), l.outputs)) for l in layers])
        told = decisions[depth[decisions[:, 0]] == level]
        told_row = np.searchsorted(nodes, told[:, 0])
        for start in range(0, len(nodes), at_once):
            chunk = slice(start, min(start + at_once, len(nodes)))
            mine = (told_row >= chunk.start) & (told_row < chunk.stop)
            parts = None
            if level > 0:
                parts = [[ends[position[chunk]] for ends in side] for side in around]
            bounds = Bounds(layers, low[chunk], high[chunk], parts,
                            (told_row[mine] - chunk.start, told[mine, 1], told[mine, 2] == 1, told[mine, 3]))
            if not bounds.are_decided:
                return False
            for k in range(len(layers)):
                found[0][k][chunk], found[1][k][chunk] = bounds.lower[k], bounds.upper[k]
            is_leaf = leaf[nodes[chunk]] >= 0
            if is_leaf.any():
                bounds.lower = [ends[is_leaf] for ends in bounds.lower]
                bounds.upper = [ends[is_leaf] for ends in bounds.upper]
                if not inequality.are_positive_definite(bounds, multipliers[leaf[nodes[chunk]][is_leaf]]):
                    return False
        before, around = nodes, found
    return True
