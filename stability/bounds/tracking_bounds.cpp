#include "stability/bounds/tracking_bounds.h"

#include <algorithm>
#include <cmath>

#include "stability/bounds/sampled_bounds.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

constexpr double kPositionNoise_m = 1e-3;
constexpr double kVelocityNoise_m_s = 0.05;

bool same(const AxisLoop& a, const AxisLoop& b) {
  return a.mass_kg == b.mass_kg && a.Kp == b.Kp && a.Kd == b.Kd && a.Ki == b.Ki && a.lags_s == b.lags_s &&
         a.delay_s == b.delay_s;
}

AxisFacts facts_of(const Gains& gains, const AxisLoop& loop, const std::optional<SampledLoop>& sampled,
                   int axis, double bias_N) {
  AxisFacts facts;
  facts.axis = axis;
  facts.stable = is_stable(loop);
  facts.lag_floor = lag_floor(loop);
  facts.effort_gain = effort_gain(loop);
  facts.lag_limit_s = lag_limit(loop);
  facts.delay_limit_s = delay_limit(loop);
  facts.written_Ki = loop.Ki;
  facts.effective_Ki = sampled ? effective_Ki(*sampled) : loop.Ki;
  const double limit_m_s = gains.integrator_limit_m_s[static_cast<std::size_t>(axis)];
  facts.clamp_authority_N = loop.Ki > 0 ? loop.mass_kg * loop.Ki * limit_m_s : 0;
  facts.clamp_residual_m = clamp_residual(loop, bias_N, limit_m_s);
  if (sampled) {
    facts.spectral_radius = spectral_radius(*sampled);
    facts.noise = noise_deviation(*sampled, kPositionNoise_m, kVelocityNoise_m_s);
  }
  return facts;
}

void add_assumptions(const Gains& gains, const DisturbanceSource& source, TrackingReport& report) {
  const auto add = [&report](const std::string& name, const std::string& status, const std::string& note) {
    report.assumptions.push_back({name, status, note});
  };
  if (source.kind == "rate of f_hat") {
    add("rate of f_hat", "proved", "bounds the learned force, not its error: gives no ball");
  } else if (source.kind == "declared truth") {
    add("the force is that of the declared truth", "assumed", source.note);
    add("constants of the declared truth", "proved", "enclosed over the motions stated");
    if (source.f_hat_rate_known) add("rate of f_hat", "proved", "from the network's Lipschitz constant");
  } else if (source.kind != "none") {
    add("disturbance class", source.kind == "measured" ? "measured" : "assumed",
        source.kind + " numbers bound the learning error: " + source.note);
  }
  for (const std::string& assumption : source.further_assumptions) add(assumption, "assumed", "");
  add("mass and thrust scale as in the model", "assumed", "--uncertain encloses intervals");
  const bool has_thrust = report.thrust_margin_N && *report.thrust_margin_N >= 0;
  add("no saturation of the collective thrust",
      !has_thrust                 ? "assumed"
      : source.kind == "measured" ? "measured"
                                  : "proved",
      report.thrust_margin_N
          ? "under the disturbance class, about hover, by the effort gain of the continuous loop"
          : "");
  add("exact position and velocity", "assumed", "sensor noise adds to every bound");
  if (gains.rate_hz > 0) {
    add("continuous position loop", "assumed", "rows named 'sampled' do not need it");
  }
  if (gains.motor_lag_s > 0 || gains.attitude_lag_s > 0 || gains.delay_s > 0) {
    add("first-order lags and a constant delay", "assumed", "as in [lag]");
  }
  if (gains.attitude_lag_s > 0) {
    add("attitude error small", "assumed", "the direction of thrust is treated as linear");
  }
}

}  // namespace

const char* axis_name(int axis) { return axis == 0 ? "x" : axis == 1 ? "y" : "z"; }
const char* name(Channel channel) { return channel == Channel::kForce ? "force" : "command"; }
const char* name(Loop loop) { return loop == Loop::kContinuous ? "continuous" : "sampled"; }

std::optional<AxisLoop> axis_loop(const Gains& gains, const Plant& plant, int axis) {
  const std::optional<AxisGains> pid = axis_gains(gains, plant.mass_kg, axis);
  if (!pid) return std::nullopt;
  AxisLoop loop;
  loop.mass_kg = plant.mass_kg;
  loop.Kp = pid->Kp * plant.thrust_scale;
  loop.Kd = pid->Kd * plant.thrust_scale;
  loop.Ki = pid->Ki * plant.thrust_scale;
  if (gains.motor_lag_s > 0) loop.lags_s.push_back(gains.motor_lag_s);
  if (axis < 2 && gains.attitude_lag_s > 0) loop.lags_s.push_back(gains.attitude_lag_s);
  loop.delay_s = gains.delay_s;
  return loop;
}

std::optional<SampledLoop> sampled_axis_loop(const Gains& gains, const Plant& plant, int axis) {
  const std::optional<AxisLoop> loop = axis_loop(gains, plant, axis);
  if (!loop || gains.rate_hz == 0) return std::nullopt;
  return SampledLoop{*loop, 1 / gains.rate_hz, gains.integrator_step_s};
}

