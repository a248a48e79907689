/// @file Claims about NET: one per function, block of inputs and norm; laws for several neighbours.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "nn/weights/network.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::lipschitz {

/// Number of neighbours of each kind.
using Neighbours = std::map<std::string, int>;

/// |f(x) - f(y)|_2 <= L |x - y| for all x and y of the domain that differ in `block` only; in a set function, x and y
/// are two positions of one moving neighbour.
struct Claim {
  files::FunctionId function;     ///< "network", "phi:<kind>", "rho:<kind>" or "set:<phi kind>:<rho kind>"
  std::string block = "all";      ///< see files::block_coordinates()
  std::vector<double> scale;      ///< empty: |x - y|_2; else |x - y|^2 = sum_k ((x_k - y_k) / scale_k)^2
  std::string domain = "global";  ///< or "box"
  /// For a set function on a box: the largest number of neighbours of each kind, including the moving one, all in the
  /// box. Empty: any number, anywhere.
  Neighbours neighbours = {};
};

/// How bounds for single neighbours give a bound for several terms of the sum that move: one term after the other, by
/// the triangle inequality. K_j is the bound of neighbour j; the ground, if present, counts as one more term.
enum class LawKind {
  kAllStacked,  ///< |df| <= sqrt(sum_j K_j^2) sqrt(sum_j |dx_j|^2): all inputs as one vector
  kAllMax,      ///< |df| <= (sum_j K_j) max_j |dx_j|
  kOwnState,    ///< |df| <= (sum_j K_j) |dx|: the vehicle's own state and hence every input moves by dx
};
/// "all_stacked", "all_max" or "own_state".
const char* name(LawKind law);

/// A law for one group of neighbours in front of one rho. There are no laws for single coordinates, because the ground
/// and a neighbour have different coordinates.
struct LawClaim {
  std::string rho;  ///< kind of the vehicle
  Neighbours neighbours;
  std::string block = "all";  ///< "all", "position" or "velocity"
  LawKind law = LawKind::kAllStacked;
};

/// Which claims to make.
struct ClaimOptions {
  /// Blocks besides "all", each for the functions that have it; "every": all blocks of all functions.
  std::vector<std::string> blocks;
  std::vector<double> scale;  ///< if not empty: more claims in this norm, for functions with as many inputs
  int neighbours = 0;         ///< laws for this many neighbours of each kind; 0: none
  Neighbours mixture;         ///< laws for this group in addition; empty: none
  bool counted = false;       ///< additional claims for these numbers of neighbours, if there is a domain
  /// By part ("network", "phi:<kind>"): the box on which claims about functions of this part's input hold. Empty: all
  /// of R^n.
  Domain domain;
};

/// Returns the claims and the laws to be certified.
/// @throws std::invalid_argument if no function has a block of that name or as many inputs as `scale` has entries, if
///   a scale is not positive, or if `mixture` names a kind that NET does not have.
std::vector<Claim> claims(const files::Network& network, const ClaimOptions& options);
std::vector<LawClaim> law_claims(const files::Network& network, const ClaimOptions& options);

/// Describes box.toml.
void describe_box_file(files::Keys& keys);

/// Reads a box.toml of the plain network's inputs or of the neighbours' phi; without a table `ground`, the ground's
/// inputs (-z and -v) get the last four intervals.
/// @throws files::InputError with line, field, value and hint.
Domain read_domain(const std::string& path, const files::Network& network);

}  // namespace swarmcert::lipschitz
