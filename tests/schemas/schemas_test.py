"""Compares the JSON Schemas that the tool prints with its output and input files.

    schemas_test.py SWARMCERT SOURCE_FOLDER

Runs each command once on small inputs; the C++ tests validate all their other results against the same schemas. Exits
with 77, which ctest treats as skipped, if Debian's python3-jsonschema is missing.
"""

import functools
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

try:
    import tomllib

    from jsonschema import Draft7Validator, Draft202012Validator, RefResolver
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

TOOL, SOURCE = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
SCHEMAS = {}
FAULTS = []


def expect(condition, what):
    if not condition:
        FAULTS.append(what)
        print("FAILED:", what)


def read_schema(name):
    if name not in SCHEMAS and name in names():
        SCHEMAS[name] = json.loads(run(["schema", name]))
    return SCHEMAS.get(name)


@functools.cache
def names():
    return run(["schema"]).split()


def run(words, codes=(0,), folder=None):
    done = subprocess.run([TOOL, *words], cwd=folder, capture_output=True, text=True, timeout=600)
    expect(done.returncode in codes, f"{' '.join(words)}: exit code {done.returncode}: {done.stderr}")
    return done.stdout


def conforms(document, name, source):
    schema = read_schema(name)
    if schema is None:
        expect(False, f"{source}: no schema {name}")
        return
    for error in Draft202012Validator(schema).iter_errors(document):
        place = ".".join(map(str, error.absolute_path))
        expect(False, f"{source} against {name}: {place}: {error.message[:200]}")


# --- the schemas themselves ---


def objects(schema, place=""):
    """Yields each subschema with its path."""
    if isinstance(schema, dict):
        yield place, schema
        for key, value in schema.items():
            if key in ("properties", "patternProperties", "$defs"):
                for name, inner in value.items():
                    yield from objects(inner, f"{place}/{name}")
            elif key in ("items", "additionalProperties", "propertyNames"):
                yield from objects(value, place)
            elif key in ("anyOf", "oneOf"):
                for inner in value:
                    yield from objects(inner, place)


def test_schemas_are_valid_and_closed():
    """Each object lists its allowed fields, and each top-level field has a description."""
    expect(len(names()) >= 35, f"only {len(names())} schemas")
    for name in names():
        schema = read_schema(name)
        Draft202012Validator.check_schema(schema)
        expect(schema["$schema"] == "https://json-schema.org/draft/2020-12/schema", f"{name}: another draft")
        _, kind, version = schema["properties"].get("schema", {}).get("const", f"swarmcert/{name}/1").split("/")
        expect(kind == ("model" if name == "model-draft" else name), f"{name}: of documents {kind}")
        expect(schema["$id"] == f"urn:swarmcert:schema:{name}:{version}", f"{name}: $id {schema['$id']}")
        expect("title" in schema and "description" in schema, f"{name}: no title or description")
        silent = [field for field, rule in schema["properties"].items() if not rule.get("description")]
        expect(not silent, f"{name}: no description of {', '.join(silent)}")
        for place, inner in objects(schema):
            kinds = inner.get("type", [])
            kinds = [kinds] if isinstance(kinds, str) else kinds
            if "array" in kinds:
                expect("items" in inner, f"{name}{place} does not say what its elements are")
            if "properties" not in inner and "object" not in kinds:
                continue
            if (name, place) == ("schema", "/json_schema"):
                continue  # a JSON Schema may contain anything
            expect(inner.get("additionalProperties") is not True, f"{name}{place} is open")
            expect("additionalProperties" in inner, f"{name}{place} does not say whether it is closed")


def test_the_command_prints_them():
    expect(names() == sorted(names()), "schema lists names out of order")
    run(["schema", "certifi"], codes=(2,))


# --- results of all commands ---


