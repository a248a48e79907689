#include "nn/weights/invariants.h"

#include "nn/base/input_error.h"
#include "nn/weights/functions.h"

namespace swarmcert::files {

const std::vector<std::string>& relative_state() {
  static const std::vector<std::string> kNames = {"dp_x_m",   "dp_y_m",   "dp_z_m",
                                                  "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"};
  return kNames;
}

const std::vector<std::string>& neighbour_invariant_names() {
  static const std::vector<std::string> kNames = {"dp_xy_m", "scaled_dp_z_m", "dv_xy_m_s", "scaled_dv_z_m_s",
                                                  "dp_xy_ahead_m"};
  return kNames;
}

const std::vector<std::string>& own_invariant_names() {
  static const std::vector<std::string> kNames = {"minus_z_m", "v_xy_m_s", "minus_v_z_m_s"};
  return kNames;
}

bool maps_to_invariants(const Network& network, const FunctionId& function) {
  return network.invariants && function.is_set();
}

double slope_of_inputs(const Network& network, const FunctionId& function) {
  if (!maps_to_invariants(network, function)) return 1;
  return function.input_part().is_ground_phi() ? nn::kOwnInvariantsSlope : nn::kNeighbourInvariantsSlope;
}

std::vector<double> invariants_of(const FunctionId& phi, const std::vector<double>& state) {
  const bool is_ground = phi.is_ground_phi();
  std::vector<double> invariants(is_ground ? nn::kOwnInvariants : nn::kNeighbourInvariants);
  if (is_ground)
    nn::own_invariants(state.data(), invariants.data());
  else
    nn::neighbour_invariants(state.data(), invariants.data());
  return invariants;
}

void require_relative_states(const Network& network, const std::string& what) {
  if (!network.invariants) return;
  throw InputError({network.path, "", "input.invariants", "\"rotation\"", "but " + what,
                    "certify without --domain, simulate, export and match accept it"});
}

}  // namespace swarmcert::files
