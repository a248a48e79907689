/// @file The Crazyflie app, compiled for this computer from the sources that fly, with any network.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/firmware/golden_flight.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

/// Constants of the app's controller that gains and model state too, by name: "c00" in gram-force, "inertia_x_kg_m2",
/// "integrator_limit_x_m_s", "integrator_step_s".
using AppConstants = std::vector<std::pair<std::string, float>>;

/// The app. It keeps its state in variables of its own, as on the vehicle, so there is one at a time; construction
/// starts it anew.
class AppOnHost {
 public:
  /// @param network must outlive this. @param most_neighbours of the export.
  AppOnHost(const files::Network& network, int most_neighbours);
  ~AppOnHost();
  AppOnHost(const AppOnHost&) = delete;
  AppOnHost& operator=(const AppOnHost&) = delete;

  TickResult run(const Tick& tick);

  /// The words of the controller's settings after its initialisation: floats, and two enumerators in one word.
  static std::vector<std::uint32_t> settings();
  static AppConstants constants();
  /// The parameters with which the app starts (parameters.c).
  static AppParameters defaults();
};

}  // namespace swarmcert::firmware
