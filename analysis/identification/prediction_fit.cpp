#include "analysis/identification/prediction_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <stdexcept>

#include "analysis/identification/box_least_squares.h"
#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/thrust_stage.h"
#include "nn/base/parallel.h"
#include "nn/base/pi.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::kNumErrors;
using residuals::PredictedState;

/// Starts per flight. More change the coefficients by less than their intervals.
constexpr std::size_t kStarts = 80;
/// An effect must lower the error of held-out flights by this share, and may not raise that of one group by more.
constexpr double kLeastFall = 0.01, kLargestRise = 0.01;
constexpr int kIterations = 5;
/// Iterations end when the objective falls by less than this share.
constexpr double kConverged = 1e-4;

/// A coefficient that the fit may change.
struct Coefficient {
  std::size_t effect;  ///< index into Model::effects
  std::string name;
  double lower, upper, step;
};

/// A flight with the places where predictions start.
struct Fitted {
  residuals::Track track;
  std::string group;
  std::vector<std::size_t> starts;
  std::size_t steps = 0;
  std::array<double, kNumErrors> held{};  ///< mean error of a held state, per quantity
};

/// Errors of all starts of a flight, each quantity over its `held`: [3 x (starts x steps x kNumErrors)].
using Errors = Eigen::Matrix3Xd;

/// Returns the difference of two attitudes as a rotation vector; its norm is the angle between them.
Eigen::Vector3d rotation_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  const Eigen::AngleAxisd turn(from.conjugate() * to);
  const double angle = turn.angle() > kPi ? turn.angle() - 2 * kPi : turn.angle();
  return angle * turn.axis();
}

Errors errors_of(const residuals::Inputs& inputs, const stability::Model& model, Fitted& flight) {
  residuals::apply_model(model, inputs.kinds, inputs.rules, flight.track);
  const residuals::Predictor predictor(model, inputs.kinds, flight.track);
  Errors errors(3, static_cast<Eigen::Index>(flight.starts.size() * flight.steps * kNumErrors));
  Eigen::Index at = 0;
  for (const std::size_t start : flight.starts) {
    PredictedState state = predictor.measured(start);
    for (std::size_t h = 0; h < flight.steps; ++h) {
      state = predictor.step(start + h, state);
      const PredictedState truth = predictor.measured(start + h + 1);
      errors.col(at++) = (state.p_W_m - truth.p_W_m) / flight.held[residuals::kPositionError];
      errors.col(at++) = (state.v_W_m_s - truth.v_W_m_s) / flight.held[residuals::kVelocityError];
      errors.col(at++) = rotation_between(truth.q_WB, state.q_WB) / flight.held[residuals::kRotationError];
      errors.col(at++) = (state.omega_B_rad_s - truth.omega_B_rad_s) / flight.held[residuals::kRateError];
    }
  }
  return errors;
}

/// Returns the objective of one flight: the mean norm of its errors.
double objective(const Errors& errors) { return errors.colwise().norm().mean(); }

/// Returns the coefficients of the model's effects that predictions depend on.
std::vector<Coefficient> coefficients_of(const stability::Model& model) {
  std::vector<Coefficient> all;
  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    const stability::EffectSpec& spec = model.effects[k];
    if (spec.is_expression() || !spec.vehicle.empty() || residuals::is_thrust_stage(spec.name)) continue;
    stability::EffectInfo info = stability::effect_info(spec.name);
    if (info.remembers || info.needs_neighbours) continue;
    scale_bounds(model.mass_kg, info);
    for (const stability::Parameter& parameter : info.linear) {
      if (parameter.upper > parameter.lower)
        all.push_back({k, parameter.name, parameter.lower, parameter.upper,
                       1e-3 * std::min(parameter.upper - parameter.lower, 1.0)});
    }
  }
  return all;
}

double& value_of(stability::Model& model, const Coefficient& coefficient) {
  stability::EffectSpec& spec = model.effects[coefficient.effect];
  const auto found = spec.parameters.find(coefficient.name);
  if (found != spec.parameters.end()) return found->second;
  for (const stability::Parameter& parameter : stability::effect_info(spec.name).linear) {
    if (parameter.name == coefficient.name) spec.parameters[coefficient.name] = parameter.value;
  }
  return spec.parameters[coefficient.name];
}

/// Normal equations of a Gauss-Newton step around the current coefficients.
struct Normal {
  Eigen::MatrixXd gram;
  Eigen::VectorXd slope;
  double objective = 0;

  Normal& operator+=(const Normal& other) {
    gram += other.gram;
    slope += other.slope;
    objective += other.objective;
    return *this;
  }
};

class Fit {
 public:
  Fit(const residuals::Inputs& inputs, std::vector<Fitted>& flights, int jobs)
      : inputs_(inputs), flights_(flights), jobs_(jobs) {}

