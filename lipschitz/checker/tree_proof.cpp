#include "lipschitz/checker/tree_proof.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "lipschitz/checker/part_inequality.h"
#include "lipschitz/checker/tree_words.h"
#include "nn/base/doubles.h"

namespace swarmcert::check {
namespace {

using Row = std::vector<double>;

/// Numbers of a proof must be within 2^-kRange .. 2^kRange, so that kLost is small compared with their products.
constexpr int kRange = 400;

/// Largest depth of a tree. A coordinate cannot be halved more often than this, and a malicious tree must not exhaust
/// the memory.
constexpr std::size_t kDeepest = 2000;

/// The current box of the walk and the bounds on its neurons.
struct Part {
  Row lower, upper;
  std::shared_ptr<const NeuronBounds> around = {};  ///< bounds over the parent box; null for a root
  /// Bounds over this part, set when its first word that is not a decision is read.
  std::shared_ptr<const NeuronBounds> bounds = {};
  std::vector<Decision> decisions = {};  ///< decisions that are not yet verified
  /// Set by the last form: bounds on all layers of a set function, and G of the form. Null: no form yet.
  std::shared_ptr<const NeuronBounds> through_rho = {};
  std::shared_ptr<const Rounded> gram = {};
};

/// Verifies that forms of rho hold in parts.
class FormChecker {
 public:
  FormChecker(const LocalFunction& f, const std::vector<Form>& forms) : forms_(forms) {
    layers_ = f.hidden;
    layers_.insert(layers_.end(), f.behind.begin(), f.behind.end());
    first_ = f.hidden.size() + 1;
    if (f.behind.size() < 2) return;
    rho_.hidden.assign(f.behind.begin() + 1, f.behind.end());
    rho_.gram = f.behind_gram;
    gram_ = rounded(rho_.gram);
    for (int i = 0; i < f.behind.front().outputs; ++i) rho_.coordinates.push_back(i);
    rho_.weight.assign(rho_.coordinates.size(), 1.0);
  }

  /// Returns an error in the format of the forms, or an empty string.
  std::string fault() const {
    const std::size_t inputs = rho_.coordinates.size();
    std::size_t neurons = 0;
    for (const HiddenLayer& layer : rho_.hidden) neurons += static_cast<std::size_t>(layer.outputs);
    if (!forms_.empty() && inputs == 0) return "there are forms, but no rho";
    if (!gram_) return "rho's Gram matrix leaves the range of double";
    for (const Form& form : forms_) {
      if (form.q.size() != inputs * (inputs + 1) / 2 || form.t.size() != neurons)
        return "a form has another size";
      const auto usable = [](double x) { return std::abs(x) <= 0x1p400; };
      if (!std::all_of(form.q.begin(), form.q.end(), usable) ||
          !std::all_of(form.t.begin(), form.t.end(), [&](double x) { return x >= 0 && usable(x); }))
        return "a form is out of range, or a t of it negative";
    }
    return "";
  }

  /// Bounds rho's neurons in the part, using its decisions. Returns an error or an empty string.
  std::string look(Part& part) const {
    if (rho_.coordinates.empty()) return "there is no rho";
    auto through = std::make_shared<NeuronBounds>(*part.bounds);
    if (!add_layers(*through, layers_, part.lower, part.upper, part.through_rho.get(), part.decisions))
      return "a neuron of rho is not decided by its slopes";
    std::size_t neurons = 0;
    for (const HiddenLayer& layer : layers_) neurons += static_cast<std::size_t>(layer.outputs);
    for (const Decision& decision : part.decisions)
      if (decision.neuron >= neurons) return "there is no such neuron";
    part.decisions.clear();
    part.through_rho = std::move(through);
    return "";
  }

  /// Verifies the form and assigns it to the part. Returns an error or an empty string.
  std::string use(std::size_t index, Part& part) const {
    if (index >= forms_.size()) return "there is no such form";
    const Form& form = forms_[index];
    const std::string fault = look(part);
    if (!fault.empty()) return fault;
    NeuronBounds bounds;  // bounds on rho's neurons
    const auto first = static_cast<std::ptrdiff_t>(first_);
    bounds.lower.assign(part.through_rho->lower.begin() + first, part.through_rho->lower.end());
    bounds.upper.assign(part.through_rho->upper.begin() + first, part.through_rho->upper.end());
    const std::size_t inputs = rho_.coordinates.size();
    Row q(inputs * inputs);
    for (std::size_t i = 0, at = 0; i < inputs; ++i)
      for (std::size_t j = 0; j <= i; ++j, ++at) q[i * inputs + j] = q[j * inputs + i] = form.q[at];
    if (!PartInequality(rho_, *gram_, bounds, q, form.t, {}).is_positive_definite())
      return "its multipliers do not show the form there";
    part.gram = std::make_shared<Rounded>(gram_of_form(form.q, layers_[first_ - 1]));
    return "";
  }

