/// @file Slope of a network cell by cell over two input coordinates, enclosed from both sides.
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
  std::array<int, 2> coordinates{};  ///< of the moving input, different
  std::array<int, 2> cells{12, 12};  ///< along each, at least 1
  Domain domain;   ///< by part; finite. The other coordinates range over their whole intervals.
  int nodes = 50;  ///< boxes that branch and bound looks at, per cell of a ReLU network
  int rounds = 3;  ///< of the search for steep points, per cell, each of a few linear regions; 0: none
  std::uint64_t seed = 1;
  int jobs = 0;                                       ///< threads; 0: all. Results do not depend on it.
  const std::atomic<bool>* cancelled = nullptr;       ///< cells not looked at keep the bound over all inputs
  std::function<void(int done, int total)> progress;  ///< called from any thread
};

struct SlopeCell {
  Box box;                ///< of the moving input
  UpperBound upper{0};    ///< |f(x) - f(y)| <= upper |x - y| for all x and y in `box`
  bool is_local = false;  ///< proved for this cell, and smaller than the bound that holds everywhere
  UpperMethod method = UpperMethod::kBranch;  ///< of a local one: kBranch, kLocalSdp or kLocalProduct
  FoundSlope lower;  ///< two points of the cell between which f is as steep; other neighbours in their boxes
};

struct SlopeMap {
  files::FunctionId function;    ///< "network" or "set:<phi kind>:<rho kind>"
  std::vector<SlopeCell> cells;  ///< the second coordinate fastest; together they cover the domain's box
};

/// One map for each function of `found` that composes NET and moves such an input: the plain network, or each set
/// function but the ground's, with one neighbour in the cell and any others anywhere. What is `upper` has been accepted
/// by the checker, or is the bound of `found`; what the clamp maps to one point has been bounded after it.
///
/// ReLU networks are bounded by branch and bound, and a cell's search for steep points starts where the cell before in
/// its row and the whole box are steep. Others are bounded by the slopes that their activations have in the cell
/// (bound_by_slopes_on_box()), where those of rho, whose input has other terms, are those of all inputs.
/// Cost: about 0.08 s of a processor per cell for 6-25-40-40-20 in front of 20-40-40-40-1, half of it either search's;
/// with SiLU 0.5 s, 0.14 s without the second.
/// @param found certified with the same network: its bounds of block "all" and the Euclidean norm.
/// @throws std::invalid_argument if a coordinate does not exist or both are the same, or a number of cells is not
/// positive.
std::vector<SlopeMap> slope_maps(const files::Network& network, const Certification& found,
                                 const SlopeMapOptions& options);

/// The index of the moving input that `name` names: as in network.toml's order, or "x<k>".
/// @throws std::invalid_argument, with the names there are, if there is none.
int map_coordinate(const files::Network& network, const std::string& name);

/// The name of an input coordinate: as in network.toml's order, or "x<k>".
std::string coordinate_name(const files::Network& network, int coordinate);

}  // namespace swarmcert::lipschitz
