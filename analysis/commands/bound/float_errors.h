/// @file Errors added by float32 arithmetic on the vehicle.
#pragma once

#include "nn/base/record.h"
#include "stability/simulation/float_errors.h"

namespace swarmcert::analysis {

void print(const stability::FloatErrors& errors);

}  // namespace swarmcert::analysis

namespace swarmcert::stability {

void describe(files::Record& record, const FloatErrors& errors);

}  // namespace swarmcert::stability
