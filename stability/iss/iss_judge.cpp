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
    : loop_(loop), check_(check), theorem_(theorem) {
  if (check_.has_ball) table_.emplace(theorem, loop.plant.mass_kg, check_.duration_s);
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
      [&](double t, const double* x, double* dx) {
        // Checked at every evaluation, so that nothing is missed between samples, although the last step may be a trial
        // step.
        if (run->left.empty()) {
          if (const char* const left = loop_.left_hypothesis(x)) {
            run->left = left;
            run->left_at_s = t;
          }
        }
        if (!run->left.empty()) {  // the run is over: freeze the state, so that it ends at once
          std::fill(dx, dx + PositionLoop::kSize, 0.0);
          return;
        }
        loop_.derivative(x, eps + (t - from_s) * rate, dx);
      },
      1e-9, std::vector<double>(PositionLoop::kSize, 1e-10 * check_.ball_m));
  PositionLoop::State state = loop_.start(run->position_m, run->velocity_m_s);
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
      state = Eigen::Map<const PositionLoop::State>(integrator.state());
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

std::array<double, 4> IssJudge::start_sizes(const IssRun& run, const PositionLoop::State& state) const {
  if (!check_.has_ball) return {};
  double derivative[PositionLoop::kSize];
  loop_.derivative(state.data(), run.disturbance.bias_W_N, derivative);
  const Eigen::Map<const Eigen::Vector3d> acceleration(derivative + 3);
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
