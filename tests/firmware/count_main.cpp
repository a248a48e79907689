// Cost of one evaluation on the microcontroller: lines "NAME INSTRUCTIONS CYCLES TAKEN_BRANCHES", some names several
// times, for different inputs. Run under QEMU with the plugin of cycle_model/.
#include "flash_networks.h"
#include "flight_case.h"
#include "measure.h"
#include "published_style.h"

namespace {

namespace nn = swarmcert::nn;
namespace controller = swarmcert::controller;
using swarmcert::tests::FlashNetwork;
using swarmcert::tests::measure;

constexpr int kHidden = 40, kMost = controller::kMostNeighbours;
constexpr auto phi_values = FlashNetwork<6, 25, 40, 40, 40>::random(1);
constexpr auto rho_values = FlashNetwork<40, 40, 40, 40, 1>::random(2);
nn::DenseLayer<float> phi_layers[4], rho_layers[4];
const nn::Mlp<float> phi{phi_layers, 4}, rho{rho_layers, 4};

float inputs[kMost][6], hidden[kHidden], output[kHidden];
float copies[6 * kMost], sum[kHidden], scratch[1024];
int order[kMost];

std::uint32_t state = 1;
float next() {
  state = state * 1664525u + 1013904223u;
  return static_cast<float>(static_cast<std::int32_t>(state >> 8) - (1 << 23)) * 0x1p-23f;
}

/// One network and sets of them.
void networks() {
  measure("phi_6_25_40_40_40", [] { nn::evaluate(phi, inputs[0], output, scratch); });
  measure("rho_40_40_40_40_1", [] { nn::evaluate(rho, hidden, output, scratch); });
  const nn::DeepSet<float> set{nullptr, &phi, 1, rho, nullptr, nullptr};
  const nn::DeepSetWorkspace<float> workspace{copies, order, kMost, sum, scratch};
  nn::Neighbour<float> neighbours[kMost];
  for (int j = 0; j < kMost; ++j) neighbours[j] = {inputs[j], 0};
  const char* const names[] = {"set_of_1", "set_of_2", "set_of_3", "set_of_4", "set_of_5",
                               "set_of_6", "set_of_7", "set_of_8", "set_of_9", "set_of_10"};
  for (int count = 1; count <= kMost; ++count) {
    measure(names[count - 1], [&] {
      nn::evaluate(set, static_cast<const float*>(nullptr), neighbours, count, output, workspace);
    });
  }
}

void flight() {
  swarmcert::tests::FlightCase flight;
  for (int i = 0; i < 100; ++i) {
    flight.next();
    measure(flight.is_lee() ? "position_attitude_lee_mixing" : "position_attitude_mixing",
            [&] { flight.step(true); });
    measure("attitude_mixing", [&] { flight.step(false); });
  }
}

}  // namespace

extern "C" int program() {
  phi_values.layers(phi_layers);
  rho_values.layers(rho_layers);
  for (const float scale : {1.0f, -100.0f, 0.0f}) {
    for (auto& input : inputs) {
      for (float& x : input) x = scale * next();
    }
    for (float& x : hidden) x = scale * next();
    networks();
  }
  measure("published_phi", [] { swarmcert::tests::published_phi(phi_values.values, inputs[0], scratch); });
  measure("published_rho", [] { swarmcert::tests::published_rho(rho_values.values, hidden, scratch); });
  flight();
  return 0;
}
