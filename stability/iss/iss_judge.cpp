#include "stability/iss/iss_judge.h"

#include <algorithm>
#include <cmath>

#include "stability/gains_matrices.h"
#include "stability/simulation/ode_integrator.h"

namespace swarmcert::stability {
namespace {

constexpr double kTolerance = 1e-6;  ///< for violations; the integrator's tolerance is a thousandth of it
/// Transient bounds below this fraction of the ball are not compared, because of the integrator's absolute tolerance.
constexpr double kLeastShare = 1e-3;

}  // namespace

TransientTable::TransientTable(const Theorem& theorem, double mass_kg, double duration_s) {
  for (int part = 0; part < kParts; ++part) {
    Transient unit;
    unit.l = theorem.min_Lambda;
    unit.k = theorem.min_K;
    unit.mass_kg = mass_kg;
    (part == 0 ? unit.error_m : part == 1 ? unit.speed_m_s : part == 2 ? unit.s_dot_m_s2 : unit.rate_N_s) = 1;
    for (int k = 0; k <= kIssSamples; ++k) values_[part].push_back(unit.at(duration_s * k / kIssSamples));
  }
}

double TransientTable::at(int k, const std::array<double, 4>& sizes) const {
  double sum = 0;
  for (std::size_t part = 0; part < kParts; ++part)
    sum += sizes[part] * values_[part][static_cast<std::size_t>(k)];
  return sum;
}

IssJudge::IssJudge(const FlownLoop& loop, const IssCheck& check, const Theorem& theorem)
    : matrix_(loop.matrix()),
      law_(loop.law()),
      limit_m_s_{loop.integral_limit_m_s(0), loop.integral_limit_m_s(1), loop.integral_limit_m_s(2)},
      mass_kg_(loop.plant.mass_kg),
      thrust_N_(loop.thrust_range_N()),
      check_(check),
      theorem_(theorem) {
  if (check_.has_ball) table_.emplace(theorem, loop.plant.mass_kg, check_.duration_s);
}

LoopState IssJudge::derivative(const LoopState& x, const Eigen::Vector3d& eps_W_N) const {
  LoopState result = matrix_ * x;
  result.segment<3>(3) -= eps_W_N / mass_kg_;
  return result;
}

const char* IssJudge::left_hypothesis(const LoopState& x) const {
  /// Below this fraction of the weight, the direction of the commanded force is meaningless.
  constexpr double kLeastShare = 0.01;
  const Eigen::Vector3d integral = x.segment<3>(6);
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(integral[i]) < limit_m_s_[static_cast<std::size_t>(i)]))
      return "the integral reaches its clamp";
  }
  const double weight_N = mass_kg_ * kGravity_m_s2;
  const Eigen::Vector3d force =
      Eigen::Vector3d(0, 0, weight_N) -
      mass_kg_ * (law_.Kp * x.head<3>() + law_.Kd * x.segment<3>(3) + law_.Ki * integral);
  const double size_N = force.stableNorm();
  if (!(size_N <= thrust_N_.upper && size_N >= thrust_N_.lower)) return "the thrust saturates";
  if (size_N < kLeastShare * weight_N) return "the commanded force is near zero";
  return force.z() > 0 ? nullptr : "the commanded force tilts by 90 degrees";
}

void IssJudge::judge(IssRun* run) const {
  try {
    integrate(run);
  } catch (const IntegrationError& error) {
    // A run that has violated the hypotheses need not be integrable.
    if (run->left.empty()) run->failure = error.what();
  }
}

