/// @file Detects vehicles that fly like another kind by evaluating the thrust in their logs with each model.
///
/// A wrong kind acts like a thrust scale, (T / m of one model) / (T / m of the other). It is considered if the mean
/// thrust is far from the weight with the vehicle's own model (`residuals::doubts_of`) but not with another one. Kinds
/// that hover at the same duty cannot be distinguished.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// A log evaluated with the model of another kind. Squares are mean squares, over blocks of 2 s, of the residual
/// acceleration along the thrust axis, in (m/s^2)^2.
struct KindTrial {
  std::string kind;
  std::vector<double> own, other;  ///< both models unchanged
  /// Each model with a thrust scale, fitted to every second block and evaluated on the others.
  std::vector<double> own_scaled, other_scaled;
};

/// The evidence in one log about its label.
struct LogKind {
  std::string flight, vehicle, kind, path;
  bool is_plausible = false;  ///< the mean thrust is close to the weight
  /// Models of other kinds with which it is plausible; empty if it is with its own.
  std::vector<KindTrial> trials;
};

/// Evaluates a track. Precondition: `track` was loaded by inputs.load() and is not position only.
LogKind kind_of(const residuals::Inputs& inputs, const residuals::Track& track);

/// A vehicle whose logs are those of another kind.
struct WrongKind {
  std::string vehicle, kind, is_kind, flight, path;  ///< no flight and path: all of its flights
  /// The vehicle of the same flight that flies as `kind`, if both names fit in other flights: the names are exchanged.
  std::string exchanged_with;
  /// No thrust scale explains as much: the thrust curve is that of the other kind, or names were exchanged.
  bool is_sure = false;
  double before_m_s2 = 0, after_m_s2 = 0;  ///< root mean squares with the models of both kinds
  int blocks = 0, flights = 0;
};

/// Finds vehicles of the wrong kind, by tests at 1 % for all trials together.
/// @param logs of all flights
std::vector<WrongKind> wrong_kinds(const std::vector<LogKind>& logs);

}  // namespace swarmcert::identification
