/// @file What vehicles flew, signal by signal, with the force residual under one or two models; thinned for a page.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::residuals {

/// A group of columns of FlownVehicle::rows.
struct FlownGroup {
  const char* name;
  const char* unit;  ///< "N": a force
  std::vector<const char*> columns;
};
/// Returns the groups in the order of their columns, which follow the time.
const std::vector<FlownGroup>& flown_groups();

/// Time in the flight, s; position, its set point, velocity, its set point in W; roll, pitch and heading; body rates;
/// thrust; command of each motor; battery; residual in W; residual with the fitted models in W.
inline constexpr std::size_t kMostMotors = 8, kFlownColumns = 27 + kMostMotors;
using FlownRow = std::array<float, kFlownColumns>;

struct FlownVehicle {
  std::string name;
  /// NaN: unknown, or cut, as are residuals outside of flight. A row of NaN follows the last record before a gap.
  std::vector<FlownRow> rows;
  std::size_t records = 0;  ///< of the log
};

struct FlownFlight {
  std::string name;
  std::vector<FlownVehicle> vehicles;
};

/// The flights with the worst moments first, then others, as many as fit on a page. All records of a log that fits are
/// kept, and of longer ones those within 2 s of a worst moment; of the others, intervals of several records become two
/// rows, 2 k and 2 k + 1, that hold the least and the largest value of each signal, and two positions.
/// @param fitted the same inputs with other models; null: there is no second residual
std::vector<FlownFlight> flown_signals(const Inputs& inputs, const Inputs* fitted,
                                       const std::vector<Moment>& worst);

}  // namespace swarmcert::residuals
