"""Weight files of every kind for the tests of the second and third readers, written with the standard library, and with
NumPy and SciPy where they are installed."""
import io
import random
import struct
import sys
import zipfile
import zlib
from pathlib import Path

sys.path.insert(1, str(Path(__file__).parent.parent / "proof"))
import weight_files  # noqa: E402
from weight_files import field, integers, node, varint  # noqa: E402

try:
    import numpy
    import scipy.io
except ImportError:  # numpy and scipy only write more files
    numpy = scipy = None

SPECIAL = {"float16": [0x0001, 0x8001, 0x03ff, 0x0400, 0x7bff, 0xfbff, 0x3c00, 0x8000],  # subnormal ... largest, 1, -0
           "bfloat16": [0x0001, 0x8001, 0x007f, 0x0080, 0x7f7f, 0xff7f, 0x3f80, 0x8000]}


def uniform(count, generator):
    return [generator.uniform(-1, 1) for _ in range(count)]


# --- ONNX ----------------------------------------------------------------------------------------------------------

def tensor(name, dims, kind, data, typed_field=None):
    """A stored tensor; `data`: raw bytes, or the contents of the field `typed_field`."""
    return field(5, b"".join(field(1, d) for d in dims) + field(2, kind) + field(8, name)
                 + field(typed_field or 9, data))


def half_model(kind, is_raw, generator):
    """Three layers of float16 or bfloat16 with a Reshape by int32 between them; the first numbers are special ones."""
    number, graph = {"float16": 10, "bfloat16": 16}[kind], b""
    for k, dims in enumerate([(4, 3), (4, 4), (2, 4)]):
        for name, shape in (f"w{k}", dims), (f"b{k}", dims[:1]):
            count = dims[0] * (dims[1] if name[0] == "w" else 1)
            bits = [generator.randrange(0x3000, 0x3c00) | generator.choice([0, 0x8000]) for _ in range(count)]
            if name == "w1":
                bits[:8] = SPECIAL[kind]
            raw = struct.pack(f"<{count}H", *bits)
            graph += tensor(name, shape, number, raw) if is_raw else \
                tensor(name, shape, number, b"".join(map(varint, bits)), 5)
        graph += node("Gemm", [f"h{k}", f"w{k}", f"b{k}"], [f"y{k}"], transB=1)
        if k < 2:
            graph += node("Relu", [f"y{k}"], [f"r{k}"]) + node("Reshape", [f"r{k}", f"shape{k}"], [f"h{k + 1}"])
    graph += tensor("shape0", [2], 6, struct.pack("<2i", 1, -1))
    graph += tensor("shape1", [2], 6, varint(2 ** 64 - 1) + varint(4), 5)
    return field(1, 7) + field(2, "test") + field(7, graph + field(11, field(1, "h0")) + field(12, field(1, "y2")))


# --- PyTorch -------------------------------------------------------------------------------------------------------

class Tensors:
    """A state dict of tensors that each have a storage of their own, for any type of numbers."""

    CODES = {"FloatStorage": "f", "DoubleStorage": "d", "HalfStorage": "e", "BFloat16Storage": "H"}

    def __init__(self, kind, values):
        """values: (name, shape, numbers); bfloat16 by their bits."""
        self.kind, self.values = kind, values

    def pickled(self):
        """Writes the pickle by hand, with protocol 2 and without memo."""
        text = lambda word: b"X" + struct.pack("<I", len(word)) + word.encode()
        whole = lambda n: b"J" + struct.pack("<i", n)
        tuple_ = lambda *parts: b"(" + b"".join(parts) + b"t"
        out = b"\x80\x02ccollections\nOrderedDict\n)R("
        for k, (name, shape, numbers) in enumerate(self.values):
            storage = tuple_(text("storage"), f"ctorch\n{self.kind}\n".encode(), text(str(k)), text("cpu"),
                             whole(len(numbers))) + b"Q"
            strides = [1] * len(shape)
            for d in range(len(shape) - 1, 0, -1):
                strides[d - 1] = strides[d] * shape[d]
            out += text(name) + b"ctorch._utils\n_rebuild_tensor_v2\n" + tuple_(
                storage, whole(0), tuple_(*map(whole, shape)), tuple_(*map(whole, strides)), b"\x89",
                b"ccollections\nOrderedDict\n)R") + b"R"
        return out + b"u."

    def zip(self):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr("net/data.pkl", self.pickled())
            for k, (_, _, numbers) in enumerate(self.values):
                archive.writestr(f"net/data/{k}", struct.pack(f"<{len(numbers)}{self.CODES[self.kind]}", *numbers))
        return out.getvalue()


