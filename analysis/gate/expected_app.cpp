#include "analysis/gate/expected_app.h"

#include "nn/base/input_error.h"
#include "stability/bounds/theorem.h"
#include "stability/bounds/tracking_setup.h"

namespace swarmcert::gate {

firmware::AppExpectation expected_app(const std::string& gains, const std::string& model) {
  const stability::TrackingSetup setup = stability::load_tracking_setup(gains, model);
  const auto refuse = [&gains](const std::string& what) {
    throw files::InputError(
        {gains, "", "position", "", what, "the app has one gain for x and y and one for z"});
  };
  firmware::AppExpectation expected;
  const double mass_kg = setup.model.mass_kg;
  expected.parameters.mass_kg = static_cast<float>(mass_kg);
  for (const int axis : {0, 1, 2}) {
    const auto pid = axis_gains(setup.gains, mass_kg, axis);
    if (!pid) refuse("couples the axes");
    const std::size_t place = axis == 2 ? 1 : 0;
    const double values[] = {pid->Kp_1_s2, pid->Kd_1_s, pid->Ki_1_s3};
    for (std::size_t k = 0; k < 3; ++k) {
      float& gain = expected.parameters.gains[2 * k + place];
      if (axis == 1 && gain != static_cast<float>(values[k])) refuse("has different gains for x and y");
      gain = static_cast<float>(values[k]);
    }
  }
  const auto& map = setup.model.thrust;
  const auto& inertia = setup.model.inertia_kg_m2;
  const auto& limit = setup.gains.integrator_limit_m_s;
  const double values[] = {map.c00,  map.c10,    map.c01,    map.c20,
                           map.c11,  inertia[0], inertia[1], inertia[2],
                           limit[0], limit[1],   limit[2],   setup.gains.integrator_step_s};
  expected.constants = firmware::AppOnHost::constants();
  for (std::size_t i = 0; i < expected.constants.size(); ++i)
    expected.constants[i].second = static_cast<float>(values[i]);
  return expected;
}

}  // namespace swarmcert::gate
