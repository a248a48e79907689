/// @file What every experiment is told: size, seed, folders; and the truths that are flown.
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
  bool full = false;     ///< else the size that runs in every build
  bool updraft = false;  ///< the truth of simulations has an updraft around the downwash
  std::uint64_t seed = 1;
  int jobs = 0;
  files::Shard shard;  ///< of the units: these are computed, others are read if they are there
  std::string work;    ///< folder for flights, networks and units, which experiments share and take up again
  std::string models;  ///< folder of the bundled models
  std::string gains;   ///< gains.toml of the simulated vehicles
  std::string fleet;   ///< flights.toml of the recorded vehicles
  std::string recorded;  ///< folder of the published data: flights/development, flights/visible_test, weights
  std::string calibrate, flights;  ///< folders for gains_in_flight()
  double coverage = 0.9;           ///< that it promises
  std::function<void(int done, int total, const std::string& what)> progress;
};

/// What differs between both sizes. One minute per task is the paper's (section V-B).
struct Scale {
  double task_s;       ///< of every task, of the flights to fit
  int steps;           ///< of the optimiser, in batches of 256
  int training_seeds;  ///< networks trained anew, on flights of their own
  int flight_seeds;    ///< flights of each network and number of vehicles
  int walks;           ///< random walks over which the least distance of a stage is averaged
};
Scale scale_of(const Setting& setting);

/// A vehicle that is flown in simulation in place of the real one.
struct Truth {
  std::string name;  ///< "flights" or "calibrated"
  stability::Model model;
  double battery_V = 4.1;          ///< at take-off
  std::vector<std::string> knobs;  ///< what was chosen so that the published table comes out; empty: nothing
};

/// "flights": every parameter from recorded flights, among them the composition of downwash from flights of three
/// vehicles, p = 1.85. "calibrated": p, the force and the thrust limit chosen to give the published baseline errors.
/// Never mix their results.
std::vector<Truth> truths(const Setting& setting);

/// The truth "flights" with wakes that are composed by another p-norm: 1 adds them up, a large one keeps the strongest.
Truth with_norm_exponent(const Setting& setting, const std::string& name, double p);

/// What the labels are computed with: mass, thrust map and motor lag of the truth, and nothing of its forces.
stability::Model nominal(const Truth& truth);

/// A seed that depends on all of its parts and on their order.
std::uint64_t seed_of(std::uint64_t seed, const std::string& use, std::uint64_t number = 0);

}  // namespace swarmcert::reproduction