def parametrized(style, kind, generator, exact=False):
    """A state dict of three layers, two of them under `style`: spectral_norm or weight_norm, old or new. `exact`: with
    numbers for which the weights are float32 numbers that need no rounding."""
    draw = (lambda n: [generator.choice([-1.0, 1.0]) * 2.0 ** generator.randrange(-2, 3) for _ in range(n)]) if exact \
        else (lambda n: [struct.unpack("<e", struct.pack("<e", x))[0] for x in uniform(n, generator)]
              if kind == "HalfStorage" else uniform(n, generator))
    values, sizes = [], [3, 5, 4, 2]
    for k, (inputs, outputs) in enumerate(zip(sizes, sizes[1:])):
        layer, matrix = f"fc{k + 1}", draw(inputs * outputs)
        bias = (f"{layer}.bias", [outputs], draw(outputs))
        if k == 2:
            values += [(f"{layer}.weight", [outputs, inputs], matrix), bias]
            continue
        u, v, g = draw(outputs), draw(inputs), draw(outputs)
        if exact and "spectral" in style:  # u' W v is the entry at the top left
            u, v = [1.0] + [0.0] * (outputs - 1), [1.0] + [0.0] * (inputs - 1)
        if exact and "weight" in style:  # one entry per row
            matrix = [x if i % inputs == 0 else 0.0 for i, x in enumerate(matrix)]
        stored = {"spectral_old": [("weight_orig", 2, matrix), ("weight_u", 1, u), ("weight_v", 0, v)],
                  "spectral_new": [("parametrizations.weight.original", 2, matrix),
                                   ("parametrizations.weight.0._u", 1, u), ("parametrizations.weight.0._v", 0, v)],
                  "weight_old": [("weight_g", 3, g), ("weight_v", 2, matrix)],
                  "weight_new": [("parametrizations.weight.original0", 3, g),
                                 ("parametrizations.weight.original1", 2, matrix)]}[style]
        shapes = [[inputs], [outputs], [outputs, inputs], [outputs, 1]]
        values += [bias] + [(f"{layer}.{name}", shapes[shape], numbers) for name, shape, numbers in stored]
    return Tensors(kind, values)


# --- .npz, .nnet, .mat ---------------------------------------------------------------------------------------------

def npy(shape, numbers, kind="<f8", version=1, blanks=""):
    text = f"{{'descr': {blanks}'{kind}', 'fortran_order': False, 'shape': ({', '.join(map(str, shape))}" \
           f"{',' if len(shape) == 1 else ''}), }}"
    begin = 10 if version == 1 else 12
    text += " " * (-(begin + len(text) + 1) % 64) + "\n"
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    code = {"<f2": "e", "<f4": "f", "<f8": "d"}[kind]
    return b"\x93NUMPY" + bytes([version, 0]) + length + text.encode() + struct.pack(f"<{len(numbers)}{code}", *numbers)


