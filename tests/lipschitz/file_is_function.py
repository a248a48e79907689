#!/usr/bin/env python3
"""Does a weight file hold the network of a certificate? Decided by the format's own library, on random inputs, without
any code of swarmcert.

    file_is_function.py CERTIFICATE FILE [--part NAME] [--points N]

Reads .pth with torch, .safetensors with safetensors, .npz with numpy, .mat with scipy, or h5py for version 7.3, .h5
and .keras with h5py, and .onnx with onnxruntime or onnx's reference evaluator. State dicts and arrays hold no function:
their tensors are looked up under the names in the certificate and evaluated with its chain, here in double. An ONNX
model is evaluated by its runtime.
Exit codes: 0 equal; 1 they differ, with the input; 3 the file cannot be read; 4 not run: no library of this format is
installed here, or the certificate names no tensors, because layers were folded.
"""
import argparse
import importlib
import io
import json
import math
import random
import sys
import zipfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import canonical  # noqa: E402


class NotRun(Exception):
    pass


def library(*names):
    for name in names:
        try:
            return importlib.import_module(name)
        except ImportError:
            continue
    raise NotRun(f"not run: none of {', '.join(names)} is installed here")


# --- tensors by name, each a list of rows or of numbers ---------------------------------------------------------------

def flattened(tensors, prefix=""):
    """Nested dicts as one, with dots between the names."""
    found = {}
    for name, value in tensors.items():
        if isinstance(value, dict):
            found.update(flattened(value, f"{prefix}{name}."))
        elif hasattr(value, "tolist"):
            found[prefix + str(name)] = value
    return found


def of_torch(path, key):
    torch = library("torch")
    state = torch.load(path, map_location="cpu")
    for step in filter(None, key.split(".")):
        state = state[step]
    return {name: t.double().tolist() for name, t in flattened(state).items() if hasattr(t, "double")}


def of_safetensors(path, _):
    library("safetensors")
    found = importlib.import_module("safetensors.numpy").load_file(path)
    return {name: t.astype("float64").tolist() for name, t in found.items()}


def of_npz(path, _):
    numpy = library("numpy")
    with numpy.load(path) as arrays:
        return {name: arrays[name].astype("float64").tolist() for name in arrays.files}


def of_mat(path, _):
    if Path(path).read_bytes()[124:126] == b"\x00\x02":
        return of_mat73(path)
    found = {}
    for name, value in library("scipy.io").loadmat(path).items():
        if name.startswith("__") or not hasattr(value, "dtype"):
            continue
        if value.dtype == object:  # cells: layer1.weight, ...
            part = {"W": "weight", "weights": "weight", "b": "bias", "biases": "bias", "bias": "bias"}.get(name)
            for k, cell in enumerate(value.flatten()):
                if part:
                    found[f"layer{k + 1}.{part}"] = cell.astype("float64").tolist()
        elif value.dtype.kind in "fiu":
            found[name] = value.astype("float64").tolist()
    return found


def of_mat73(path):
    with library("h5py").File(path) as file:
        found = {}
        for name, part in (("W", "weight"), ("weights", "weight"), ("b", "bias"), ("biases", "bias")):
            for k, reference in enumerate(file[name][()].flatten() if name in file else ()):
                found[f"layer{k + 1}.{part}"] = file[reference][()].T.astype("float64").tolist()
        return found


def of_keras(path, _):
    found = {}
    with library("h5py").File(path) as file:
        group = file["model_weights"] if "model_weights" in file else file
        for layer in group.attrs["layer_names"]:
            layer = layer if isinstance(layer, str) else layer.decode()
            for weight in group[layer].attrs["weight_names"]:
                weight = weight if isinstance(weight, str) else weight.decode()
                numbers = group[layer][weight][()].astype("float64")
                is_kernel = "kernel" in weight
                found[f"{layer}.{'weight' if is_kernel else 'bias'}"] = (numbers.T if is_kernel else numbers).tolist()
    return found


def of_keras_archive(path, _):
    h5py, found = library("h5py"), {}
    with zipfile.ZipFile(path) as archive:
        stated = json.loads(archive.read("config.json"))["config"]["layers"]
        with h5py.File(io.BytesIO(archive.read("model.weights.h5"))) as file:
            dense = [layer["config"]["name"] for layer in stated if layer["class_name"] == "Dense"]
            for k, name in enumerate(dense):
                stored = file["layers"][f"dense_{k}" if k else "dense"]["vars"]
                found[f"{name}.weight"] = stored["0"][()].astype("float64").T.tolist()
                if "1" in stored:
                    found[f"{name}.bias"] = stored["1"][()].astype("float64").tolist()
    return found


TENSORS = {".pth": of_torch, ".pt": of_torch, ".safetensors": of_safetensors, ".npz": of_npz, ".mat": of_mat,
           ".h5": of_keras, ".keras": of_keras_archive}


