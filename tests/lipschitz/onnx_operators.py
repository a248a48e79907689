"""What linear, shape and sorting operators of ONNX compute, for onnx_graphs.py."""
import itertools
import math
import struct

from onnx_file import MOST_ROWS, MOST_STEP, MOST_WINDOW_NUMBERS, need, Unread
from onnx_maps import divided, exactly, Map, ONE, opposite, plus, square_root, stacked, Sum, times, Value, ZERO


def axis_of(axis, rank):
    need(-rank <= axis < rank, f"axis {axis} does not exist")
    return axis % rank


def places(shape):
    """Yields the indices of all entries, row by row."""
    return itertools.product(*map(range, shape))


def index_of(place, shape):
    index = 0
    for at, size in zip(place, shape):
        index = index * size + at
    return index


def broadcast(tensor, shape):
    """Returns the numbers of a tensor, one per entry of `shape`."""
    need(tensor.is_float(), "its constant must be float16, bfloat16, float32 or float64",
         "convert before exporting: model.float()")
    own = list(tensor.shape)
    while len(own) > len(shape) and own[0] == 1:
        own.pop(0)
    own = [1] * (len(shape) - len(own)) + own
    need(len(own) == len(shape) and all(n in (1, size) for n, size in zip(own, shape)),
         f"its constant of shape {tensor.shape} does not fit its input")
    return [exactly(tensor.numbers[index_of([0 if n == 1 else at for n, at in zip(own, place)], own)])
            for place in places(shape)]


def need_trailing_axes(node, tensor, shape, operator_set):
    """Refuses a constant that operator sets before 7 align with other axes than the last ones of `shape`."""
    own, rank = len(tensor.shape), len(shape)
    if own >= rank or tensor.is_float() and len(tensor.numbers) == 1:
        return
    is_by_channel = node.kind == "PRelu" and 0 < operator_set < 7
    need(node.number("axis", 1 if is_by_channel else rank - own) in (rank - own, -own),
         "aligns its constant with other axes than the last ones, as before operator set 7",
         "export with operator set 7 or newer")


def need_inference(node, mode=None):
    """Refuses training mode, which is stated by an attribute, the input `mode` of Dropout, or, for BatchNormalization
    before operator set 14, by the number of outputs."""
    trains = node.number("training_mode", 0) != 0 or node.number("is_test", 1) == 0 or \
        mode is not None and mode.integers() != [0]
    if node.kind == "BatchNormalization" and "is_test" not in node.attributes:
        trains = trains or sum(name != "" for name in node.outputs) > 1
    need(not trains, "is in training mode", "export the model after model.eval()")


def need_exact_cast(to, numbers):
    """Refuses a cast of stored numbers that would change one of them."""
    def is_kept(x):
        if to == 1:
            return math.isinf(x) or abs(x) <= 2.0 ** 128 - 2.0 ** 104 and \
                struct.unpack("<f", struct.pack("<f", x))[0] == x
        return to == 11 or to in (6, 7) and abs(x) < 2.0 ** 31 and x == int(x)
    need(all(map(is_kept, numbers)), "rounds stored numbers",
         "fold constants: torch.onnx.export(..., do_constant_folding=True)")


def sizes_between(node, shape):
    """Returns the sizes `start` to `end` - 1 of a shape, both counted from the end if negative, limited to the rank."""
    rank = len(shape)
    start, end = (int(min(rank, max(0.0, at + rank if at < 0 else at)))
                  for at in (node.number("start", 0), node.number("end", rank)))
    return shape[start:end]


