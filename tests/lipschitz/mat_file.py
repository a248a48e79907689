"""MATLAB's .mat files of version 5 (save -v6, save -v7, scipy.io.savemat) for check_certificate.py."""
import math
import struct
import zlib

from named_arrays import Array, need, tensors_of
from onnx_file import MOST_NUMBERS, Refused

# Types of data elements, with the codes of struct; classes of arrays.
NUMBERS = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 7: "f", 9: "d"}
INT8, INT32, UINT32, MATRIX, COMPRESSED = 1, 5, 6, 14, 15
CELL, STRUCT, DOUBLE, SINGLE, LAST_NUMERIC = 1, 2, 6, 7, 15
MOST_CELLS, MOST_BYTES = 4096, 2 ** 27
SAVE = "save in MATLAB with save('net.mat', 'weights', '-v7'), or with scipy.io.savemat"
COPY = "copy the file again"


class Variable:
    """`array`: numbers. `cells`: arrays of a cell array. `fields`: variables of a struct. At most one is not None."""

    def __init__(self, name="", array=None, cells=None, fields=None):
        self.name, self.array, self.cells, self.fields = name, array, cells, fields


def elements(data):
    """Yields (type, bytes) of consecutive data elements."""
    at = 0
    while at < len(data):
        need(len(data) - at >= 8, f"a data element is cut off; {COPY}")
        first, second = struct.unpack_from("<2I", data, at)
        if first >> 16:  # size and type share a word
            need(first >> 16 <= 4, f"a small data element has more than 4 bytes; {COPY}")
            yield first & 0xffff, data[at + 4:at + 4 + (first >> 16)]
            at += 8
            continue
        need(second <= len(data) - at - 8, f"a data element is longer than what holds it; {COPY}")
        yield first, data[at + 8:at + 8 + second]
        at += 8 + second
        if first != COMPRESSED:
            at = min(len(data), (at + 7) // 8 * 8)


def expect(parts, kind, what):
    found = next(parts, None)
    need(found is not None and kind in (None, found[0]), f"an array lacks its {what}; {COPY}")
    return found


def unpacked(code, data):
    size = struct.calcsize(code)
    return list(struct.unpack(f"<{len(data) // size}{code}", data[:len(data) // size * size]))


def rows_first(numbers, shape):
    if len(shape) != 2 or not numbers:
        return numbers
    return [numbers[j * shape[0] + i] for i in range(shape[0]) for j in range(shape[1])]


def array_of(parts, name, shape, is_single):
    kind, data = expect(parts, None, "numbers")
    need(kind in NUMBERS, f'"{name}" holds numbers of type {kind}, which is not read; {SAVE}')
    numbers = list(map(float, unpacked(NUMBERS[kind], data)))
    need(len(numbers) == math.prod(shape), f'"{name}" holds {len(numbers)} numbers for the shape {shape}; {COPY}')
    return Array(name, shape, rows_first(numbers, shape), is_single)


def fields_of(parts, name):
    """Names of fields have the same length and are padded with zeros."""
    lengths, (_, names) = unpacked("i", expect(parts, INT32, "length of names")[1]), expect(parts, INT8, "field names")
    length = lengths[0] if len(lengths) == 1 else 0
    need(length >= 1 and len(names) // length <= MOST_CELLS, f'"{name}": the names of its fields are damaged; {COPY}')
    fields = []
    for at in range(0, len(names) - length + 1, length):
        field = variable(expect(parts, MATRIX, "fields")[1], "struct")
        field.name = names[at:at + length].split(b"\0")[0].decode("latin-1")
        if field.array:
            field.array.name = field.name
        fields.append(field)
    return fields


def cells_of(parts, name, count):
    need(count <= MOST_CELLS, f'"{name}" has more than 4096 cells')
    cells = []
    for k in range(count):
        cell = variable(expect(parts, MATRIX, "cells")[1], "cell")
        need(cell.array, f'"{name}": cell {k + 1} is not a numeric array; {SAVE}')
        cells.append(cell.array)
    return cells


def variable(data, inside):
    """`inside`: "file", "cell" or "struct"."""
    if not data:
        return Variable()
    parts = elements(data)
    flags = expect(parts, UINT32, "flags")[1]
    need(len(flags) == 8, f"the flags of an array are damaged; {COPY}")
    word = struct.unpack("<I", flags[:4])[0]
    shape = unpacked("i", expect(parts, INT32, "size")[1])
    need(2 <= len(shape) <= 8 and min(shape) >= 0 and math.prod(shape) <= MOST_NUMBERS,
         f"an array has a size that is not read: {shape}; {SAVE}")
    name = expect(parts, INT8, "name")[1].decode("latin-1")
    kind = word & 0xff
    if kind == CELL and inside != "cell":
        return Variable(name, cells=cells_of(parts, name, math.prod(shape)))
    if kind == STRUCT and inside == "file" and math.prod(shape) == 1:
        return Variable(name, fields=fields_of(parts, name))
    if DOUBLE <= kind <= LAST_NUMERIC:
        need(not word & 0x800, f'"{name}" holds complex numbers; {SAVE}')
        return Variable(name, array=array_of(parts, name, shape, kind == SINGLE))
    return Variable(name)


def variables_of(data):
    result, room = [], MOST_BYTES
    for kind, element in elements(data[128:]):
        if kind == COMPRESSED:
            stream = zlib.decompressobj()
            try:
                element = stream.decompress(element, room + 1)
            except zlib.error as fault:
                raise Refused(f"its compressed data are damaged ({fault}); {COPY}") from None
            need(len(element) <= room, "decompresses to more than 128 MiB; save without compression: save(..., '-v6')")
            need(stream.eof, f"its compressed data are damaged; {COPY}")
            room -= len(element)
            kind, element = expect(elements(element), MATRIX, "contents")
        need(kind == MATRIX, f"a data element is not an array; {COPY}")
        result.append(variable(element, "file"))
        need(len(result) <= MOST_CELLS, "holds more than 4096 variables")
    return result


def looks_like_mat(data):
    return len(data) >= 128 and data[:7] == b"MATLAB " and data[126:128] in (b"IM", b"MI")


def read_mat(data):
    """Returns the tensors of a .mat file: a cell array "weights", matrices, or one struct of these."""
    need(data[126:128] == b"IM", f"the numbers are not little-endian; {SAVE}")
    need(data[124:126] != b"\0\2", "is a .mat file of version 7.3 (HDF5), which this checker does not read; "
         f"{SAVE}, and certify that file")
    need(data[124:126] == b"\0\1", f"is a .mat file of an unknown version; {SAVE}")
    variables = variables_of(data)
    are_weights = lambda one: one.cells is not None and one.name in ("weights", "W")
    structs = [one for one in variables if one.fields is not None]
    if len(structs) == 1 and not any(one.array or are_weights(one) for one in variables):
        variables = structs[0].fields
    cells, arrays = [], []
    for one in variables:
        if one.cells is not None and (are_weights(one) or one.name in ("biases", "bias", "b")):
            for k, cell in enumerate(one.cells):
                cell.name = f"layer{k + 1}.{'weight' if are_weights(one) else 'bias'}"
                cells.append(cell)
        elif one.array:
            arrays.append(one.array)
    has_weights = any(map(are_weights, variables))
    need(has_weights or arrays, f'holds neither a cell array "weights" nor numeric matrices; {SAVE}')
    return tensors_of(cells if has_weights else arrays)