def command_lines():
    """Returns one command line per command, in an order in which each finds its inputs."""
    network = "network/network.toml"
    model = str(SOURCE / "stability/models/crazyflie-small.toml")
    truth = str(SOURCE / "stability/models/crazyflie-small-effects.toml")
    gains = str(SOURCE / "controller/gains/crazyflie-small.toml")
    composite = str(SOURCE / "controller/gains/composite.toml")
    loop = ["--gains", gains, "--model", model]
    any_verdict = (0, 1, 4)
    for seed in "123":
        task = ["simulate", "random-walk", "--vehicles", "2", "--duration", "12", "--seed", seed]
        yield [*task, "--gains", gains, "--model", truth, "-o", f"flights/{seed}"], (0,)
    yield ["certify", network, "-o", "cert.json", "--nodes", "2"], (0,)
    yield ["check", "cert.json", network], (0,)
    yield ["inspect", network, model, "cert.json", "flights", "missing"], (3,)
    yield ["compare", model, "flights", "--gains", gains], (0,)
    yield ["diagnose", model, "flights"], any_verdict
    yield ["add", "downwash", "--model", model, "flights", "-o", "fitted.toml", "--keep-anyway"], any_verdict
    yield ["study", model, "flights", "-o", "study"], any_verdict
    yield ["model", "draft", "flights", "-o", "draft.toml"], (0,)
    sizes = ["--phi", "4", "--rho", "4", "--features", "2", "--epochs", "1"]
    yield ["train", model, "flights", *sizes, "-o", "trained"], any_verdict
    force = ["--rate", "0.3", "--amplitude", "0.1"]
    yield ["bound", "--gains", composite, "--model", model, *force, "--tube", "--verified",
           "-o", "gains-cert.json"], any_verdict
    yield ["check", "gains-cert.json"], (0,)
    yield ["spacing", "--gains", gains, "--model", truth, "--max-error", "0.1"], any_verdict
    yield ["sweep", "grid.toml", "-o", "sweep"], (0,)
    yield ["sweep", "grid.toml", "--shard", "1/1", "-o", "shards"], (0,)
    yield ["merge", "shards"], (0,)
    yield ["tune", *loop, "--nodes", "60"], any_verdict
    yield ["iss-check", "--gains", composite, "--model", model, "--runs", "5"], any_verdict
    yield ["identify-thrust", "thrust.csv"], any_verdict
    yield ["export", network, "--certificate", "cert.json", "-o", "release"], (0,)
    yield ["match", network, "release"], (0,)
    baseline = ["--baseline", "baseline.json", "--update-baseline"]
    yield ["gate", "policy.toml", *baseline, "--bundle", "evidence", "--sarif", "pass.sarif"], (0,)
    yield ["gate", "strict.toml", "--sarif", "fail.sarif"], (1,)
    yield ["verify-bundle", "evidence"], (0,)
    yield ["schema", "certify"], (0,)
    yield ["explain", "wind"], (0,)
    yield ["demo", "-o", "demo"], (0,)


def write_inputs(folder):
    gains = SOURCE / "controller/gains/crazyflie-small.toml"
    model = SOURCE / "stability/models/crazyflie-small.toml"
    shutil.copytree(SOURCE / "nn/networks/demo", folder / "network")  # the bundled network is beside the policy
    (folder / "grid.toml").write_text(
        f'schema = "swarmcert/grid/1"\ngains = "{gains}"\nmodel = "{model}"\ncompute = ["amplitude", "impulse"]\n'
        'pareto = ["amplitude", "impulse"]\n[axes]\nKp = { from = 5, to = 10, steps = 2 }\n'
    )
    for name, limit in (("policy", 500), ("strict", 1)):
        (folder / f"{name}.toml").write_text(
            f'schema = "swarmcert/policy/1"\n[release]\nnetwork = "network/network.toml"\ncertificate = "cert.json"\n'
            f"[certificate]\n[lipschitz]\nmax_joint_gf = {limit}\n"
        )
    rows = ["pwm,vbat,thrust_gf"]
    for k in range(60):
        pwm, volts = 10000 + 900 * k, 3.2 + 0.1 * (k % 10)
        p, v = pwm / 65536, volts / 4.2
        rows.append(f"{pwm},{volts:.2f},{11.09 - 39.08 * p - 9.53 * v + 20.57 * p * p + 38.43 * p * v:.4f}")
    (folder / "thrust.csv").write_text("\n".join(rows) + "\n")


def test_every_command_writes_what_its_schema_says(folder):
    write_inputs(folder)
    seen = set()
    for words, codes in command_lines():
        text = run([*words, "--json", "-", "-q"], codes, folder)
        try:
            document = json.loads(text)
        except ValueError:
            expect(False, f"{' '.join(words)}: no JSON but {text[:200]}")
            continue
        conforms(document, "model-draft" if words[0] == "model" else words[0], " ".join(words))
        seen.add(words[0])
    commands = set(re.findall(r"^  ([a-z][a-z-]+)  ", run(["--help"]), re.MULTILINE))
    expect(len(commands) >= 23, f"--help lists {sorted(commands)}")
    expect(commands - seen == {"reproduce"}, f"commands without a checked result: {sorted(commands - seen)}")
    expect(commands - {"model"} <= set(names()), f"commands without a schema: {sorted(commands - set(names()))}")


