#include "lipschitz/checker/tree_proof.h"

#include <algorithm>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

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
  PartInequality(const LocalFunction& f, const Rounded& gram, const NeuronBounds& bounds, double rho,
                 const Row& t)
      : f_(f), bounds_(bounds), t_(t), moving_(static_cast<int>(f.coordinates.size())) {
    int free = 0;
    for (std::size_t k = 0; k < f.hidden.size(); ++k)
      for (int i = 0; i < f.hidden[k].outputs; ++i)
        if (undecided(k, i)) ++free;
    n_ = moving_ + free;
    s_.assign(static_cast<std::size_t>(n_) * n_, 0.0);
    excess_.assign(s_.size(), 0.0);
    for (int i = 0; i < moving_; ++i) s(i, i) = rho;
    subtract_output(gram, subtract_neurons());
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
  bool on(std::size_t k, int i) const { return bounds_.lower[k][static_cast<std::size_t>(i)] >= 0; }
  bool off(std::size_t k, int i) const { return bounds_.upper[k][static_cast<std::size_t>(i)] <= 0; }
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
    std::vector<int> exponent(static_cast<std::size_t>(n_));
    for (int i = 0; i < n_; ++i)
      exponent[static_cast<std::size_t>(i)] = s(i, i) > 0 ? -std::ilogb(s(i, i)) / 2 : 0;
    for (int i = 0; i < n_; ++i)
      for (int j = 0; j < n_; ++j) {
        const int e = exponent[static_cast<std::size_t>(i)] + exponent[static_cast<std::size_t>(j)];
        s(i, j) = std::ldexp(s(i, j), e);
        excess(i, j) = std::ldexp(excess(i, j), e) + 0x1p-1000;
      }
  }

  bool cholesky_runs_through() {
    for (int j = 0; j < n_; ++j) {
      double pivot = s(j, j);
      for (int k = 0; k < j; ++k) pivot -= s(j, k) * s(j, k);
      if (!(pivot > 0) || !std::isfinite(pivot)) return false;
      const double root = std::sqrt(pivot);
      s(j, j) = root;
      for (int i = j + 1; i < n_; ++i) {
        double entry = s(i, j);
        for (int k = 0; k < j; ++k) entry -= s(i, k) * s(j, k);
        s(i, j) = entry / root;
        if (!std::isfinite(s(i, j))) return false;
      }
    }
    return true;
  }

  const LocalFunction& f_;
  const NeuronBounds& bounds_;
  const Row& t_;
  int moving_, n_ = 0;
  Row s_, excess_;  ///< the true entries of S lie within s +- excess
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

}  // namespace

TreeVerdict check_tree(const LocalFunction& f, const Row& lower, const Row& upper, double rho,
                       const TreeProof& proof) {
  TreeVerdict verdict;
  std::size_t neurons = 0;
  for (const HiddenLayer& layer : f.hidden) neurons += static_cast<std::size_t>(layer.outputs);
  for (const Row& t : proof.multipliers)
    if (t.size() != neurons ||
        !std::all_of(t.begin(), t.end(), [](double x) { return x >= 0 && std::isfinite(x); }))
      return {false, "multipliers are not one nonnegative number per hidden neuron", 0};
  const auto in_range = [](double x) {
    return std::ldexp(1.0, -kRange) <= x && x <= std::ldexp(1.0, kRange);
  };
  if (!in_range(rho)) return {false, "rho is not positive, or out of range", 0};
  const auto usable_weight = [](double w) { return 0x1p-200 <= w && w <= 0x1p200; };
  if (f.weight.size() != f.coordinates.size() ||
      !std::all_of(f.weight.begin(), f.weight.end(), usable_weight))
    return {false, "scale is out of range", 0};
  if (f.hidden.empty() || lower.size() != upper.size() ||
      lower.size() != static_cast<std::size_t>(f.hidden[0].inputs))
    return {false, "the box has another size", 0};
  for (std::size_t k = 0; k < lower.size(); ++k)
    if (!(std::abs(lower[k]) <= kLargestInput && std::abs(upper[k]) <= kLargestInput && lower[k] <= upper[k]))
      return {false, "the box is empty or too large", 0};
  const Rounded gram = rounded(f.gram);

  std::vector<Part> open;  // what preorder has still to visit, the next one last
  open.push_back({lower, upper, neuron_bounds(f.hidden, lower, upper, nullptr)});
  const char* at = proof.tree.data();
  const char* const end = at + proof.tree.size();
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
      if (index >= lower.size()) return {false, where + ": there is no such coordinate", verdict.leaves};
      if (open.size() > kDeepest) return {false, where + ": the tree is too deep", verdict.leaves};
      const double middle = part.lower[index] + (part.upper[index] - part.lower[index]) / 2;
      if (!(part.lower[index] <= middle && middle <= part.upper[index]))
        return {false, where + ": the side cannot be halved", verdict.leaves};
      for (const bool is_upper : {true, false}) {
        Part half{part.lower, part.upper, {}};
        (is_upper ? half.lower : half.upper)[index] = middle;
        half.bounds = neuron_bounds(f.hidden, half.lower, half.upper, &part.bounds);
        open.push_back(std::move(half));
      }
      continue;
    }
    if (index >= proof.multipliers.size())
      return {false, where + ": there are no such multipliers", verdict.leaves};
    ++verdict.leaves;
    if (!PartInequality(f, gram, part.bounds, rho, proof.multipliers[index]).is_positive_definite())
      return {false, where + ": its multipliers do not show the bound there", verdict.leaves};
  }
  if (!open.empty()) return {false, "the tree ends before the box is covered", verdict.leaves};
  verdict.holds = true;
  return verdict;
}

}  // namespace swarmcert::check
