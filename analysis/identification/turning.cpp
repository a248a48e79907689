#include "analysis/identification/turning.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "analysis/identification/candidates.h"
#include "analysis/residuals/prediction.h"
#include "nn/base/parallel.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::PredictedState;
using stability::EffectSpec;

constexpr double kHorizonOfTurning_s = 0.5;
/// Errors are compared this often over the horizon.
constexpr std::size_t kComparisons = 10;
/// Steps of predictions in one evaluation, over all flights, which bounds its time; records, which bound the memory.
constexpr std::size_t kMostPredictedSteps = 40'000, kMostRecordsOfTurning = 1'000'000;
/// Slower logs with measured rotor speeds miss the motion of the attitude loop.
constexpr double kLeastRateOfSpeeds_hz = 50, kLeastRateOfForces_hz = 400;

/// Returns the rotation from `from` to `to` as a vector, in rad, in the frame of `from`.
Eigen::Vector3d rotation_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  const Eigen::Quaterniond turn = from.conjugate() * to;
  const double sine = turn.vec().norm();
  if (sine < 1e-12) return Eigen::Vector3d::Zero();
  const double angle = 2 * std::atan2(sine, std::abs(turn.w()));
  return (turn.w() < 0 ? -angle : angle) / sine * turn.vec();
}

bool shows_turning(const residuals::Track& track) {
  if (track.position_only || !track.has_rates || track.instants.size() < 2) return false;
  const double rate_hz = static_cast<double>(track.instants.size() - 1) / track.duration_s();
  return rate_hz >= (track.has_rotor_speeds ? kLeastRateOfSpeeds_hz : kLeastRateOfForces_hz);
}

/// Returns records in flight from which `steps` steps can be predicted, at most `most` of them, evenly spread.
std::vector<std::size_t> starts_in_flight(const residuals::Track& track, std::size_t steps,
                                          std::size_t most) {
  std::vector<std::size_t> all;
  for (const std::size_t start : residuals::prediction_starts(track, steps)) {
    if (track.cut[start] == residuals::Cut::kNone && track.cut[start + steps] == residuals::Cut::kNone)
      all.push_back(start);
  }
  std::vector<std::size_t> some;
  const std::size_t count = std::min(most, all.size());
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

/// The coefficients of several effects as one vector.
class Coefficients {
 public:
  Coefficients(std::vector<EffectSpec> specs, const stability::Model& model) : specs_(std::move(specs)) {
    for (std::size_t i = 0; i < specs_.size(); ++i) {
      for (const stability::Parameter& parameter : stability::effect_info(specs_[i].name, model).linear)
        places_.push_back({i, parameter});
    }
  }

  Eigen::Index size() const { return static_cast<Eigen::Index>(places_.size()); }

  Eigen::VectorXd values() const {
    Eigen::VectorXd c(size());
    for (Eigen::Index k = 0; k < size(); ++k) c[k] = specs_[of(k).first].parameters.at(of(k).second.name);
    return c;
  }

  std::vector<EffectSpec> specs(const Eigen::VectorXd& c) const {
    std::vector<EffectSpec> specs = specs_;
    for (Eigen::Index k = 0; k < size(); ++k) specs[of(k).first].parameters[of(k).second.name] = c[k];
    return specs;
  }

  Eigen::VectorXd within_bounds(Eigen::VectorXd c) const {
    for (Eigen::Index k = 0; k < size(); ++k) c[k] = std::clamp(c[k], of(k).second.lower, of(k).second.upper);
    return c;
  }

  /// Small against what a coefficient can be.
  double difference(Eigen::Index k) const { return 1e-4 * of(k).second.upper; }

 private:
  const std::pair<std::size_t, stability::Parameter>& of(Eigen::Index k) const {
    return places_[static_cast<std::size_t>(k)];
  }

  std::vector<EffectSpec> specs_;
  std::vector<std::pair<std::size_t, stability::Parameter>> places_;
};

void add_error(const Eigen::Vector3d& error_rad_s, RateErrors& errors) {
  for (int axis = 0; axis < 3; ++axis)
    errors.rad_s[static_cast<std::size_t>(axis)] += std::abs(error_rad_s[axis]);
  errors.rad_s[3] += error_rad_s.norm();
}

/// Huber's loss of a norm, and the weight of its square.
struct Huber {
  static constexpr double kLinearFrom = 2;
  static double loss(double norm) {
    return norm < kLinearFrom ? norm * norm : 2 * kLinearFrom * norm - kLinearFrom * kLinearFrom;
  }
  static double weight(double norm) { return norm < kLinearFrom ? 1 : kLinearFrom / norm; }
};

}  // namespace

