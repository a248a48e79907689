#include "controller/rounding/rounding_bounds.h"

#include <algorithm>
#include <cmath>

#include "controller/rounding/bounded.h"

namespace swarmcert::controller {
namespace {

/// Error of heading_of_yaw() for |yaw| <= pi: 1.9e-7 from rounding yaw to float, 1.2e-7 and 1e-13 from sin_cos() in
/// float and double.
constexpr double kHeadingError = 3.2e-7;

using Vector = Vector3<Bounded>;
using Matrix = Matrix3<Bounded>;

constexpr double kPi = 3.14159265358979323846;
/// Cosines and lengths below are accurate to a few units of 2^-53; restricted sets are widened by this margin.
constexpr double kSlack = 1e-12;

Vector inputs(double largest) {
  return {Bounded::input(largest), Bounded::input(largest), Bounded::input(largest)};
}

Vector constants(const Vector3<double>& v) { return {Bounded(v.x), Bounded(v.y), Bounded(v.z)}; }
Matrix constants(const Matrix3<double>& m) { return {constants(m.x), constants(m.y), constants(m.z)}; }

Vector3<double> errors(const Vector& v) { return {v.x.error(), v.y.error(), v.z.error()}; }

Vector within(const Vector& v, double largest) {
  return {v.x.within(-largest, largest), v.y.within(-largest, largest), v.z.within(-largest, largest)};
}

void raise(Vector3<double>& bound, const Vector3<double>& by) {
  bound = {std::fmax(bound.x, by.x), std::fmax(bound.y, by.y), std::fmax(bound.z, by.z)};
}

/// Returns a - b for two inputs whose difference has a known bound smaller than their magnitudes.
Vector difference(double largest, double largest_difference) {
  return within(inputs(largest) - inputs(largest), largest_difference);
}

double least(double a, double limit) { return limit < a ? limit : a; }

/// Bounds f_d and one step of its integral.
Vector force_stage(const RoundedLaw& law, const FlightEnvelope& e, RoundingBounds& bounds) {
  const TrackingError<Bounded> error{difference(e.position_m, e.position_error_m),
                                     difference(e.velocity_m_s, e.velocity_error_m_s)};
  const Vector3<double>& limit = law.integrator.limit_m_s;
  const Vector integral{Bounded::input(least(e.integral_m_s, limit.x)),
                        Bounded::input(least(e.integral_m_s, limit.y)),
                        Bounded::input(least(e.integral_m_s, limit.z))};
  const FeedForward<Bounded> forward{inputs(e.acceleration_m_s2), inputs(e.effect_N)};
  const Bounded mass(law.mass_kg);

  // One step from an integral that both instances share; the clamp contributes only the rounding of its limit.
  const auto step = [&](double largest, const Bounded& position_error) {
    const Bounded shared = Bounded::of(-largest, largest, 0);
    return (shared + product(Bounded(law.integrator.step_s), position_error)).error() + largest * 0x1p-24;
  };
  bounds.integral_m_s = {step(integral.x.magnitude(), error.position_m.x),
                         step(integral.y.magnitude(), error.position_m.y),
                         step(integral.z.magnitude(), error.position_m.z)};

  const Vector force =
      law.is_composite
          ? desired_force(
                CompositeGains<Bounded>{constants(law.composite.Lambda_1_s), constants(law.composite.K_kg_s)},
                mass, error, integral, forward)
          : desired_force(PidGains<Bounded>{constants(law.pid.Kp_1_s2), constants(law.pid.Kd_1_s),
                                            constants(law.pid.Ki_1_s3)},
                          mass, error, integral, forward);
  bounds.force_N = errors(force);
  return force;
}

/// Restricts f_d to magnitudes in [low, high] and the envelope's tilt.
Vector force_cell(const Vector& force, double low, double high, double tilt_rad) {
  const double across = high * std::sin(tilt_rad) + kSlack;
  return {force.x.within(-across, across), force.y.within(-across, across),
          force.z.within(low * std::cos(tilt_rad) - kSlack, high + kSlack)};
}

/// Bounds on the distance between the columns of the desired attitude in float and double, in the Euclidean norm.
struct ColumnErrors {
  double x = 0, y = 0, z = 0;
};

/// Without rounding, z = f / |f| changes by at most |df| / |f|, y = z x x_c / |z x x_c| by (|dz| + |dx_c|) / |z x x_c|
/// with |z x x_c| >= cos(tilt), and x = y x z by |dy| + |dz|. Norms are used because intervals of components would be
/// ten times wider here. The rounding errors are obtained from the templates, evaluated on sets without input error.
ColumnErrors attitude_stage(const Vector& force, double low, double high, double tilt_rad) {
  const auto exact = [](const Bounded& b) { return Bounded::of(b.lower(), b.upper(), 0); };
  const Vector f{exact(force.x), exact(force.y), exact(force.z)};
  const double c = std::cos(tilt_rad);
  const double force_error = norm(errors(force));
  const double heading_error = std::sqrt(2.0) * kHeadingError;
  ColumnErrors moved;
  moved.z = force_error / (low - force_error);
  moved.y = (moved.z + heading_error) / (c - moved.z - heading_error);
  moved.x = moved.y + moved.z;

  const Bounded magnitude = norm(f).within(low - kSlack, high + kSlack);
  const Vector direction = divided(f, magnitude);
  const double s = std::sin(tilt_rad) + kSlack;
  const Vector z{direction.x.within(-s, s), direction.y.within(-s, s),
                 direction.z.within(c - kSlack, 1 + kSlack)};
  ColumnErrors rounding;
  constexpr int kHeadings = 72;
  for (int i = 0; i < kHeadings; ++i) {
    const double from = 2 * kPi * i / kHeadings, to = 2 * kPi * (i + 1) / kHeadings;
    const auto cell = [](double a, double b) {
      // No extremum of sine or cosine lies inside a cell: they are at multiples of pi/2, which are boundaries of cells.
      return Bounded::of(std::min(a, b) - kHeadingError, std::max(a, b) + kHeadingError, 0);
    };
    const Heading<Bounded> heading{cell(std::cos(from), std::cos(to)), cell(std::sin(from), std::sin(to))};
    const Matrix axes = transpose(attitude_of_axis(z, heading).R_WR);
    rounding.x = std::max(rounding.x, norm(errors(axes.x)));
    rounding.y = std::max(rounding.y, norm(errors(axes.y)));
    rounding.z = std::max(rounding.z, norm(errors(axes.z)));
  }
  // The double instance also rounds its own inputs: 2^-29 of the float error, covered by this factor.
  constexpr double kBoth = 1 + 0x1p-20;
  return {kBoth * (moved.x + rounding.x), kBoth * (moved.y + rounding.y), kBoth * (moved.z + rounding.z)};
}

/// Bounds R_RB = R_WR' R_WB: entry (i, j) is the product of column i of R_WR and column j of R_WB, both of norm 1.
Matrix relative_attitude(const ColumnErrors& columns, double angle_rad) {
  constexpr double kUnit = 0x1p-24;
  // R_WB rounded to float (sqrt(3) units), and three products and two sums of numbers of magnitude 1 (at most 8 units).
  constexpr double kRounding = 10 * kUnit;
  // For a rotation by the angle t, diagonal entries are in [cos t, 1] and the others within sin t + (1 - cos t) / 2.
  const double c = std::cos(angle_rad);
  const double least_on = angle_rad < kPi / 2 ? c : -1;
  const double most_beside = angle_rad < kPi / 2 ? std::min(1.0, std::sin(angle_rad) + (1 - c) / 2) : 1;
  const auto row = [&](int i, double error) {
    const double e = (error + kRounding) * (1 + kSlack);
    const auto entry = [&](int j) {
      return i == j ? Bounded::of(least_on - kSlack - e, 1 + kSlack + e, e)
                    : Bounded::of(-most_beside - kSlack - e, most_beside + kSlack + e, e);
    };
    return Vector{entry(0), entry(1), entry(2)};
  };
  return {row(0, columns.x), row(1, columns.y), row(2, columns.z)};
}

Vector torque_stage(const RoundedLaw& law, const FlightEnvelope& e, const ColumnErrors& columns,
                    RoundingBounds& bounds) {
  // With R_WB = I the templates compute R_RB from its transpose, which has tighter bounds than its factors.
  const AttitudeState<Bounded> state{constants(identity<double>()), inputs(e.rate_rad_s)};
  const Matrix R_RB = relative_attitude(columns, e.attitude_error_rad);
  AttitudeError<Bounded> error = attitude_error(
      state, {transpose(R_RB), inputs(e.reference_rate_rad_s), inputs(e.reference_rate_derivative_rad_s2)});
  // Rotations preserve lengths.
  error.reference_omega_B_rad_s =
      within(error.reference_omega_B_rad_s, std::sqrt(3.0) * e.reference_rate_rad_s + kSlack);
  const Matrix inertia = constants(law.inertia_kg_m2);
  if (!law.is_robust) {
    return lee_torque(LeeGains<Bounded>{constants(law.lee.k_R_N_m), constants(law.lee.k_omega_N_m_s)},
                      inertia, state, error);
  }
  const RobustGains<Bounded> gains{constants(law.robust.Lambda_1_s), constants(law.robust.K_omega_N_m_s),
                                   constants(law.robust.K_I_N_m), constants(law.robust.integral_limit_rad)};
  const Vector sigma = within(modified_rodrigues(error.R_RB), std::tan(e.attitude_error_rad / 4) + kSlack);
  const ReferenceRate<Bounded> rate = reference_rate(gains.Lambda_1_s, sigma, error);
  const Vector3<double>& limit = law.robust.integral_limit_rad;
  const Vector integral{Bounded::input(limit.x), Bounded::input(limit.y), Bounded::input(limit.z)};
  const Vector shared{Bounded::of(-limit.x, limit.x, 0), Bounded::of(-limit.y, limit.y, 0),
                      Bounded::of(-limit.z, limit.z, 0)};
  const Bounded step(law.attitude_step_s);
  raise(bounds.rate_integral_rad,
        errors(shared + scaled(step, state.omega_B_rad_s - rate.omega_r_rad_s)) + scaled(0x1p-24, limit));
  return robust_torque(gains, inertia, state.omega_B_rad_s, rate, integral);
}

std::string refusal(const RoundedLaw& law, const FlightEnvelope& e) {
  if (!(law.mass_kg > 0)) return "the mass is not positive";
  if (!(e.least_force_N > 0 && e.least_force_N < e.largest_force_N))
    return "the range of |f_d| is empty or contains 0";
  if (!(e.tilt_rad >= 0 && e.tilt_rad < 1.5)) return "the envelope's tilt is not below 1.5 rad";
  if (!(e.attitude_error_rad >= 0 && e.attitude_error_rad < kPi))
    return "the envelope's attitude error is not below pi";
  if (law.is_robust && e.attitude_error_rad >= 1.2) {
    return "the two instances of the robust law may take different branches if the attitude error reaches "
           "1.2 rad";
  }
  return "";
}

}  // namespace

RoundingBounds rounding_bounds(const RoundedLaw& law, const FlightEnvelope& envelope) {
  RoundingBounds bounds;
  bounds.why_not = refusal(law, envelope);
  if (!bounds.why_not.empty()) return bounds;
  try {
    const Vector force = force_stage(law, envelope, bounds);
    constexpr double kRatio = 1.1;
    for (double low = envelope.least_force_N; low < envelope.largest_force_N; low *= kRatio) {
      const double high = std::min(low * kRatio, envelope.largest_force_N) + kSlack;
      const Vector cell = force_cell(force, low, high, envelope.tilt_rad);
      const ColumnErrors columns = attitude_stage(cell, low, high, envelope.tilt_rad);
      const Matrix R_WB{inputs(1), inputs(1), inputs(1)};
      bounds.thrust_N = std::max(bounds.thrust_N, collective_thrust(law.thrust_rule, cell, R_WB).error());
      raise(bounds.torque_N_m, errors(torque_stage(law, envelope, columns, bounds)));
    }
    bounds.applies = true;
  } catch (const Undecided& undecided) {
    bounds.why_not = undecided.what();
  }
  return bounds;
}

}  // namespace swarmcert::controller
