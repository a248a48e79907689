#include "lipschitz/checker/slope_tree.h"

#include <algorithm>
#include <cmath>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/checker/tree_words.h"

namespace swarmcert::check {
namespace {

/// Largest number of parts that are still to be visited: a malicious tree must not exhaust the memory.
constexpr std::size_t kMostOpen = 2000;

/// Replaces the last of the open parts by its halves, the lower half last. Returns an error or an empty string.
std::string halve_last(std::vector<Sides>& open, std::size_t coordinate) {
  Sides lower = open.back(), upper = open.back();
  if (open.size() > kMostOpen) return "the tree is too deep";
  if (coordinate >= lower.lower.size()) return "there is no such coordinate";
  const double low = lower.lower[coordinate], high = lower.upper[coordinate];
  const double middle = low + (high - low) / 2;
  if (!(low <= middle && middle <= high)) return "the side cannot be halved";
  lower.upper[coordinate] = upper.lower[coordinate] = middle;
  open.back() = std::move(upper);
  open.push_back(std::move(lower));
  return "";
}

}  // namespace

TreeVerdict check_slope_tree(const files::Network& network, const files::FunctionId& function,
                             const std::string& block, const std::vector<double>& scale, const Sides& box,
                             double rho, const TreeProof& proof) {
  TreeVerdict verdict;
  if (!(rho > 0 && std::isfinite(rho))) return {false, "rho is not positive, or out of range", 0};
  for (std::size_t k = 0; k < box.lower.size(); ++k)
    if (!(std::abs(box.lower[k]) <= kLargestInput && std::abs(box.upper[k]) <= kLargestInput))
      return {false, "the box is too large", 0};
  std::vector<Sides> open = {box};
  Words words(proof.tree);
  for (long count = 1; words.are_left(); ++count) {
    const auto fails = [&](const std::string& fault) {
      return TreeVerdict{false, "word " + std::to_string(count) + " of the tree: " + fault, verdict.leaves};
    };
    Word word;
    if (!words.read(word) || (word.kind != 's' && word.kind != 't'))
      return fails("neither a split nor a leaf");
    if (open.empty()) return fails("the box is covered already");
    if (word.kind == 's') {
      const std::string fault = halve_last(open, word.index);
      if (!fault.empty()) return fails(fault);
      continue;
    }
    if (word.index >= proof.multipliers.size()) return fails("there are no such multipliers");
    const std::vector<double>& t = proof.multipliers[word.index];
    const Sides part = std::move(open.back());
    open.pop_back();
    const BentChain chain =
        chain_on_box(network, function, block, scale,
                     {{part.lower.begin(), part.lower.end()}, {part.upper.begin(), part.upper.end()}});
    if (t.size() != hidden_neurons(chain.stages) ||
        !std::all_of(t.begin(), t.end(), [](double x) { return x >= 0 && std::isfinite(x); }))
      return fails("multipliers are not one nonnegative number per hidden neuron");
    if (!shows_positive_semidefinite(lipschitz_lmi(chain, rho, {t.begin(), t.end()}), std::nullopt))
      return fails("its multipliers do not show the bound there");
    ++verdict.leaves;
  }
  if (!open.empty()) return {false, "the tree ends before the box is covered", verdict.leaves};
  verdict.holds = true;
  return verdict;
}

}  // namespace swarmcert::check
