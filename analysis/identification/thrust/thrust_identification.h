/// @file Fits the calibration polynomials of controller/battery.h to load-cell data.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/thrust/thrust_data.h"

namespace swarmcert::analysis {

/// A fitted value with its confidence interval.
struct Coefficient {
  std::string name;  ///< as in controller/battery.h, e.g. "c10"
  double value = 0, lower = 0, upper = 0;
};

/// What a fit cannot follow, by an F test. Like the intervals it assumes independent errors of equal variance.
struct LackOfFit {
  /// Against which the fit was tested: the scatter of repeated rows, which have equal inputs, if there are enough, else
  /// a polynomial with terms of the next order. Empty: not tested.
  std::string against;
  int terms = 0, left = 0;  ///< degrees of freedom of what the fit lacks and of the noise
  double F = 0;
  double chance = 1;  ///< probability of such an F, or a larger one, where nothing is lacking
  double rms = 0;     ///< of what is lacking, in the unit of the fit

  bool is_found() const { return chance < 0.01; }
};

/// A polynomial fitted by least squares.
///
/// The intervals are Student's and assume independent errors of equal variance, in the fitted quantity only. Rows of a
/// slow ramp are not independent, so their intervals are too narrow.
struct PolynomialFit {
  bool determined = false;
  std::string why_not;                    ///< what is missing in the data; empty if determined
  std::vector<Coefficient> coefficients;  ///< empty unless determined
  std::string method;                     ///< which quantity was fitted to which data
  std::string unit;                       ///< of the fitted quantity and of the two numbers below
  int samples = 0;
  double residual_rms = 0;
  double largest_residual = 0;
  /// Largest half-width of the confidence interval of the polynomial's value, over the corners of the measured PWM
  /// range and a battery from empty to full.
  double largest_uncertainty = 0;
  LackOfFit lack;
};

struct ThrustIdentification {
  PolynomialFit thrust;      ///< g = c00 + c10 p + c01 v + c20 p^2 + c11 p v
  PolynomialFit pwm;         ///< p = d00 + d10 g + d01 v + d20 g^2 + d11 g v
  PolynomialFit max_thrust;  ///< g_max = e00 + e10 p + e01 v
  /// N of one rotor = t0 + t1 u + t2 u^2 + t3 u^3 in the voltage u = p V that the motor sees, that of newer Crazyflie
  /// firmware (VMOTOR2THRUST0 .. 3). It needs no range of the battery.
  PolynomialFit motor_voltage;
  double smallest_p = 0, largest_p = 0, smallest_v = 0, largest_v = 0;
  double confidence = 0;
};

/// Fits the polynomials.
///
/// The data determine a polynomial if its columns are independent (smallest singular value of the columns, scaled to
/// norm 1, above 1e-6), if PWM spans at least 0.2 and the battery at least 0.1 V, and if the uncertainty of the fit
/// where it will be used is at most a tenth of the largest measured value.
///
/// Maximum thrust: if at least three ramps reach 98 % PWM (rows with the same `run` or, without that column, rows in
/// which PWM does not fall), the largest thrust of each ramp is fitted to p and v of the ramp's rows, so that e10
/// describes the remaining sag of the battery. Otherwise it is the thrust polynomial at p = 1, and e10 is 0.
/// @param confidence of the intervals, between 0 and 1
ThrustIdentification identify_thrust(const ThrustData& data, double confidence);

}  // namespace swarmcert::analysis
