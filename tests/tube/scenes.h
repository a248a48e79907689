/// @file Networks, truths and loops for tests of tubes.
#pragma once

#include <string>

#include "nn/base/random.h"
#include "nn/weights/network.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::tests {

inline const std::string kRoot = SWARMCERT_SOURCE_DIR;

inline files::Network demo_network() {
  files::NetworkArguments arguments;
  arguments.file = kRoot + "/nn/networks/demo/network.toml";
  return files::load_network(arguments);
}

inline stability::Model truth_model() {
  return stability::read_model(kRoot + "/stability/models/crazyflie-small-effects.toml");
}

/// Gains of controller/gains/<name>.toml on the small vehicle.
inline stability::FlownLoop loop_of(const std::string& name) {
  return stability::load_flown_loop(kRoot + "/controller/gains/" + name + ".toml",
                                    kRoot + "/stability/models/crazyflie-small.toml");
}

inline double between(files::Random& random, double from, double to) {
  return from + (to - from) * (random.symmetric() + 1) / 2;
}

}  // namespace swarmcert::tests
