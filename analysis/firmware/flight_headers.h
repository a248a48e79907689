/// @file The headers of the evaluator as text, so that an export builds on its own.
#pragma once

namespace swarmcert::firmware {

struct FlightHeader {
  const char* name;  ///< "nn/mlp.h"
  const char* text;
};

/// Generated at build time from nn/, byte for byte.
extern const FlightHeader kFlightHeaders[4];

}  // namespace swarmcert::firmware
