/// @file Least-squares fits of forms to samples.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/identification/scan/forms.h"

namespace swarmcert::identification {

/// What a form is fitted to.
struct FormData {
  Eigen::MatrixXd inputs;  ///< [samples x inputs of the form]
  Eigen::VectorXd factor;  ///< by which every function is multiplied; empty: 1
  Eigen::VectorXd target;  ///< [samples]
};

struct FormFit {
  std::vector<double> theta;
  Eigen::VectorXd coefficients;  ///< of the functions, then the constant
  double mean_square = 0;        ///< of what is left
};

/// The coefficients for this theta.
FormFit fit_coefficients(const Form& form, const FormData& data, const std::vector<double>& theta);

/// The best theta: that of the form's starts, then steps along each parameter, halved where none helps.
/// @param start where to begin; empty: all combinations of the form's starts.
FormFit fit_form(const Form& form, const FormData& data, const std::vector<double>& start = {});

/// What the fit says of one sample.
double value_of(const Form& form, const FormFit& fit, const double* inputs, double factor);

}  // namespace swarmcert::identification
