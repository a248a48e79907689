/// @file Upper and lower bounds on the slope of a network in each cell of a grid over two input coordinates.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "lipschitz/certify.h"

namespace swarmcert::lipschitz {

struct SlopeMapOptions {
  std::array<int, 2> coordinates{};  ///< two different coordinates of the moving input
  std::array<int, 2> cells{12, 12};  ///< number of cells along each coordinate, at least 1
  Domain domain;   ///< by part; finite. The other coordinates range over their whole intervals.
  int nodes = 50;  ///< boxes examined by branch and bound, per cell of a ReLU network
  int rounds = 3;  ///< rounds of the lower-bound search per cell, each of a few linear regions; 0: none
  std::uint64_t seed = 1;
  int jobs = 0;                                       ///< threads; 0: all. Results do not depend on it.
  const std::atomic<bool>* cancelled = nullptr;       ///< unfinished cells keep the bound over all inputs
  std::function<void(int done, int total)> progress;  ///< called from any thread
};

struct SlopeCell {
  Box box;                ///< range of the moving input
  UpperBound upper{0};    ///< |f(x) - f(y)| <= upper |x - y| for all x and y in `box`
  bool is_local = false;  ///< `upper` was proved for this cell and is smaller than the global bound
  UpperMethod method = UpperMethod::kBranch;  ///< of a local bound: kBranch, kLocalSdp or kLocalProduct
  FoundSlope lower;  ///< from two points of the cell; other neighbours are in their boxes
};

struct SlopeMap {
  files::FunctionId function;    ///< "network" or "set:<phi kind>:<rho kind>"
  std::vector<SlopeCell> cells;  ///< the second coordinate fastest; together they cover the domain's box
};

/// Returns one map for the plain network, or one for each set function except the ground's, with one neighbour in the
/// cell and any number of others anywhere. Each `upper` was accepted by the checker or is the global bound of `found`.
/// Cells are bounded after the input clamp, which may map a cell to a smaller box or a point.
///
/// ReLU networks are bounded by branch and bound, and the lower-bound search of a cell starts at the steep points of
/// the previous cell in its row and of the whole box. Other networks are bounded by the slopes of their activations in
/// the cell (bound_by_slopes_on_box()); for rho, whose input contains other terms, these are the slopes over all
/// inputs.
/// Cost: about 0.08 s of processor time per cell for 6-25-40-40-20 in front of 20-40-40-40-1, half for each of the two
/// searches; with SiLU 0.5 s, or 0.14 s without the lower-bound search.
/// @param found certification of the same network; its bounds for block "all" and the Euclidean norm are used.
/// @throws std::invalid_argument if a coordinate does not exist, both are the same, or a number of cells is not
///   positive.
std::vector<SlopeMap> slope_maps(const files::Network& network, const Certification& found,
                                 const SlopeMapOptions& options);

/// Returns the index of the coordinate of the moving input called `name`: a name from network.toml, or "x<k>".
/// @throws std::invalid_argument, listing the existing names, if there is no such coordinate.
int map_coordinate(const files::Network& network, const std::string& name);

/// Returns the name of an input coordinate: the name from network.toml, or "x<k>".
std::string coordinate_name(const files::Network& network, int coordinate);

}  // namespace swarmcert::lipschitz
