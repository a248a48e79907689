/// @file The tree of boxes of a search. Not for users.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "lipschitz/branch/branch.h"

namespace swarmcert::lipschitz {

/// What proves a leaf, in the units of the network.
struct LeafProof {
  std::vector<double> multipliers;  ///< one per hidden neuron
  std::vector<check::Conflict> conflicts;
};

/// A box examined by a search. Proofs and forms are shared by the nodes that inherit them.
struct SearchNode {
  int split = BranchTree::kLeaf, first_child = 0;  ///< index of the lower half; the upper half follows
  std::shared_ptr<const LeafProof> proof;          ///< of a leaf; null if none was found
  std::shared_ptr<const check::Form> form;         ///< form valid in this subtree; null: that of the parent
  std::vector<check::Decision> decided;            ///< at this node: neurons of phi, then of rho
};

/// Returns the tree in preorder, its `rho` unset. The first `roots` nodes are the boxes of the search. A form on which
/// no leaf depends is reduced to the mark that rho's neurons are bounded at its node, because forms below depend on
/// these bounds.
BranchTree in_preorder(const std::vector<SearchNode>& nodes, std::size_t roots);

/// Returns the tree as the words of check::TreeProof.
std::string words_of(const BranchTree& tree);

}  // namespace swarmcert::lipschitz
