/// @file What is certified about NET: one claim per function, block of inputs and norm; laws for several neighbours.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// Neighbours by kind.
using Neighbours = std::map<std::string, int>;

/// |f(x) - f(y)|_2 <= L |x - y| for all x and y of the domain that differ in `block` only; in a set function for one
/// neighbour that moves.
struct Claim {
  files::FunctionId function;     ///< "network", "phi:<kind>", "rho:<kind>" or "set:<phi kind>:<rho kind>"
  std::string block = "all";      ///< see files::block_coordinates()
  std::vector<double> scale;      ///< empty: |x - y|_2; else |x - y|^2 = sum_k ((x_k - y_k) / scale_k)^2
  std::string domain = "global";  ///< or "box"
  /// Of a set function on a box: there are at most as many neighbours, the moving one included, all in the box. Empty:
  /// any number, anywhere.
  Neighbours neighbours = {};
};

/// How a bound for one neighbour becomes one for several terms of the sum, moved one after the other (triangle
/// inequality), with K_j the bound of neighbour j, and the ground as one more term where there is one:
enum class LawKind {
  kAllStacked,  ///< |df| <= sqrt(sum_j K_j^2) sqrt(sum_j |dx_j|^2): all inputs as one vector
  kAllMax,      ///< |df| <= (sum_j K_j) max_j |dx_j|
  kOwnState,  ///< |df| <= (sum_j K_j) |dx|: the vehicle's own state moves by dx, so every input moves by as much
};
/// "all_stacked", "all_max" or "own_state".
const char* name(LawKind law);

/// A law for one group of neighbours in front of one rho. Single coordinates have none: those of the ground are others
/// than those of a neighbour.
struct LawClaim {
  std::string rho;  ///< kind
  Neighbours neighbours;
  std::string block = "all";  ///< "all", "position" or "velocity"
  LawKind law = LawKind::kAllStacked;
};

/// Which claims to make.
struct ClaimOptions {
  /// Besides "all": names of blocks, each for the functions that have it; "every": all blocks of all functions.
  std::vector<std::string> blocks;
  std::vector<double> scale;  ///< not empty: claims in this norm as well, for functions with as many inputs
  int neighbours = 0;         ///< laws for as many neighbours of each kind; 0: none
  Neighbours mixture;         ///< laws for this group as well; empty: none
  bool counted = false;       ///< claims for these numbers of neighbours as well, where there is a domain
  /// By part ("network", "phi:<kind>"): claims of functions of these inputs hold for them. Empty: all of R^n.
  Domain domain;
};

/// @throws std::invalid_argument if no function has a block of that name or as many inputs as `scale`, a scale is not
///   positive, or `mixture` names a kind that NET has not.
std::vector<Claim> claims(const files::Network& network, const ClaimOptions& options);
std::vector<LawClaim> law_claims(const files::Network& network, const ClaimOptions& options);

/// Reads a box.toml: `schema = "swarmcert/box/1"`, `lower` and `upper`, one number per input of the plain network or
/// of the neighbours' phi; a table `ground` with the same keys for the ground's inputs (-z and -v), which otherwise
/// get the last four intervals.
/// @throws files::InputError with line, field, value and hint.
Domain read_domain(const std::string& path, const files::Network& network);

}  // namespace swarmcert::lipschitz
