/// @file The matrix inequality of one part of a box, in double with bounds on all round-off errors. Not for users.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "lipschitz/checker/tree_proof.h"

namespace swarmcert::check {

/// A matrix with bounds `radius` on the errors of its entries, both row-major.
struct Rounded {
  int rows, cols;
  std::vector<double> value, radius;
  Rounded(int r, int c)
      : rows(r), cols(c), value(static_cast<std::size_t>(r) * c), radius(static_cast<std::size_t>(r) * c) {}
  double* at(int i) { return &value[static_cast<std::size_t>(i) * cols]; }
  const double* at(int i) const { return &value[static_cast<std::size_t>(i) * cols]; }
  double* radius_at(int i) { return &radius[static_cast<std::size_t>(i) * cols]; }
  const double* radius_at(int i) const { return &radius[static_cast<std::size_t>(i) * cols]; }
};

/// Rounds a matrix to double and bounds the rounding errors. Nothing if an entry leaves the range of double.
std::optional<Rounded> rounded(const Matrix& exact);

/// Returns W' Q W, with bounds on the round-off errors, for the lower triangle q of a form; W is exactly as stored.
Rounded gram_of_form(const std::vector<double>& q, const HiddenLayer& last);

/// The matrix S of check_tree(), over the moving inputs and the undecided neurons of a part.
class PartInequality {
 public:
  /// @param gram      G of the function behind the last hidden layer.
  /// @param bounds    bounds on the neurons over the part.
  /// @param form      the quadratic form in dx that is to bound |df|^2: symmetric, row-major.
  /// @param t         one multiplier per output of a hidden layer.
  /// @param conflicts conflicts between undecided neurons that hold in the part.
  PartInequality(const LocalFunction& f, const Rounded& gram, const NeuronBounds& bounds,
                 const std::vector<double>& form, const std::vector<double>& t,
                 const std::vector<const Conflict*>& conflicts);

  /// Returns true only if S is positive definite in exact arithmetic. May be called only once.
  bool is_positive_definite();

 private:
  using Row = std::vector<double>;
  /// dy of an undecided neuron as a linear form in the variables, and the index of its own variable dz.
  struct NeuronForms {
    int variable = 0;
    Row value, radius;
  };

  double& s(int i, int j) { return s_[static_cast<std::size_t>(i) * n_ + j]; }
  double& excess(int i, int j) { return excess_[static_cast<std::size_t>(i) * n_ + j]; }
  bool on(std::size_t k, int i) const;
  bool off(std::size_t k, int i) const;
  bool undecided(std::size_t k, int i) const { return !on(k, i) && !off(k, i); }

  Rounded subtract_neurons();
  static NeuronForms factor(NeuronForms forms, bool is_on);
  static std::vector<int> support(const NeuronForms& forms);
  void subtract_conflict(const Conflict& conflict);
  Rounded first_layer() const;
  Rounded next_layer(const HiddenLayer& layer, std::size_t k, const Rounded& z, int known) const;
  void subtract_output();
  Row scale() const;
  double largest_error(const Row& d) const;
  void add_error_of_output(const Row& d, Row& sums) const;
  bool cholesky_runs_through();

  const LocalFunction& f_;
  const Rounded& gram_;
  const NeuronBounds& bounds_;
  const Row& t_;
  int moving_, n_ = 0;
  std::map<std::size_t, NeuronForms> factors_;  ///< forms of the neurons in conflicts
  Rounded z_;                                   ///< dz of the last hidden layer as forms in the variables
  /// Lower triangles, row-major: the computed entries of S, and bounds on their errors except for those of G's term.
  Row s_, excess_;
};

}  // namespace swarmcert::check
