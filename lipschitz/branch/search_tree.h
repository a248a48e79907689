/// @file The tree of boxes of a search. Not for users.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "lipschitz/branch/branch.h"

namespace swarmcert::lipschitz {

/// A box examined by a search.
struct SearchNode {
  static constexpr int kNone = -1;
  int split = BranchTree::kLeaf, first_child = 0;  ///< index of the lower half; the upper half follows
  int multipliers = kNone;                         ///< of a leaf
  int form = kNone;                                ///< form valid in this subtree
  std::vector<check::Decision> decided;            ///< at this node: neurons of phi, then of rho
};

/// Returns the tree in preorder. The first `roots` nodes are the boxes of the search. Keeps those multipliers and forms
/// of `found`, whose nodes are empty, that prove a leaf. An unused form is reduced to the mark that rho's neurons are
/// bounded at its node, because forms below depend on these bounds.
BranchTree in_preorder(const std::vector<SearchNode>& nodes, std::size_t roots, BranchTree found);

/// Returns the tree as the words of check::TreeProof.
std::string words_of(const BranchTree& tree);

}  // namespace swarmcert::lipschitz
