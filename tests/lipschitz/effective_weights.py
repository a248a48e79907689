"""Weights under spectral_norm and weight_norm, for check_certificate.py: what PyTorch computes of the stored tensors
after eval(), each sum in exact integers and rounded once, as the C++ reader states it."""
import math
import struct

from onnx_file import Refused
from onnx_maps import divided, exactly, square_root, Sum

# Endings of the names: the stored matrix; u or g; v, "" for weight_norm.
STYLES = (("weight_orig", "weight_u", "weight_v"),
          ("parametrizations.weight.original", "parametrizations.weight.0._u", "parametrizations.weight.0._v"),
          ("weight_v", "weight_g", ""),
          ("parametrizations.weight.original1", "parametrizations.weight.original0", ""))
# Between these magnitudes a product of two doubles is the sum of two doubles, which the C++ reader needs to be exact.
SMALLEST, LARGEST = 2.0 ** -960, 2.0 ** 960
REMEDY = ("remove the parametrization before saving: torch.nn.utils.parametrize.remove_parametrizations(layer, "
          '"weight"), torch.nn.utils.remove_spectral_norm(layer) or torch.nn.utils.remove_weight_norm(layer)')


def need(condition, name, reason):
    if not condition:
        raise Refused(f"{name}: {reason}; {REMEDY}")


def prefix_before(name, ending):
    """Returns "fc1." for "fc1.weight_orig" and "weight_orig"; None for other names."""
    prefix = name.removesuffix(ending) if name.endswith(ending) else "."
    return prefix if prefix == "" or len(prefix) > 1 and prefix.endswith(".") else None


def numbers_of(tensor, shape):
    need(list(tensor.shape) == shape, tensor.name, f"has the shape {list(tensor.shape)}, and the parametrization needs "
         f"{shape}")
    need(tensor.precision is not None, tensor.name, "does not hold floating-point numbers")
    result = tensor.numbers()
    need(all(map(math.isfinite, result)), tensor.name, "holds a number that is not finite")
    return result


def sum_of_products(name, pairs):
    result = Sum()
    for a, b in pairs:
        need(a[0] == 0 or b[0] == 0 or SMALLEST <= abs(a[0] * b[0]) <= LARGEST, name,
             "the weight is computed from products below 2^-960 or above 2^960")
        result.plus_product(a, b)
    return result.value()


def usable(name, divisor):
    need(math.isfinite(divisor[0]) and abs(divisor[0]) > 2 * divisor[1], name,
         "the norm that the weight is divided by is 0")
    return divisor


def spectral_divisor(matrix, rows, u, v):
    """Returns u' W v."""
    products = [sum_of_products(matrix.name, [(exactly(a), exactly(b)) for a, b in zip(row, v)]) for row in rows]
    return usable(matrix.name, sum_of_products(matrix.name, zip(map(exactly, u), products)))


def entries(matrix, parts, style, prefix):
    """Returns the entries of the effective weight, each with a bound on its error."""
    need(len(matrix.shape) == 2 and min(matrix.shape) > 0, matrix.name, "only the weights of linear layers may be "
         "parametrised")
    outputs, inputs = matrix.shape
    stored = numbers_of(matrix, [outputs, inputs])
    rows = [stored[i * inputs:(i + 1) * inputs] for i in range(outputs)]
    if style[2]:
        need(prefix + style[2] in parts, matrix.name, f"the weight is under spectral_norm, but the file holds no "
             f"{prefix + style[2]}")
        divisor = spectral_divisor(matrix, rows, numbers_of(parts[prefix + style[1]], [outputs]),
                                   numbers_of(parts[prefix + style[2]], [inputs]))
        return [divided(exactly(x), divisor) for row in rows for x in row]
    found = []
    for g, row in zip(numbers_of(parts[prefix + style[1]], [outputs, 1]), rows):
        squares = sum_of_products(matrix.name, [(exactly(x), exactly(x)) for x in row])
        need(squares[0] > 0, matrix.name, "the norm that the weight is divided by is 0")
        length = usable(matrix.name, square_root(squares))
        found += [divided(sum_of_products(matrix.name, [(exactly(g), exactly(x))]), length) for x in row]
    return found


def is_float32(entry):
    value, radius = entry
    return radius == 0 and abs(value) <= 2.0 ** 128 - 2.0 ** 104 and struct.unpack(
        "<f", struct.pack("<f", value))[0] == value


class Tensor:
    """A named tensor. `precision`: None for numbers that are not read. `numbers`: a function that returns them, row by
    row. `is_float32`: of a computed weight, whether every entry is exact and a float32."""

    def __init__(self, name, shape, precision, numbers, is_float32=True):
        self.name, self.shape, self.precision, self.numbers = name, list(shape), precision, numbers
        self.is_float32 = is_float32


def with_effective_weights(tensors):
    """Returns the tensors with every parametrised weight replaced by its effective value, and whether there are any."""
    parts, matrices, used = {tensor.name: tensor for tensor in tensors}, {}, set()
    for tensor in tensors:
        for style in STYLES:
            prefix = prefix_before(tensor.name, style[0])
            if prefix is not None and prefix + style[1] in parts:
                matrices[tensor.name] = style, prefix
                used |= {prefix + ending for ending in style[1:] if ending}
    result = []
    for tensor in tensors:
        if tensor.name in used:
            continue
        if tensor.name not in matrices:
            need("parametrizations." not in tensor.name and
                 all(prefix_before(tensor.name, end) is None for end in ("weight_g", "weight_orig", "weight_u")),
                 tensor.name, "the weight is parametrised, and the file does not hold all that it is computed from")
            result.append(tensor)
            continue
        style, prefix = matrices[tensor.name]
        found = entries(tensor, parts, style, prefix)
        numbers = [value for value, _ in found]
        result.append(Tensor(f"{prefix}weight", tensor.shape, tensor.precision, lambda numbers=numbers: numbers,
                             all(map(is_float32, found))))
    return result, bool(matrices)
