/// @file The boxes of a search, and what is recorded of them. Not for users.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "lipschitz/branch/branch.h"

namespace swarmcert::lipschitz {

/// A box that a search has looked at.
struct SearchNode {
  static constexpr int kNone = -1;
  int split = BranchTree::kLeaf, first_child = 0;  ///< index of the lower half; the upper one follows
  int multipliers = kNone;                         ///< of a leaf
  int form = kNone;                                ///< that holds from here down
  std::vector<check::Decision> decided;            ///< here: of phi, then of rho
};

/// The tree in preorder, the first `roots` nodes being the boxes searched. Of `found`, whose nodes are empty, it keeps
/// the multipliers and forms that prove a leaf; of other forms only that rho's neurons were bounded there, which the
/// forms below rest on.
BranchTree in_preorder(const std::vector<SearchNode>& nodes, std::size_t roots, BranchTree found);

/// The words of check::TreeProof.
std::string words_of(const BranchTree& tree);

}  // namespace swarmcert::lipschitz