/// Of Gauss-Newton: A d = -g for the change d of the coefficients.
struct TurningFlights::NormalEquations {
  Eigen::MatrixXd A;
  Eigen::VectorXd g;
  double loss = 0;
  RateErrors rates;

  void add(const NormalEquations& other) {
    A += other.A;
    g += other.g;
    loss += other.loss;
  }
};

std::vector<std::string> turning_effects() {
  std::vector<std::string> names = stability::effect_names();
  names.erase(std::remove_if(names.begin(), names.end(), [](const auto& name) { return !is_turning(name); }),
              names.end());
  return names;
}

EffectSpec turning_effect(const std::string& name) {
  EffectSpec spec;
  spec.name = name;
  for (const stability::Parameter& parameter : stability::effect_info(name).linear)
    spec.parameters[parameter.name] = 0;
  spec.fit.note = "effective over predictions of half a second";
  return spec;
}

TurningFlights::TurningFlights(const residuals::Inputs& inputs, const std::string& kind,
                               const std::vector<int>& which, int jobs)
    : kinds_(inputs.kinds), jobs_(jobs) {
  std::size_t records = 0;
  for (const int flight : which) {
    std::vector<std::string> problems;
    for (residuals::Track& track : inputs.load(static_cast<std::size_t>(flight), problems)) {
      if (track.kind != kind || !shows_turning(track) || records > kMostRecordsOfTurning) continue;
      records += track.instants.size();
      const stability::Model model = inputs.model_for(track);
      if (residuals::Predictor(model, kinds_, track).has_torque())
        tracks_.push_back({std::move(track), model, {}, 0, 0, 0, {}});
    }
  }
  for (TurningTrack& t : tracks_) {
    const double step_s = t.track.duration_s() / static_cast<double>(t.track.instants.size() - 1);
    t.steps = static_cast<std::size_t>(residuals::prediction_steps(kHorizonOfTurning_s, step_s));
    t.starts = starts_in_flight(t.track, t.steps, kMostPredictedSteps / t.steps / tracks_.size() + 1);
  }
  tracks_.erase(
      std::remove_if(tracks_.begin(), tracks_.end(), [](const auto& t) { return t.starts.empty(); }),
      tracks_.end());
  for (TurningTrack& t : tracks_) set_scales(t);
}

void TurningFlights::set_scales(TurningTrack& t) const {
  const residuals::Predictor measured(t.model, kinds_, t.track);
  double rates = 0, rotation = 0, count = 0;
  for (const std::size_t start : t.starts) {
    const PredictedState begin = measured.measured(start);
    for (std::size_t k = 1; k <= kComparisons; ++k) {
      const PredictedState truth = measured.measured(start + k * t.steps / kComparisons);
      rates += (truth.omega_B_rad_s - begin.omega_B_rad_s).squaredNorm();
      add_error(truth.omega_B_rad_s - begin.omega_B_rad_s, t.held);
      rotation += rotation_between(begin.q_WB, truth.q_WB).squaredNorm();
      ++count;
    }
  }
  constexpr double kSmallest = 1e-9;  // a log in which nothing turns
  for (double& error : t.held.rad_s) error = std::max(error / count, kSmallest);
  t.rates_rad_s = std::max(std::sqrt(rates / count), kSmallest);
  t.rotation_rad = std::max(std::sqrt(rotation / count), kSmallest);
}

