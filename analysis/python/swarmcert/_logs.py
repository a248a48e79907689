"""Flight logs as arrays."""

import os
import tempfile
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional

import numpy as np

from . import _core
from ._errors import InputError


class Source(NamedTuple):
    """The origin of a signal in a log."""

    name: str
    source: str  #: "measured", "derived" or "missing"
    origin: str  #: columns of the file, or the derivation from other signals
    unit: str  #: of the columns as stored
    rate_hz: float
    noise: float  #: standard deviation in SI units; NaN: not estimated


#: Arrays of a Log: name, width, unit, and the signals of columns.toml with their unit.
_COLUMNS = {
    "time_s": (1, "s", ["time"], "s"),
    "position_m": (3, "m", ["position_x", "position_y", "position_z"], "m"),
    "velocity_m_s": (3, "m/s", ["velocity_x", "velocity_y", "velocity_z"], "m/s"),
    "specific_force_m_s2": (
        3,
        "m/s^2",
        ["specific_force_x", "specific_force_y", "specific_force_z"],
        "m/s^2",
    ),
    "attitude": (4, "1", ["attitude_x", "attitude_y", "attitude_z", "attitude_w"], "1"),
    "rates_rad_s": (3, "rad/s", ["rate_x", "rate_y", "rate_z"], "rad/s"),
    "duty": (4, "1", ["duty_1", "duty_2", "duty_3", "duty_4"], "1"),
    "battery_V": (1, "V", ["battery"], "V"),
    "thrust_N": (1, "N", ["thrust_command"], "N"),
    "target_position_m": (3, "m", ["target_position_x", "target_position_y", "target_position_z"], "m"),
    "target_velocity_m_s": (3, "m/s", ["target_velocity_x", "target_velocity_y", "target_velocity_z"], "m/s"),
    "motor_force_N": (4, "N", ["motor_force_1", "motor_force_2", "motor_force_3", "motor_force_4"], "N"),
    "thrust_command_N": (1, "N", ["thrust_command"], "N"),
    "torque_command_N_m": (3, "N m", ["torque_command_x", "torque_command_y", "torque_command_z"], "Nm"),
}


class Log(Mapping[str, np.ndarray]):
    """A flight log in SI units: a mapping from names to arrays of float64, [n] or [n, k].

    time_s [n]; position_m, velocity_m_s, specific_force_m_s2 (accelerometer reading, +9.81 upward at rest),
    target_position_m, target_velocity_m_s [n, 3], in the world frame with z up; attitude [n, 4]: unit quaternion
    x, y, z, w that rotates body to world; rates_rad_s, torque_command_N_m [n, 3], in the body frame; duty [n, 4]:
    PWM/65536; battery_V [n]; thrust_N or thrust_over_hover [n] if the thrust does not come from the duties;
    motor_force_N [n, 4]; thrust_command_N [n]. Signals that the log does not contain are absent.

    Attributes:
        path, format:   path and format of the file
        units:          unit by name
        sources:        list of Source, for every known signal including missing ones
        judged_force:   axes along which a force can be judged, such as ["x", "y", "z"]
        findings:       what was damaged or left out
        interpretation: decisions made from the data, with reasons
    """

    def __init__(self, read: Dict[str, Any]):
        self.path: str = read["path"]
        self.format: str = read["format"]
        self._signals: Dict[str, np.ndarray] = read["signals"]
        self.units = {name: _COLUMNS[name][1] if name in _COLUMNS else "1" for name in self._signals}
        self.sources: List[Source] = [
            Source(s["name"], s["source"], s["from"], s["unit"], s["rate_hz"], s["noise"])
            for s in read["sources"]
        ]
        self.judged_force: List[str] = read["judged_force"]
        self.findings: List[str] = read["findings"]
        self.interpretation: List[str] = read["interpretation"]

    def __getitem__(self, name: str) -> np.ndarray:
        return self._signals[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._signals)

    def __len__(self) -> int:
        return len(self._signals)

    def __repr__(self) -> str:
        names = ", ".join(f"{name} {list(array.shape)}" for name, array in self._signals.items())
        return f"<Log {self.path} ({self.format}): {names}>"

    def table(self) -> Dict[str, np.ndarray]:
        """Returns one column per scalar, for pandas: "position_m_x", ..."""
        columns: Dict[str, np.ndarray] = {}
        for name, array in self._signals.items():
            if array.ndim == 1:
                columns[name] = array
                continue
            letters = "1234" if name in ("duty", "motor_force_N") else "xyzw"
            for k in range(array.shape[1]):
                columns[f"{name}_{letters[k]}"] = array[:, k]
        return columns


