#!/usr/bin/python3
"""Writes MATLAB's files of version 7.3 with h5py, as save(..., "-v7.3") lays them out, and a struct of version 5 with
SciPy; adds what these networks compute to expected.json.

Run it in this folder after make_files.py: `python3 make_mat_files.py`. It needs Debian's python3-h5py and
python3-scipy.
"""
import json

import h5py
import numpy as np
import scipy.io

named = np.load("numpy_named.npz")
weights = [named[f"fc{k}.weight"] for k in (1, 2, 3)]
biases = [named[f"fc{k}.bias"] for k in (1, 2, 3)]
rng = np.random.default_rng(73)


def open_file(name, **options):
    return h5py.File(name, "w", userblock_size=512, **options)


def add_head(name):
    """Writes MATLAB's text and version 0x0200 to the HDF5 user block."""
    with open(name, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, written by h5py HDF5 schema 1.00 .".ljust(116) + bytes(8) + b"\0\2IM")


def set_class(item, name):
    item.attrs["MATLAB_class"] = np.bytes_(name)


def matrix(group, name, values, **options):
    """Writes a matrix; MATLAB's columns are HDF5's rows."""
    stored = group.create_dataset(name, data=np.atleast_2d(values).T, **options)
    set_class(stored, {"float64": "double", "float32": "single"}[values.dtype.name])
    return stored


def cells(file, name, matrices):
    items = [matrix(file["#refs#"], f"{name}{k}", values).ref for k, values in enumerate(matrices)]
    stored = file.create_dataset(name, (len(items), 1), dtype=h5py.ref_dtype)
    stored[:, 0] = items
    set_class(stored, "cell")


def compact(group, name, values):
    values = np.ascontiguousarray(np.atleast_2d(values).T)
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_layout(h5py.h5d.COMPACT)
    space = h5py.h5s.create_simple(values.shape)
    stored = h5py.Dataset(h5py.h5d.create(group.id, name.encode(), h5py.h5t.py_create(values.dtype), space, properties))
    stored[...] = values
    set_class(stored, "single")


def cell_file(name):
    """Symbol tables and contiguous numbers; the reader skips text."""
    with open_file(name) as file:
        file.create_group("#refs#")
        cells(file, "weights", weights)
        cells(file, "biases", [bias[:, None] for bias in biases])
        text = file.create_dataset("comment", data=np.array([[ord(c)] for c in "trained"], dtype=np.uint16))
        set_class(text, "char")
    add_head(name)


def chunked_file(name):
    """Version 2 object headers, and chunks that extend beyond the matrix, with each filter."""
    filters = [{"compression": 3}, {"compression": 9, "shuffle": True}, {}]
    with open_file(name, libver=("v108", "v108")) as file:
        for k, options in enumerate(filters):
            matrix(file, f"W{k + 1}", weights[k], chunks=(3, 2), **options)
            matrix(file, f"b{k + 1}", biases[k])
    add_head(name)


def struct_file(name):
    """A struct of single matrices that lie in their object headers."""
    with open_file(name) as file:
        set_class(file.create_group("net"), "struct")
        for k in range(3):
            compact(file["net"], f"W{k + 1}", weights[k].astype(np.float32))
            compact(file["net"], f"b{k + 1}", biases[k].astype(np.float32))
    add_head(name)


def record(expected, name, rounded):
    cases = []
    for _ in range(6):
        x = rng.normal(size=3).round(3) * 2
        y = x
        for k in range(3):
            w, b = weights[k].astype(rounded).astype(float), biases[k].astype(rounded).astype(float)
            y = w @ (np.maximum(y, 0) if k else y) + b
        cases.append({"x": x.tolist(), "y": y.tolist()})
    expected[name] = cases


with open("expected.json") as file:
    outputs = json.load(file)
cell_file("h5py_cells.mat")
chunked_file("h5py_chunked.mat")
struct_file("h5py_struct.mat")
fields = {f"{letter}{k + 1}": values[k] for k in range(3) for letter, values in (("W", weights), ("b", biases))}
scipy.io.savemat("scipy_struct.mat", {"net": fields, "comment": "trained"}, do_compression=True)
record(outputs, "h5py_cells.mat", np.float64)
record(outputs, "h5py_chunked.mat", np.float64)
record(outputs, "h5py_struct.mat", np.float32)
record(outputs, "scipy_struct.mat", np.float64)
with open("expected.json", "w") as file:
    json.dump(outputs, file, indent=0)
    file.write("\n")
