/// @file The force error of [theorem] and [tracking]: declared in the table, or measured on the reference flights.
#pragma once

#include <optional>
#include <string>

#include "analysis/gate/evidence.h"
#include "nn/base/file_keys.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::gate {

/// stability::read_force_error(); or a quantile of the learning error from `compare`.
struct DisturbanceTable {
  stability::DisturbanceSource declared;  ///< kind "none" if nothing is declared
  std::string quantile = "p99";
  bool is_declared() const { return declared.kind != "none"; }
};

/// Describes this part of a table.
void describe_disturbance(files::Keys& keys);

/// @throws files::InputError for negative numbers.
DisturbanceTable read_disturbance(const files::TomlTable& table);

/// velocity_error_m_s and position_error_m: errors of the estimates passed to the control law.
struct EstimateTable {
  std::optional<double> velocity_m_s;  ///< if empty, as measured on the reference flights, if there are any
  double position_m = 0;
};
void describe_estimates(files::Keys& keys);
EstimateTable read_estimates(const files::TomlTable& table);

/// Adds the estimation errors to a source of `force`. Without reference flights, the velocity error is as declared,
/// or zero.
void add_estimates(const EstimateTable& estimates, const DisturbanceTable& force, Evidence& evidence,
                   stability::DisturbanceSource& source);

/// Returns the declared force error, otherwise the measured one.
/// @throws Unfounded if the flights have no window to measure on.
stability::DisturbanceSource disturbance(const DisturbanceTable& table, Evidence& evidence);

/// Returns "amplitude 0.1 N, ..." for the axis, for a row.
std::string words(const stability::DisturbanceSource& source, int axis);

}  // namespace swarmcert::gate
