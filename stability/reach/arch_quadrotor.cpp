#include "stability/reach/arch_quadrotor.h"

#include "stability/reach/network_values.h"

namespace swarmcert::stability {
namespace {

const Interval kGravity_m_s2 = decimal(9.81), kMass_kg = decimal(1.4);
const Interval kInertia_kg_m2 = decimal(0.054);  ///< of roll and pitch
const Interval kYawInertia_kg_m2 = decimal(0.104);
const Interval kHover_N = kMass_kg * kGravity_m_s2;

}  // namespace

std::vector<TimeSeries> arch_quadrotor(const std::vector<TimeSeries>& x, const QuadrotorInputs& inputs) {
  const TimeSeries &u = x[3], &v = x[4], &w = x[5], &p = x[9], &q = x[10], &r = x[11];
  const auto [s7, c7] = sin_and_cos(x[6]);
  const auto [s8, c8] = sin_and_cos(x[7]);
  const auto [s9, c9] = sin_and_cos(x[8]);
  const TimeSeries right = s7 * v + c7 * w;  // along the pitched body's down axis
  const TimeSeries forward = c8 * u + s8 * right, left = c7 * v - s7 * w, turn = (s7 * q + c7 * r) / c8;
  const TimeSeries gravity = kGravity_m_s2;
  const Interval slant = (kInertia_kg_m2 - kYawInertia_kg_m2) / kInertia_kg_m2;
  return {c9 * forward - s9 * left,
          s9 * forward + c9 * left,
          s8 * u - c8 * right,
          r * v - q * w - gravity * s8,
          p * w - r * u + gravity * c8 * s7,
          q * u - p * v + gravity * c8 * c7 - inputs.thrust_N / kMass_kg,
          p + s8 * turn,
          c7 * q - s7 * r,
          turn,
          slant * q * r + inputs.roll_Nm / kInertia_kg_m2,
          -TimeSeries(slant) * p * r + inputs.pitch_Nm / kInertia_kg_m2,
          inputs.yaw_Nm / kYawInertia_kg_m2};
}

AffineVector arch_start(const std::array<double, 6>& radius, Interval altitude) {
  AffineVector x(12);
  for (std::size_t k = 0; k < radius.size(); ++k) x[k] = AffineForm(decimal(radius[k])) * symbol(k);
  x[2] = x[2] + altitude;
  return x;
}

std::vector<TimeSeries> arch_altitude_step(const std::vector<TimeSeries>& x) {
  const TimeSeries thrust = TimeSeries(kHover_N) - TimeSeries(10.0) * (x[2] - 1.0) + TimeSeries(3.0) * x[5];
  return arch_quadrotor(x, {thrust, -x[6] - x[9], -x[7] - x[10], 0.0});
}

SampledField arch_network_loop(files::Weights network) {
  return [network = std::move(network)](const AffineVector& start) -> VectorField {
    const AffineVector u = with_radii_as_symbols(network_values(network, start), symbols(start));
    return [u](const std::vector<TimeSeries>& x) {
      return arch_quadrotor(x, {TimeSeries(kHover_N) + u[0], u[1], u[2], 0.0});
    };
  };
}

}  // namespace swarmcert::stability
