/// @file The setting of an experiment: size, seed, folders; and the truths used in simulation.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "nn/base/shard.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::reproduction {

struct Setting {
  bool full = false;     ///< otherwise the small size, which runs in every build
  bool updraft = false;  ///< the truth used in simulation has an updraft around the downwash
  std::uint64_t seed = 1;
  int jobs = 0;
  files::Shard shard;    ///< units to compute; other units are read if they exist
  std::string work;      ///< folder for flights, networks and units, which experiments share and resume
  std::string models;    ///< folder of the bundled models
  std::string gains;     ///< gains.toml of the simulated vehicles
  std::string fleet;     ///< flights.toml of the recorded vehicles
  std::string recorded;  ///< folder of the published data: flights/development, flights/visible_test, weights
  std::string calibrate, flights;  ///< folders for gains_in_flight()
  double coverage = 0.9;           ///< coverage that it promises
  std::function<void(int done, int total, const std::string& what)> progress;
};

/// Differences between the two sizes. One minute per task is the duration in the paper (section V-B).
struct Scale {
  double task_s;       ///< duration of every task in the flights to fit
  int steps;           ///< optimiser steps, in batches of 256
  int training_seeds;  ///< networks trained anew, each on its own flights
  int flight_seeds;    ///< flights per network and number of vehicles
  int walks;           ///< random walks over which the least distance of a stage is averaged
};
Scale scale_of(const Setting& setting);

/// A vehicle used in simulation in place of the real one.
struct Truth {
  std::string name;  ///< "flights" or "calibrated"
  stability::Model model;
  double battery_V = 4.1;          ///< at take-off
  std::vector<std::string> knobs;  ///< parameters chosen to reproduce the published table; empty: none
};

/// Returns the truths. "flights": every parameter comes from recorded flights, including the downwash composition
/// from flights of three vehicles, p = 1.85. "calibrated": p, the force and the thrust limit are chosen to reproduce
/// the published baseline errors. Never mix their results.
std::vector<Truth> truths(const Setting& setting);

/// Returns the truth "flights" with wakes combined by another p-norm: 1 adds them up, a large p keeps the strongest.
Truth with_norm_exponent(const Setting& setting, const std::string& name, double p);

/// Returns the model used to compute labels: mass, thrust map and motor lag of the truth, without its forces.
stability::Model nominal(const Truth& truth);

/// Returns a seed that depends on all its parts and on their order.
std::uint64_t seed_of(std::uint64_t seed, const std::string& use, std::uint64_t number = 0);

}  // namespace swarmcert::reproduction
