/// @file What flights say that a declared truth leaves out: forces by the place of the neighbour.
#pragma once

#include <array>
#include <vector>

#include "analysis/tracking/tube/truth_force.h"

namespace swarmcert::analysis {

/// Ranges of a force on a vehicle, in newton and world axes, by the cell of the place of one neighbour: the laterally
/// nearest of those within the grid's heights. `away` holds where there is none or it is beyond the grid.
struct ResidualEnvelope {
  struct Cell {
    std::array<Interval, 3> force_N;
    int flights = 0;  ///< that have been in it; 0: a range that others gave
  };
  double lowest_m = 0, height_step_m = 0, lateral_step_m = 0;
  int heights = 0, laterals = 0;
  std::vector<Cell> cells;  ///< [heights x laterals], height by height, then `away`

  std::size_t away() const { return cells.size() - 1; }
  std::size_t at(int height, int lateral) const {
    return static_cast<std::size_t>(height) * static_cast<std::size_t>(laterals) +
           static_cast<std::size_t>(lateral);
  }
  /// Every cell that may count while the neighbours are at these offsets. Whichever of them is the nearest, its cells
  /// are among these; so is `away`, unless one of them is certainly within the grid.
  std::vector<std::size_t> reached(const std::vector<Offset>& neighbours) const;
  /// Contains the force along `axis` wherever the neighbours are within their offsets.
  Interval over(const std::vector<Offset>& neighbours, std::size_t axis) const;
};

}  // namespace swarmcert::analysis
