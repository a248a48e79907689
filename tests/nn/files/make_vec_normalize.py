#!/usr/bin/python3
"""Writes vec_normalize.pkl as VecNormalize.save() of Stable-Baselines3 2 does, and one of observations by name, without
that package: its classes and those of gymnasium are stood in for by classes of the same names and attributes."""
import pickle
import sys
import types

import numpy as np


def stand_in(module, name):
    made = type(name, (), {})
    made.__module__ = module
    parts = module.split(".")
    for k in range(1, len(parts) + 1):
        sys.modules.setdefault(".".join(parts[:k]), types.ModuleType(".".join(parts[:k])))
    setattr(sys.modules[module], name, made)
    return made


VecNormalize = stand_in("stable_baselines3.common.vec_env.vec_normalize", "VecNormalize")
RunningMeanStd = stand_in("stable_baselines3.common.running_mean_std", "RunningMeanStd")
Box = stand_in("gymnasium.spaces.box", "Box")


def with_attributes(kind, **attributes):
    made = kind()
    made.__dict__.update(attributes)
    return made


def statistics(mean, var):
    return with_attributes(RunningMeanStd, mean=np.array(mean), var=np.array(var), count=1000.0001)


def normalization(obs_rms):
    bound = np.array([np.inf, np.inf], dtype=np.float32)
    space = with_attributes(Box, dtype=np.dtype("float32"), _shape=(2,), low=-bound, high=bound, low_repr="-inf",
                            high_repr="inf", bounded_below=np.array([False, False]),
                            _np_random=np.random.Generator(np.random.PCG64(1)))
    return with_attributes(
        VecNormalize, num_envs=1, observation_space=space, render_mode=None, reset_infos=[{}], _seeds=[None],
        norm_obs=True, norm_obs_keys=None, obs_rms=obs_rms, ret_rms=statistics(0.5, 2.0), clip_obs=2.0,
        clip_reward=10.0, gamma=0.99, epsilon=1e-08, training=False, norm_reward=False,
        old_reward=np.array([], dtype=np.float64))


with open("vec_normalize.pkl", "wb") as file:
    pickle.dump(normalization(statistics([0.25, -1.5], [4.0, 0.0225])), file)
with open("vec_normalize_by_name.pkl", "wb") as file:
    pickle.dump(normalization({"pose": statistics([0.25], [4.0])}), file)
