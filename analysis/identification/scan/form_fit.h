/// @file Least squares fits of forms to samples.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/identification/scan/forms.h"

namespace swarmcert::identification {

/// The data to which a form is fitted.
struct FormData {
  Eigen::MatrixXd inputs;  ///< [samples x inputs of the form]
  Eigen::VectorXd factor;  ///< multiplies each function; empty: 1
  Eigen::VectorXd target;  ///< [samples]
};

struct FormFit {
  std::vector<double> theta;
  Eigen::VectorXd coefficients;  ///< of the functions, then the constant
  double mean_square = 0;        ///< of the residual
};

/// Returns the coefficients for this theta.
FormFit fit_coefficients(const Form& form, const FormData& data, const std::vector<double>& theta);

/// Returns the best theta: the best of the form's starts, improved by steps along each parameter, halved if none helps.
/// @param start initial theta; empty: all combinations of the form's starts
FormFit fit_form(const Form& form, const FormData& data, const std::vector<double>& start = {});

/// Returns the value of the fit for one sample.
double value_of(const Form& form, const FormFit& fit, const double* inputs, double factor);

}  // namespace swarmcert::identification
