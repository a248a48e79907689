// Prints how many instructions one evaluation takes, as lines "NAME COUNT". Needs QEMU's -icount shift=0: then one
// instruction is one nanosecond, and SysTick, at 168 MHz, counts them in steps of 5.952.
#include <cstdint>

#include "networks.h"
#include "semihosting.h"

namespace semihosting = swarmcert::tests::semihosting;
namespace nn = swarmcert::nn;
using swarmcert::tests::FourLayers;
using swarmcert::tests::kHidden;

namespace {

volatile std::uint32_t& control = *reinterpret_cast<volatile std::uint32_t*>(0xE000E010);
volatile std::uint32_t& reload = *reinterpret_cast<volatile std::uint32_t*>(0xE000E014);
volatile std::uint32_t& current = *reinterpret_cast<volatile std::uint32_t*>(0xE000E018);

/// Instructions of `work`, the mean of a hundred runs.
template <typename Work>
std::uint32_t count(const Work& work) {
  constexpr std::uint32_t kRuns = 100;
  const std::uint32_t before = current;
  for (std::uint32_t i = 0; i < kRuns; ++i) work();
  const std::uint32_t ticks = (before - current) & 0xFFFFFFu;  // counts down
  return (ticks * 125u + 21u * kRuns / 2u) / (21u * kRuns);    // 125 / 21 = 1000 / 168
}

void print(const char* name, std::uint32_t value) {
  char text[64];
  int at = 0;
  for (; name[at] != '\0'; ++at) text[at] = name[at];
  text[at++] = ' ';
  char digits[10];
  int n = 0;
  do {
    digits[n++] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value != 0);
  while (n > 0) text[at++] = digits[--n];
  text[at++] = '\n';
  text[at] = '\0';
  semihosting::print(text);
}

std::uint32_t state = 1;
float next() {
  state = state * 1664525u + 1013904223u;
  return static_cast<float>(static_cast<std::int32_t>(state >> 8) - (1 << 23)) * 0x1p-23f;
}

FourLayers<6, 25, kHidden> phi;
FourLayers<kHidden, kHidden, 1> rho;
float inputs[10][6], output[kHidden], scratch[2 * kHidden], copies[60], sum[kHidden], hidden[kHidden];
int order[10];

}  // namespace

extern "C" int program() {
  phi.fill(next);
  rho.fill(next);
  for (auto& input : inputs) {
    for (float& x : input) x = next();
  }
  reload = 0xFFFFFF;
  current = 0;
  control = 5;
  const nn::Mlp<float> phi_mlp = phi.mlp(), rho_mlp = rho.mlp();
  print("phi_6_25_40_40_40", count([&] { nn::evaluate(phi_mlp, inputs[0], output, scratch); }));
  print("rho_40_40_40_40_1", count([&] { nn::evaluate(rho_mlp, hidden, output, scratch); }));
  nn::Neighbour<float> neighbours[6];
  for (int j = 0; j < 6; ++j) neighbours[j] = {inputs[j], 0};
  const nn::DeepSet<float> set{nullptr, &phi_mlp, 1, rho_mlp, nullptr, nullptr};
  const nn::DeepSetWorkspace<float> workspace{copies, order, 10, sum, hidden, scratch};
  print("set_of_6", count([&] {
          nn::evaluate(set, static_cast<const float*>(nullptr), neighbours, 6, output, workspace);
        }));
  return 0;
}
