#include "analysis/commands/bound/float_errors.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace swarmcert::analysis {

void print(const stability::FloatErrors& errors) {
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

namespace swarmcert::stability {

void describe(files::Record& record, const FloatErrors& errors) {
  const auto three = [&record](const char* name, const double(&values)[3], const char* meaning,
                               const char* unit) {
    record.field(name, std::array<double, 3>{values[0], values[1], values[2]}, meaning, unit, "upper bound");
  };
  record.field("applies", errors.applies, "Whether they are bounded.");
  record.field("why_not", errors.why_not, "Why they are not.");
  record.field("thrust_N", errors.thrust_N, "Of the collective thrust.", "N", "upper bound");
  three("force_N", errors.force_N, "Of the commanded force, each cycle.", "N");
  three("torque_N_m", errors.torque_N_m, "Of the attitude law, each cycle.", "N m");
  three("integral_m_s", errors.integral_m_s, "Of the integrator, each cycle.", "m s");
  three("tracking_error_m", errors.tracking_error_m,
        "What that adds to the tracking error; null: not bounded.", "m");
}

}  // namespace swarmcert::stability