 private:
  const std::vector<Form>& forms_;
  std::vector<HiddenLayer> layers_;  ///< layers of phi and rho
  std::size_t first_;                ///< index of rho's first layer
  LocalFunction rho_;                ///< rho as a function of v
  std::optional<Rounded> gram_ = Rounded(0, 0);
};

/// Returns layer and output of the n-th neuron.
WeightedNeuron neuron_at(const std::vector<HiddenLayer>& layers, std::size_t n, double weight) {
  std::size_t layer = 0;
  for (; n >= static_cast<std::size_t>(layers[layer].outputs); ++layer)
    n -= static_cast<std::size_t>(layers[layer].outputs);
  return {layer, static_cast<int>(n), weight};
}

/// Returns the conflicts between undecided neurons of the part that their lambda proves there.
std::vector<const Conflict*> shown(const std::vector<HiddenLayer>& layers, const Part& part,
                                   const std::vector<Conflict>& conflicts) {
  std::vector<const Conflict*> result;
  const auto is_undecided = [&](const WeightedNeuron& at) {
    const auto i = static_cast<std::size_t>(at.output);
    return layers[at.layer].has_relu(i) && part.bounds->lower[at.layer][i] < 0 &&
           part.bounds->upper[at.layer][i] > 0;
  };
  for (const Conflict& conflict : conflicts) {
    const WeightedNeuron first =
        neuron_at(layers, conflict.first, conflict.first_on ? conflict.lambda : -conflict.lambda);
    const double rest = 1 - conflict.lambda;  // may be rounded: any nonnegative weights, not both 0, will do
    const WeightedNeuron second = neuron_at(layers, conflict.second, conflict.second_on ? rest : -rest);
    if (is_undecided(first) && is_undecided(second) &&
        largest_sum(layers, *part.bounds, part.lower, part.upper, first, second) <= 0)
      result.push_back(&conflict);
  }
  return result;
}

bool is_usable(const Sides& box, const std::vector<HiddenLayer>& layers) {
  const Row &lower = box.lower, &upper = box.upper;
  if (layers.empty() || lower.size() != upper.size() ||
      lower.size() != static_cast<std::size_t>(layers.front().inputs))
    return false;
  for (std::size_t k = 0; k < lower.size(); ++k)
    if (!(std::abs(lower[k]) <= kLargestInput && std::abs(upper[k]) <= kLargestInput && lower[k] <= upper[k]))
      return false;
  return true;
}

/// Bounds the part's neurons, using its decisions. Returns an error or an empty string.
std::string bound_neurons(const std::vector<HiddenLayer>& layers, Part& part) {
  auto bounds = std::make_shared<NeuronBounds>();
  if (!add_layers(*bounds, layers, part.lower, part.upper, part.around.get(), part.decisions))
    return "a neuron is not decided by its slopes";
  std::size_t neurons = 0;
  for (const HiddenLayer& layer : layers) neurons += static_cast<std::size_t>(layer.outputs);
  const auto is_looked_at = [&](const Decision& decision) { return decision.neuron < neurons; };
  part.decisions.erase(std::remove_if(part.decisions.begin(), part.decisions.end(), is_looked_at),
                       part.decisions.end());
  part.bounds = std::move(bounds);
  part.around.reset();
  return "";
}

/// Pushes both halves of the part onto `open`, the lower half last. Returns an error or an empty string.
std::string halve(const Part& part, std::size_t coordinate, std::vector<Part>& open) {
  if (coordinate >= part.lower.size()) return "there is no such coordinate";
  const double middle = part.lower[coordinate] + (part.upper[coordinate] - part.lower[coordinate]) / 2;
  if (!(part.lower[coordinate] <= middle && middle <= part.upper[coordinate]))
    return "the side cannot be halved";
  for (const bool is_upper : {true, false}) {
    Part half{part.lower, part.upper, part.bounds};
    half.through_rho = part.through_rho;
    half.gram = part.gram;
    (is_upper ? half.lower : half.upper)[coordinate] = middle;
    open.push_back(std::move(half));
  }
  return "";
}

/// Visits the leaves of a tree. `leaf(index, part)` verifies a leaf and returns an error or an empty string.
/// `form(word, part)` does the same for a form or for bounds on rho's neurons, and assigns them to the part.
template <class Leaf, class UseForm>
TreeVerdict walk(const std::vector<HiddenLayer>& layers, const std::vector<Sides>& boxes,
                 const std::string& tree, const Leaf& leaf, const UseForm& form) {
  TreeVerdict verdict;
  std::vector<Part> open;  // parts that are still to be visited in preorder, the next one last
  for (auto box = boxes.rbegin(); box != boxes.rend(); ++box) open.push_back({box->lower, box->upper});
  Words words(tree);
  for (long count = 1; words.are_left(); ++count) {
    const auto fails = [&](const std::string& fault) {
      return TreeVerdict{false, "word " + std::to_string(count) + " of the tree: " + fault, verdict.leaves};
    };
    Word word;
    if (!words.read(word)) return fails("neither a split nor a leaf, a form or a decision");
    if (open.empty()) return fails("the box is covered already");
    if (word.kind == 'd') {
      open.back().decisions.push_back(word.decision);
      continue;
    }
    std::string fault;
    if (open.back().bounds == nullptr) fault = bound_neurons(layers, open.back());
    if (!fault.empty()) return fails(fault);
    if (word.kind == 'q' || word.kind == 'r') {
      fault = form(word, open.back());
      if (!fault.empty()) return fails(fault);
      continue;
    }
    const Part part = std::move(open.back());
    open.pop_back();
    if (!part.decisions.empty()) return fails("a neuron is decided, but the decision is not used");
    if (word.kind == 's') {
      if (open.size() > kDeepest + boxes.size()) return fails("the tree is too deep");
      fault = halve(part, word.index, open);
    } else {
      ++verdict.leaves;
      fault = leaf(word.index, part);
    }
    if (!fault.empty()) return fails(fault);
  }
  if (!open.empty()) return {false, "the tree ends before the box is covered", verdict.leaves};
  verdict.holds = true;
  return verdict;
}

}  // namespace

TreeVerdict check_tree(const LocalFunction& f, const Row& lower, const Row& upper, double rho,
                       const TreeProof& proof) {
  return check_tree(f, {{lower, upper}}, rho, proof);
}

TreeVerdict check_tree(const LocalFunction& f, const std::vector<Sides>& boxes, double rho,
                       const TreeProof& proof) {
  std::size_t neurons = 0;
  for (const HiddenLayer& layer : f.hidden) neurons += static_cast<std::size_t>(layer.outputs);
  for (const Row& t : proof.multipliers)
    if (t.size() != neurons ||
        !std::all_of(t.begin(), t.end(), [](double x) { return x >= 0 && std::isfinite(x); }))
      return {false, "multipliers are not one nonnegative number per hidden neuron", 0};
  if (!proof.conflicts.empty() && proof.conflicts.size() != proof.multipliers.size())
    return {false, "there are conflicts for other multipliers", 0};
  for (const std::vector<Conflict>& conflicts : proof.conflicts)
    for (const Conflict& c : conflicts)
      if (!(c.first < c.second && c.second < neurons && 0 <= c.lambda && c.lambda <= 1 &&
            std::isfinite(c.multiplier)))
        return {false, "a conflict is not between two neurons, or its lambda not in [0, 1]", 0};
  const auto in_range = [](double x) {
    return std::ldexp(1.0, -kRange) <= x && x <= std::ldexp(1.0, kRange);
  };
  if (!in_range(rho)) return {false, "rho is not positive, or out of range", 0};
  const auto usable_weight = [](double w) { return 0x1p-200 <= w && w <= 0x1p200; };
  if (f.weight.size() != f.coordinates.size() ||
      !std::all_of(f.weight.begin(), f.weight.end(), usable_weight))
    return {false, "scale is out of range", 0};
  for (const Sides& box : boxes)
    if (!is_usable(box, f.hidden)) return {false, "the box is empty, too large or of another size", 0};
  const FormChecker forms(f, proof.forms);
  if (!forms.fault().empty()) return {false, forms.fault(), 0};
  const std::optional<Rounded> gram = rounded(f.gram);
  if (!gram) return {false, "the output's Gram matrix leaves the range of double", 0};
  Row square(f.coordinates.size() * f.coordinates.size());
  for (std::size_t i = 0; i < f.coordinates.size(); ++i) square[i * (f.coordinates.size() + 1)] = rho;
  const auto leaf = [&](std::size_t index, const Part& part) -> std::string {
    if (index >= proof.multipliers.size()) return "there are no such multipliers";
    if (part.gram == nullptr && gram->rows == 0) return "there is no form yet";
    std::vector<const Conflict*> conflicts;
    if (!proof.conflicts.empty()) conflicts = shown(f.hidden, part, proof.conflicts[index]);
    if (!PartInequality(f, part.gram != nullptr ? *part.gram : *gram, *part.bounds, square,
                        proof.multipliers[index], conflicts)
             .is_positive_definite())
      return "its multipliers do not show the bound there";
    return "";
  };
  return walk(f.hidden, boxes, proof.tree, leaf, [&](const Word& word, Part& part) {
    return word.kind == 'q' ? forms.use(word.index, part) : forms.look(part);
  });
}

TreeVerdict check_range(const std::vector<HiddenLayer>& layers, const Row& lower, const Row& upper,
                        const std::string& tree, const Row& least, const Row& most) {
  if (!is_usable({lower, upper}, layers)) return {false, "the box is empty, too large or of another size", 0};
  const auto outputs = static_cast<std::size_t>(layers.back().outputs);
  if (layers.back().without_relu != layers.back().outputs || least.size() != outputs ||
      most.size() != outputs)
    return {false, "the range belongs to something else", 0};
  const auto leaf = [&](std::size_t index, const Part& part) -> std::string {
    if (index != 0) return "a leaf of a range has no multipliers";
    for (std::size_t i = 0; i < outputs; ++i)
      if (!(least[i] <= part.bounds->lower.back()[i] && part.bounds->upper.back()[i] <= most[i]))
        return "the range is larger there";
    return "";
  };
  return walk(layers, {{lower, upper}}, tree, leaf,
              [](const Word&, Part&) { return "a range has no forms"; });
}

}  // namespace swarmcert::check
