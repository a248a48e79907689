#include "lipschitz/checker/tree_proof.h"

#include <algorithm>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "nn/files/doubles.h"

namespace swarmcert::check {
namespace {

using Row = std::vector<double>;

/// More than what a product, or flushing its result to zero, loses below the range of normal numbers.
constexpr double kLost = 0x1p-1000;
/// Numbers of a proof stay within 2^-kRange .. 2^kRange, so that kLost is small beside what they make.
constexpr int kRange = 400;

/// Halving a coordinate more often than this leaves nothing to halve; and a hostile tree must not take all memory.
constexpr std::size_t kDeepest = 2000;

static_assert(std::numeric_limits<double>::is_iec559 && FLT_EVAL_METHOD == 0,
              "the error bounds here are those of IEEE double arithmetic");

/// A matrix whose entries are off by at most `radius`, both row-major.
struct Rounded {
  int rows, cols;
  Row value, radius;
  Rounded(int r, int c)
      : rows(r), cols(c), value(static_cast<std::size_t>(r) * c), radius(static_cast<std::size_t>(r) * c) {}
  double* at(int i) { return &value[static_cast<std::size_t>(i) * cols]; }
  const double* at(int i) const { return &value[static_cast<std::size_t>(i) * cols]; }
  double* radius_at(int i) { return &radius[static_cast<std::size_t>(i) * cols]; }
  const double* radius_at(int i) const { return &radius[static_cast<std::size_t>(i) * cols]; }
};

/// The matrix inequality of one part.
class PartInequality {
 public:
  /// @param conflicts that hold in the part, between undecided neurons.
  PartInequality(const LocalFunction& f, const Rounded& gram, const NeuronBounds& bounds, double rho,
                 const Row& t, const std::vector<const Conflict*>& conflicts)
      : f_(f), bounds_(bounds), t_(t), moving_(static_cast<int>(f.coordinates.size())) {
    for (const Conflict* conflict : conflicts) factors_[conflict->first] = factors_[conflict->second] = {};
    int free = 0;
    for (std::size_t k = 0; k < f.hidden.size(); ++k)
      for (int i = 0; i < f.hidden[k].outputs; ++i)
        if (undecided(k, i)) ++free;
    n_ = moving_ + free;
    s_.assign(static_cast<std::size_t>(n_) * n_, 0.0);
    excess_.assign(s_.size(), 0.0);
    for (int i = 0; i < moving_; ++i) s(i, i) = rho;
    const Rounded z = subtract_neurons();
    for (const Conflict* conflict : conflicts) subtract_conflict(*conflict);
    subtract_output(gram, z);
  }

  bool is_positive_definite() {
    scale_to_unit_diagonal();
    double trace = 0, excess = 0;
    for (int i = 0; i < n_; ++i) {
      trace += std::abs(s(i, i));
      double row = 0;
      for (int j = 0; j < n_; ++j) row += excess_[static_cast<std::size_t>(i) * n_ + j];
      if (!(row <= excess)) excess = row;  // keeps a NaN
    }
    // Sums of nonnegative doubles of at most n terms are too small by at most n u of themselves.
    const double shift = 1.001 * excess + 1.01 * (n_ + 4) * kUnit * trace + 0x1p-900;
    if (!std::isfinite(shift)) return false;
    for (int i = 0; i < n_; ++i) s(i, i) = std::nextafter(s(i, i) - shift, -1e300);
    return cholesky_runs_through();
  }

 private:
  double& s(int i, int j) { return s_[static_cast<std::size_t>(i) * n_ + j]; }
  double& excess(int i, int j) { return excess_[static_cast<std::size_t>(i) * n_ + j]; }
  bool on(std::size_t k, int i) const {
    return !f_.hidden[k].has_relu(static_cast<std::size_t>(i)) ||
           bounds_.lower[k][static_cast<std::size_t>(i)] >= 0;
  }
  bool off(std::size_t k, int i) const {
    return f_.hidden[k].has_relu(static_cast<std::size_t>(i)) &&
           bounds_.upper[k][static_cast<std::size_t>(i)] <= 0;
  }
  bool undecided(std::size_t k, int i) const { return !on(k, i) && !off(k, i); }

