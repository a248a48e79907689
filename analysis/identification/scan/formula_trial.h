/// @file One form fitted to the samples of an entry, what it is worth, and its text. Not for users.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/scan/form_fit.h"
#include "analysis/identification/scan/samples.h"
#include "nn/base/doubles.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// One form with one factor, fitted.
struct FormulaTrial {
  Form form;
  FormFit fit;
  ScanVariable factor = ScanVariable::kCount;  ///< kCount: none
  double saved_bits = -kInfinity;
  double mean_square = 0;  ///< of the target about its mean
  double independent = 0;  ///< samples that saved_bits counts
};

/// The samples of an entry: all in order, and those that the search looks at.
struct EntryData {
  FormData all, few;
  std::vector<int> flight;               ///< of `all`
  std::vector<Eigen::Index> rows, thin;  ///< of ScanSamples, for `all` and `few`
  double mean_square = 0;                ///< about the mean
};

/// How many of the samples are worth one each: n (1 - rho) / (1 + rho), rho the correlation of what `trial` leaves from
/// one sample to the next.
double independent_samples(const EntryData& data, const FormulaTrial& trial);

/// By how much a second variable must be worth more than its numbers cost: many are tried.
inline constexpr double kSurely_bits = 10;

/// What the form saves against a constant, which leaves `mean_square`, less what its numbers cost; of a product also
/// less kSurely_bits.
double saved_bits(double mean_square, const FormulaTrial& trial, double independent);

/// From the first to the last percentile.
FormRange range_of(const Eigen::VectorXd& values);

/// "N" over "m" squared: "N_per_m2".
std::string unit_of_coefficient(const std::string& unit, const std::string& variable_unit, int power);

/// Shape parameters with their bounds and grids, in the spec and by name in the texts.
/// @param unit of the variable.
void add_shapes(const FormulaTrial& trial, const std::string& unit, stability::EffectSpec& spec,
                std::vector<std::string>& texts);

/// A coefficient of the fit as a linear parameter of the spec, with bounds.
void add_coefficient(const std::string& name, double value, stability::EffectSpec& spec);

}  // namespace swarmcert::identification
