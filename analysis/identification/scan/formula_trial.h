/// @file One form fitted to the samples of an entry, with its score and text. Internal.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/scan/form_fit.h"
#include "analysis/identification/scan/samples.h"
#include "nn/base/doubles.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// One fitted form with one factor.
struct FormulaTrial {
  Form form;
  FormFit fit;
  ScanVariable factor = ScanVariable::kCount;  ///< kCount: none
  double saved_bits = -kInfinity;
  double mean_square = 0;  ///< of the target after subtracting its mean
  double independent = 0;  ///< effective number of samples for saved_bits
};

/// The samples of an entry: all of them in order, and the subset that the search uses.
struct EntryData {
  FormData all, few;
  std::vector<int> flight;               ///< of `all`
  std::vector<Eigen::Index> rows, thin;  ///< rows of ScanSamples for `all` and `few`
  double mean_square = 0;                ///< about the mean
};

/// Returns the effective number of samples: n (1 - rho) / (1 + rho), where rho is the correlation between consecutive
/// residuals of `trial`.
double independent_samples(const EntryData& data, const FormulaTrial& trial);

/// Additional saving required of a second variable, because many are tried.
inline constexpr double kSurely_bits = 10;

/// Returns the bits that the form saves compared with a constant, whose error is `mean_square`, minus the cost of its
/// parameters; for a product, also minus kSurely_bits.
double saved_bits(double mean_square, const FormulaTrial& trial, double independent);

/// Returns the range from the first to the last percentile.
FormRange range_of(const Eigen::VectorXd& values);

/// Returns the unit as in parameter names: "N" over "m" squared gives "N_per_m2".
std::string unit_of_coefficient(const std::string& unit, const std::string& variable_unit, int power);

/// Adds the shape parameters with their bounds and grids to the spec, and by name to the texts.
/// @param unit of the variable
void add_shapes(const FormulaTrial& trial, const std::string& unit, stability::EffectSpec& spec,
                std::vector<std::string>& texts);

/// Adds a coefficient of the fit as a linear parameter of the spec, with bounds.
void add_coefficient(const std::string& name, double value, stability::EffectSpec& spec);

}  // namespace swarmcert::identification