  /// Adds to S and returns dz of the last hidden layer as forms in the variables.
  Rounded subtract_neurons() {
    Rounded z(0, 0);
    int variable = moving_;
    std::size_t neuron = 0;
    for (std::size_t k = 0; k < f_.hidden.size(); ++k) {
      const HiddenLayer& layer = f_.hidden[k];
      Rounded y = k == 0 ? first_layer() : next_layer(layer, k, z, variable);
      const int known = variable;  // y depends on variables before this one
      for (int i = 0; i < layer.outputs; ++i, ++neuron) {
        if (!undecided(k, i)) continue;
        const double t = t_.at(neuron);
        const double* const row = y.at(i);
        const double* const radius = y.radius_at(i);
        for (int j = 0; j < known; ++j) {
          const double product = t * row[j];
          s(variable, j) -= product;
          s(j, variable) = s(variable, j);
          excess(variable, j) +=
              t * radius[j] + kUnit * std::abs(product) + kUnit * std::abs(s(variable, j)) + kLost;
          excess(j, variable) = excess(variable, j);
        }
        s(variable, variable) += 2 * t;  // exact: nothing else is there yet
        const auto wanted = factors_.find(neuron);
        if (wanted != factors_.end())
          wanted->second = {variable, Row(row, row + n_), Row(radius, radius + n_)};
        std::fill(y.at(i), y.at(i) + n_, 0.0);
        std::fill(y.radius_at(i), y.radius_at(i) + n_, 0.0);
        y.at(i)[variable++] = 1;  // from here on the row is dz
      }
      for (int i = 0; i < layer.outputs; ++i) {
        if (!off(k, i) || on(k, i)) continue;
        std::fill(y.at(i), y.at(i) + n_, 0.0);
        std::fill(y.radius_at(i), y.radius_at(i) + n_, 0.0);
      }
      z = std::move(y);
    }
    return z;
  }

  /// dy of an undecided neuron as a form in the variables, and its own variable dz.
  struct NeuronForms {
    int variable = 0;
    Row value, radius;
  };

  /// e_i, or a_i = dy_i - e_i: exact but for dy_i, which does not depend on the neuron's own variable.
  static NeuronForms factor(NeuronForms forms, bool is_on) {
    if (is_on) {
      std::fill(forms.value.begin(), forms.value.end(), 0.0);
      std::fill(forms.radius.begin(), forms.radius.end(), 0.0);
    }
    forms.value[static_cast<std::size_t>(forms.variable)] = is_on ? 1 : -1;
    return forms;
  }

  /// S -= s (p q' + q p').
  void subtract_conflict(const Conflict& conflict) {
    const NeuronForms p = factor(factors_.at(conflict.first), conflict.first_on);
    const NeuronForms q = factor(factors_.at(conflict.second), conflict.second_on);
    const std::vector<int> rows = support(p), columns = support(q);
    for (const int i : rows)
      for (const int j : columns) {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
        const double product = conflict.multiplier * (p.value[a] * q.value[b]);
        const double spread = std::abs(p.value[a]) * q.radius[b] + p.radius[a] * std::abs(q.value[b]) +
                              p.radius[a] * q.radius[b] + kLost;
        for (const auto& [k, l] : {std::pair(i, j), std::pair(j, i)}) {
          s(k, l) -= product;
          excess(k, l) += 1.01 * (std::abs(conflict.multiplier) * spread + 4 * kUnit * std::abs(product)) +
                          kUnit * std::abs(s(k, l)) + kLost;
        }
      }
  }

  static std::vector<int> support(const NeuronForms& forms) {
    std::vector<int> result;
    for (std::size_t j = 0; j < forms.value.size(); ++j)
      if (forms.value[j] != 0 || forms.radius[j] != 0) result.push_back(static_cast<int>(j));
    return result;
  }