def read(log: Any, columns: Any = None) -> Log:
    """Reads a flight log of any known format.

    Args:
        log:     path
        columns: path of a columns.toml, for CSV files whose columns are not recognised

    Raises:
        InputError: the file cannot be read at all. Damaged parts are skipped and listed in Log.findings.
    """
    return Log(_core.read_log(os.fspath(log), os.fspath(columns) if columns is not None else ""))


def _refuse(field: str, value: str, what: str, hint: str) -> None:
    raise InputError(f"{field} = {value}: {what}; {hint}", "", "", field, value, what, hint)


class Written:
    """Writes flights given as arrays to CSV files in a temporary folder; paths are passed through.

    Numbers are written with enough digits to be read back exactly.
    """

    def __init__(self, flights: List[Any]):
        self._folder: Optional[tempfile.TemporaryDirectory] = None
        self.words: List[str] = []
        self.columns = ""
        self._names: Dict[str, str] = {}
        for i, flight in enumerate(flights):
            if isinstance(flight, (str, os.PathLike)):
                self.words.append(os.fspath(flight))
            else:
                self._write(i, flight)

    def __enter__(self) -> "Written":
        return self

    def __exit__(self, *unused: Any) -> None:
        if self._folder is not None:
            self._folder.cleanup()

    def _write(self, number: int, flight: Any) -> None:
        vehicles = {"cf1": flight} if "time_s" in flight else dict(flight)
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="swarmcert-")
        folder = os.path.join(self._folder.name, f"flight_{number}")
        os.mkdir(folder)
        for vehicle, signals in vehicles.items():
            if not (vehicle.startswith("cf") and vehicle[2:].isdigit()):
                _refuse("vehicle", repr(vehicle), "is not the name of a vehicle", "name it cf1, cf2, ...")
            self._write_csv(os.path.join(folder, f"{vehicle}_00.csv"), signals)
        self.words.append(folder)
        self.columns = os.path.join(self._folder.name, "columns.toml")
        with open(self.columns, "w", encoding="utf-8") as file:
            file.write('schema = "swarmcert/columns/1"\n')
            for signal, unit in self._names.items():
                frame = ', frame = "world"' if signal.startswith("specific_force") else ""
                file.write(f'{signal} = {{ column = "{signal}", unit = "{unit}"{frame} }}\n')

    def _write_csv(self, path: str, signals: Mapping[str, Any]) -> None:
        columns: Dict[str, np.ndarray] = {}
        for name, values in signals.items():
            if name not in _COLUMNS:
                hint = "the names are " + ", ".join(_COLUMNS)
                _refuse("signal", repr(name), "is not known here", hint)
            width, _, names, unit = _COLUMNS[name]
            array = np.asarray(values, dtype=np.float64).reshape(len(values), -1)
            if array.shape[1] != width:
                _refuse(name, str(list(np.shape(values))), f"must be [n, {width}]" if width > 1 else "must be [n]", "")
            for k, column in enumerate(names):
                columns[column] = array[:, k]
                self._names[column] = unit
        lengths = {len(column) for column in columns.values()}
        if len(lengths) != 1:
            _refuse("signals", str(sorted(lengths)), "must all have the same number of records", "")
        with open(path, "w", encoding="utf-8") as file:
            file.write(",".join(columns) + "\n")
            for row in zip(*(column.tolist() for column in columns.values())):
                file.write(",".join(map(repr, row)) + "\n")


class Residuals(NamedTuple):
    """The force residual of a model for one vehicle in one flight; arrays over the records of the log."""

    flight: str
    vehicle: str
    kind: str
    file: str
    judged: np.ndarray  #: [3] 1 for world axes along which a force can be judged, else 0
    time_s: np.ndarray  #: [n] on the clock of the flight
    residual_N: np.ndarray  #: [n, 3] measured minus model, world frame, z up; m/s^2 if no model is known
    position_m: np.ndarray  #: [n, 3]
    velocity_m_s: np.ndarray  #: [n, 3]
    thrust_N: np.ndarray  #: [n] total thrust according to the model
    used: np.ndarray  #: [n] bool: the record is used
    cut: List[str]  #: [n] why the record is not used; "" if it is

    def table(self) -> Dict[str, np.ndarray]:
        """Returns one column per scalar, for pandas."""
        columns = {"time_s": self.time_s, "used": self.used, "cut": np.array(self.cut, dtype=object)}
        for name in ("residual_N", "position_m", "velocity_m_s"):
            for k, axis in enumerate("xyz"):
                columns[f"{name}_{axis}"] = getattr(self, name)[:, k]
        columns["thrust_N"] = self.thrust_N
        return columns
