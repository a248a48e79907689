"""Results of the commands."""

import json
from typing import Any, Dict, Iterator, List, Tuple

import numpy as np


def _flat(row: Dict[str, Any], prefix: str = "") -> Iterator[Tuple[str, Any]]:
    """Flattens members of nested objects to "outer.inner"; arrays are kept."""
    for key, value in row.items():
        if isinstance(value, dict):
            yield from _flat(value, prefix + key + ".")
        else:
            yield prefix + key, value


def _column(values: List[Any]) -> np.ndarray:
    """Returns numbers as float64 with NaN for null, integers and booleans as such, everything else as objects."""
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return np.array(values, dtype=bool)
    if kinds == {int}:
        return np.array(values, dtype=np.int64)
    if kinds and kinds <= {int, float, type(None)} and kinds != {type(None)}:
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    column = np.empty(len(values), dtype=object)
    for i, value in enumerate(values):
        column[i] = value
    return column


class Result:
    """The result of a command: the JSON that `--json` writes, identical to the last bit.

    Fields are attributes and items: ``result.overall["rmse"]["z"]``, ``result["overall"]``. The schema
    ``swarmcert.schema(result.command)`` states their meaning and units.

    Attributes:
        code:  exit code of the command: 0 done or holds, 1 violated or refuted, 4 inconclusive
        notes: lines that the command writes to standard error
        text:  the JSON as text
    """

    def __init__(self, code: int, text: str, notes: List[str]) -> None:
        self.code = code
        self.text = text
        self.notes = list(notes)
        self.data: Dict[str, Any] = json.loads(text) if text else {}

    @property
    def command(self) -> str:
        """The command's name, from the field `schema`."""
        return self.data["schema"].split("/")[1]

    @property
    def holds(self) -> bool:
        """Whether the exit code is 0: the command is done, or the claim holds."""
        return self.code == 0

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "data":
            raise AttributeError(name)
        try:
            return self.data[name]
        except KeyError:
            raise AttributeError(f"no field {name!r}; there are {', '.join(self.data)}") from None

    def __getitem__(self, name: str) -> Any:
        return self.data[name]

    def __contains__(self, name: str) -> bool:
        return name in self.data

    def __dir__(self) -> List[str]:
        return sorted(set(super().__dir__()) | set(self.data))

    def __repr__(self) -> str:
        return f"<swarmcert {self.command}: code {self.code}, fields {', '.join(self.data)}>"

    def tables(self) -> List[str]:
        """Returns the names of the fields that table() accepts."""

        def is_rows(value: Any) -> bool:
            rows = list(value.values()) if isinstance(value, dict) else value
            return isinstance(rows, list) and bool(rows) and all(isinstance(row, dict) for row in rows)

        return [name for name, value in self.data.items() if is_rows(value)]

    def table(self, name: str) -> Dict[str, np.ndarray]:
        """Returns a list of objects as columns, for ``pandas.DataFrame(result.table("regions"))``.

        Members of nested objects become columns such as "rmse.z". Numbers are float64 [rows] with NaN for null. An
        object whose members are objects, such as compare's `vehicles`, becomes rows with the names in "name".
        """
        value = self.data[name]
        if isinstance(value, dict):
            value = [{"name": key, **row} for key, row in value.items()]
        rows = [dict(_flat(row)) for row in value]
        names: Dict[str, None] = {}
        for row in rows:
            names.update(dict.fromkeys(row))
        return {key: _column([row.get(key) for row in rows]) for key in names}


class Certification(Result):
    """The result of certify(); `certificate` is the text that `certify -o` writes, for check() or a file."""

    def __init__(self, code: int, text: str, notes: List[str], certificate: str) -> None:
        super().__init__(code, text, notes)
        self.certificate = certificate

    def upper(self, function: str = "") -> float:
        """Returns the proved Lipschitz constant over all inputs and all coordinates, in `bounds[].unit`.

        Args:
            function: "network", "phi:small", "set:small:small", ...; if omitted, the largest constant of the whole
                network: of the plain network or of all set functions.
        """
        found = [
            bound["upper"]
            for bound in self.data["bounds"]
            if bound["block"] == "all"
            and not bound.get("scale")
            and "neighbours" not in bound
            and (
                bound["function"] == function
                if function
                else bound["function"] == "network" or bound["function"].startswith("set:")
            )
        ]
        if not found:
            raise KeyError(f"no bound of {function or 'the whole network'}")
        return max(found)
