/// @file Explanations of a residual force, with what each predicts in the flights.
#pragma once

#include <array>
#include <set>
#include <string>
#include <vector>

#include "analysis/identification/candidates.h"
#include "analysis/identification/evidence/flight_columns.h"
#include "analysis/identification/evidence/noise_model.h"
#include "analysis/identification/passes.h"

namespace swarmcert::evidence {

enum class Kind {
  kEffect,
  kCurve  ///< a free curve over a variable, along one axis
};

/// The name of the free curve along the velocity over the speed.
inline constexpr char kDragCurve[] = "drag over speed";

/// A normal distribution of coefficients.
struct Prior {
  Eigen::VectorXd mean;
  Eigen::MatrixXd precision;
  Eigen::VectorXd sign;  ///< +1 or -1: only coefficients of this sign; 0: all
};

/// A named effect or a free curve. Both are explanations of the same kind.
struct Entry {
  std::string name;  ///< of the effect, or "force_z over z"
  Kind kind = Kind::kEffect;
  std::string variable;           ///< of a curve; empty for a component of the velocity across its force
  double doubt = 0;               ///< ln of odds against it, before any flight
  int size = 1;                   ///< columns
  std::vector<int> first_column;  ///< by shape
  std::size_t shapes = 1;         ///< of the grid; later ones are off it
  std::vector<Prior> priors;      ///< equally likely
};

/// An explanation with one of its shapes and one of its priors.
struct Item {
  std::size_t entry = 0, shape = 0, prior = 0;
  bool operator==(const Item& other) const {
    return entry == other.entry && shape == other.shape && prior == other.prior;
  }
};

/// Transforms of columns, by axis of the world, [rows x columns].
using Columns = std::array<Eigen::MatrixXf, 3>;

/// Explanations and flights, in the frequency domain.
struct Hypotheses {
  std::vector<identification::Candidate> candidates;
  std::vector<Entry> entries;  ///< those of the candidates in their order, then those of the curves
  Survey surveyed;
  Spectral spectral;
  NoiseModel noise;
  Columns columns;
  std::array<Eigen::VectorXf, 3> residual_N;

  /// By axis, [rows x instruments]; empty if a log has no set points.
  std::array<Eigen::MatrixXf, 3> instruments;
  std::set<std::string> excluded;  ///< names of effects that are not weighed

  bool has_set_points() const { return instruments[0].size() > 0; }
  const Prior& prior_of(const Item& item) const;
  /// Returns ln of the share of the prior probability that falls to an item: half to effects and half to curves,
  /// equally to their entries, equally to their shapes and priors. An effect that varies is 128 times less likely than
  /// its plain form: it is named where flights show that it varies.
  double log_prior(const Item& item) const;
};

/// Evaluates `candidates` and curves over every variable of the scan along the flights of `passes`.
Hypotheses hypotheses(const identification::Passes& passes,
                      const std::vector<identification::Candidate>& candidates);

/// An entry with shape parameters.
struct Shape {
  std::size_t entry;
  std::vector<double> theta;
};

/// Evaluates effects with these shapes along the flights: their columns, one shape after the other.
Columns evaluate(const identification::Passes& passes, const Hypotheses& all,
                 const std::vector<Shape>& shapes);

}  // namespace swarmcert::evidence
