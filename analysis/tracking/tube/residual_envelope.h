/// @file The force that a declared truth leaves out according to flights, by the position of the neighbour.
#pragma once

#include <array>
#include <vector>

#include "analysis/tracking/tube/truth_force.h"

namespace swarmcert::analysis {

/// Ranges of a force on a vehicle, in newton and world axes, by the cell of the position of one neighbour: the one
/// with the smallest lateral distance among those within the grid's heights. `away` applies if there is none or it is
/// outside the grid.
struct ResidualEnvelope {
  struct Cell {
    std::array<Interval, 3> force_N;
    int flights = 0;  ///< number of flights that visited it; 0: the range comes from other cells
  };
  double lowest_m = 0, height_step_m = 0, lateral_step_m = 0;
  int heights = 0, laterals = 0;
  std::vector<Cell> cells;  ///< [heights x laterals], height by height, then `away`

  std::size_t away() const { return cells.size() - 1; }
  std::size_t at(int height, int lateral) const {
    return static_cast<std::size_t>(height) * static_cast<std::size_t>(laterals) +
           static_cast<std::size_t>(lateral);
  }
  /// Returns every cell that may apply while the neighbours are at these offsets. Whichever neighbour is nearest, its
  /// cells are included; so is `away`, unless one neighbour is certainly within the grid.
  std::vector<std::size_t> reached(const std::vector<Offset>& neighbours) const;
  /// Encloses the force along `axis` for all neighbour positions within the offsets.
  Interval over(const std::vector<Offset>& neighbours, std::size_t axis) const;
};

}  // namespace swarmcert::analysis