def test_files_that_they_write_conform(folder):
    kinds = set()
    for path in sorted(folder.rglob("*.json")):
        document = json.loads(path.read_text())
        if str(document.get("schema", "")).startswith("swarmcert/") and "command_line" not in document:
            kinds.add(document["schema"].split("/")[1])
            conforms(document, document["schema"].split("/")[1], str(path))
    wanted = {"certificate", "tracking-certificate", "baseline", "sweep-points", "sweep-shard"}
    expect(wanted <= kinds, f"no file of the kinds {sorted(wanted - kinds)}")


# --- TOML ---


def test_toml_files_conform(folder):
    kinds = set()
    for path in [*SOURCE.glob("*/**/*.toml"), *folder.rglob("*.toml")]:
        if "build" in path.relative_to(path.anchor).parts and SOURCE / "build" in path.parents:
            continue
        if path.parent == SOURCE / "analysis/logs/dictionary":  # no user's file: a source of the tool, see Dictionary.*
            continue
        document = tomllib.loads(path.read_text())
        kind = document["schema"].split("/")[1]
        kinds.add(kind)
        conforms(document, kind, str(path))
    wanted = {"network", "model", "gains", "flights", "box", "policy", "swarm", "grid"}
    expect(wanted <= kinds, f"no file of the kinds {sorted(wanted - kinds)}")


# --- SARIF ---

SARIF = {
    "type": "object",
    "required": ["version", "runs"],
    "properties": {
        "$schema": {"type": "string"},
        "version": {"const": "2.1.0"},
        "runs": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["tool"],
                "additionalProperties": False,
                "properties": {
                    "tool": {
                        "type": "object",
                        "required": ["driver"],
                        "additionalProperties": False,
                        "properties": {"driver": {"$ref": "#/$defs/driver"}},
                    },
                    "invocations": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "required": ["executionSuccessful"],
                            "additionalProperties": False,
                            "properties": {"executionSuccessful": {"type": "boolean"}},
                        },
                    },
                    "artifacts": {
                        "type": "array",
                        "uniqueItems": True,
                        "items": {
                            "type": "object",
                            "additionalProperties": False,
                            "properties": {"location": {"$ref": "#/$defs/artifactLocation"}},
                        },
                    },
                    "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
                    "results": {"type": "array", "items": {"$ref": "#/$defs/result"}},
                },
            },
        },
    },
    "additionalProperties": False,
    "$defs": {
        "level": {"enum": ["none", "note", "warning", "error"]},
        "message": {
            "type": "object",
            "required": ["text"],
            "additionalProperties": False,
            "properties": {"text": {"type": "string"}},
        },
        "artifactLocation": {
            "type": "object",
            "additionalProperties": False,
            "properties": {"uri": {"type": "string"}, "index": {"type": "integer", "minimum": -1}},
        },
        "driver": {
            "type": "object",
            "required": ["name"],
            "additionalProperties": False,
            "properties": {
                "name": {"type": "string"},
                "version": {"type": "string"},
                "semanticVersion": {"type": "string", "pattern": r"^\d+\.\d+\.\d+"},
                "rules": {
                    "type": "array",
                    "uniqueItems": True,
                    "items": {
                        "type": "object",
                        "required": ["id"],
                        "additionalProperties": False,
                        "properties": {
                            "id": {"type": "string"},
                            "name": {"type": "string"},
                            "shortDescription": {"$ref": "#/$defs/message"},
                            "defaultConfiguration": {
                                "type": "object",
                                "additionalProperties": False,
                                "properties": {"level": {"$ref": "#/$defs/level"}},
                            },
                        },
                    },
                },
            },
        },
        "result": {
            "type": "object",
            "required": ["message"],
            "additionalProperties": False,
            "properties": {
                "ruleId": {"type": "string"},
                "ruleIndex": {"type": "integer", "minimum": -1},
                "level": {"$ref": "#/$defs/level"},
                "message": {"$ref": "#/$defs/message"},
                "locations": {
                    "type": "array",
                    "items": {
                        "type": "object",
                        "additionalProperties": False,
                        "properties": {
                            "physicalLocation": {
                                "type": "object",
                                "required": ["artifactLocation"],
                                "additionalProperties": False,
                                "properties": {
                                    "artifactLocation": {"$ref": "#/$defs/artifactLocation"},
                                    "region": {
                                        "type": "object",
                                        "additionalProperties": False,
                                        "properties": {"startLine": {"type": "integer", "minimum": 1}},
                                    },
                                },
                            }
                        },
                    },
                },
                "partialFingerprints": {"type": "object", "additionalProperties": {"type": "string"}},
                "properties": {"type": "object"},
            },
        },
    },
}


