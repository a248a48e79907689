"""Inputs shared by the tests."""

import os
import pathlib
import subprocess

import numpy as np
import pytest

TOOL = os.environ["SWARMCERT_TOOL"]
SOURCE = pathlib.Path(os.environ["SWARMCERT_SOURCE"])

NETWORK = SOURCE / "nn/networks/demo/network.toml"
BOX = SOURCE / "nn/networks/demo/box.toml"
MODEL = SOURCE / "stability/models/crazyflie-small.toml"
TRUTH = SOURCE / "stability/models/crazyflie-small-effects.toml"
GAINS = SOURCE / "controller/gains/crazyflie-small.toml"
COMPOSITE = SOURCE / "controller/gains/composite.toml"


def tool(*words, folder=None):
    """Runs the command line and returns its exit code."""
    done = subprocess.run([TOOL, *map(str, words)], cwd=folder, capture_output=True, text=True)
    assert done.returncode in (0, 1, 4), done.stderr
    return done.returncode


@pytest.fixture(scope="session")
def flights(tmp_path_factory):
    """Three flights of two vehicles with effects that MODEL lacks."""
    folder = tmp_path_factory.mktemp("flights")
    for seed in (1, 2, 3):
        task = ["simulate", "random-walk", "--vehicles", 2, "--duration", 12, "--seed", seed]
        tool(*task, "--gains", GAINS, "--model", TRUTH, "-o", folder / str(seed), "-q")
    return folder


@pytest.fixture
def arrays():
    """A plain network, 3 -> 8 -> 6 -> 2, in float32."""
    random = np.random.default_rng(7)
    sizes = [3, 8, 6, 2]
    result = {}
    for k in range(3):
        result[f"fc{k + 1}.weight"] = random.normal(size=(sizes[k + 1], sizes[k])).astype(np.float32)
        result[f"fc{k + 1}.bias"] = random.normal(size=sizes[k + 1]).astype(np.float32)
    return result
