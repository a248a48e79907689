#!/usr/bin/env python3
"""Two attacks on certifiers that prove bounds for real arithmetic although the flight code uses float32. Biases much
larger than the inputs turn the float32 evaluation into a step function: its slope between adjacent floats and its
values at the border of the range violate the bounds of the exact function. Both must happen here, and both must stay
within the float32 errors stated by certify: the printed one, and those that its certificate holds for the order of
summation of the flight code and for any order.

    float32_attacks_test.py SWARMCERT
"""
import json
import random
import struct
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

SWARMCERT = Path(sys.argv[1]).resolve()


def f32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def after(x):
    """Returns the next float above a positive one."""
    return struct.unpack("<f", struct.pack("<I", struct.unpack("<I", struct.pack("<f", x))[0] + 1))[0]


def safetensors(layers):
    header, data = {}, b""
    for k, (weights, biases) in enumerate(layers):
        for part, shape, numbers in (("weight", [len(weights), len(weights[0])], sum(weights, [])),
                                     ("bias", [len(biases)], biases)):
            raw = struct.pack(f"<{len(numbers)}f", *numbers)
            header[f"fc{k + 1}.{part}"] = {"dtype": "F32", "shape": shape,
                                           "data_offsets": [len(data), len(data) + len(raw)]}
            data += raw
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data


def exact(layers, x):
    """Returns the single output at float x as a fraction."""
    h = [Fraction(x)]
    for k, (weights, biases) in enumerate(layers):
        y = [sum(map(lambda w, v: Fraction(w) * v, row, h), Fraction(b)) for row, b in zip(weights, biases)]
        h = [max(v, Fraction(0)) for v in y] if k + 1 < len(layers) else y
    return h[0]


def in_float32(layers, x, bias_first):
    """Evaluates like the firmware, with each product and sum rounded to float32."""
    h = [x]
    for k, (weights, biases) in enumerate(layers):
        y = []
        for row, bias in zip(weights, biases):
            terms = [f32(w * v) for w, v in zip(row, h)]
            terms = [bias] + terms if bias_first else terms + [bias]
            total = terms[0]
            for term in terms[1:]:
                total = f32(total + term)
            y.append(total)
        h = [max(v, 0.0) for v in y] if k + 1 < len(layers) else y
    return h[0]


def largest_step(layers, low, high, bias_first, generator):
    """Returns (step, x, next float): adjacent floats between which the values differ most, found by bisection from many
    starting intervals."""
    value = lambda x: Fraction(in_float32(layers, x, bias_first))
    best = (Fraction(0), low, after(low))
    for _ in range(40):
        a, b = sorted(f32(generator.uniform(low, high)) for _ in range(2))
        if a == b:
            continue
        rate = exact(layers, b) - exact(layers, a)  # the change of the exact function is not part of the step
        while after(a) < b:
            middle = f32(a + (b - a) / 2)
            left, right = value(middle) - value(a), value(b) - value(middle)
            share = rate * Fraction(middle - a) / Fraction(b - a)
            if abs(left - share) >= abs(right - (rate - share)):
                b, rate = middle, share
            else:
                a, rate = middle, rate - share
        best = max(best, (abs(value(b) - value(a)), a, b))
    return best


def through_biases(bias):
    """f(x) = x for x >= -bias, computed via a sum with the bias."""
    return [([[1.0]], [bias]), ([[1.0]], [-bias])]


def random_network(bias, generator):
    """Every hidden neuron is active on [0, 1], and the next layer subtracts its bias again."""
    inward = [f32(generator.uniform(0.2, 1)) for _ in range(6)]
    onward = [[f32(generator.uniform(-1, 1)) for _ in range(6)] for _ in range(5)]
    outward = [f32(generator.uniform(-1, 1)) for _ in range(5)]
    second = [f32(2 * bias - bias * sum(row)) for row in onward]
    last = [f32(-2 * bias * sum(outward))]
    return [([[w] for w in inward], [bias] * 6), (onward, second), ([outward], last)]


def certify(folder, layers, low, high):
    (folder / "net.safetensors").write_bytes(safetensors(layers))
    (folder / "box.toml").write_text(f'schema = "swarmcert/box/1"\nlower = [{low!r}]\nupper = [{high!r}]\n')
    out = folder / "result.json"
    done = subprocess.run([SWARMCERT, "certify", folder / "net.safetensors", "--domain", folder / "box.toml",
                           "--nodes", "1", "-q", "--json", out, "--force"], capture_output=True, text=True)
    assert done.returncode == 0, done
    result = json.loads(out.read_text())
    (bound,), (error,), (span,) = result["bounds"], result["float32_error"], result["range"]
    in_certificate = {True: Fraction(error["bound_in_certificate"]),
                      False: Fraction(error["bound_in_certificate_any_order"])}
    assert in_certificate[True] < in_certificate[False]
    return (Fraction(bound["upper"]), Fraction(error["evaluation"]), in_certificate, Fraction(span["lower"]),
            Fraction(span["upper"]))


def slopes_through_biases(folder, generator):
    steeper = 0
    cases = [(f"x + {2 ** k} - {2 ** k}", 2.0 ** k, through_biases(2.0 ** k)) for k in (6, 10, 16, 20)] + \
        [(f"6 and 5 neurons, biases {2 ** k}", 2.0 ** k, random_network(2.0 ** k, generator)) for k in (8, 12, 16)]
    for name, bias, layers in cases:
        upper, error, in_certificate, _, _ = certify(folder, layers, 0.25, 1.0)
        for bias_first in True, False:
            step, a, b = largest_step(layers, 0.25, 1.0, bias_first, generator)
            gap = Fraction(b) - Fraction(a)
            assert gap > 0 and after(a) == b
            assert step > 10 * upper * gap, f"{name}: the float32 function is not steeper than the exact one: no attack"
            steeper += 1
            assert step <= upper * gap + 2 * error, f"{name}: a step of {float(step)}, error {float(error)}"
            for x in [a, b] + [f32(generator.uniform(0.25, 1)) for _ in range(60)]:
                off = abs(Fraction(in_float32(layers, x, bias_first)) - exact(layers, x))
                for stated in error, in_certificate[bias_first]:
                    assert off <= stated, f"{name} at {x}: off by {float(off)}, error {float(stated)}"
            print(f"{name:32} slope at most {float(upper):.4g}; a step of {float(step):.4g} between "
                  f"neighbouring floats, slope {float(step / gap):.4g}; stated error {float(error):.4g}")
    assert steeper == 14


def values_outside_of_the_range(folder):
    """Round-off moves the value at the end of the box out of the proved range, by less than the stated error."""
    outside = 0
    for k in 8, 12, 16:
        grain = 2.0 ** (k - 23)  # distance of adjacent floats in [2^k, 2^(k+1))
        layers, high = through_biases(2.0 ** k), f32(0.5 + 0.75 * grain)
        _, error, _, lower, upper = certify(folder, layers, 0.25, high)
        assert lower <= Fraction(1, 4) and upper >= Fraction(high)
        value = Fraction(in_float32(layers, high, True))
        assert upper < value <= upper + error, f"{float(value)} against {float(upper)} + {float(error)}"
        outside += 1
        print(f"2^{k}: proved at most {float(upper):.9g}, float32 gives {float(value):.9g}, "
              f"stated error {float(error):.3g}")
    assert outside == 3


def main():
    generator = random.Random(2)
    with tempfile.TemporaryDirectory() as name:
        slopes_through_biases(Path(name), generator)
        values_outside_of_the_range(Path(name))


if __name__ == "__main__":
    main()
