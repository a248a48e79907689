#include "analysis/gate/checks/disturbance.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/velocity_error.h"
#include "analysis/tracking/measured_source.h"
#include "nn/base/toml.h"
#include "stability/bounds/declared_disturbance.h"

namespace swarmcert::gate {
namespace {

using residuals::LearningError;

const std::vector<std::string> kQuantiles = {"p50", "p95", "p99", "max"};

const residuals::Axes& quantile_of(const LearningError::Quantiles& all, const std::string& quantile) {
  return quantile == "p50" ? all.p50 : quantile == "p95" ? all.p95 : quantile == "p99" ? all.p99 : all.max;
}

double of_axis(const residuals::Axes& axes, int axis) {
  return axis == 0 ? axes.x : axis == 1 ? axes.y : axes.z;
}

/// The measured quantile of one axis.
double at(const LearningError::Quantiles& all, const std::string& quantile, int axis) {
  return std::abs(of_axis(quantile_of(all, quantile), axis));
}

stability::DisturbanceSource measured(const LearningError& error, const std::string& quantile) {
  std::array<analysis::MeasuredAxis, 3> axes;
  for (int axis = 0; axis < 3; ++axis) {
    axes[static_cast<std::size_t>(axis)] = {
        at(error.bias_N, quantile, axis), at(error.amplitude_N, quantile, axis),
        at(error.rate_N_s, quantile, axis), at(error.variation_N, quantile, axis),
        at(error.impulse_N_s, quantile, axis)};
  }
  stability::DisturbanceSource source = analysis::measured_source(axes, LearningError::kWindow_s);
  source.note = fmt::format("{} over windows of {} s", quantile, LearningError::kWindow_s);
  return source;
}

}  // namespace

void describe_disturbance(files::Keys& keys) {
  stability::describe_force_error(keys);
  keys.may("quantile", "Of the force error measured on the flights, where none is declared.", "",
           files::OneOf{kQuantiles});
}

DisturbanceTable read_disturbance(const files::TomlTable& table) {
  DisturbanceTable result;
  stability::read_force_error(table, result.declared);
  if (table.has("bias_N") && !result.is_declared())
    table.refuse("bias_N", "", "stands alone",
                 "declare rate_N_s, amplitude_N, variation_N or impulse_N_s too");
  result.declared.note = "as the policy declares";
  if (table.has("quantile")) {
    if (result.is_declared())
      table.refuse("quantile", "", "conflicts with a declared force error", "give one");
    result.quantile = kQuantiles[table.choice("quantile", kQuantiles)];
  }
  return result;
}

stability::DisturbanceSource disturbance(const DisturbanceTable& table, Evidence& evidence) {
  if (table.is_declared()) return table.declared;
  const residuals::Comparison& comparison =
      evidence.policy().wants_guard_factor ? evidence.comparison() : evidence.residual_comparison();
  if (comparison.learning_error.windows == 0)
    throw Unfounded(fmt::format("the reference flights have no window of {} s to measure the force error on",
                                LearningError::kWindow_s));
  return measured(comparison.learning_error, table.quantile);
}

void describe_estimates(files::Keys& keys) {
  keys.may<double>("velocity_error_m_s", "sup |estimated - true velocity|; absent: as measured.", "m/s");
  keys.may<double>("position_error_m", "sup |estimated - true position|.", "m");
}

EstimateTable read_estimates(const files::TomlTable& table) {
  EstimateTable result;
  const auto number = [&table](const char* key) {
    const double value = table.number(key);
    if (value < 0) table.refuse(key, fmt::format("{}", value), "must not be negative");
    return value;
  };
  if (table.has("velocity_error_m_s")) result.velocity_m_s = number("velocity_error_m_s");
  if (table.has("position_error_m")) result.position_m = number("position_error_m");
  return result;
}

void add_estimates(const EstimateTable& estimates, const DisturbanceTable& force, Evidence& evidence,
                   stability::DisturbanceSource& source) {
  const auto set = [](stability::EstimateError& error, double amplitude) {
    error = {};
    error.amplitude = amplitude;
  };
  const bool is_measured =
      !estimates.velocity_m_s && !evidence.release().flights.empty() && !force.is_declared();
  const residuals::VelocityError* const velocity = is_measured ? evidence.velocity_error() : nullptr;
  for (int axis = 0; axis < 3; ++axis) {
    set(source.velocity_error[axis], estimates.velocity_m_s.value_or(0));
    set(source.position_error[axis], estimates.position_m);
    if (velocity == nullptr) continue;
    const std::string& q = force.quantile;
    source.velocity_error[axis] =
        analysis::measured_estimate({at(velocity->bias_m_s, q, axis), at(velocity->amplitude_m_s, q, axis),
                                     at(velocity->rate_m_s2, q, axis), at(velocity->variation_m_s, q, axis),
                                     at(velocity->impulse_m, q, axis)},
                                    LearningError::kWindow_s);
  }
}

std::string words(const stability::DisturbanceSource& source, int axis) {
  const stability::Disturbance& d = source.axis[axis];
  std::string text = source.kind;
  const auto add = [&text](const char* what, double value, const char* unit) {
    if (std::isfinite(value)) text += fmt::format(", {} {:.4g} {}", what, value, unit);
  };
  add("rate", d.rate_N_s, "N/s");
  add("amplitude", d.amplitude_N, "N");
  add("variation", d.variation_N, "N");
  add("impulse", d.impulse_N_s, "N s");
  if (source.bias_N[axis] != 0) add("bias", source.bias_N[axis], "N");
  const auto add_estimate = [&add](const char* what, const stability::EstimateError& error,
                                   const char* unit) {
    if (!error.is_zero()) add(what, error.largest(), unit);
  };
  add_estimate("velocity error", source.velocity_error[axis], "m/s");
  add_estimate("position error", source.position_error[axis], "m");
  return text;
}

}  // namespace swarmcert::gate
