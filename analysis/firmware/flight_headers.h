/// @file The evaluator's own headers, as text: an export builds alone.
#pragma once

namespace swarmcert::firmware {

struct FlightHeader {
  const char* name;  ///< "nn/mlp.h"
  const char* text;
};

/// Made at build time from nn/: the same bytes.
extern const FlightHeader kFlightHeaders[5];

}  // namespace swarmcert::firmware
