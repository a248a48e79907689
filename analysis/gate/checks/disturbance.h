/// @file The force error of [theorem] and [tracking]: declared in the table, or measured on the reference flights.
#pragma once

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

/// What was declared, else measured. @throws Unfounded if the flights have no window to measure on.
stability::DisturbanceSource disturbance(const DisturbanceTable& table, Evidence& evidence);

/// "amplitude 0.1 N, ..." of the axis, for a row.
std::string words(const stability::DisturbanceSource& source, int axis);

}  // namespace swarmcert::gate