  Rounded first_layer() const {
    const HiddenLayer& layer = f_.hidden.front();
    Rounded y(layer.outputs, n_);
    for (int i = 0; i < layer.outputs; ++i)
      for (int j = 0; j < moving_; ++j) {
        const auto column = static_cast<std::size_t>(f_.coordinates[static_cast<std::size_t>(j)]);
        y.at(i)[j] = layer.weights[static_cast<std::size_t>(i) * layer.inputs + column] *
                     f_.weight[static_cast<std::size_t>(j)];
        y.radius_at(i)[j] =
            f_.weight[static_cast<std::size_t>(j)] == 1 ? 0 : 2 * kUnit * std::abs(y.at(i)[j]) + kLost;
      }
    return y;
  }

  /// W z; rows of neurons that are off stay 0. An undecided neuron's dz is a variable of its own: no product is needed.
  Rounded next_layer(const HiddenLayer& layer, std::size_t k, const Rounded& z, int known) const {
    Rounded y(layer.outputs, n_);
    const double gamma = 1.01 * (layer.inputs + 2) * kUnit;
    int variable = known;
    std::vector<int> own(static_cast<std::size_t>(layer.inputs), -1);
    for (int c = layer.inputs; c-- > 0;)
      if (undecided(k - 1, c)) own[static_cast<std::size_t>(c)] = --variable;
    for (int i = 0; i < layer.outputs; ++i) {
      if (off(k, i) && !on(k, i)) continue;
      double* const row = y.at(i);
      double* const radius = y.radius_at(i);
      const double* const w = &layer.weights[static_cast<std::size_t>(i) * layer.inputs];
      for (int c = 0; c < layer.inputs; ++c) {
        if (own[static_cast<std::size_t>(c)] >= 0) {
          row[own[static_cast<std::size_t>(c)]] = w[c];  // exact: no other neuron before has this variable
          continue;
        }
        if (!on(k - 1, c)) continue;
        const double* const zc = z.at(c);
        const double* const zr = z.radius_at(c);
        const double size = std::abs(w[c]);
        for (int j = 0; j < variable; ++j) {
          row[j] += w[c] * zc[j];
          radius[j] += size * (1.01 * zr[j] + gamma * std::abs(zc[j]) + kLost) + kLost;
        }
      }
      for (int j = 0; j < variable; ++j) radius[j] *= 1.01;  // what rounding of the radii themselves may lack
    }
    return y;
  }

  /// S -= F' G F with F = dz of the last hidden layer.
  void subtract_output(const Rounded& gram, const Rounded& z) {
    const int rows = z.rows;
    const double gamma = 1.01 * (2 * rows + 8) * kUnit;
    std::vector<std::vector<int>> support(static_cast<std::size_t>(rows));
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < n_; ++j)
        if (z.at(i)[j] != 0 || z.radius_at(i)[j] != 0) support[static_cast<std::size_t>(i)].push_back(j);
    Rounded h(rows, n_);                            // G F
    Row size(static_cast<std::size_t>(rows) * n_);  // |G| (|F| + radius), rounded up
    for (int i = 0; i < rows; ++i)
      for (int c = 0; c < rows; ++c) {
        const double g = gram.at(i)[c];
        const double g_size = std::abs(g) + gram.radius_at(i)[c];
        for (const int j : support[static_cast<std::size_t>(c)]) {
          h.at(i)[j] += g * z.at(c)[j];
          h.radius_at(i)[j] +=
              1.01 * (g_size * z.radius_at(c)[j] + gram.radius_at(i)[c] * std::abs(z.at(c)[j])) + kLost;
          size[static_cast<std::size_t>(i) * n_ + j] +=
              1.01 * g_size * (std::abs(z.at(c)[j]) + z.radius_at(c)[j]) + kLost;
        }
      }
    for (int c = 0; c < rows; ++c)
      for (const int i : support[static_cast<std::size_t>(c)]) {
        const double f = z.at(c)[i];
        const double f_size = std::abs(f) + z.radius_at(c)[i];
        for (int j = 0; j < n_; ++j) {
          const double product = f * h.at(c)[j];
          s(i, j) -= product;
          excess(i, j) +=
              1.01 * (f_size * h.radius_at(c)[j] + (z.radius_at(c)[i] + gamma * f_size + kLost) *
                                                       size[static_cast<std::size_t>(c) * n_ + j]) +
              kLost + kUnit * std::abs(s(i, j));
        }
      }
    for (int i = 0; i < n_; ++i)  // the two halves were rounded apart
      for (int j = 0; j < i; ++j) {
        excess(i, j) = excess(j, i) = excess(i, j) + excess(j, i) + std::abs(s(i, j) - s(j, i));
        s(j, i) = s(i, j);
      }
  }