def npz(arrays, method=zipfile.ZIP_STORED):
    """arrays: (name, bytes of .npy)."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in arrays:
            archive.writestr(f"{name}.npy", data)
    return out.getvalue()


def arrays(generator, sizes=(3, 5, 4, 2)):
    """(shape, numbers) of weights and biases in turn."""
    return [(shape, uniform(shape[0] * (shape[1] if len(shape) == 2 else 1), generator))
            for inputs, outputs in zip(sizes, sizes[1:]) for shape in ((outputs, inputs), (outputs,))]


def npz_files(generator):
    found = arrays(generator)
    named = lambda names, kinds, version=1: [
        (name, npy(shape, numbers, kind, version)) for name, kind, (shape, numbers) in zip(names, kinds, found)]
    places = [f"arr_{k}" for k in range(6)]
    return {
        "names.npz": npz(named(["W1", "b1", "W2", "b2", "W3", "b3"], ["<f8"] * 6)),
        "words.npz": npz(named(["weights_3", "biases_3", "weights_10", "biases_10", "weights_11", "biases_11"],
                               ["<f4"] * 6, 2)[::-1]),
        "dots.npz": npz(named(["a/weight", "a/bias", "b_weight", "b_bias", "c.W", "c.b"], ["<f2"] * 6)),
        "mixed.npz": npz(named(places, ["<f4", "<f8", "<f2", "<f4", "<f4", "<f4"])[::-1]),
        "packed.npz": npz(named(places, ["<f8"] * 6), zipfile.ZIP_DEFLATED),
        # The type of the numbers stands far behind in the header.
        "blanks.npz": npz([(name, npy(*array, blanks=" " * 200)) for name, array in zip(places, found)]),
        "without_biases.npz": npz(named(places, ["<f4"] * 6)[::2])}


def nnet(sizes, generator, scaled=True):
    line = lambda numbers: ",".join(f"{x!r}" for x in numbers) + ",\n"
    text = f"// a comment\n{len(sizes) - 1},{sizes[0]},{sizes[-1]},{max(sizes)},\n{line(sizes)}0,\n"
    text += line([-1] * sizes[0]) + line([1] * sizes[0])
    ranges = [generator.uniform(0.5, 2) if scaled else 1.0 for _ in range(sizes[0] + 1)]
    text += line(uniform(sizes[0] + 1, generator) if scaled else [0.0] * (sizes[0] + 1)) + line(ranges)
    for inputs, outputs in zip(sizes, sizes[1:]):
        text += "".join(line([x if generator.random() < 0.8 else 0.0 for x in uniform(inputs, generator)])
                        for _ in range(outputs))
        text += "".join(line([x]) for x in uniform(outputs, generator))
    return text.encode()


def element(kind, data, compact=False):
    if compact and len(data) <= 4:
        return struct.pack("<HH4s", kind, len(data), data)
    return struct.pack("<2I", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(name, shape, contents, kind=6):
    return element(14, element(6, struct.pack("<2I", kind, 0)) + element(5, struct.pack("<2i", *shape))
                   + element(1, name.encode(), True) + contents)


def packed_by(data, level, strategy):
    stream = zlib.compressobj(level, strategy=strategy)
    result = stream.compress(data) + stream.flush()
    return struct.pack("<2I", 15, len(result)) + result


def mat(variables, packed=None):
    """packed: level and strategy of zlib."""
    pack = (lambda data: packed_by(data, *packed)) if packed else bytes
    return b"MATLAB 5.0 MAT-file, test".ljust(124) + b"\0\1IM" + b"".join(map(pack, variables))


def mat_files(generator):
    found = [(shape if len(shape) == 2 else (*shape, 1), numbers) for shape, numbers in arrays(generator)]
    columns = lambda shape, numbers: [numbers[i * shape[1] + j] for j in range(shape[1]) for i in range(shape[0])]

    def array(name, k, code="d", data_type=9, kind=6):
        shape, numbers = found[k]
        numbers = columns(shape, numbers) if code in "df" else [int(100 * x) for x in columns(shape, numbers)]
        return matrix(name, shape, element(data_type, struct.pack(f"<{len(numbers)}{code}", *numbers)), kind)
    named = [array(name, k) for k, name in enumerate(["W1", "b1", "W2", "b2", "W3", "b3"])]
    single = [array(name, k, "f", 7, 7) for k, name in enumerate(["W1", "b1", "W2", "b2", "W3", "b3"])]
    cells = [matrix(name, (1, 3), b"".join(array("", k) for k in which), 1)
             for name, which in (("weights", (0, 2, 4)), ("biases", (1, 3, 5)))]
    names = b"".join(name.encode().ljust(8, b"\0") for name in ("weights", "biases"))
    inner = b"".join(matrix("", (1, 3), b"".join(array("", k) for k in which), 1) for which in ((0, 2, 4), (1, 3, 5)))
    struct_ = matrix("net", (1, 1), element(5, struct.pack("<i", 8), True) + element(1, names) + inner, 2)
    small = [array("W1", 0, "b", 1), array("W2", 2, "h", 3), array("W3", 4, "i", 5)]
    text = matrix("comment", (1, 3), element(4, struct.pack("<3H", *b"abc")), 4)
    repeated = (uniform(7, generator) * 6000)[:40 * 1000]  # back references of all distances
    wide = [matrix("W1", (40, 1000), element(9, struct.pack("<40000d", *repeated)))]
    usual = zlib.Z_DEFAULT_STRATEGY
    return {"named.mat": mat(named[::-1]), "single.mat": mat(single, (9, usual)), "cells.mat": mat([*cells, text]),
            "struct.mat": mat([text, struct_], (6, usual)), "small.mat": mat(small, (0, usual)),
            "fixed.mat": mat(small, (6, zlib.Z_FIXED)), "huffman.mat": mat(named, (6, zlib.Z_HUFFMAN_ONLY)),
            "wide.mat": mat(wide, (6, usual))}


def numpy_files(folder, generator):
    """What numpy.savez, savez_compressed and scipy.io.savemat write."""
    if numpy is None:
        return
    found = [numpy.array(numbers).reshape(shape) for shape, numbers in arrays(generator, (3, 6, 6, 2))]
    names = ["W1", "b1", "W2", "b2", "W3", "b3"]
    numpy.savez(folder / "numpy.npz", **dict(zip(names, found)))
    numpy.savez(folder / "numpy_halves.npz", *[a.astype(numpy.float16) for a in found])
    numpy.savez_compressed(folder / "numpy_packed.npz", *[a.astype(numpy.float32) for a in found])
    for is_packed in False, True:
        scipy.io.savemat(folder / f"scipy_{is_packed}.mat", dict(zip(names, found)), do_compression=is_packed)
        scipy.io.savemat(folder / f"scipy_single_{is_packed}.mat",
                         {name: a.astype(numpy.float32) for name, a in zip(names, found)}, do_compression=is_packed)


def write(folder, seed=1):
    """Writes all files to the folder and returns their paths."""
    generator, folder = random.Random(seed), Path(folder)
    files = {f"{kind}_{'raw' if is_raw else 'listed'}.onnx": half_model(kind, is_raw, generator)
             for kind in SPECIAL for is_raw in (True, False)}
    for style in "spectral_old", "spectral_new", "weight_old", "weight_new":
        for kind, exact in (("FloatStorage", False), ("FloatStorage", True), ("DoubleStorage", False),
                            ("HalfStorage", False), ("HalfStorage", True)):
            files[f"{style}_{kind}_{exact}.pth"] = parametrized(style, kind, generator, exact).zip()
    for kind, bits in ("HalfStorage", None), ("BFloat16Storage", SPECIAL["bfloat16"]):
        numbers = (bits or [0.5, -0.25, 2.0 ** -24, 65504.0, 1.0, -0.0, 3.0, 0.1])[:6]
        values = [("fc1.weight", [2, 3], numbers), ("fc1.bias", [2], numbers[:2]), ("fc2.weight", [3, 2], numbers)]
        files[f"{kind}.pth"] = Tensors(kind, values).zip()
    files |= npz_files(generator) | mat_files(generator)
    files |= {"net.nnet": nnet([3, 5, 4, 2], generator), "plain.nnet": nnet([2, 6, 3], generator, False),
              "affine.nnet": nnet([4, 2], generator)}
    for name, data in files.items():
        (folder / name).write_bytes(data)
    numpy_files(folder, generator)
    return sorted(folder.iterdir())