void IssJudge::integrate(IssRun* run) const {
  const RateDisturbance& disturbance = run->disturbance;
  // The learning error within the current segment: eps + (t - from) rate. A Runge-Kutta method restarts at every switch
  // without cost, unlike multistep methods.
  Eigen::Vector3d eps = disturbance.bias_W_N, rate = Eigen::Vector3d::Zero();
  double from_s = 0;
  OdeIntegrator integrator(
      OdeMethod::kRungeKutta,
      [&](double t, const double* at, double* dx) {
        const Eigen::Map<const LoopState> x(at);
        // Checked at every evaluation, so that nothing is missed between samples, although the last step may be a trial
        // step.
        if (run->left.empty()) {
          if (const char* const left = left_hypothesis(x)) {
            run->left = left;
            run->left_at_s = t;
          }
        }
        Eigen::Map<LoopState> slope(dx);
        if (!run->left.empty()) {  // the run is over: freeze the state, so that it ends at once
          slope.setZero();
          return;
        }
        slope = derivative(x, eps + (t - from_s) * rate);
      },
      1e-9, std::vector<double>(15, 1e-10 * check_.ball_m));
  LoopState state = LoopState::Zero();
  state.head<3>() = run->position_m;
  state.segment<3>(3) = run->velocity_m_s;
  const bool from_rest =
      run->position_m.isZero(0) && run->velocity_m_s.isZero(0) && disturbance.bias_W_N.isZero(0);
  const std::array<double, 4> sizes = start_sizes(*run, state);
  std::size_t piece = 0;
  const auto rate_of = [&disturbance](std::size_t i) {
    return i < disturbance.rate_W_N_s.size() ? disturbance.rate_W_N_s[i]
                                             : Eigen::Vector3d(Eigen::Vector3d::Zero());
  };
  rate = rate_of(0);
  integrator.start(0, state.data());
  for (int k = 1; k <= kIssSamples; ++k) {
    const double target_s = check_.duration_s * k / kIssSamples;
    while (piece < disturbance.until_s.size() && disturbance.until_s[piece] < target_s) {
      const double until_s = disturbance.until_s[piece];
      integrator.advance(until_s, until_s);
      if (!run->left.empty()) return;
      eps += (until_s - from_s) * rate;
      from_s = until_s;
      rate = rate_of(++piece);
      state = Eigen::Map<const LoopState>(integrator.state());
      integrator.start(until_s, state.data());
    }
    const double limit_s = piece < disturbance.until_s.size() ? disturbance.until_s[piece] : 1e300;
    integrator.advance(target_s, std::max(limit_s, target_s));
    // Judged only up to the previous sample, since the violation occurred after it.
    if (!run->left.empty()) return;
    const Eigen::Map<const Eigen::Vector3d> error(integrator.state());
    if (!weigh(error.norm(), k, from_rest, sizes, run)) return;
  }
}

std::array<double, 4> IssJudge::start_sizes(const IssRun& run, const LoopState& state) const {
  if (!check_.has_ball) return {};
  const Eigen::Vector3d acceleration = derivative(state, run.disturbance.bias_W_N).segment<3>(3);
  const Eigen::Matrix3d lambda = to_eigen(theorem_.composite->Lambda_1_s);
  const Eigen::Vector3d s_dot =
      acceleration + 2 * lambda * run.velocity_m_s + lambda * lambda * run.position_m;
  return {run.position_m.norm(), run.velocity_m_s.norm(), s_dot.norm(), check_.rate_N_s};
}

bool IssJudge::weigh(double error_m, int k, bool from_rest, const std::array<double, 4>& sizes,
                     IssRun* run) const {
  const double ball_m = check_.ball_m;
  if (!(error_m <= 1e6 * ball_m)) error_m = 1e6 * ball_m;  // diverged, or NaN
  if (error_m > run->largest_m) {
    run->largest_m = error_m;
    run->at_s = check_.duration_s * k / kIssSamples;
  }
  if (from_rest) {
    run->ratio = std::max(run->ratio, error_m / ball_m);
    run->is_violation = run->is_violation || error_m > ball_m * (1 + kTolerance);
  }
  if (!check_.has_ball) return error_m < 1e6 * ball_m;
  if (const double limit_m = table_->at(k, sizes); limit_m > kLeastShare * ball_m) {
    run->transient_ratio = std::max(run->transient_ratio, error_m / limit_m);
    run->is_violation = run->is_violation || error_m > limit_m * (1 + kTolerance);
  }
  return error_m < 1e6 * ball_m;
}

}  // namespace swarmcert::stability
