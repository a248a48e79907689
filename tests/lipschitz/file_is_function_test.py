#!/usr/bin/env python3
"""The network of a certificate is the one in the weight file, as the format's own library reads it; a certificate of
another file is found out. Formats without a library here are named.

    file_is_function_test.py SWARMCERT SOURCE_DIR
"""
import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

SOURCE = Path(sys.argv[2])
sys.path.insert(0, str(SOURCE / "tests/proof"))
import canonical  # noqa: E402
import file_is_function  # noqa: E402
import written_files  # noqa: E402


def certificate_of(path, folder):
    found = folder / "certificate.json"
    done = subprocess.run([sys.argv[1], "certify", path, "--method", "product", "--nodes", "0", "-q", "--force", "-o",
                           found], capture_output=True, text=True)
    return canonical.read(found) if done.returncode in (0, 4) else None


def with_another_weight(certificate):
    changed = json.loads(json.dumps(certificate))
    rows = changed["network"]["weights"]["network"]["layers"][0]["weights"]
    words = rows[0].split()
    words[0] = (float.fromhex(words[0]) + 1).hex()
    rows[0] = " ".join(words)
    return changed


def main():
    counts = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "written").mkdir()
        files = written_files.write(folder / "written") + sorted((SOURCE / "tests/nn/files").iterdir())
        for path in files:
            certificate = certificate_of(path, folder)
            if certificate is None:
                counts["refused by certify"] += 1
                continue
            try:
                file_is_function.compare(certificate, path, "network", 20)
            except file_is_function.NotRun as reason:
                counts[f"{path.suffix}: {str(reason).split(':')[0]}"] += 1
                continue
            try:
                file_is_function.compare(with_another_weight(certificate), path, "network", 20)
            except AssertionError:
                counts[f"{path.suffix}: equal"] += 1
            else:
                raise SystemExit(f"{path}: another weight makes no difference")
    for what, count in sorted(counts.items()):
        print(f"{what}: {count}")
    has_numpy = file_is_function._has("numpy")
    assert not has_numpy or counts[".npz: equal"] > 3, counts


if __name__ == "__main__":
    main()