def spellings(tensor):
    """Names under which the file may hold the tensor that the certificate calls "fc1.weight"."""
    layer, _, part = tensor.rpartition(".")
    number = "".join(c for c in layer if c.isdigit())
    letter = {"weight": "W", "bias": "b"}[part]
    return [tensor, tensor.replace(".", "_"), f"{letter}{number}", f"{letter.lower()}{number}",
            f"{'weights' if part == 'weight' else 'biases'}_{number}"]


def looked_up(tensors, tensor, otherwise):
    for name in spellings(tensor):
        if name in tensors:
            return tensors[name]
    return otherwise


def from_tensors(path, part, key):
    """Returns the function that the file's own tensors define with the chain of the certificate."""
    tensors = TENSORS[Path(path).suffix](path, key)
    if any(layer["tensor"] is None and not layer["name"].startswith("layer") for layer in part["layers"]):
        raise NotRun("not run: the certificate's layers were folded or rewritten")
    ops = [step["op"] for step in part["chain"] if step["op"] not in ("linear", "clamp")]
    layers = []
    for layer, op in zip(part["layers"], [*ops, None]):
        rows = looked_up(tensors, layer["tensor"] or "", None) if layer["tensor"] else None
        if rows is None:
            raise NotRun(f"not run: the library finds no tensor {layer['tensor']} of the layer {layer['name']}")
        biases = looked_up(tensors, layer["tensor"].rpartition(".")[0] + ".bias" if "." in layer["tensor"] else "bias",
                           [0.0] * len(rows))
        if biases and isinstance(biases[0], list):
            biases = [x for row in biases for x in row]
        layers.append((rows, biases, op))
    return lambda x: canonical.value(layers, x)


def from_onnx(path):
    try:
        runtime = library("onnxruntime")
        session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
        name, shape = session.get_inputs()[0].name, session.get_inputs()[0].shape
        run = lambda array: session.run(None, {name: array})[0]
    except NotRun:
        onnx = library("onnx")
        reference = importlib.import_module("onnx.reference") if hasattr(onnx, "reference") or _has("onnx.reference") \
            else None
        if reference is None:
            raise NotRun("not run: this onnx has no reference evaluator, and there is no onnxruntime") from None
        model = onnx.load(str(path))
        stored = {t.name for t in model.graph.initializer}
        inputs = [i for i in model.graph.input if i.name not in stored]
        name, shape = inputs[0].name, [d.dim_value for d in inputs[0].type.tensor_type.shape.dim]
        session = reference.ReferenceEvaluator(model)
        run = lambda array: session.run(None, {name: array})[0]
    numpy = library("numpy")
    sizes = [d if isinstance(d, int) and d > 0 else 1 for d in shape]
    return lambda x: run(numpy.array(x, dtype="float32").reshape(sizes)).flatten().tolist()


def _has(name):
    try:
        importlib.import_module(name)
        return True
    except ImportError:
        return False


def compare(certificate, path, part_name, points):
    """Returns the largest difference, relative to the largest output. Raises AssertionError with the input."""
    part = certificate["network"]["weights"][part_name]
    layers = canonical.networks(certificate)[part_name]
    is_onnx = Path(path).suffix == ".onnx"
    if not is_onnx and Path(path).suffix not in TENSORS:
        raise NotRun(f"not run: {Path(path).suffix} has no library of its own")
    own = from_onnx(path) if is_onnx else from_tensors(path, part, certificate["network"]["options"]["key"])
    tolerance = 1e-4 if is_onnx else 1e-9  # runtimes compute in float32
    generator, worst = random.Random(1), 0.0
    for _ in range(points):
        x = [generator.uniform(-2, 2) for _ in layers[0][0][0]]
        stated, found = canonical.value(layers, x), own(x)
        size = 1 + max(map(abs, stated))
        difference = max(map(abs, (a - b for a, b in zip(stated, found)))) / size
        assert len(stated) == len(found) and difference <= tolerance and not math.isnan(difference), (
            f"differs at {x}: the certificate gives {stated}, the file {found}")
        worst = max(worst, difference)
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("certificate")
    parser.add_argument("file")
    parser.add_argument("--part", default="network")
    parser.add_argument("--points", type=int, default=50)
    given = parser.parse_args()
    try:
        worst = compare(canonical.read(given.certificate), given.file, given.part, given.points)
    except NotRun as reason:
        print(reason)
        return 4
    except AssertionError as difference:
        print(difference)
        return 1
    except Exception as fault:  # whatever the libraries raise
        print(f"{given.file}: {fault}", file=sys.stderr)
        return 3
    print(f"equal at {given.points} random inputs, up to {worst:.1e} of the largest output")
    return 0


if __name__ == "__main__":
    sys.exit(main())
