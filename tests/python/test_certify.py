"""Networks in memory: certify and check in a training loop."""

import gc
import os
import pickle
import signal
import sys
import threading

import numpy as np
import pytest
from conftest import BOX, NETWORK, tool

import swarmcert


class Tensor:
    """The part of torch.Tensor that is used."""

    def __init__(self, array):
        self.array = array

    def detach(self):
        return self

    def cpu(self):
        return self

    def numpy(self):
        return self.array


class Linear:
    def __init__(self, weight, bias):
        self.weight, self.bias = Tensor(weight), Tensor(bias)


class ReLU:
    pass


class Tanh:
    pass


class Sequential(list):
    def state_dict(self):
        raise AssertionError("the modules are looked at one by one")


def sequential(arrays):
    one, two, three = (Linear(arrays[f"fc{k}.weight"], arrays[f"fc{k}.bias"]) for k in (1, 2, 3))
    return Sequential([one, ReLU(), two, ReLU(), three])


def pair(random):
    """phi: 6 -> 8 -> 4, rho: 4 -> 8 -> 1, in float64."""
    part = lambda a, b, c: {
        "fc1.weight": random.normal(size=(b, a)),
        "fc1.bias": random.normal(size=b),
        "fc2.weight": random.normal(size=(c, b)),
        "fc2.bias": random.normal(size=c),
    }
    return {"phi": part(6, 8, 4), "rho": part(4, 8, 1)}


def certificate_of_files(tmp_path, *words):
    tool("certify", *words, "-o", tmp_path / "cert.json", "-q")
    return (tmp_path / "cert.json").read_text()


def test_arrays_give_the_certificate_of_the_file_that_holds_them(arrays, tmp_path):
    path = swarmcert.save(arrays, tmp_path)
    found = swarmcert.certify(arrays)
    assert found.certificate == certificate_of_files(tmp_path, path)
    assert swarmcert.check(found, path).accepted
    assert swarmcert.check(tmp_path / "cert.json", arrays).accepted


def test_half_precision_is_the_float32_network_of_the_same_numbers(arrays):
    half = {name: array.astype(np.float16) for name, array in arrays.items()}
    single = {name: array.astype(np.float32) for name, array in half.items()}
    assert swarmcert.certify(half).certificate == swarmcert.certify(single).certificate


def test_a_pair_of_arrays_gives_the_certificate_of_its_two_files(tmp_path):
    net = pair(np.random.default_rng(1))
    swarmcert.save(net, tmp_path)
    files = ["--phi", tmp_path / "phi.safetensors", "--rho", tmp_path / "rho.safetensors"]
    assert swarmcert.certify(net).certificate == certificate_of_files(tmp_path, *files)


def test_a_described_network_gives_the_certificate_of_its_folder(tmp_path):
    parts = pair(np.random.default_rng(2))
    net = {"phi.safetensors": parts["phi"], "rho.safetensors": parts["rho"]}
    text = (
        'schema = "swarmcert/network/1"\noutput = { quantity = "force_z", unit = "gf" }\n'
        '[phi.small]\nweights = "phi.safetensors"\n[rho.small]\nweights = "rho.safetensors"\n'
    )
    path = swarmcert.save(net, tmp_path, description=text)
    found = swarmcert.certify(net, description=text)
    assert found.certificate == certificate_of_files(tmp_path, path)
    assert found.bounds[-1]["function"] == "set:small:small"


def test_a_sequential_is_the_network_of_its_arrays(arrays):
    found, expected = swarmcert.certify(sequential(arrays)), swarmcert.certify(arrays)
    assert [b["upper"] for b in found.bounds] == [b["upper"] for b in expected.bounds]
    source = found.chain_source["network"]
    assert (source["order"], source["activation"]) == ("file", "file")
    assert expected.chain_source["network"]["activation"] == "assumed"
    assert "torch" not in sys.modules


def test_a_sequential_of_other_modules_is_refused(arrays):
    layers = list(sequential(arrays))
    for wrong in ([layers[0], Tanh(), layers[2]], [layers[0], layers[2]], layers[:2]):
        with pytest.raises(swarmcert.InputError, match="Sequential of Linear and ReLU"):
            swarmcert.certify(Sequential(wrong))


def test_tensors_of_a_state_dict_are_taken(arrays):
    state = {name: Tensor(array) for name, array in arrays.items()}
    assert swarmcert.certify(state).certificate == swarmcert.certify(arrays).certificate


def test_strides_do_not_matter_and_inputs_stay_as_they_are(arrays):
    turned = {name: np.asfortranarray(array) for name, array in arrays.items()}
    before = {name: array.copy() for name, array in turned.items()}
    assert swarmcert.certify(turned).certificate == swarmcert.certify(arrays).certificate
    for name, array in turned.items():
        assert np.array_equal(array, before[name]) and array.flags.f_contiguous


