/// @file Answers of the stub of the stock firmware, set by tests.
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