def reshaped(shape, wanted, zero_is_zero=False):
    count = math.prod(shape)
    sizes = [shape[k] if size == 0 and not zero_is_zero and k < len(shape) else size for k, size in enumerate(wanted)]
    known = math.prod(size for size in sizes if size != -1)
    need(all(size == -1 or 1 <= size <= count for size in sizes) and sizes.count(-1) <= 1
         and (count % known == 0 if -1 in sizes else known == count), "its shape does not fit its input")
    return [count // known if size == -1 else size for size in sizes]


def flattened(shape, axis):
    at = len(shape) if axis == len(shape) else axis_of(axis, len(shape))
    return [math.prod(shape[:at]), math.prod(shape[at:])]


def squeezed(shape, axes):
    named = {axis_of(axis, len(shape)) for axis in axes}
    result = [size for d, size in enumerate(shape) if not (d in named if axes else size == 1)]
    need(math.prod(result) == math.prod(shape), "its axes do not fit its input")
    return result


def unsqueezed(shape, axes):
    rank = len(shape) + len(axes)
    named, rest = {axis_of(axis, rank) for axis in axes}, iter(shape)
    need(rank <= 16 and len(named) == len(axes), "its axes do not fit its input")
    return [1 if d in named else next(rest) for d in range(rank)]


def transposition(shape, permutation):
    """Returns the shape of the result and, for each of its entries, the index of the original entry."""
    rank = len(shape)
    axes = [axis_of(axis, rank) for axis in permutation] if permutation else list(range(rank))[::-1]
    need(sorted(axes) == list(range(rank)), "perm is not a permutation of its axes")
    result, which = [shape[axis] for axis in axes], []
    for place in places(result):
        original = [0] * rank
        for axis, at in zip(axes, place):
            original[axis] = at
        which.append(index_of(original, shape))
    return result, which


def matrix_of(tensor, outputs_first):
    need(tensor.is_float() and len(tensor.shape) == 2 and tensor.numbers,
         f"its weights of shape {tensor.shape} are no float32 or float64 matrix")
    first, second = tensor.shape
    rows = [tensor.numbers[i * second:(i + 1) * second] for i in range(first)]
    return rows if outputs_first else list(map(list, zip(*rows)))


def dense(rows, shifts):
    return Map([{j: x for j, x in enumerate(row) if x != ZERO} for row in rows], shifts)


def biases(tensor, factor, repeats, size):
    if tensor is None:
        return [ZERO] * size
    count = len(tensor.numbers) if tensor.is_float() else 0
    need(count == 1 or count > 0 and count * repeats == size, f"its bias of shape {tensor.shape} does not fit")
    return [times(factor, exactly(tensor.numbers[0 if count == 1 else i // repeats])) for i in range(size)]


def need_row(shape, axis, inputs):
    need(shape and shape[axis] == inputs and math.prod(shape) == inputs,
         f"takes {inputs} inputs, but gets the shape {shape}")


def gemm_map(node, weight, bias, shape):
    alpha, beta = exactly(node.number("alpha", 1)), exactly(node.number("beta", 1))
    need(node.number("transA", 0) == 0, "transposes its input")
    rows = [[exactly(x) if alpha == ONE else times(alpha, exactly(x)) for x in row]
            for row in matrix_of(weight, node.number("transB", 0) != 0)]
    need_row(shape, -1, len(rows[0]))
    return dense(rows, biases(bias, beta, 1, len(rows))), [1, len(rows)]


def matmul_map(weight, is_left, shape):
    rows = [[exactly(x) for x in row] for row in matrix_of(weight, is_left)]
    axis = len(shape) - (2 if is_left and len(shape) >= 2 else 1)
    need_row(shape, axis, len(rows[0]))
    return dense(rows, [ZERO] * len(rows)), shape[:axis] + [len(rows)] + shape[axis + 1:]


class Window:
    """Places of a window that slides along the axes behind the channels."""

    def __init__(self, node, shape, kernel):
        axes = len(kernel)
        need(axes > 0 and len(shape) == axes + 2 and shape[0] == 1,
             "its input must have the shape [1, channels, sizes...]")
        self.image, self.kernel = shape[2:], kernel
        self.stride, self.dilation = node.listed("strides", [1] * axes), node.listed("dilations", [1] * axes)
        for sizes in self.kernel, self.stride, self.dilation:
            need(len(sizes) == axes and all(1 <= size <= MOST_STEP for size in sizes),
                 "its strides or dilations do not fit its window")
        need(node.number("ceil_mode", 0) == 0, "ceil_mode is not 0")
        reach = [(k - 1) * d + 1 for k, d in zip(kernel, self.dilation)]
        mode, pads = node.text("auto_pad", "NOTSET"), node.listed("pads", [0] * 2 * axes)
        need(mode in ("NOTSET", "VALID", "SAME_UPPER", "SAME_LOWER"), "auto_pad is unknown")
        if mode == "NOTSET":
            need(len(pads) == 2 * axes, "pads does not fit its window")
            before, after = pads[:axes], pads[axes:]
        else:
            total = [0 if mode == "VALID" else max(0, (math.ceil(n / s) - 1) * s + r - n)
                     for n, s, r in zip(self.image, self.stride, reach)]
            before = [n // 2 if mode == "SAME_UPPER" else n - n // 2 for n in total]
            after = [n - b for n, b in zip(total, before)]
        need(all(0 <= pad <= MOST_STEP for pad in before + after), "pads does not fit its window")
        room = [n + b + a - r for n, b, a, r in zip(self.image, before, after, reach)]
        need(min(room) >= 0, "its window is larger than its input")
        self.before, self.out = before, [r // s + 1 for r, s in zip(room, self.stride)]

    def limit(self, factor, rows):
        if math.prod(self.out) * math.prod(self.kernel) * factor > MOST_WINDOW_NUMBERS or rows > MOST_ROWS:
            raise Unread("as a dense layer it has too many numbers", "certify a smaller network")

    def covered(self):
        """Returns for each place (number k of the window, entry that it covers), without padding."""
        result = []
        for place in places(self.out):
            start = [at * s - b for at, s, b in zip(place, self.stride, self.before)]
            inside = []
            for k, offset in enumerate(places(self.kernel)):
                at = [x + o * d for x, o, d in zip(start, offset, self.dilation)]
                if all(0 <= x < n for x, n in zip(at, self.image)):
                    inside.append((k, index_of(at, self.image)))
            result.append(inside)
        return result


def convolution_map(node, weight, bias, shape):
    need(weight.is_float() and len(weight.shape) >= 3 and weight.numbers,
         f"its weights of shape {weight.shape} are not a kernel")
    (outputs, per_group), kernel = weight.shape[:2], weight.shape[2:]
    window, groups = Window(node, shape, kernel), node.whole("group", 1)
    need(1 <= groups <= shape[1] and shape[1] == per_group * groups and outputs % groups == 0,
         f"its weights of shape {weight.shape} do not fit its input")
    count, image, size = math.prod(window.out), math.prod(window.image), math.prod(kernel)
    window.limit(outputs * per_group, outputs * count)
    covered, rows = window.covered(), []
    for o in range(outputs):
        first = o // (outputs // groups) * per_group
        for inside in covered:
            entries = (((first + c) * image + at, exactly(weight.numbers[(o * per_group + c) * size + k]))
                       for c in range(per_group) for k, at in inside)
            rows.append({column: x for column, x in entries if x != ZERO})
    return Map(rows, biases(bias, ONE, count, outputs * count)), [1, outputs] + window.out


def pooling(node, shape):
    """Returns for each place of a pooling window what it covers of a channel, its size, and the shape of the result."""
    need(len(shape) >= 3, "its input must have the shape [1, channels, sizes...]")
    kernel = shape[2:] if node.kind.startswith("Global") else node.listed("kernel_shape")
    window = Window(node, shape, kernel)
    window.limit(shape[1], shape[1] * math.prod(window.out))
    covered = [[at for _, at in inside] for inside in window.covered()]
    need(all(covered), "its window lies entirely in the padding")
    return covered, math.prod(kernel), shape[:2] + window.out


def average_map(node, shape):
    covered, size, result = pooling(node, shape)
    image, counts_padding = math.prod(shape[2:]), node.number("count_include_pad", 0) != 0
    shares = [divided(ONE, exactly(float(size if counts_padding else len(inside)))) for inside in covered]
    rows = [{channel * image + at: share for at in inside}
            for channel in range(shape[1]) for inside, share in zip(covered, shares)]
    return Map(rows, [ZERO] * len(rows)), result


def normalization(node, parameters, shape):
    """Returns for each entry factor and amount of batch normalization in inference, factor x + amount."""
    need_inference(node)
    channels = shape[1] if len(shape) > 1 else 0
    need(all(tensor.is_float() and len(tensor.numbers) == channels for tensor in parameters),
         "its parameters do not fit its channels")
    epsilon = exactly(node.number("epsilon", struct.unpack("<f", struct.pack("<f", 1e-5))[0]))
    repeats, factors, amounts = math.prod(shape) // max(channels, 1), [], []
    for scale, bias, mean, variance in zip(*(map(exactly, tensor.numbers) for tensor in parameters)):
        squared = plus(variance, epsilon)
        need(squared[0] > squared[1], "its variance is not positive")
        factor = divided(scale, square_root(squared))
        factors += [factor] * repeats
        amounts += [Sum().plus(bias).plus_product(opposite(factor), mean).value()] * repeats
    return factors, amounts


def padded(node, x, pads, filler, axes):
    rank = len(x.shape)
    need(axes is None or [axis_of(axis, rank) for axis in axes.integers()] == list(range(rank)),
         "its axes are not all axes of its input in order", "state pads for every axis")
    need(node.text("mode", "constant") == "constant", "its mode is not constant")
    need(len(pads) == 2 * rank and all(a >= 0 and b >= 0 and a + b <= MOST_STEP for a, b in zip(pads, pads[rank:])),
         "pads does not fit its input")
    shape = [n + a + b for n, a, b in zip(x.shape, pads, pads[rank:])]
    need(math.prod(shape) <= MOST_ROWS, "its result has more than 2^20 entries", "certify a smaller network")
    result = Map([], [])
    for place in places(shape):
        at = [p - before for p, before in zip(place, pads)]
        is_inside = all(0 <= k < n for k, n in zip(at, x.shape))
        result.rows.append(x.map.rows[index_of(at, x.shape)] if is_inside else {})
        result.shifts.append(x.map.shifts[index_of(at, x.shape)] if is_inside else exactly(filler))
    return Value(result, shape, x.first)


def concatenated(parts, axis):
    first = parts[0].shape
    axis = axis_of(axis, len(first))
    need(all(len(part.shape) == len(first) and part.shape[:axis] + part.shape[axis + 1:] ==
             first[:axis] + first[axis + 1:] for part in parts), "its inputs are of different shapes")
    shape = first[:axis] + [sum(part.shape[axis] for part in parts)] + first[axis + 1:]
    need(math.prod(shape) <= MOST_ROWS, "its result has more than 2^20 entries", "certify a smaller network")
    pieces = []
    for before in range(math.prod(first[:axis])):
        for part in parts:
            size = math.prod(part.shape[axis:])
            pieces.append(part.map.selected(range(before * size, (before + 1) * size)))
    return Value(stacked(pieces), shape, parts[0].first)


SORTING = ("MaxMin is Split into two halves, their Max and Min, and Concat, or ReduceMax and ReduceMin of pairs along "
           "the last axis and Concat; GroupSort is TopK of the whole last axis")


def sorting(node, shape, integers):
    """Returns the name of the operation in chains, the shape of the result, and which sorted number each entry is."""
    rank, which = len(shape), list(range(math.prod(shape)))
    if node.kind == "MaxMin":
        split, concat = node.parts[0], node.parts[-1]
        axis = axis_of(split.whole("axis", 0), rank)
        half = shape[axis] // 2
        need(shape[axis] == 2 * half and integers(split, 1, "split") in ([], [half, half]),
             "joins parts that are not halves", SORTING)
        need(axis_of(concat.whole("axis", 0), rank) == axis and math.prod(shape[:axis]) == 1,
             "does not join the halves of the whole layer along the axis of the Split before it", SORTING)
        return "maxmin:halves", shape, which
    if node.kind == "PairsMaxMin":
        *reduced, concat = node.parts
        for one in reduced:
            axes = integers(one, 1, "axes")
            need(rank >= 2 and len(axes) == 1 and axis_of(axes[0], rank) == rank - 1 and shape[-1] == 2
                 and one.whole("keepdims", 1) == 0,
                 "joins other maxima and minima than those of pairs along the last axis", SORTING)
        need(axis_of(concat.whole("axis", 0), rank - 1) == rank - 2 and math.prod(shape[:-2]) == 1,
             "does not join the maxima and minima of the whole layer", SORTING)
        return "maxmin:pairs", shape[:-2] + [2 * shape[-2]], which
    sizes = [node.whole("k", 0)] if "k" in node.attributes else integers(node, 1, "k")
    need(rank > 0 and axis_of(node.whole("axis", -1), rank) == rank - 1 and sizes == shape[-1:]
         and node.whole("sorted", 1) == 1, "does not sort the whole last axis", SORTING)
    size = shape[-1]
    need(2 <= size <= 64, "sorts groups of less than 2 or more than 64 numbers", SORTING)
    if node.whole("largest", 1) != 0:
        which = [k - k % size + size - 1 - k % size for k in which]
    return f"groupsort:{size}", shape, which