def test_an_order_that_nothing_tells_is_asked_for(arrays):
    square = {f"{name}.weight": np.eye(3) * k for name, k in (("a", 2.0), ("b", 3.0))}
    with pytest.raises(swarmcert.InputError):
        swarmcert.certify(square)
    assert swarmcert.certify(square, order=["b", "a"]).chain[0]["layer"] == "b"


def test_the_bound_lies_above_the_slope_that_was_found(arrays):
    found = swarmcert.certify(arrays)
    bound = found.bounds[0]
    assert found.upper() == found.upper("network") == bound["upper"] >= bound["lower"] > 0
    assert swarmcert.certify(arrays, max_lipschitz=bound["upper"] * 2).holds
    refuted = swarmcert.certify(arrays, max_lipschitz=bound["lower"] / 2)
    assert refuted.code == 1 and refuted.verdict == "refuted"


def test_a_changed_weight_is_not_accepted(arrays):
    found = swarmcert.certify(arrays)
    arrays["fc1.weight"][0, 0] += 1
    verdict = swarmcert.check(found, arrays)
    assert not verdict.accepted and verdict.code == 1


def test_faults_of_arrays_name_field_value_and_hint(arrays):
    arrays["fc2.weight"] = arrays["fc2.weight"].astype(np.int32)
    with pytest.raises(swarmcert.InputError) as caught:
        swarmcert.certify(arrays)
    fault = caught.value
    assert (fault.field, fault.value) == ("fc2.weight", "int32") and fault.hint
    again = pickle.loads(pickle.dumps(fault))
    assert (str(again), again.field, again.hint) == (str(fault), fault.field, fault.hint)
    for bad in (np.full((6, 8), np.nan), np.zeros((6, 9)), np.zeros((6, 8), dtype=int)):
        with pytest.raises(swarmcert.InputError):
            swarmcert.certify({**arrays, "fc2.weight": bad})


def test_faults_of_files_name_the_file(tmp_path):
    (tmp_path / "net.pth").write_bytes(b"nothing")
    with pytest.raises(swarmcert.InputError) as caught:
        swarmcert.certify(tmp_path / "net.pth")
    assert caught.value.file == str(tmp_path / "net.pth")


def test_unknown_options_are_named(arrays):
    with pytest.raises(swarmcert.UsageError, match="max_lipshitz"):
        swarmcert.certify(arrays, max_lipshitz=3)
    with pytest.raises(swarmcert.UsageError):
        swarmcert.certify(arrays, cuts=3)  # needs method="branch"


def test_a_training_loop_leaves_no_file_no_output_and_no_reference(arrays, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    references = {name: sys.getrefcount(array) for name, array in arrays.items()}
    for _ in range(20):
        arrays["fc1.weight"] *= np.float32(0.99)
        found = swarmcert.certify(arrays, nodes=0)
    del found
    gc.collect()
    assert {name: sys.getrefcount(array) for name, array in arrays.items()} == references
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def endless(progress=None):
    """Branch and bound that would take too long."""
    return swarmcert.certify(NETWORK, domain=BOX, method="branch", nodes=10**9, progress=progress)


def test_ctrl_c_interrupts_and_the_next_call_works(arrays):
    handler = signal.getsignal(signal.SIGINT)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        endless()
    assert signal.getsignal(signal.SIGINT) is handler
    assert swarmcert.certify(arrays).holds


def test_progress_is_reported_and_what_it_raises_ends_the_call():
    class Enough(Exception):
        pass

    calls = []

    def progress(done, total, what):
        calls.append((done, total, what))
        raise Enough

    with pytest.raises(Enough):
        swarmcert.certify(NETWORK, progress=progress)
    (call,) = calls
    assert 0 <= call[0] <= call[1] and isinstance(call[2], str)


def test_other_threads_run_meanwhile():
    class Enough(Exception):
        pass

    is_enough = threading.Event()
    caught = []

    def progress(done, total, what):
        if is_enough.is_set():
            raise Enough

    def call():
        try:
            endless(progress)
        except Enough as error:
            caught.append(error)

    thread = threading.Thread(target=call)
    thread.start()
    is_enough.set()  # not reached if the other thread kept the lock
    thread.join()
    assert len(caught) == 1


def test_the_time_limit_holds_without_signals(arrays):
    before = signal.getitimer(signal.ITIMER_REAL)
    found = swarmcert.certify(NETWORK, domain=BOX, method="branch", nodes=10**9, time=0.2)
    assert found.status == "interrupted" and signal.getitimer(signal.ITIMER_REAL) == before


def test_export_and_match_take_arrays(tmp_path):
    net = pair(np.random.default_rng(3))
    single = {part: {name: a.astype(np.float32) for name, a in of.items()} for part, of in net.items()}
    assert swarmcert.export(single, tmp_path / "firmware").holds
    assert swarmcert.match(single, tmp_path / "firmware").equal
    single["phi"]["fc1.bias"][0] += 1
    different = swarmcert.match(single, tmp_path / "firmware")
    assert different.code == 1 and different.equal is False