  /// Returns the objective of each flight.
  std::vector<double> objectives(const stability::Model& model) const {
    std::vector<double> result(flights_.size());
    files::parallel_for(static_cast<int>(flights_.size()), jobs_, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      result[k] = objective(errors_of(inputs_, model, flights_[k]));
    });
    return result;
  }

  /// Minimises the sum of the objectives of all flights over all coefficients of the model.
  stability::Model minimised(stability::Model model) const {
    const std::vector<Coefficient> coefficients = coefficients_of(model);
    if (coefficients.empty()) return model;
    double damping = 1e-3;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      const Normal normal = sum(normal_equations(model, coefficients), {});
      double fall = 0;
      for (int attempt = 0; attempt < 5 && fall <= 0; ++attempt, damping *= 8) {
        stability::Model next = stepped(model, coefficients, normal, damping);
        fall = 1 - sum(objectives(next)) / normal.objective;
        if (fall > 0) model = std::move(next);
      }
      damping /= 64;
      if (fall < kConverged) break;
    }
    return model;
  }

  /// Returns `model`, the minimum over all flights, moved by one step to the minimum over all but each set of `without`.
  std::vector<stability::Model> moved_without(const stability::Model& model,
                                              const std::vector<std::vector<std::size_t>>& without) const {
    const std::vector<Coefficient> coefficients = coefficients_of(model);
    const std::vector<Normal> parts = normal_equations(model, coefficients);
    std::vector<stability::Model> moved;
    for (const std::vector<std::size_t>& left_out : without)
      moved.push_back(stepped(model, coefficients, sum(parts, left_out), 0));
    return moved;
  }

 private:
  /// Per flight.
  std::vector<Normal> normal_equations(const stability::Model& model,
                                       const std::vector<Coefficient>& coefficients) const {
    std::vector<Normal> parts(flights_.size());
    files::parallel_for(static_cast<int>(parts.size()), jobs_, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      parts[k] = normal_equations(model, coefficients, flights_[k]);
    });
    return parts;
  }

  Normal normal_equations(const stability::Model& model, const std::vector<Coefficient>& coefficients,
                          Fitted& flight) const {
    const Errors errors = errors_of(inputs_, model, flight);
    // An error that is small by chance must not outweigh all others.
    const Eigen::RowVectorXd weight =
        errors.colwise().norm().cwiseMax(0.05).cwiseInverse() / static_cast<double>(errors.cols());
    Eigen::MatrixXd columns(errors.size(), static_cast<Eigen::Index>(coefficients.size()));
    for (Eigen::Index c = 0; c < columns.cols(); ++c) {
      const Coefficient& coefficient = coefficients[static_cast<std::size_t>(c)];
      stability::Model moved = model;
      double& value = value_of(moved, coefficient);
      const double step = value + coefficient.step > coefficient.upper ? -coefficient.step : coefficient.step;
      value += step;
      const Errors change = (errors_of(inputs_, moved, flight) - errors) / step;
      columns.col(c) = Eigen::Map<const Eigen::VectorXd>(change.data(), change.size());
    }
    const Eigen::Matrix3Xd spread = weight.replicate(3, 1);
    const Eigen::Map<const Eigen::VectorXd> weights(spread.data(), spread.size());
    const Eigen::Map<const Eigen::VectorXd> values(errors.data(), errors.size());
    return {columns.transpose() * weights.asDiagonal() * columns,
            columns.transpose() * weights.cwiseProduct(values), objective(errors)};
  }

  static double sum(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
  }

  static Normal sum(const std::vector<Normal>& parts, const std::vector<std::size_t>& left_out) {
    const Eigen::Index n = parts.front().slope.size();
    Normal total = {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (std::find(left_out.begin(), left_out.end(), k) == left_out.end()) total += parts[k];
    }
    return total;
  }

  static stability::Model stepped(const stability::Model& model, const std::vector<Coefficient>& coefficients,
                                  const Normal& normal, double damping) {
    stability::Model next = model;
    const auto n = static_cast<Eigen::Index>(coefficients.size());
    Eigen::VectorXd lower(n), upper(n);
    for (Eigen::Index c = 0; c < n; ++c) {
      const Coefficient& coefficient = coefficients[static_cast<std::size_t>(c)];
      const double value = value_of(next, coefficient);
      lower[c] = std::min(coefficient.lower - value, 0.0);
      upper[c] = std::max(coefficient.upper - value, 0.0);
    }
    Eigen::MatrixXd gram = normal.gram;
    gram.diagonal() *= 1 + damping;
    const Eigen::VectorXd change = box_least_squares(gram, -normal.slope, lower, upper);
    for (Eigen::Index c = 0; c < n; ++c)
      value_of(next, coefficients[static_cast<std::size_t>(c)]) += change[c];
    return next;
  }

  const residuals::Inputs& inputs_;
  std::vector<Fitted>& flights_;
  int jobs_;
};

