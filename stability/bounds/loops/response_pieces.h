/// @file The two ways to compute a response, chosen by impulse_response.cpp. Not for users.
#pragma once

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// As response_norms() and sampled_response() where there is no delay; the poles must lie on the left.
ResponseNorms rational_norms(const TransferFunction& y);
std::vector<double> rational_samples(const TransferFunction& y, double step_s, int count);

/// The same with a delay, by the method of steps: on each stretch of a fraction of the delay the response is a Taylor
/// polynomial, driven by the polynomial one delay before.
ResponseNorms delayed_norms(const TransferFunction& y);
std::vector<double> delayed_samples(const TransferFunction& y, double step_s, int count);

}  // namespace swarmcert::stability
