"""Networks from paths, arrays and PyTorch modules; PyTorch itself is never imported."""

import os
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from . import _core
from ._errors import InputError


class Arrays:
    """A network in memory, in the form expected by the extension module."""

    def __init__(self, parts: Dict[str, Dict[str, Any]], description: str = ""):
        self.source = {"parts": parts, "description": description}


def _array(value: Any) -> np.ndarray:
    """Returns a numpy array; PyTorch tensors are recognised by their methods and never modified."""
    if hasattr(value, "detach"):
        value = value.detach()
        if hasattr(value, "cpu"):
            value = value.cpu()
        value = value.numpy()
    return np.ascontiguousarray(value)


def _part(tensors: List[Tuple[str, Any]], order: Sequence[str] = (), is_chain: bool = False) -> Dict[str, Any]:
    return {
        "tensors": [(name, _array(value)) for name, value in tensors],
        "order": list(order),
        "is_chain": is_chain,
    }


def _kind(module: Any) -> str:
    return type(module).__name__


def _refuse_module(field: str, value: str, what: str) -> None:
    message = f"{field} = {value}: {what}; give a Sequential of Linear and ReLU, or a dict of arrays"
    raise InputError(
        message, "", "", field, value, what, "give a Sequential of Linear and ReLU, or a dict of arrays"
    )


def _sequential(modules: Sequence[Any]) -> Dict[str, Any]:
    """Reads Linear, ReLU, Linear, ..., Linear: order and activations are those of the evaluation."""
    tensors: List[Tuple[str, Any]] = []
    for i, module in enumerate(modules):
        expected = "Linear" if i % 2 == 0 else "ReLU"
        if _kind(module) != expected:
            _refuse_module(str(i), _kind(module), f"must be {expected}: layers and ReLU take turns")
        if expected == "Linear":
            tensors.append((f"{i}.weight", module.weight))
            if module.bias is not None:
                tensors.append((f"{i}.bias", module.bias))
    if len(modules) % 2 == 0:
        _refuse_module("", f"{len(modules)} modules", "must begin and end with Linear")
    return _part(tensors, is_chain=True)


def _is_modules(value: Any) -> bool:
    return hasattr(value, "state_dict") and hasattr(value, "__iter__") and not hasattr(value, "keys")


def _is_source(value: Any) -> bool:
    return hasattr(value, "items") or _is_modules(value)


def _one(value: Any, order: Sequence[str]) -> Dict[str, Any]:
    if _is_modules(value):
        if order:
            _refuse_module("order", str(order), "a Sequential states its order")
        return _sequential(list(value))
    return _part(list(value.items()), order)


def load(net: Any, order: Any = (), description: Optional[str] = None) -> Any:
    """Returns a network argument of certify() as a path (str) or as Arrays."""
    if isinstance(net, Arrays):
        return net
    if isinstance(net, (str, os.PathLike)):
        if description is not None:
            raise TypeError("description goes with arrays")
        return os.fspath(net)
    if not _is_source(net) and hasattr(net, "phi") and hasattr(net, "rho"):
        net = {"phi": net.phi, "rho": net.rho}
    if not _is_source(net):
        raise TypeError(f"a network is a path, a dict of arrays or a Sequential, not {_kind(net)}")
    if description is not None:
        return Arrays({name: _one(value, _of(order, name)) for name, value in net.items()}, description)
    if hasattr(net, "keys") and set(net.keys()) == {"phi", "rho"} and all(map(_is_source, net.values())):
        return Arrays({name: _one(net[name], _of(order, name)) for name in ("phi", "rho")})
    return Arrays({"network": _one(net, order)})


def _of(order: Any, part: str) -> Sequence[str]:
    return order.get(part, ()) if hasattr(order, "get") else ()


def save(net: Any, folder: Any, order: Any = (), description: Optional[str] = None, overwrite: bool = False) -> str:
    """Writes a network of arrays to an existing folder as safetensors, with a network.toml if `description` is given.

    A certificate of the arrays is also a certificate of these files, because their hashes are the same.

    Returns:
        Path of the network; for a pair, the path of rho.
    """
    loaded = load(net, order, description)
    if not isinstance(loaded, Arrays):
        raise TypeError("the network is a file already")
    return _core.save_network(loaded.source, os.fspath(folder), overwrite)
