#include "analysis/tracking/measured_truth.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

/// One flight in this many defines the shape.
constexpr std::size_t kShapeOf = 3;
/// Force resolution in N; no force is measured more finely.
constexpr double kFinest_N = 1e-9;
constexpr int kMostCells = 1000;
/// Candidates for the least half-width of a cell as a share of the largest.
constexpr double kFloors[] = {0.25, 0.5, 0.75, 1};

using Ranges = std::array<Interval, 3>;
using CellsOfFlight = std::map<std::size_t, Ranges>;

[[noreturn]] void refuse(const std::string& path, const std::string& field, const std::string& value,
                         const std::string& what) {
  throw files::InputError(
      {path, "", field, value, what, "write the file with compare --json of this version"});
}

void unite(Ranges& a, const Ranges& b) {
  for (std::size_t k = 0; k < 3; ++k) a[k] = hull(a[k], b[k]);
}

double number(const Json& of, const char* key, const std::string& path, const std::string& field) {
  if (!of.is_object() || !of.contains(key) || !of[key].is_number())
    refuse(path, field + "." + key, "", "is not a number");
  return of[key].get<double>();
}

ResidualEnvelope empty_envelope(const Json& document, const std::string& path) {
  if (!document.contains("place_grid")) refuse(path, "place_grid", "", "is missing");
  const Json& grid = document["place_grid"];
  const auto value = [&](const char* key) { return number(grid, key, path, "place_grid"); };
  ResidualEnvelope envelope;
  envelope.lowest_m = value("lowest_m");
  envelope.height_step_m = value("height_step_m");
  envelope.lateral_step_m = value("lateral_step_m");
  const double heights = value("heights"), laterals = value("laterals");
  if (!(envelope.height_step_m > 0 && envelope.lateral_step_m > 0 && heights >= 1 && heights <= kMostCells &&
        laterals >= 1 && laterals <= kMostCells))
    refuse(path, "place_grid", "", "has no positive steps, or not 1 to 1000 cells");
  envelope.heights = static_cast<int>(heights);
  envelope.laterals = static_cast<int>(laterals);
  envelope.cells.resize(envelope.at(envelope.heights, 0) + 1);
  return envelope;
}

std::size_t cell_of(const Json& cell, const ResidualEnvelope& envelope, const std::string& path) {
  const std::string field = "flights.residual_by_place.cell";
  if (!cell.is_object() || !cell.contains("cell") || !cell["cell"].is_array() || cell["cell"].size() != 2 ||
      !cell["cell"][0].is_number_integer() || !cell["cell"][1].is_number_integer())
    refuse(path, field, "", "is not a pair of integers");
  const auto height = cell["cell"][0].get<std::int64_t>(), lateral = cell["cell"][1].get<std::int64_t>();
  if (height == -1 && lateral == -1) return envelope.away();
  if (height < 0 || height >= envelope.heights || lateral < 0 || lateral >= envelope.laterals)
    refuse(path, field, cell["cell"].dump(), "is outside place_grid");
  return envelope.at(static_cast<int>(height), static_cast<int>(lateral));
}

Ranges ranges_of(const Json& cell, const std::string& path) {
  Ranges ranges;
  for (const char* const key : {"least", "largest"}) {
    const std::string field = std::string("flights.residual_by_place.") + key;
    if (!cell.contains(key) || !cell[key].is_array() || cell[key].size() != 3)
      refuse(path, field, "", "has not three numbers");
    for (std::size_t k = 0; k < 3; ++k) {
      if (!cell[key][k].is_number() || !std::isfinite(cell[key][k].get<double>()))
        refuse(path, field, cell[key][k].dump(), "is not a finite number");
      (key[1] == 'e' ? ranges[k].lower : ranges[k].upper) = cell[key][k].get<double>();
    }
  }
  for (const Interval& x : ranges)
    if (!(x.lower <= x.upper)) refuse(path, "flights.residual_by_place", "", "has a least above its largest");
  return ranges;
}

