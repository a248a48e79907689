"""One function per command. Options are keyword arguments: `max_lipschitz=500` is `--max-lipschitz 500`."""

import os
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Union

from . import _core, _logs, _networks
from ._errors import UsageError
from ._results import Certification, Result

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[int, int, str], None]

_OPTIONS: Dict[str, Dict[str, bool]] = _core.options()
_FLIGHT_OPTIONS = ("select", "test", "against")


def _text(value: Any) -> str:
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # numpy
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return ",".join(map(_text, value))
    return repr(value)


def _words(command: str, options: Mapping[str, Any]) -> List[str]:
    """Options as words: a list of strings repeats the option, a list of numbers becomes a comma-separated value."""
    known = _OPTIONS[command]
    words: List[str] = []
    for key, value in options.items():
        name = key.rstrip("_").replace("_", "-")
        if name not in known and name not in ("jobs", "force"):
            raise UsageError(f"{command} has no option {key}; there are {', '.join(sorted(known))}")
        if value is None or value is False:
            continue
        if value is True:
            words.append("--" + name)
            continue
        is_many = isinstance(value, (list, tuple)) and any(isinstance(v, (str, os.PathLike)) for v in value)
        for one in value if is_many else [value]:
            words += ["--" + name, _text(one)]
    return words


def _run(
    command: str,
    positional: Sequence[Any],
    options: Mapping[str, Any],
    progress: Optional[Progress] = None,
    network: Any = None,
    certificate: Optional[str] = None,
) -> Result:
    words = [command, *map(_text, positional)]
    source = None
    if isinstance(network, _networks.Arrays):
        source = network.source
    elif network is not None:
        words.append(network)
    done = _core.run(words + _words(command, options), source, certificate, progress)
    if command == "certify":
        return Certification(done["code"], done["result"], done["notes"], done["certificate"])
    return Result(done["code"], done["result"], done["notes"])


def run(command: str, *arguments: Any, progress: Optional[Progress] = None, **options: Any) -> Result:
    """Runs any command of the tool in this process: `run("tune", gains="g.toml", model="m.toml", axis="z")`.

    Prints nothing. Files are written only if an option such as `output` names them.

    Raises:
        InputError: a file is missing or invalid
        UsageError: an option does not exist or the options make no sense together
    """
    if command not in _OPTIONS:
        raise UsageError(f"no command {command}; there are {', '.join(_OPTIONS)}")
    return _run(command, arguments, options, progress)


