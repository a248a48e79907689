/// @file grid.toml: which gains and vehicles to try, and what to compute for each.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "stability/bounds/tracking_bounds.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::stability {

/// One axis of the grid: `values` of the parameter `name`.
struct GridAxis {
  std::string name;
  std::vector<double> values;
};

/// A requirement on a computed quantity; a cell that violates it is infeasible.
struct GridLimit {
  std::string quantity;
  double least, most;
};

struct Grid {
  std::string path, sha256;
  Gains gains;
  Model model;
  int axis = 2;  ///< of the loop under study
  std::vector<GridAxis> axes;
  std::vector<std::string> compute;
  std::vector<GridLimit> limits;
  std::vector<std::string> pareto;  ///< quantities of the Pareto front
  Disturbance disturbance;          ///< due to one neighbour
  std::vector<std::string> inputs;  ///< files that were read

  long cells() const;
  /// Returns the values of the axes at a cell, in the order of `axes`; the last axis varies fastest.
  std::vector<double> at(long cell) const;
};

/// Returns the parameters that an axis may vary:
///   Kp Kd Ki (1/s^2, 1/s, 1/s^3), Lambda K (1/s, kg/s), mass_kg, thrust_scale, battery_V, motor_s, attitude_s,
///   delay_s, rate_hz, integrator_step_s, neighbours (multiplies the disturbance), vehicles (neighbours + 1).
std::vector<std::string> grid_parameters();

/// A quantity that can be computed; `better` is -1 if smaller is better, +1 if larger is better.
struct Quantity {
  std::string name;
  std::string unit;
  int better;
  std::string meaning;
};
const std::vector<Quantity>& grid_quantities();

/// Describes grid.toml.
void describe_grid_file(files::Keys& keys);

/// Reads grid.toml.
/// @throws files::InputError with line, key, value and hint; more than ten million cells are refused.
Grid load_grid(const std::string& path);

/// The results of one cell.
struct Cell {
  long index = 0;
  std::vector<double> values;  ///< of grid.compute, in that order; NaN if undefined
  /// Why the cell is infeasible, "REASON" or "REASON: the values of this cell"; empty if feasible.
  std::string infeasible;
};

/// Computes one cell. The result depends on nothing but the grid and the index.
Cell compute_cell(const Grid& grid, long index);

/// Returns the indices, ascending, of the feasible cells that are not dominated in the quantities of grid.pareto.
std::vector<long> pareto_front(const Grid& grid, const std::vector<Cell>& cells);

}  // namespace swarmcert::stability
