#include "analysis/gate/expected_app.h"

#include "nn/base/input_error.h"
#include "stability/bounds/flown_loop.h"

namespace swarmcert::gate {
namespace {

/// The law as gains.toml writes it, without what the loop makes of it.
stability::PidMatrices written_law(const stability::Gains& gains, double mass_kg) {
  if (gains.composite) return stability::pid_matrices(*gains.composite, mass_kg);
  const auto diagonal = [](const auto& v) {
    return Eigen::Vector3d(v.x, v.y, v.z).asDiagonal().toDenseMatrix();
  };
  return {diagonal(gains.pid->Kp_1_s2), diagonal(gains.pid->Kd_1_s), diagonal(gains.pid->Ki_1_s3)};
}

}  // namespace

firmware::AppExpectation expected_app(const std::string& gains, const std::string& model) {
  const stability::FlownLoop setup = stability::load_flown_loop(gains, model);
  const auto refuse = [&gains](const std::string& what) {
    throw files::InputError(
        {gains, "", "position", "", what, "the app has one gain for x and y and one for z"});
  };
  firmware::AppExpectation expected;
  const double mass_kg = setup.model.mass_kg;
  expected.parameters.mass_kg = static_cast<float>(mass_kg);
  const stability::PidMatrices law = written_law(setup.gains, mass_kg);
  const Eigen::MatrixXd* const matrices[] = {&law.Kp, &law.Kd, &law.Ki};
  for (std::size_t k = 0; k < 3; ++k) {
    if (!matrices[k]->isDiagonal(0)) refuse("couples the axes");
    const Eigen::VectorXf gain = matrices[k]->diagonal().cast<float>();
    if (gain[0] != gain[1]) refuse("has different gains for x and y");
    expected.parameters.gains[2 * k] = gain[0];
    expected.parameters.gains[2 * k + 1] = gain[2];
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
