#include "analysis/reproduction/table_flights.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/residuals/statistics.h"
#include "nn/base/json_number.h"
#include "nn/base/parallel.h"
#include "nn/base/shard.h"

namespace swarmcert::reproduction {
namespace {

constexpr const char* kUnitSchema = "swarmcert/table-unit/1";

/// One flight of the table: six swaps.
struct Cell {
  int controller = 0, vehicles = 0, training_seed = 0;
  std::uint64_t flight_seed = 0;
  double max_m[3] = {0, 0, 0};                  ///< |x|, |y|, |z|; infinite: vehicle lost
  double p50_m[2] = {0, 0}, p95_m[2] = {0, 0};  ///< of |x|, |y|
  double saturated_share = 0;
};

void fill(const Flown& flown, Cell& cell) {
  for (int axis = 0; axis < 3; ++axis) cell.max_m[axis] = largest_error_m(flown, axis);
  cell.saturated_share = flown.saturated_share;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> errors;
    for (const auto& moments : flown.vehicles) {
      for (const Moment& now : moments)
        errors.push_back(static_cast<double>(std::abs(now.p_m[axis] - now.p_d_m[axis])));
    }
    cell.p50_m[axis] = residuals::quantile(errors, 0.5);
    cell.p95_m[axis] = residuals::quantile(errors, 0.95);
  }
}

using Networks = std::array<std::optional<files::Network>, 4>;

/// The planned flights of the table.
std::vector<Cell> planned(const Setting& setting, int training_seed) {
  std::vector<Cell> cells;
  for (const int controller : kControllers) {
    if (controller == 0 && training_seed > 0) continue;  // the baseline does not depend on training
    for (int vehicles = kLeastVehicles; vehicles <= kMostVehicles; ++vehicles) {
      for (int k = 0; k < scale_of(setting).flight_seeds; ++k) {
        Cell cell;
        cell.controller = controller;
        cell.vehicles = vehicles;
        cell.training_seed = training_seed;
        cell.flight_seed = seed_of(setting.seed, "table", static_cast<std::uint64_t>(k));
        cells.push_back(cell);
      }
    }
  }
  return cells;
}

files::Json to_json(const std::vector<Cell>& cells) {
  files::Json flights = files::Json::array();
  for (const Cell& cell : cells) {
    flights.push_back({{"trained_with", cell.controller},
                       {"vehicles", cell.vehicles},
                       {"training_seed", cell.training_seed},
                       {"flight_seed", cell.flight_seed},
                       {"max_x_m", files::finite(cell.max_m[0])},
                       {"max_y_m", files::finite(cell.max_m[1])},
                       {"max_z_m", files::finite(cell.max_m[2])},
                       {"p50_x_m", cell.p50_m[0]},
                       {"p50_y_m", cell.p50_m[1]},
                       {"p95_x_m", cell.p95_m[0]},
                       {"p95_y_m", cell.p95_m[1]},
                       {"saturated_share", cell.saturated_share}});
  }
  return flights;
}

files::Json flown_cells(const Setting& setting, const Truth& flown, const Networks& networks,
                        int training_seed, double higher_m) {
  std::vector<Cell> cells = planned(setting, training_seed);
  files::parallel_for(static_cast<int>(cells.size()), setting.jobs, [&](int i) {
    Cell& cell = cells[static_cast<std::size_t>(i)];
    const std::size_t c = cell.controller == 0 ? 0 : static_cast<std::size_t>(cell.controller - 1);
    fill(fly(setting, flown, {"swap", cell.vehicles, 0, cell.flight_seed, higher_m},
             networks[c] ? &*networks[c] : nullptr, false),
         cell);
  });
  return to_json(cells);
}

}  // namespace

files::Json table_flights(const Setting& setting, Stages& stages, const Truth& flown, int training_seed,
                          double higher_m, const std::string& file) {
  Networks networks;
  std::string key =
      fmt::format("{} {} {} {} ", higher_m, flown.battery_V, setting.seed, scale_of(setting).flight_seeds) +
      stability::to_toml(flown.model) + stages.key(kNumStages - 1);
  for (std::size_t c = 1; c < kControllers.size(); ++c) {
    networks[c] = stages.learned(stage_of(kControllers[c])).network;
    for (const auto& [kind, weights] : networks[c]->rho) key += weights.sha256;
  }
  const auto fly_all = [&] {
    files::Json unit;
    unit["flights"] = flown_cells(setting, flown, networks, training_seed, higher_m);
    return unit;
  };
  return files::kept_unit(file, kUnitSchema, key, fly_all).at("flights");
}

Spread spread_of(const files::Json& flights, int controller, int vehicles, const char* field) {
  std::vector<double> values;
  for (const files::Json& flight : flights) {
    if (flight.at("trained_with") != controller || flight.at("vehicles") != vehicles) continue;
    values.push_back(flight.at(field).is_number() ? flight.at(field).get<double>() : INFINITY);
  }
  Spread spread{0, INFINITY, 0};
  for (const double value : values) {
    spread.least_m = std::min(spread.least_m, value);
    spread.most_m = std::max(spread.most_m, value);
  }
  spread.median_m = residuals::quantile(values, 0.5);
  return spread;
}

Spreads height_spreads(const files::Json& flights) {
  Spreads spreads;
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t v = 0; v < 4; ++v)
      spreads[c][v] = spread_of(flights, kControllers[c], kLeastVehicles + static_cast<int>(v), "max_z_m");
  }
  return spreads;
}

}  // namespace swarmcert::reproduction
