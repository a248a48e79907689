#include "analysis/reproduction/table_flights.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/residuals/statistics.h"
#include "nn/base/json.h"
#include "nn/base/parallel.h"
#include "nn/base/shard.h"

namespace swarmcert::reproduction {
namespace {

constexpr const char* kUnitSchema = "swarmcert/table-unit/1";

void fill(const Flown& flown, TableFlight& cell) {
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
TableFlights planned(const Setting& setting, int training_seed) {
  TableFlights cells;
  for (const int controller : kControllers) {
    if (controller == 0 && training_seed > 0) continue;  // the baseline does not depend on training
    for (int vehicles = kLeastVehicles; vehicles <= kMostVehicles; ++vehicles) {
      for (int k = 0; k < scale_of(setting).flight_seeds; ++k) {
        TableFlight cell;
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

/// The inverse of describe().
TableFlight flight_of(const files::Json& json) {
  const auto number = [&json](const char* key) {
    return json.at(key).is_number() ? json.at(key).get<double>() : INFINITY;
  };
  return {json.at("trained_with"),
          json.at("vehicles"),
          json.at("training_seed"),
          json.at("flight_seed"),
          {number("max_x_m"), number("max_y_m"), number("max_z_m")},
          {number("p50_x_m"), number("p50_y_m")},
          {number("p95_x_m"), number("p95_y_m")},
          number("saturated_share")};
}

TableFlights flown_cells(const Setting& setting, const Truth& flown, const Networks& networks,
                         int training_seed, double higher_m) {
  TableFlights cells = planned(setting, training_seed);
  files::parallel_for(static_cast<int>(cells.size()), setting.jobs, [&](int i) {
    TableFlight& cell = cells[static_cast<std::size_t>(i)];
    const std::size_t c = cell.controller == 0 ? 0 : static_cast<std::size_t>(cell.controller - 1);
    fill(fly(setting, flown, {"swap", cell.vehicles, 0, cell.flight_seed, higher_m},
             networks[c] ? &*networks[c] : nullptr, false),
         cell);
  });
  return cells;
}

}  // namespace

void describe(files::Record& record, const TableFlight& flight) {
  record.field("trained_with", flight.controller, "Vehicles in training; 0: no network.");
  record.field("vehicles", flight.vehicles, "");
  record.field("training_seed", flight.training_seed, "");
  record.field("flight_seed", flight.flight_seed, "");
  record.field("max_x_m", flight.max_m[0], "Largest error; null: a vehicle was lost.", "m");
  record.field("max_y_m", flight.max_m[1], "Likewise.", "m");
  record.field("max_z_m", flight.max_m[2], "Likewise.", "m");
  record.field("p50_x_m", flight.p50_m[0], "Median of the errors.", "m");
  record.field("p50_y_m", flight.p50_m[1], "Likewise.", "m");
  record.field("p95_x_m", flight.p95_m[0], "95 % quantile of the errors.", "m");
  record.field("p95_y_m", flight.p95_m[1], "Likewise.", "m");
  record.field("saturated_share", flight.saturated_share, "Of the control periods of the worst vehicle.");
}

TableFlights table_flights(const Setting& setting, Stages& stages, const Truth& flown, int training_seed,
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
    unit["flights"] =
        files::to_json(files::record_of(flown_cells(setting, flown, networks, training_seed, higher_m)));
    return unit;
  };
  const files::Json unit = files::kept_unit(file, kUnitSchema, key, fly_all);
  TableFlights flights;
  for (const files::Json& flight : unit.at("flights")) flights.push_back(flight_of(flight));
  return flights;
}

Spread spread_of(const TableFlights& flights, int controller, int vehicles,
                 const std::function<double(const TableFlight&)>& value) {
  std::vector<double> values;
  for (const TableFlight& flight : flights)
    if (flight.controller == controller && flight.vehicles == vehicles) values.push_back(value(flight));
  Spread spread{0, INFINITY, 0};
  for (const double one : values) {
    spread.least_m = std::min(spread.least_m, one);
    spread.most_m = std::max(spread.most_m, one);
  }
  spread.median_m = residuals::quantile(values, 0.5);
  return spread;
}

Spreads height_spreads(const TableFlights& flights) {
  Spreads spreads;
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t v = 0; v < 4; ++v)
      spreads[c][v] = spread_of(flights, kControllers[c], kLeastVehicles + static_cast<int>(v),
                                [](const TableFlight& flight) { return flight.max_m[2]; });
  }
  return spreads;
}

}  // namespace swarmcert::reproduction
