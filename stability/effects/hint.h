/// @file A formula found beside a model, at which an effect starts whose shape no grid covers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// Range for a position from a formula: half the flown range beyond both of its ends.
struct FlownRange {
  double lower_m, upper_m, at_m;
  double span_m() const { return upper_m - lower_m; }
};

/// A formula that fits the remainder, in the terms of the model file.
struct Hint {
  std::string form, variable;  ///< "gaussian", "xy"
  const EffectSpec& formula;   ///< with its numbers
  double weight_N;             ///< of the vehicle

  /// Returns the parameter whose name, without its unit, begins with `word`.
  std::optional<double> number_of(const std::string& word) const;
  /// Returns the first of `words` that the formula has.
  std::optional<double> first_of(const std::vector<std::string>& words) const;
  bool acts_along(const std::vector<std::string>& targets) const;
  bool is_vertical() const { return acts_along({"force_z_N", "force_b3_N"}); }
  bool is_horizontal() const { return acts_along({"force_x_N", "force_y_N", "force_b1_N", "force_b2_N"}); }
  /// Returns the range for the formula's first position; for a decay without one, its end of the range plus a length.
  std::optional<FlownRange> range_of_place() const;
};

/// Where an effect starts.
struct Start {
  EffectInfo info;                          ///< with the bounds of the fit
  std::vector<std::vector<double>> thetas;  ///< to try

  /// Excludes all coefficients other than `free` from the fit.
  void hold_others(const std::vector<std::string>& free);
  /// Lets the shape parameters `free` move from the first theta, by about 0.3 (metres) if they are near zero; fixes the
  /// others.
  void free_shape(const std::vector<std::string>& free);
};

}  // namespace swarmcert::stability
