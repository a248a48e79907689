/// @file Vehicles that fly as another kind does: the thrust of their logs under the model of every kind.
///
/// A wrong kind is a scale of the thrust, (T / m of the one model) / (T / m of the other). It is looked for where the
/// mean thrust under the own model is far from the weight (`residuals::doubts_of`) and under another model is not:
/// kinds that hover at the same duty cannot be told apart.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// A log under the model of another kind. Squares are of the acceleration along the thrust axis that a model leaves, in
/// (m/s^2)^2, means over blocks of 2 s.
struct KindTrial {
  std::string kind;
  std::vector<double> own, other;  ///< both models as they are
  /// Each with a scale of its thrust, which was fitted to every second block and is judged on the others.
  std::vector<double> own_scaled, other_scaled;
};

/// What the thrust of one log says of its label.
struct LogKind {
  std::string flight, vehicle, kind, path;
  bool is_plausible = false;  ///< the mean thrust is about the weight
  std::vector<KindTrial>
      trials;  ///< models of other kinds under which it is; empty where it is under its own
};

/// Precondition: `track` is of inputs.load(), and not position only.
LogKind kind_of(const residuals::Inputs& inputs, const residuals::Track& track);

/// A vehicle whose logs are those of another kind.
struct WrongKind {
  std::string vehicle, kind, is_kind, flight, path;  ///< no flight and no path: in all of its flights
  /// The vehicle of the same flight that flies as `kind`, where both names fit other flights: they are exchanged.
  std::string exchanged_with;
  /// No scale of the thrust explains as much: its curve is the other kind's, or names were exchanged.
  bool is_sure = false;
  double before_m_s2 = 0, after_m_s2 = 0;  ///< root mean squares under the model of either kind
  int blocks = 0, flights = 0;
};

/// @param logs of all flights. By tests at 1 % for all trials together.
std::vector<WrongKind> wrong_kinds(const std::vector<LogKind>& logs);

}  // namespace swarmcert::identification
