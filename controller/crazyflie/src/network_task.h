/// @file The network's task: neighbours' positions in, f_a_hat out, a hundred times per second.
#pragma once

#include <cstdint>

namespace swarmcert::crazyflie {

inline constexpr std::uint32_t kPeriod_ms = 10;

/// Runs the self-test, the first time; its result stays in swarmcert_status.self_test.
bool passes_self_test();

/// One period at the time `now_ms`: takes the peers' positions into their tracks and, unless the network is off or
/// failed its self-test, predicts. Anything wrong gives f_a_hat = 0.
void step_network(std::uint32_t now_ms);

}  // namespace swarmcert::crazyflie
