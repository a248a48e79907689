#include "lipschitz/branch/search_tree.h"

#include <algorithm>

#include "lipschitz/checker/tree_words.h"

namespace swarmcert::lipschitz {
namespace {

class Writer {
 public:
  Writer(const std::vector<SearchNode>& nodes, BranchTree found)
      : nodes_(nodes),
        found_(std::move(found)),
        proves_(found_.forms.size(), false),
        multipliers_(found_.multipliers.size(), SearchNode::kNone),
        forms_(found_.forms.size(), SearchNode::kNone) {
    written_.rho = found_.rho;
  }

  BranchTree write(std::size_t roots) {
    for (std::size_t root = 0; root < roots; ++root) mark(static_cast<int>(root), SearchNode::kNone);
    for (std::size_t root = 0; root < roots; ++root) write_from(static_cast<int>(root));
    const auto are_none = [](const std::vector<check::Conflict>& some) { return some.empty(); };
    if (std::all_of(written_.conflicts.begin(), written_.conflicts.end(), are_none))
      written_.conflicts.clear();
    return std::move(written_);
  }

 private:
  const SearchNode& node(int index) const { return nodes_[static_cast<std::size_t>(index)]; }

  /// Marks the forms that the leaves depend on. @param form the form of the parent box.
  void mark(int index, int form) {
    if (node(index).form != SearchNode::kNone) form = node(index).form;
    if (node(index).split != BranchTree::kLeaf) {
      mark(node(index).first_child, form);
      mark(node(index).first_child + 1, form);
    } else if (form != SearchNode::kNone) {
      proves_[static_cast<std::size_t>(form)] = true;
    }
  }

  void write_from(int index) {
    const SearchNode& from = node(index);
    BranchTree::Node to;
    to.split = from.split;
    to.decided = from.decided;
    if (from.form != SearchNode::kNone) {
      const auto form = static_cast<std::size_t>(from.form);
      to.bounds_rho = true;
      if (proves_[form]) to.form = moved(form, forms_, found_.forms, written_.forms);
    }
    if (from.split == BranchTree::kLeaf && from.multipliers != SearchNode::kNone) {
      const auto own = static_cast<std::size_t>(from.multipliers);
      const bool is_new = multipliers_[own] == SearchNode::kNone;
      to.multipliers = moved(own, multipliers_, found_.multipliers, written_.multipliers);
      if (is_new) written_.conflicts.push_back(std::move(found_.conflicts[own]));
    }
    written_.nodes.push_back(std::move(to));
    if (from.split == BranchTree::kLeaf) return;
    write_from(from.first_child);
    write_from(from.first_child + 1);
  }

  /// Returns the index of an item in `to`; the item is moved there at its first use.
  template <class Item>
  static int moved(std::size_t item, std::vector<int>& places, std::vector<Item>& from,
                   std::vector<Item>& to) {
    if (places[item] == SearchNode::kNone) {
      places[item] = static_cast<int>(to.size());
      to.push_back(std::move(from[item]));
    }
    return places[item];
  }

  const std::vector<SearchNode>& nodes_;
  BranchTree found_, written_;
  std::vector<bool> proves_;              ///< by form: whether a leaf depends on it
  std::vector<int> multipliers_, forms_;  ///< new indices
};

}  // namespace

BranchTree in_preorder(const std::vector<SearchNode>& nodes, std::size_t roots, BranchTree found) {
  return Writer(nodes, std::move(found)).write(roots);
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