def certify(
    net: Any,
    *,
    order: Any = (),
    description: Optional[str] = None,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Certification:
    """Spectral norms and Lipschitz bounds that hold in exact arithmetic.

    Prints nothing, and reads or writes only the files that `net` or options name, so that it can be called in every
    epoch of a training loop. The interpreter lock is released, and Ctrl-C raises KeyboardInterrupt.

    Args:
        net: one of
            - a path: network.toml or one weight file;
            - a dict of arrays {"fc1.weight": [outputs, inputs], "fc1.bias": [outputs], ...} or a state dict of PyTorch:
              ReLU between the layers, or as set by the option `activation`, and none after the last;
            - a Sequential of Linear and ReLU;
            - {"phi": ..., "rho": ...}, or an object with these attributes: a deep set rho(sum_j phi(x_j)).
            Arrays are float32 or float64, or float16, which is a float32 network.
        order: names of the layers in the order of evaluation if neither names nor shapes determine it; for a pair
            {"phi": [...], "rho": [...]}.
        description: text of a network.toml; `net` is then a dict from the names under `weights` to arrays.
        progress: called with (done, total, what), at most 50 times a second.
        options: options of `swarmcert certify --help`, with "_" for "-": max_lipschitz=500, method="sdp", gamma=3,
            domain="box.toml", neighbours=3, nodes=0, time=10, as_="float32".

    Returns:
        bounds, layers, range, verdict, ... as written by `--json`; `certificate` as text; `upper()`.
    """
    loaded = _networks.load(net, order, description)
    result = _run("certify", (), options, progress, loaded)
    assert isinstance(result, Certification)
    return result


def check(certificate: Any, net: Any, *, order: Any = (), description: Optional[str] = None, **options: Any) -> Result:
    """Verifies a certificate with the independent checker.

    Args:
        certificate: the result of certify(), the text of a certificate, or a path.
        net: as in certify().

    Returns:
        accepted, reason, ...
    """
    loaded = _networks.load(net, order, description)
    text = getattr(certificate, "certificate", certificate)
    if isinstance(text, str) and text.lstrip().startswith("{"):
        return _run("check", ["certificate"], options, None, loaded, text)
    return _run("check", [text], options, None, loaded)


def _flights(
    command: str, models: Sequence[Any], flights: Any, options: Dict[str, Any], progress: Optional[Progress]
) -> Result:
    """Runs a command on flights: a path, a mapping, or a list of these; likewise for options that name flights."""

    def listed(given: Any) -> List[Any]:
        return [given] if isinstance(given, (str, os.PathLike)) or hasattr(given, "keys") else list(given)

    groups = {key: listed(options[key]) for key in _FLIGHT_OPTIONS if options.get(key) is not None}
    flights = listed(flights)
    with _logs.Written(flights + [flight for group in groups.values() for flight in group]) as written:
        first = len(flights)
        for key, group in groups.items():
            options = {**options, key: written.words[first : first + len(group)]}
            first += len(group)
        if written.columns:
            if options.get("columns") is not None:
                raise UsageError("columns goes with files, and there are flights given as arrays")
            options = {**options, "columns": written.columns}
        return _run(command, [*models, *written.words[: len(flights)]], options, progress)


def _models(model: Any) -> List[Any]:
    if model is None:
        return []
    return [model] if isinstance(model, (str, os.PathLike)) else list(model)


def compare(model: Any, flights: Any, *, progress: Optional[Progress] = None, **options: Any) -> Result:
    """Force residuals of a model on flights, and where the model fails. Forces are in newton.

    Args:
        model: path of a model.toml, a list of them, or None for known vehicles.
        flights: paths of logs or folders; or arrays: a dict with the names of Log, or {"cf1": ..., "cf2": ...} for the
            vehicles of one flight; or a list of these, one per flight. Arrays are passed in temporary files. The
            options select, test and against accept the same, if the command has them.
        options: options of `swarmcert compare --help`.

    Returns:
        overall, flights, regions, moments, learning_error, ...; tables: flights, vehicles, regions, ...
    """
    return _flights("compare", _models(model), flights, options, progress)


def diagnose(model: Any, flights: Any, *, progress: Optional[Progress] = None, **options: Any) -> Result:
    """Finds which physical effect a model lacks. Arguments as in compare(); tables: ranking, remainder, detectable."""
    return _flights("diagnose", _models(model), flights, options, progress)


def study(
    model: Any, flights: Any, output: Path, *, progress: Optional[Progress] = None, **options: Any
) -> Result:
    """Runs compare, diagnose, add and compare again, with one page in the folder `output`. Arguments as in compare().

    Returns:
        before, after, ladder, ranking, remainder, verdict, next
    """
    return _flights("study", _models(model), flights, {"output": output, **options}, progress)


def add(
    effects: Union[str, Iterable[str]],
    model: Path,
    flights: Any,
    output: Path,
    *,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Result:
    """Fits effects and reports the error ladder on flights not used in the fit.

    Args:
        effects: "auto", one effect, or several.
        model, flights: as in compare().
        output: path of the new model.toml; written if an effect was accepted.
        options: options of `swarmcert add --help`.

    Returns:
        ladder, effects, split, written
    """
    names = effects if isinstance(effects, str) else ",".join(effects)
    return _flights("add", [names], flights, {"model": model, "output": output, **options}, progress)


def bound(gains: Path, model: Path, *, progress: Optional[Progress] = None, **options: Any) -> Result:
    """Bounds on the tracking error in metres. Options as in `swarmcert bound --help`: rate=0.3 (N/s), amplitude, ..."""
    return _run("bound", (), {"gains": gains, "model": model, **options}, progress)


def simulate(
    task: str, output: Path, *, gains: Path, model: Any, progress: Optional[Progress] = None, **options: Any
) -> Result:
    """Simulates "hover", "swap", "random-walk", "circle" or "takeoff" and writes logs into the folder `output`."""
    return _run("simulate", [task], {"output": output, "gains": gains, "model": model, **options}, progress)


def export(net: Any, output: Path, *, order: Any = (), description: Optional[str] = None, **options: Any) -> Result:
    """Writes the network as firmware source into the folder `output`. `net` as in certify()."""
    return _run("export", (), {"output": output, **options}, None, _networks.load(net, order, description))


def match(
    net: Any, firmware: Path, *, order: Any = (), description: Optional[str] = None, **options: Any
) -> Result:
    """Checks whether an exported folder, a source file or an ELF file contains exactly this network."""
    loaded = _networks.load(net, order, description)
    if isinstance(loaded, _networks.Arrays):
        return _run("match", ["arrays", firmware], options, None, loaded)
    return _run("match", [loaded, firmware], options)


def schema(name: str = "") -> Any:
    """Returns the JSON Schema of a result or file as a dict; without a name, the list of names."""
    result = _run("schema", [name] if name else [], {})
    return result["json_schema"] if name else result["names"]


def residuals(
    model: Any, flights: Any, *, vehicles: Path = "", columns: Path = "", network: Path = ""
) -> List[_logs.Residuals]:
    """Returns the residuals used by compare(): one entry per vehicle and flight, with arrays over the records.

    Args:
        model, flights: as in compare().
        vehicles: path of a flights.toml, like `--flights`.
        columns, network: paths, like `--columns` and `--network`.
    """
    if isinstance(flights, (str, os.PathLike)) or hasattr(flights, "keys"):
        flights = [flights]
    with _logs.Written(list(flights)) as written:
        words = [*map(_text, _models(model)), *written.words]
        found = _core.residuals(words, os.fspath(vehicles), written.columns or os.fspath(columns), os.fspath(network))
    return [_logs.Residuals(**one) for one in found]
