/// @file What the stub of the stock firmware answers, for a test to set.
#pragma once

#include <cstdint>

#include "upstream.h"
extern "C" {
#include "param.h"
}

namespace swarmcert::tests::stub {

inline std::uint32_t now_ms = 1000;
inline float own[6] = {0, 0, 1, 0, 0, 0};  ///< position in m, velocity in m/s
inline peerLocalizationOtherPosition_t peers[PEER_LOCALIZATION_MAX_NEIGHBORS];
inline float battery_V = 3.9f;

}  // namespace swarmcert::tests::stub

extern "C" {
extern const stub_variable stub_param_swarmcert[], stub_log_swarmcert[];
}
