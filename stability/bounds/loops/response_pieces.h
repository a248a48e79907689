/// @file The two methods of computing a response, selected by impulse_response.cpp. Not for users.
#pragma once

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// Like response_norms() and sampled_response(), for systems without a delay; the poles must lie in the left
/// half-plane.
ResponseNorms rational_norms(const TransferFunction& y);
std::vector<double> rational_samples(const TransferFunction& y, double step_s, int count);

/// The same with a delay, by the method of steps: on each segment of a fraction of the delay the response is a Taylor
/// polynomial, driven by the polynomial one delay earlier.
ResponseNorms delayed_norms(const TransferFunction& y);
std::vector<double> delayed_samples(const TransferFunction& y, double step_s, int count);

}  // namespace swarmcert::stability