/// Spreads the starts over the stretches in which a prediction is possible, and measures what a held state errs.
bool prepare(const residuals::Inputs& inputs, double horizon_s, Fitted& flight) {
  const stability::Model model = inputs.model_for(flight.track);
  const residuals::FlightPrediction held =
      residuals::predict(model, inputs.kinds, flight.track, horizon_s, false);
  if (!held.refused.empty() || !held.has_torque) return false;
  flight.steps = held.errors[0].mean.size();
  for (std::size_t k = 0; k < kNumErrors; ++k)
    flight.held[k] = std::max(held.held[k].sum() / static_cast<double>(flight.steps), 1e-9);
  const std::vector<std::size_t> possible = residuals::prediction_starts(flight.track, flight.steps);
  const std::size_t stride = std::max<std::size_t>(1, possible.size() / kStarts);
  for (std::size_t i = 0; i < possible.size(); i += stride) flight.starts.push_back(possible[i]);
  return !flight.starts.empty();
}

bool has_effect(const stability::Model& model, const std::string& name) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&](const stability::EffectSpec& spec) { return spec.name == name; });
}

/// Fits and judges one model after another.
class Ladder {
 public:
  Ladder(const Fit& fit, const std::vector<Fitted>& flights) : fit_(fit) {
    std::map<std::string, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < flights.size(); ++i) groups[flights[i].group].push_back(i);
    for (auto& [name, which] : groups) {
      names_.push_back(name);
      groups_.push_back(std::move(which));
    }
  }

  const std::vector<std::string>& groups() const { return names_; }

  /// Takes the given model as it is.
  void start(const stability::Model& model) {
    given_ = best_ = errors_of_groups(std::vector<stability::Model>(groups_.size(), model));
  }

  /// Tries the accepted model with `effect`, fitted without each group in turn.
  PredictionStep attempt(const std::string& effect, PredictionFit& result) {
    stability::Model next = fit_.minimised(with(result.model, effect));
    const std::vector<double> errors = errors_of_groups(fit_.moved_without(next, groups_));
    PredictionStep step;
    step.effect = effect;
    step.worst = 0;
    double before = 0, after = 0, given = 0, worst = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      worst = std::max(worst, errors[g] / best_[g]);
      step.worst = std::max(step.worst, errors[g] / given_[g]);
      before += best_[g];
      after += errors[g];
      given += given_[g];
    }
    step.held_out = after / given;
    step.accepted = after <= (1 - kLeastFall) * before && worst <= 1 + kLargestRise;
    if (step.accepted) {
      best_ = errors;
      result.model = std::move(next);
      result.changed = true;
    }
    return step;
  }

 private:
  /// Returns the error of each group under its model. A group counts once, however many flights it has.
  std::vector<double> errors_of_groups(const std::vector<stability::Model>& models) const {
    std::vector<double> errors;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const std::vector<double> objectives = fit_.objectives(models[g]);
      double sum = 0;
      for (const std::size_t flight : groups_[g]) sum += objectives[flight];
      errors.push_back(sum / static_cast<double>(groups_[g].size()));
    }
    return errors;
  }

  static stability::Model with(stability::Model model, const std::string& effect) {
    if (effect == "model" || has_effect(model, effect)) return model;
    stability::EffectSpec spec;
    spec.name = effect;
    model.effects.push_back(std::move(spec));
    return model;
  }

  const Fit& fit_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::size_t>> groups_;
  std::vector<double> given_, best_;  ///< errors of the groups
};

}  // namespace

std::string flight_group(const std::string& path) {
  std::string name = std::filesystem::path(path).stem().string();
  for (;;) {
    const std::size_t cut = name.find_last_of("_-. ");
    if (cut == std::string::npos || cut == 0) return name;
    const std::string word = name.substr(cut + 1);
    const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
    if (word.empty() || !is_digit(word.back())) return name;
    name.resize(cut);
  }
}

PredictionFit fit_prediction(const residuals::Inputs& inputs, const std::vector<int>& flights,
                             double horizon_s, int jobs) {
  if (inputs.models.size() != 1) throw std::invalid_argument("fit_prediction: exactly one model is fitted");
  PredictionFit result;
  result.model = inputs.models[0];
  std::vector<Fitted> fitted;
  for (const int index : flights) {
    std::vector<std::string> problems;
    for (residuals::Track& track : inputs.load(static_cast<std::size_t>(index), problems)) {
      if (track.position_only || track.kind != result.model.kind) continue;
      Fitted flight;
      flight.group = flight_group(track.path);
      flight.track = std::move(track);
      if (prepare(inputs, horizon_s, flight)) fitted.push_back(std::move(flight));
    }
  }
  const Fit fit(inputs, fitted, jobs);
  Ladder ladder(fit, fitted);
  result.groups = ladder.groups();
  if (result.groups.size() < 2) {
    result.refused = "takes flights of at least two kinds with rates and the force of each rotor";
    return result;
  }
  ladder.start(result.model);
  for (const char* const effect :
       {"torque_ratio", "rate_damping", "flow_torque", "com_offset", "torque_bias", "gyroscopic", "model"})
    result.ladder.push_back(ladder.attempt(effect, result));
  return result;
}

}  // namespace swarmcert::identification