TrackingReport tracking_bounds(const Gains& gains, const Plant& plant, const DisturbanceSource& source,
                               const InitialError& initial) {
  TrackingReport report;
  PerAxis integrator_needs{};
  bool needs_known = true;
  std::vector<AxisLoop> done;  // loops of earlier axes, whose rows are copied where this axis is the same
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = axis_loop(gains, plant, axis);
    const std::optional<SampledLoop> sampled = sampled_axis_loop(gains, plant, axis);
    const Disturbance& known = source.axis[axis];
    const auto i = static_cast<std::size_t>(axis);
    needs_known =
        needs_known && loop && (std::isfinite(known.amplitude_N) || std::isfinite(known.impulse_N_s));
    if (!loop) continue;
    report.facts.push_back(facts_of(gains, *loop, sampled, axis, source.bias_N[i]));
    std::vector<ExactGains> rows;
    const bool repeats_last_axis = !done.empty() && same(done.back(), *loop);
    if (repeats_last_axis) {
      for (const ExactGains& row : report.exact) {
        if (row.axis == axis - 1) rows.push_back(row);
      }
      for (ExactGains& row : rows) row.axis = axis;
    } else {
      for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
        const GainNorms norms = continuous_norms(*loop, channel);
        rows.push_back({axis, channel, Loop::kContinuous, norms, norms});
        if (!sampled) continue;
        rows.push_back({axis, channel, Loop::kSampled, sampled_norms(*sampled, channel, Instants::kSampling),
                        sampled_norms(*sampled, channel, Instants::kAll)});
      }
    }
    done.push_back(*loop);
    const double limit_m_s = gains.integrator_limit_m_s[i];
    const bool is_repeated = repeats_last_axis && axis > 0 && known == source.axis[axis - 1] &&
                             source.bias_N[i] == source.bias_N[i - 1] &&
                             limit_m_s == gains.integrator_limit_m_s[i - 1];
    const std::size_t of_last_axis = report.bounds.size() - std::min(report.bounds.size(), rows.size());
    integrator_needs[i] =
        is_repeated ? integrator_needs[i - 1]
        : sampled   ? clamp_bounds(*sampled, Channel::kForce, known, source.bias_N[i], limit_m_s).demand_m_s
                    : clamp_bounds(*loop, Channel::kForce, known, source.bias_N[i], limit_m_s).demand_m_s;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const ExactGains& row = rows[k];
      report.exact.push_back(row);
      if (source.kind == "none") continue;
      AxisBounds bounds;
      if (is_repeated) bounds = report.bounds[of_last_axis + k];
      bounds.axis = axis;
      bounds.channel = row.channel;
      bounds.loop = row.loop;
      if (!is_repeated && row.loop == Loop::kSampled) {
        bounds.bounds = disturbance_bounds(*sampled, row.channel, row.all_times, known);
        bounds.clamp = clamp_bounds(*sampled, row.channel, known, source.bias_N[i], limit_m_s);
      } else if (!is_repeated) {
        bounds.bounds = disturbance_bounds(*loop, row.channel, known);
        bounds.clamp = clamp_bounds(*loop, row.channel, known, source.bias_N[i], limit_m_s);
      }
      if (source.f_hat_rate_known) {
        bounds.staircase_m = staircase_error(row.all_times, gains.network_rate_hz, gains.network_latency_s,
                                             source.f_hat_rate_N_s);
      }
      report.bounds.push_back(bounds);
    }
    if (axis == 2 && plant.largest_thrust_N > 0 && std::isfinite(known.amplitude_N)) {
      // Neither more than the rotors give nor less than nothing.
      const double weight_N = plant.mass_kg * kGravity_m_s2;
      report.thrust_margin_N =
          std::min(plant.thrust_scale * plant.largest_thrust_N - weight_N, weight_N) -
          report.facts.back().effort_gain * (known.amplitude_N + std::abs(source.bias_N[2]));
    }
  }
  report.theorem = check_theorem(gains, plant.mass_kg,
                                 needs_known ? std::optional<PerAxis>(integrator_needs) : std::nullopt);
  if (plant.thrust_scale != 1) {
    report.theorem.applies = false;
    report.theorem.why_not.push_back("the force that acts is not the force commanded: thrust scale " +
                                     std::to_string(plant.thrust_scale));
  }
  const bool bounds_error = source.bounds_learning_error();
  if (report.theorem.composite) {
    const Composite& composite = *report.theorem.composite;
    report.vector = vector_peak_gain(composite.Lambda, composite.K, plant.mass_kg);
    Transient transient;
    transient.l = report.theorem.min_Lambda;
    transient.k = report.theorem.min_K;
    transient.mass_kg = plant.mass_kg;
    transient.error_m = initial.position_m;
    transient.speed_m_s = initial.velocity_m_s;
    // s'(0) from its definition; |Lambda| enters through its largest entry sum, an upper bound of its norm.
    double norm_L = 0;
    double norm_K = 0;
    for (std::size_t r = 0; r < 3; ++r) {
      double row_L = 0;
      double row_K = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        row_L += std::abs(composite.Lambda[3 * r + c]);
        row_K += std::abs(composite.K[3 * r + c]);
      }
      norm_L = std::max(norm_L, row_L);
      norm_K = std::max(norm_K, row_K);
    }
    // With the integral at zero, m e'' = -(m 2 Lambda + K) e' - (m Lambda^2 + 2 K Lambda) e - K Lambda^2 0 - eps(0), so
    // m s' = -K (e' + 2 Lambda e) - eps(0).
    transient.s_dot_m_s2 =
        (norm_K * (initial.velocity_m_s + 2 * norm_L * initial.position_m) + initial.learning_error_N) /
        plant.mass_kg;
    transient.rate_N_s = bounds_error && std::isfinite(source.rate_norm_N_s) ? source.rate_norm_N_s : 0;
    report.transient = transient;
    if (report.theorem.applies && bounds_error && std::isfinite(source.rate_norm_N_s)) {
      report.ball_m = source.rate_norm_N_s * report.theorem.ball_per_rate();
    }
  }
  add_assumptions(gains, source, report);
  return report;
}

}  // namespace swarmcert::stability
