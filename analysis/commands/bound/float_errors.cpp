#include "analysis/commands/bound/float_errors.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {

files::Json float_errors_json(const FloatErrors& errors) {
  files::Json json = {{"applies", errors.applies}, {"why_not", errors.why_not}};
  json["thrust_N"] = errors.thrust_N;
  for (int i = 0; i < 3; ++i) {
    json["force_N"].push_back(errors.force_N[i]);
    json["torque_N_m"].push_back(errors.torque_N_m[i]);
    json["integral_m_s"].push_back(errors.integral_m_s[i]);
    const double e = errors.tracking_error_m[i];
    json["tracking_error_m"].push_back(std::isfinite(e) ? files::Json(e) : files::Json());
  }
  return json;
}

void print_float_errors(const FloatErrors& errors) {
  if (!errors.applies) {
    fmt::print("\nfloat32 against double: not bounded: {}\n", errors.why_not);
    return;
  }
  fmt::print(
      "\nfloat32 against double: f_d within {:.3g}, {:.3g}, {:.3g} N, thrust {:.3g} N, torque {:.3g}, "
      "{:.3g}, {:.3g} N m",
      errors.force_N[0], errors.force_N[1], errors.force_N[2], errors.thrust_N, errors.torque_N_m[0],
      errors.torque_N_m[1], errors.torque_N_m[2]);
  const double* const e = errors.tracking_error_m;
  if (std::all_of(e, e + 3, [](double x) { return std::isfinite(x); })) {
    fmt::print("; adds at most {:.3g}, {:.3g}, {:.3g} m\n", e[0], e[1], e[2]);
  } else {
    fmt::print("; what that adds to the tracking error is not bounded on every axis\n");
  }
}

}  // namespace swarmcert::analysis
