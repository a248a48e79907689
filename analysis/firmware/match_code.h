/// @file Checks whether the code in a linked image computes the network bit for bit: the exported function and, if the
/// image holds the Crazyflie app, the app.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/firmware/app_on_host.h"
#include "analysis/firmware/elf_image.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

/// What the image should hold beside the network. Without it, what the app's sources state.
struct AppExpectation {
  AppParameters parameters = AppOnHost::defaults();
  AppConstants constants = {};  ///< those of gains and model; empty: not compared
};
/// Called if the image holds the app. @throws files::InputError if gains or model cannot be those of an app.
using ExpectApp = std::function<AppExpectation()>;

struct CodeMatch {
  enum class Outcome { kSame, kDifferent, kNotChecked };
  Outcome outcome = Outcome::kNotChecked;
  std::string difference;                ///< for kDifferent
  std::string why_not;                   ///< for kNotChecked: the reason
  std::vector<std::string> compared;     ///< what was compared, and how
  std::vector<std::string> not_covered;  ///< what the verdict does not cover
  bool holds_app = false;
};

/// Number of golden vectors per kind of vehicle run by match_code().
inline constexpr int kVectorsOfMatch = 64;

/// Runs code of the image on a QEMU Cortex-M4 and compares with this computer, bit for bit. The program itself is not
/// started.
///
/// 1. swarmcert_network::predict_force_z() with golden vectors.
/// 2. The same after other weights were written into the objects that hold the network's: if any weight came from
///    elsewhere, the results would not be those of the other weights. So the function takes every weight from these
///    objects, whose bytes weights_objects() compares, whether or not a golden vector depends on it.
/// 3. If the image holds the Crazyflie app: a path of calls from appMain() to predict_force_z(); the parameters and
///    constants with which it starts; a golden flight through appMain() and controllerOutOfTree(); another one with the
///    other weights; and that its self-test finds these.
/// @param most_neighbours parameter of the export. Precondition: every weight is a float32.
CodeMatch match_code(const files::Network& network, const ElfImage& image, int most_neighbours,
                     const ExpectApp& expect_app);

}  // namespace swarmcert::firmware