  /// D S D with powers of two d_i^2 near 1 / s_ii: exact, short of underflow.
  void scale_to_unit_diagonal() {
    Row power(static_cast<std::size_t>(n_), 1.0);
    for (int i = 0; i < n_; ++i)
      if (s(i, i) > 0) power[static_cast<std::size_t>(i)] = std::ldexp(1.0, -std::ilogb(s(i, i)) / 2);
    for (int i = 0; i < n_; ++i)
      for (int j = 0; j < n_; ++j) {  // of the product only overflow is inexact: it ends in a refusal
        const double both = power[static_cast<std::size_t>(i)] * power[static_cast<std::size_t>(j)];
        s(i, j) *= both;
        excess(i, j) = excess(i, j) * both + 0x1p-1000;
      }
  }

  /// S = U' U on the upper triangle, row by row.
  bool cholesky_runs_through() {
    for (int k = 0; k < n_; ++k) {
      const double pivot = s(k, k);
      if (!(pivot > 0) || !std::isfinite(pivot)) return false;
      const double root = std::sqrt(pivot);
      double* const row = &s(k, 0);
      for (int j = k + 1; j < n_; ++j) row[j] /= root;
      for (int i = k + 1; i < n_; ++i) {
        const double factor = row[i];
        if (!std::isfinite(factor)) return false;
        if (factor == 0) continue;
        double* const other = &s(i, 0);
        for (int j = i; j < n_; ++j) other[j] -= factor * row[j];
      }
    }
    return true;
  }

