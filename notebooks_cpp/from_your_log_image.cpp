// The program of a minimal image in from_your_log.md, which stands for a firmware that calls the exported network.
#include "swarmcert_network.h"

extern "C" int program() {
  if (swarmcert_network::self_test(nullptr) != swarmcert_network::SelfTest::kPassed) return 1;
  const float own[4] = {-1, 0, 0, 0};
  float force_N = 0;
  const auto status = swarmcert_network::predict_force_z(0, own, nullptr, 0, &force_N);
  return status == swarmcert::nn::DeepSetStatus::kOk ? 0 : 2;
}