def test_sarif_has_the_published_structure(folder):
    """SARIF 2.1.0 (OASIS), section 3: the properties used here, their types, and which of them are required."""
    counts = []
    for name in ("pass.sarif", "fail.sarif"):
        document = json.loads((folder / name).read_text())
        for error in Draft202012Validator(SARIF).iter_errors(document):
            expect(False, f"{name}: {'.'.join(map(str, error.absolute_path))}: {error.message[:200]}")
        (one,) = document["runs"]
        rules = one["tool"]["driver"]["rules"]
        for result in one["results"]:
            expect(rules[result["ruleIndex"]]["id"] == result["ruleId"], f"{name}: ruleIndex is of another rule")
            index = result["locations"][0]["physicalLocation"]["artifactLocation"]["index"]
            expect(index < len(one["artifacts"]), f"{name}: no artifact {index}")
        counts.append(len(one["results"]))
    expect(counts[0] == 0 and counts[1] > 0, f"results of a release that passes and of one that fails: {counts}")


# --- bundles ---


def test_the_statement_of_a_bundle_has_the_published_structure(folder):
    """in-toto attestation framework, spec/v1/statement.md and spec/predicates/test-result.md: required fields."""
    statement = json.loads((folder / "evidence/statement.json").read_text())
    expect(statement["_type"] == "https://in-toto.io/Statement/v1", "type of the statement")
    expect(statement["predicateType"] == "https://in-toto.io/attestation/test-result/v0.1", "type of the predicate")
    predicate = statement["predicate"]
    expect(predicate["result"] in ("PASSED", "WARNED", "FAILED"), "result of the statement")
    described = statement["subject"] + predicate["configuration"]
    expect(len(statement["subject"]) > 0 and len(predicate["configuration"]) > 0, "the statement names no file")
    for one in described:
        digest = one.get("digest", {}).get("sha256", "")
        expect(one.get("name") and re.fullmatch("[0-9a-f]{64}", digest), f"{one} is no resource descriptor")
    files = {str(path.relative_to(folder / "evidence")) for path in (folder / "evidence").rglob("*") if path.is_file()}
    expect(files == {one["name"] for one in described} | {"statement.json"}, "the statement does not name all files")


def test_the_bill_of_materials_conforms_to_the_schema_of_cyclonedx(folder):
    """The schema is in the npm package of CycloneDX, which is fetched, never kept."""
    scratch = folder / "cyclonedx"
    scratch.mkdir()
    if shutil.which("npm") is None:
        print("skipped: npm, for the schema of CycloneDX, is not installed")
        return
    command = ["npm", "pack", "--silent", "@cyclonedx/cyclonedx-library@10.3.0"]
    if subprocess.run(command, cwd=scratch, capture_output=True, timeout=120).returncode != 0:
        print("skipped: the npm package with the schema of CycloneDX cannot be fetched")
        return
    shutil.unpack_archive(next(scratch.glob("*.tgz")), scratch, "gztar")
    schemas = scratch / "package/res/schema"
    store = {}
    for path in schemas.glob("*.schema.json"):
        name = path.name.replace(".SNAPSHOT", "")
        store["http://cyclonedx.org/schema/" + name] = json.loads(path.read_text())
        store["http://cyclonedx.org/schema/" + path.name] = store["http://cyclonedx.org/schema/" + name]
    bom = store["http://cyclonedx.org/schema/bom-1.6.schema.json"]
    validator = Draft7Validator(bom, resolver=RefResolver(bom["$id"], bom, store=store))
    document = json.loads((folder / "evidence/bom.cdx.json").read_text())
    for error in validator.iter_errors(document):
        expect(False, f"bom.cdx.json: {'/'.join(map(str, error.absolute_path))}: {error.message[:200]}")
    expect(not validator.is_valid({**document, "bomFormat": "x"}), "the schema of CycloneDX accepts anything")


def main():
    test_schemas_are_valid_and_closed()
    test_the_command_prints_them()
    with tempfile.TemporaryDirectory(prefix="swarmcert-schemas-") as name:
        folder = pathlib.Path(name)
        test_every_command_writes_what_its_schema_says(folder)
        test_files_that_they_write_conform(folder)
        test_toml_files_conform(folder)
        test_sarif_has_the_published_structure(folder)
        test_the_statement_of_a_bundle_has_the_published_structure(folder)
        test_the_bill_of_materials_conforms_to_the_schema_of_cyclonedx(folder)
    print(f"{len(FAULTS)} faults")
    return 1 if FAULTS else 0


sys.exit(main())