  const LocalFunction& f_;
  const NeuronBounds& bounds_;
  const Row& t_;
  int moving_, n_ = 0;
  std::map<std::size_t, NeuronForms> factors_;  ///< of the neurons in conflicts
  Row s_, excess_;                              ///< the true entries of S lie within s +- excess
};

/// G in double, with what that rounding may have changed.
Rounded rounded(const Matrix& exact) {
  Rounded result(exact.rows, exact.cols);
  for (std::size_t i = 0; i < exact.entries.size(); ++i) {
    const Dyadic& x = exact.entries[i];
    signed long exponent = 0;
    const double fraction = mpz_get_d_2exp(&exponent, x.mantissa.get_mpz_t());  // truncates to 53 bits
    const long total = exponent + x.exponent;
    if (std::abs(total) > 900)
      throw std::runtime_error("the output's Gram matrix leaves the range of double");
    result.value[i] = std::ldexp(fraction, static_cast<int>(total));
    result.radius[i] = 2 * kUnit * std::abs(result.value[i]) + 0x1p-900;
  }
  return result;
}

/// Where the walk is: the box and what is known of its neurons.
struct Part {
  Row lower, upper;
  NeuronBounds bounds;
};

/// Which layer and which of its outputs the n-th one is.
WeightedNeuron neuron_at(const std::vector<HiddenLayer>& layers, std::size_t n, double weight) {
  std::size_t layer = 0;
  for (; n >= static_cast<std::size_t>(layers[layer].outputs); ++layer)
    n -= static_cast<std::size_t>(layers[layer].outputs);
  return {layer, static_cast<int>(n), weight};
}

/// The conflicts between neurons that the part leaves undecided which their lambda shows there.
std::vector<const Conflict*> shown(const std::vector<HiddenLayer>& layers, const Part& part,
                                   const std::vector<Conflict>& conflicts) {
  std::vector<const Conflict*> result;
  const auto is_undecided = [&](const WeightedNeuron& at) {
    const auto i = static_cast<std::size_t>(at.output);
    return layers[at.layer].has_relu(i) && part.bounds.lower[at.layer][i] < 0 &&
           part.bounds.upper[at.layer][i] > 0;
  };
  for (const Conflict& conflict : conflicts) {
    const WeightedNeuron first =
        neuron_at(layers, conflict.first, conflict.first_on ? conflict.lambda : -conflict.lambda);
    const double rest = 1 - conflict.lambda;  // rounded: any two nonnegative weights, not both zero, will do
    const WeightedNeuron second = neuron_at(layers, conflict.second, conflict.second_on ? rest : -rest);
    if (is_undecided(first) && is_undecided(second) &&
        largest_sum(layers, part.bounds, part.lower, part.upper, first, second) <= 0)
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

/// Visits the leaves of a tree: `leaf(index, part)` says what is wrong with one, or nothing.
template <class Leaf>
TreeVerdict walk(const std::vector<HiddenLayer>& layers, const std::vector<Sides>& boxes,
                 const std::string& tree, const Leaf& leaf) {
  TreeVerdict verdict;
  std::vector<Part> open;  // what preorder has still to visit, the next one last
  for (auto box = boxes.rbegin(); box != boxes.rend(); ++box)
    open.push_back({box->lower, box->upper, neuron_bounds(layers, box->lower, box->upper, nullptr)});
  const char* at = tree.data();
  const char* const end = at + tree.size();
  for (long word = 1; at != end; ++word) {
    const std::string where = "word " + std::to_string(word) + " of the tree";
    const char kind = *at++;
    std::size_t index = 0;
    const auto [rest, error] = std::from_chars(at, end, index);
    if (error != std::errc() || (rest != end && (*rest != ' ' || rest + 1 == end)) || rest - at > 15 ||
        (kind != 's' && kind != 't'))
      return {false, where + " is neither a split nor a leaf", verdict.leaves};
    at = rest == end ? end : rest + 1;
    if (open.empty()) return {false, where + ": the box is covered already", verdict.leaves};
    const Part part = std::move(open.back());
    open.pop_back();
    if (kind == 's') {
      if (index >= part.lower.size()) return {false, where + ": there is no such coordinate", verdict.leaves};
      if (open.size() > kDeepest + boxes.size())
        return {false, where + ": the tree is too deep", verdict.leaves};
      const double middle = part.lower[index] + (part.upper[index] - part.lower[index]) / 2;
      if (!(part.lower[index] <= middle && middle <= part.upper[index]))
        return {false, where + ": the side cannot be halved", verdict.leaves};
      for (const bool is_upper : {true, false}) {
        Part half{part.lower, part.upper, {}};
        (is_upper ? half.lower : half.upper)[index] = middle;
        half.bounds = neuron_bounds(layers, half.lower, half.upper, &part.bounds);
        open.push_back(std::move(half));
      }
      continue;
    }
    ++verdict.leaves;
    const std::string fault = leaf(index, part);
    if (!fault.empty()) return {false, where + ": " + fault, verdict.leaves};
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
  const Rounded gram = rounded(f.gram);
  return walk(f.hidden, boxes, proof.tree, [&](std::size_t index, const Part& part) -> std::string {
    if (index >= proof.multipliers.size()) return "there are no such multipliers";
    std::vector<const Conflict*> conflicts;
    if (!proof.conflicts.empty()) conflicts = shown(f.hidden, part, proof.conflicts[index]);
    if (!PartInequality(f, gram, part.bounds, rho, proof.multipliers[index], conflicts)
             .is_positive_definite())
      return "its multipliers do not show the bound there";
    return "";
  });
}

TreeVerdict check_range(const std::vector<HiddenLayer>& layers, const Row& lower, const Row& upper,
                        const std::string& tree, const Row& least, const Row& most) {
  if (!is_usable({lower, upper}, layers)) return {false, "the box is empty, too large or of another size", 0};
  const auto outputs = static_cast<std::size_t>(layers.back().outputs);
  if (layers.back().without_relu != layers.back().outputs || least.size() != outputs ||
      most.size() != outputs)
    return {false, "the range is of something else", 0};
  return walk(layers, {{lower, upper}}, tree, [&](std::size_t index, const Part& part) -> std::string {
    if (index != 0) return "a leaf of a range has no multipliers";
    for (std::size_t i = 0; i < outputs; ++i)
      if (!(least[i] <= part.bounds.lower.back()[i] && part.bounds.upper.back()[i] <= most[i]))
        return "the range is larger there";
    return "";
  });
}

}  // namespace swarmcert::check
