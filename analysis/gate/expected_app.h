/// @file What the app in an image should hold, by the files of a release.
#pragma once

#include <string>

#include "analysis/firmware/match_code.h"

namespace swarmcert::gate {

/// Returns parameters and constants of the Crazyflie app with these gains and this model.
/// @throws files::InputError if the app has no such gains: different ones for x and y, a coupled Lambda or K, or
/// another
///     rate than its own.
firmware::AppExpectation expected_app(const std::string& gains, const std::string& model);

}  // namespace swarmcert::gate
