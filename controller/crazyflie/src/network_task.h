/// @file The task that runs the network: neighbours' positions in, f_a_hat out, a hundred times per second.
#pragma once

#include <cstdint>

namespace swarmcert::crazyflie {

inline constexpr std::uint32_t kPeriod_ms = 10;

/// Runs the self-test on the first call; the result is kept in swarmcert_status.self_test.
bool passes_self_test();

/// Runs one period at the time `now_ms`: updates the tracks with the peers' positions and, unless the network is off or
/// failed its self-test, predicts. Any error gives f_a_hat = 0.
void step_network(std::uint32_t now_ms);

}  // namespace swarmcert::crazyflie
