"""NumPy's .npz archives for check_certificate.py, and the names by which arrays of .npz and .mat files are layers."""
import math
import re
import struct
import zipfile
from io import BytesIO

from effective_weights import Tensor
from onnx_file import MOST_NUMBERS, Refused

MOST_ARRAYS = 4096
NAMES = "name the arrays W1, b1, W2, b2, ... or fc1.weight, fc1.bias, ..., matrices as [outputs, inputs]"
HEADER = re.compile(r"\s*\{\s*'descr'\s*:\s*'([^']*)'\s*,\s*'fortran_order'\s*:\s*(\w+)\s*,\s*'shape'\s*:\s*"
                    r"\(([0-9,\s]*)\)\s*,?\s*\}\s*", re.ASCII)
WORDS = [("weights", "weight"), ("weight", "weight"), ("W", "weight"), ("w", "weight"), ("biases", "bias"),
         ("bias", "bias"), ("B", "bias"), ("b", "bias")]


def need(condition, reason):
    if not condition:
        raise Refused(reason)


class Array:
    """A named array, its numbers row by row. `is_float32`: stored as float32 or float16."""

    def __init__(self, name, shape, numbers, is_float32):
        self.name, self.shape, self.numbers, self.is_float32 = name, shape, numbers, is_float32

    def is_vector(self):
        return len(self.shape) == 1 or len(self.shape) == 2 and 1 in self.shape


# --- names ---------------------------------------------------------------------------------------------------------

def tensor_name_of(name):
    """Returns "fc1.weight" for "fc1_weight" and "layer1.bias" for "b1"; None for other names."""
    stem, number = re.fullmatch(r"(.*?)([0-9]*)", name, re.DOTALL | re.ASCII).groups()
    if number:
        stem = stem.removesuffix("_")
        for word, part in WORDS:
            if stem == word:
                return f"layer{number}.{part}"
    for word, part in WORDS:
        for mark in "._/":
            if name.endswith(mark + word) and len(name) > len(word) + 1:
                return f"{name[:-len(word) - 1]}.{part}"
        if name == word:
            return part
    return None


def place_of(name):
    """Returns 12 for NumPy's "arr_12"; None for other names."""
    found = re.fullmatch(r"arr_([0-9]{1,4})", name, re.ASCII)
    return int(found[1]) if found else None


def names_by_place(arrays):
    """Each matrix begins a layer; biases whose length is the number of its outputs complete it."""
    names, layer, outputs = [], 0, 0
    for array in arrays:
        are_biases = outputs > 0 and array.is_vector() and len(array.numbers) == outputs
        layer += not are_biases
        names.append(f"layer{layer}.{'bias' if are_biases else 'weight'}")
        outputs = 0 if are_biases or not array.shape else array.shape[0]
    return names


def tensors_of(arrays):
    """Returns the arrays as tensors of layers."""
    if arrays and all(place_of(array.name) is not None for array in arrays):
        arrays = sorted(arrays, key=lambda array: place_of(array.name))
        names = names_by_place(arrays)
    else:
        names = [tensor_name_of(array.name) for array in arrays]
        for array, name in zip(arrays, names):
            need(name is not None, f'"{array.name}" is neither the weights nor the biases of a layer; {NAMES}')
    precision = "float32" if all(array.is_float32 for array in arrays) else "float64"
    result = []
    for array, name in zip(arrays, names):
        shape = [len(array.numbers)] if name.endswith("bias") and array.is_vector() else array.shape
        result.append(Tensor(name, shape, precision, lambda array=array: array.numbers))
    return result


# --- .npz ----------------------------------------------------------------------------------------------------------

def looks_like_npz(data):
    """The name of a zip archive's first entry begins at offset 30; its length is at offset 26."""
    if len(data) < 30 or data[:4] != b"PK\3\4":
        return False
    length = struct.unpack("<H", data[26:28])[0]
    return length >= 4 and data[26 + length:30 + length] == b".npy"


def npy(data, entry):
    """Returns shape, numbers, and whether they are float32 or float16, of the bytes of a .npy array."""
    again = "save with numpy.savez"
    need(len(data) >= 12 and data[:6] == b"\x93NUMPY" and 1 <= data[6] <= 3, f"{entry} is not a .npy array; {again}")
    begin = 10 if data[6] == 1 else 12
    length = int.from_bytes(data[8:begin], "little")
    need(length <= 65536 and length <= len(data) - begin, f"{entry}: the header is too long; copy the file again")
    found = HEADER.fullmatch(data[begin:begin + length].decode("latin-1"))
    need(found, f"{entry}: its header is not as numpy.savez writes it; {again}")
    kind, fortran, sizes = found.groups()
    need(fortran == "False", f"{entry}: fortran_order must be False; numpy.ascontiguousarray(array) before saving")
    need(kind in ("<f2", "<f4", "<f8"), f"{entry}: '{kind}': numbers must be little-endian float16, float32 or "
         'float64; array.astype("float64") before saving')
    need(re.fullmatch(r"\s*([0-9]+\s*(,\s*[0-9]+\s*)*,?\s*)?", sizes), f"{entry}: its shape is damaged; {again}")
    shape = [int(size) for size in re.findall("[0-9]+", sizes)]
    need(len(shape) <= 8, f"{entry}: has more than 8 dimensions; {again}")
    count, width, code = math.prod(shape), int(kind[2]), {"<f2": "e", "<f4": "f", "<f8": "d"}[kind]
    need(count <= MOST_NUMBERS, f"{entry}: has more than 2^25 numbers")
    need(count * width == len(data) - begin - length, f"{entry}: its shape {shape} does not fit its data; copy the "
         "file again")
    return shape, list(struct.unpack_from(f"<{count}{code}", data, begin + length)), kind != "<f8"


def entries_of(data, what):
    """Returns the zip archive and its entries by name."""
    archive = zipfile.ZipFile(BytesIO(data))
    entries = {info.filename: info for info in archive.infolist()}
    need(len(entries) == len(archive.infolist()), f"{what} holds an entry twice")
    need(len(entries) <= 10_000, f"{what} has more than 10000 entries")
    for name, info in entries.items():
        need(info.compress_type == zipfile.ZIP_STORED and not info.flag_bits & 1, f"{name}: the entry is compressed or "
             "encrypted; save again with torch.save or numpy.savez, which do neither")
        need(info.file_size == info.compress_size, f"{name}: the entry states two sizes; copy the file again")
    return archive, entries


def read_npz(data):
    """Returns the tensors of an .npz archive."""
    archive, entries = entries_of(data, "the archive")
    need(len(entries) <= MOST_ARRAYS, "the archive holds more than 4096 arrays")
    need(sum(info.file_size for info in entries.values()) <= 8 * MOST_NUMBERS, "the archive is larger than 256 MiB")
    arrays = []
    for name, info in entries.items():
        need(name.endswith(".npy"), f'"{name}" is not a .npy array; save with numpy.savez')
        arrays.append(Array(name[:-4], *npy(archive.read(info), name)))
    return tensors_of(arrays)
