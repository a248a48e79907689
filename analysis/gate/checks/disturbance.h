/// @file The force error of [theorem] and [tracking]: declared in the table, or measured on the reference flights.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/gate/evidence.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::gate {

/// rate_N_s, amplitude_N, variation_N, impulse_N_s and bias_N; or a quantile of the learning error of `compare`.
struct DisturbanceTable {
  stability::DisturbanceSource declared;  ///< kind "none" where nothing is declared
  std::string quantile = "p99";
  bool is_declared() const { return declared.kind != "none"; }
};

/// The keys of this part of a table.
std::vector<std::string> disturbance_keys();

/// @throws files::InputError for negative numbers.
DisturbanceTable read_disturbance(const files::TomlTable& table);

/// velocity_error_m_s and position_error_m: errors of the estimates that the law is given.
struct EstimateTable {
  std::optional<double> velocity_m_s;  ///< else as measured on the reference flights, where there are some
  double position_m = 0;
};
std::vector<std::string> estimate_keys();
EstimateTable read_estimates(const files::TomlTable& table);

/// Adds them to a source of `force`. Without reference flights the velocity is exact but for what is declared.
void add_estimates(const EstimateTable& estimates, const DisturbanceTable& force, Evidence& evidence,
                   stability::DisturbanceSource& source);

/// What was declared, else measured. @throws Unfounded if the flights have no window to measure on.
stability::DisturbanceSource disturbance(const DisturbanceTable& table, Evidence& evidence);

/// "amplitude 0.1 N, ..." of the axis, for a row.
std::string words(const stability::DisturbanceSource& source, int axis);

}  // namespace swarmcert::gate