TurningFlights::NormalEquations TurningFlights::normal_equations(const TurningTrack& t,
                                                                 const std::vector<EffectSpec>& specs,
                                                                 bool with_slopes) const {
  const Coefficients coefficients(specs, t.model);
  const Eigen::VectorXd c = coefficients.values();
  const Eigen::Index unknowns = with_slopes ? c.size() : 0;
  std::vector<residuals::Predictor> predictors;  // of c, and of c with each coefficient changed
  for (Eigen::Index k = -1; k < unknowns; ++k) {
    Eigen::VectorXd changed = c;
    if (k >= 0) changed[k] += coefficients.difference(k);
    predictors.emplace_back(with_effects(t.model, coefficients.specs(changed)), kinds_, t.track,
                            residuals::Between::kMean);
  }
  NormalEquations sum = {Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns), 0, {}};
  std::vector<PredictedState> states(predictors.size());
  Eigen::Matrix3Xd slopes(3, unknowns);
  const auto add = [&](double scale, const auto& error_of) {
    const Eigen::Vector3d error = error_of(states[0]) / scale;
    for (Eigen::Index k = 0; k < unknowns; ++k)
      slopes.col(k) =
          (error_of(states[static_cast<std::size_t>(k) + 1]) / scale - error) / coefficients.difference(k);
    const double weight = Huber::weight(error.norm());
    sum.A += weight * slopes.transpose() * slopes;
    sum.g += weight * slopes.transpose() * error;
    sum.loss += Huber::loss(error.norm());
  };
  for (const std::size_t start : t.starts) {
    for (PredictedState& state : states) state = predictors[0].measured(start);
    std::size_t step = 0;
    for (std::size_t k = 1; k <= kComparisons; ++k) {
      for (; step < k * t.steps / kComparisons; ++step) {
        for (std::size_t i = 0; i < states.size(); ++i)
          states[i] = predictors[i].step(start + step, states[i]);
      }
      const PredictedState truth = predictors[0].measured(start + step);
      add(t.rates_rad_s,
          [&](const PredictedState& s) -> Eigen::Vector3d { return s.omega_B_rad_s - truth.omega_B_rad_s; });
      add(t.rotation_rad, [&](const PredictedState& s) { return rotation_between(truth.q_WB, s.q_WB); });
      add_error(states[0].omega_B_rad_s - truth.omega_B_rad_s, sum.rates);
    }
  }
  const auto count = static_cast<double>(t.starts.size() * kComparisons);
  for (double& error : sum.rates.rad_s) error /= count;
  // Each flight counts alike, however much it turns.
  sum.A /= count;
  sum.g /= count;
  sum.loss /= count;
  return sum;
}

std::vector<TurningFlights::NormalEquations> TurningFlights::of_all(const std::vector<EffectSpec>& specs,
                                                                    bool with_slopes) const {
  std::vector<NormalEquations> all(tracks_.size());
  files::parallel_for(static_cast<int>(tracks_.size()), jobs_, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    all[k] = normal_equations(tracks_[k], specs, with_slopes);
  });
  return all;
}

std::vector<RateErrors> TurningFlights::rate_errors(const std::vector<EffectSpec>& specs) const {
  std::vector<RateErrors> errors;
  for (const NormalEquations& track : of_all(specs, false)) errors.push_back(track.rates);
  return errors;
}

std::vector<RateErrors> TurningFlights::held() const {
  std::vector<RateErrors> held;
  for (const TurningTrack& t : tracks_) held.push_back(t.held);
  return held;
}

std::vector<EffectSpec> TurningFlights::fitted(const std::vector<EffectSpec>& specs) const {
  const Coefficients coefficients(specs, tracks_[0].model);
  const auto total = [&](const Eigen::VectorXd& c, bool with_slopes) {
    std::vector<NormalEquations> all = of_all(coefficients.specs(c), with_slopes);
    for (std::size_t i = 1; i < all.size(); ++i) all[0].add(all[i]);
    return all[0];
  };
  Eigen::VectorXd c = coefficients.values();
  NormalEquations now = total(c, true);
  double damping = 1e-3;  // of Levenberg and Marquardt
  constexpr int kMostSteps = 20;
  constexpr double kConverged = 1e-4;
  for (int step = 0; step < kMostSteps && damping < 1e3; ++step) {
    Eigen::MatrixXd A = now.A;
    A.diagonal() *= 1 + damping;
    const Eigen::VectorXd next = coefficients.within_bounds(c - A.ldlt().solve(now.g));
    const double loss = next.allFinite() ? total(next, false).loss : now.loss;
    if (!(loss < now.loss)) {
      damping *= 10;
      continue;
    }
    const bool has_converged = loss > (1 - kConverged) * now.loss;
    c = next;
    damping /= 10;
    if (has_converged) break;
    now = total(c, true);
  }
  return coefficients.specs(c);
}

}  // namespace swarmcert::identification