/// Cells by flight name, sorted.
std::map<std::string, CellsOfFlight> read_flights(const Json& document, const ResidualEnvelope& envelope,
                                                  const std::string& kind, const std::string& path) {
  std::map<std::string, CellsOfFlight> flights;
  if (!document.contains("flights") || !document["flights"].is_array())
    refuse(path, "flights", "", "is missing");
  for (const Json& flight : document["flights"]) {
    if (!flight.is_object() || !flight.contains("residual_by_place"))
      refuse(path, "flights.residual_by_place", "", "is missing");
    const Json& places = flight["residual_by_place"];
    if (!places.is_array() || places.empty() || flight.value("kind", "") != kind) continue;
    CellsOfFlight& cells = flights[flight.value("flight", "")];
    for (const Json& cell : places) {
      const std::size_t at = cell_of(cell, envelope, path);
      const Ranges ranges = ranges_of(cell, path);
      const auto [found, is_new] = cells.insert({at, ranges});
      if (!is_new) unite(found->second, ranges);
    }
  }
  return flights;
}

double middle(Interval x) { return x.lower + (x.upper - x.lower) / 2; }
double half_width(Interval x) { return (x.upper - x.lower) / 2; }

/// The largest half-width of a cell and its adjacent cells, among cells with flights; 0 if there are none.
double width_about(const ResidualEnvelope& envelope, std::size_t at, std::size_t axis) {
  double width_N = 0;
  const auto add = [&](const ResidualEnvelope::Cell& cell) {
    if (cell.flights > 0) width_N = std::max(width_N, half_width(cell.force_N[axis]));
  };
  add(envelope.cells[at]);
  if (at == envelope.away()) return width_N;
  const int height = static_cast<int>(at) / envelope.laterals,
            lateral = static_cast<int>(at) % envelope.laterals;
  for (int h = std::max(height - 1, 0); h <= std::min(height + 1, envelope.heights - 1); ++h) {
    for (int l = std::max(lateral - 1, 0); l <= std::min(lateral + 1, envelope.laterals - 1); ++l)
      add(envelope.cells[envelope.at(h, l)]);
  }
  return width_N;
}

/// Midpoints and half-widths of the ranges of `flights`, as described for read_measured_truth().
/// @param floor least half-width as a share of the largest along the same axis.
ResidualEnvelope shape_of(const std::vector<const CellsOfFlight*>& flights, double floor,
                          ResidualEnvelope envelope) {
  std::optional<Ranges> everywhere;
  for (const CellsOfFlight* const flight : flights) {
    for (const auto& [at, ranges] : *flight) {
      ResidualEnvelope::Cell& cell = envelope.cells[at];
      if (cell.flights++ == 0) cell.force_N = ranges;
      unite(cell.force_N, ranges);
      if (!everywhere) everywhere = ranges;
      unite(*everywhere, ranges);
    }
  }
  const ResidualEnvelope measured = envelope;
  for (std::size_t k = 0; k < 3; ++k) {
    double largest_N = kFinest_N;
    for (const ResidualEnvelope::Cell& cell : measured.cells)
      if (cell.flights > 0) largest_N = std::max(largest_N, half_width(cell.force_N[k]));
    for (std::size_t at = 0; at < envelope.cells.size(); ++at) {
      ResidualEnvelope::Cell& cell = envelope.cells[at];
      const bool has_flights = cell.flights > 0;
      const Interval x = has_flights ? cell.force_N[k] : (*everywhere)[k];
      const double width_N =
          std::max(has_flights ? width_about(measured, at, k) : half_width(x), floor * largest_N);
      cell.force_N[k] = {middle(x) - width_N, middle(x) + width_N};
    }
  }
  return envelope;
}

