#!/usr/bin/env python3
"""The kernel of coqc accepts the output of `swarmcert-check-proved --coq`, and refuses it after any number is changed.

    kernel_test.py SWARMCERT SOURCE_DIR 0 CHECKER COQC THEORY
"""
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SWARMCERT, SOURCE, CHECKER, COQC, THEORY = sys.argv[1], Path(sys.argv[2]), sys.argv[4], sys.argv[5], sys.argv[6]
sys.path.insert(0, str(SOURCE / "tests/lipschitz"))
import activations_test as smooth  # noqa: E402
import certificates as common  # noqa: E402

AXIOMS = {"ClassicalDedekindReals.sig_not_dec", "ClassicalDedekindReals.sig_forall_dec",
          "FunctionalExtensionality.functional_extensionality_dep"}


def kernel(path, text):
    path.write_text(text)
    return subprocess.run([COQC, "-q", "-R", THEORY, "Swarmcert", path], capture_output=True, text=True)


def accepted(done):
    assert done.returncode == 0, done.stderr
    assert set(re.findall(r"^([A-Z]\w*\.\w+)", done.stdout, re.M)) == AXIOMS, done.stdout


def main():
    generator = random.Random(3)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        common.heterogeneous(folder, generator)
        certificate = folder / "certificate.json"
        net = ["--phi", folder / "small.safetensors", "--rho", folder / "rho.safetensors"]
        subprocess.run([SWARMCERT, "certify", *net, "--neighbours", "2", "--nodes", "1", "--method", "sdp",
                        "--as", "float32", "--domain", folder / "box.toml", *common.QUICKLY, "-o", certificate],
                       check=True, capture_output=True)
        text = subprocess.run([CHECKER, "--coq", certificate, *net], check=True, capture_output=True, text=True).stdout
        done = kernel(folder / "Sound.v", text)
        accepted(done)
        for kind in "Norm_at_most", "Norm_at_least", "Slope_at_most", "Slope_at_least", "Law", "Within", "Sum_within", \
                "Jump_at_most", "Float_error", "Sum_float_error":
            assert f": claim := {kind}" in text, kind
        # The last number of a claim is its bound.
        claims = re.findall(r"claim := ((?:Slope_at_most|Norm_at_most) .*)\((\d+),(-?\d+)\)\.", text)
        assert claims
        head, mantissa, exponent = generator.choice(claims)
        false = text.replace(f"{head}({mantissa},{exponent}).", f"{head}({int(mantissa) - 1},{exponent}).")
        assert false != text
        assert kernel(folder / "Claim.v", false).returncode != 0
        print(f"{text.count('claim :=')} claims accepted by the kernel")
        net, sigmoid = smooth.one_network(folder, "sigmoid", generator)
        text = smooth.check(sigmoid, net, "--coq").stdout
        accepted(kernel(folder / "Sigmoid.v", text))
        between = re.findall(r" \[((?:Sigmoid;?)+)\]\.", text)  # the layers of the only part
        assert len(between) == 1
        steeper = text.replace(between[0], between[0].replace("Sigmoid", "Tanh"))
        assert kernel(folder / "Steeper.v", steeper).returncode != 0
        model = folder / "around.onnx"  # x + W sigmoid (V x): what stays has a slope of 1
        model.write_bytes(common.onnx(common.residual_block(1, "x", "y", ("Sigmoid", ["ya"], "yb")), [2, 3, 2],
                                      generator))
        text = smooth.check(smooth.certify(model), model, "--coq").stdout
        accepted(kernel(folder / "Around.v", text))
        assert text.count("(Keeping 3%nat Sigmoid)") == 1
        all_change = text.replace("(Keeping 3%nat Sigmoid)", "Sigmoid")
        assert kernel(folder / "AllChange.v", all_change).returncode != 0


if __name__ == "__main__":
    main()
