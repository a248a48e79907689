#include "lipschitz/branch/search_tree.h"

#include <algorithm>
#include <map>
#include <set>

#include "lipschitz/checker/tree_words.h"

namespace swarmcert::lipschitz {
namespace {

class Writer {
 public:
  explicit Writer(const std::vector<SearchNode>& nodes) : nodes_(nodes) {}

  BranchTree write(std::size_t roots) {
    for (std::size_t root = 0; root < roots; ++root) mark(static_cast<int>(root), nullptr);
    for (std::size_t root = 0; root < roots; ++root) write_from(static_cast<int>(root));
    const auto are_none = [](const std::vector<check::Conflict>& some) { return some.empty(); };
    if (std::all_of(written_.conflicts.begin(), written_.conflicts.end(), are_none))
      written_.conflicts.clear();
    return std::move(written_);
  }

 private:
  const SearchNode& node(int index) const { return nodes_[static_cast<std::size_t>(index)]; }

  /// Marks the forms that the leaves depend on. @param form the form of the parent box.
  void mark(int index, const check::Form* form) {
    if (node(index).form) form = node(index).form.get();
    if (node(index).split != BranchTree::kLeaf) {
      mark(node(index).first_child, form);
      mark(node(index).first_child + 1, form);
    } else if (form != nullptr) {
      proves_.insert(form);
    }
  }

  void write_from(int index) {
    const SearchNode& from = node(index);
    BranchTree::Node to;
    to.split = from.split;
    to.decided = from.decided;
    to.bounds_rho = from.form != nullptr;
    if (from.form && proves_.count(from.form.get()) != 0) {
      const auto [place, is_new] = forms_.emplace(from.form.get(), static_cast<int>(written_.forms.size()));
      if (is_new) written_.forms.push_back(*from.form);
      to.form = place->second;
    }
    if (from.split == BranchTree::kLeaf && from.proof) {
      const auto [place, is_new] =
          proofs_.emplace(from.proof.get(), static_cast<int>(written_.multipliers.size()));
      if (is_new) {
        written_.multipliers.push_back(from.proof->multipliers);
        written_.conflicts.push_back(from.proof->conflicts);
      }
      to.multipliers = place->second;
    }
    written_.nodes.push_back(std::move(to));
    if (from.split == BranchTree::kLeaf) return;
    write_from(from.first_child);
    write_from(from.first_child + 1);
  }

  const std::vector<SearchNode>& nodes_;
  BranchTree written_;
  std::set<const check::Form*> proves_;      ///< forms that a leaf depends on
  std::map<const LeafProof*, int> proofs_;   ///< index in written_
  std::map<const check::Form*, int> forms_;  ///< index in written_
};

}  // namespace

BranchTree in_preorder(const std::vector<SearchNode>& nodes, std::size_t roots) {
  return Writer(nodes).write(roots);
}

std::string words_of(const BranchTree& tree) {
  std::string text;
  const auto add = [&](const std::string& word) {
    if (!text.empty()) text += ' ';
    text += word;
  };
  for (const BranchTree::Node& node : tree.nodes) {
    for (const check::Decision& decision : node.decided) add(check::word_of(decision));
    if (node.form != BranchTree::kNone) {
      add("q" + std::to_string(node.form));
    } else if (node.bounds_rho) {
      add("r");
    }
    add(node.split == BranchTree::kLeaf ? "t" + std::to_string(node.multipliers)
                                        : "s" + std::to_string(node.split));
  }
  return text;
}

}  // namespace swarmcert::lipschitz