double score_of(const CellsOfFlight& flight, const ResidualEnvelope& shape) {
  double score = 0;
  for (const auto& [at, ranges] : flight) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Interval of_cell = shape.cells[at].force_N[k];
      const double away_N = std::max(ranges[k].upper - middle(of_cell), middle(of_cell) - ranges[k].lower);
      score = std::max(score, away_N / half_width(of_cell));
    }
  }
  return score;
}

/// The cost of a floor: the mean half-width of the cells, scaled so that the share `level` of these flights would
/// have been inside the ranges from the other flights. An estimate, used only for the choice.
double cost_of(const std::vector<const CellsOfFlight*>& flights, double floor, double level,
               const ResidualEnvelope& empty) {
  std::vector<double> scores;
  for (std::size_t i = 0; i < flights.size(); ++i) {
    std::vector<const CellsOfFlight*> others = flights;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    scores.push_back(score_of(*flights[i], shape_of(others, floor, empty)));
  }
  std::sort(scores.begin(), scores.end());
  const auto rank = static_cast<std::size_t>(level * static_cast<double>(scores.size()));
  double width_N = 0;
  for (const ResidualEnvelope::Cell& cell : shape_of(flights, floor, empty).cells)
    for (const Interval& x : cell.force_N)
      if (cell.flights > 0) width_N += half_width(x);
  return scores[std::min(rank, scores.size() - 1)] * width_N;
}

/// The floor with the least cost.
double best_floor(const std::vector<const CellsOfFlight*>& flights, double level,
                  const ResidualEnvelope& empty) {
  double best = kFloors[0], least = std::numeric_limits<double>::infinity();
  for (const double floor : kFloors) {
    const double cost = flights.size() < 2 ? 0 : cost_of(flights, floor, level, empty);
    if (cost < least) least = cost, best = floor;
  }
  return best;
}

}  // namespace

MeasuredTruth read_measured_truth(const std::string& path, const std::string& kind, double level) {
  const Json document = files::read_json(path, "swarmcert/compare/1");
  if (document.value("unit", "N") != "N")
    refuse(path, "unit", files::in_quotes(document.value("unit", "")), "is not a unit of force");
  MeasuredTruth result;
  result.envelope = empty_envelope(document, path);
  result.mean_s = number(document["place_grid"], "mean_s", path, "place_grid");
  const std::map<std::string, CellsOfFlight> flights = read_flights(document, result.envelope, kind, path);
  std::vector<const CellsOfFlight*> shape;
  std::vector<std::pair<std::string, const CellsOfFlight*>> others;
  std::size_t n = 0;
  for (const auto& [name, cells] : flights) {
    if (n++ % kShapeOf == 0)
      shape.push_back(&cells);
    else
      others.emplace_back(name, &cells);
  }
  const auto fewest = static_cast<std::size_t>(fewest_groups(level));
  if (others.size() < fewest) {
    // Out of n flights, n - ceil(n/3) give scores.
    const std::size_t needed = fewest + (fewest + kShapeOf - 2) / (kShapeOf - 1);
    throw files::InputError(
        {path, "", "flights", std::to_string(flights.size()),
         fmt::format("with the force of a vehicle of kind {} are too few: a tube that holds with probability "
                     "{:g} needs at least {}, a third of them for the shape of the residual",
                     kind, level, needed),
         "compare more flights, or ask for less with --coverage"});
  }
  result.shape_flights = static_cast<int>(shape.size());
  result.envelope = shape_of(shape, best_floor(shape, level, result.envelope), result.envelope);
  std::vector<FlightScore> scores;
  for (const auto& [name, cells] : others) scores.push_back({name, score_of(*cells, result.envelope)});
  result.promise = conformal_threshold(scores, level);
  for (ResidualEnvelope::Cell& cell : result.envelope.cells) {
    for (Interval& x : cell.force_N) {
      const double width_N = up(up(result.promise.threshold * (1 + 1e-12)) * half_width(x));
      x = {down(middle(x) - width_N), up(middle(x) + width_N)};
    }
  }
  return result;
}

}  // namespace swarmcert::analysis
