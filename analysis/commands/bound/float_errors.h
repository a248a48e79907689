/// @file Errors added by float32 arithmetic on the vehicle, as text and as JSON.
#pragma once

#include "nn/base/json.h"
#include "stability/simulation/float_errors.h"

namespace swarmcert::analysis {

using stability::float_errors;
using stability::FloatErrors;

files::Json float_errors_json(const FloatErrors& errors);
void print_float_errors(const FloatErrors& errors);

}  // namespace swarmcert::analysis
