"""Formal verification and analysis for learned multirotor controllers.

The commands of the tool `swarmcert` as functions, with results that are identical to the last bit:

    import swarmcert
    found = swarmcert.certify({"fc1.weight": w1, "fc1.bias": b1, "fc2.weight": w2, "fc2.bias": b2}, max_lipschitz=20)
    found.verdict, found.upper(), found.bounds
    swarmcert.check(found, ...).accepted

    pandas.DataFrame(swarmcert.compare("model.toml", "flights/").table("regions"))
"""

import os as _os

from . import _core
from ._commands import (
    add,
    bound,
    certify,
    check,
    compare,
    diagnose,
    export,
    match,
    residuals,
    run,
    schema,
    simulate,
    study,
)
from ._errors import InputError, UsageError
from ._logs import Log, Residuals, Source, read
from ._networks import save
from ._results import Certification, Result

__version__: str = _core.version

__all__ = [
    "Certification",
    "InputError",
    "Log",
    "Residuals",
    "Result",
    "Source",
    "UsageError",
    "add",
    "bound",
    "certify",
    "check",
    "compare",
    "diagnose",
    "export",
    "match",
    "read",
    "residuals",
    "run",
    "save",
    "schema",
    "simulate",
    "study",
]


def _bundled_files() -> str:
    """Returns the folder used in place of the tool's own: PREFIX/bin above an installed package, else this folder."""
    folder = _os.path.dirname(_os.path.abspath(__file__))
    above = folder
    while not _os.path.exists(_os.path.join(folder, "source_folder.txt")) and above != _os.path.dirname(above):
        above = _os.path.dirname(above)
        if _os.path.isdir(_os.path.join(above, "share", "swarmcert")):
            return _os.path.join(above, "bin")
    return folder


_core.bundled_files_beside(_bundled_files())
