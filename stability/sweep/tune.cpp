#include "stability/sweep/tune.h"

#include <nlopt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include "nn/base/doubles.h"

namespace swarmcert::stability {
namespace {

constexpr double kWorst = 1e6;  ///< replaces infinity, which optimisers cannot add

/// Settings that the optimiser rejects are a bug in this program; no input causes them.
void require(nlopt_result result) {
  if (result < 0) throw std::logic_error(std::string("NLopt: ") + nlopt_result_to_string(result));
}

constexpr std::size_t kNumConstraints = 6;

/// Returns the relative distance of the gains from being clear of a limit cycle. The 1 % margin avoids a decision by
/// round-off.
double limit_cycle_excess(const std::optional<CascadeMargins>& margins) {
  constexpr double kMore = 1.01;
  if (!margins) return -1;
  if (margins->gain == 0) return kWorst;
  return std::max(kMore * kLeastGainMargin / margins->gain - 1, kMore - margins->damping / kLeastDamping);
}

/// Relative violation of each constraint: at most 0 if satisfied.
std::array<double, kNumConstraints> excesses(const TunedPoint& p, const TuneConstraints& c) {
  const auto above = [](double value, double most) {
    if (most <= 0) return -1.0;
    return std::isfinite(value) ? std::min(value / most - 1, kWorst) : kWorst;
  };
  return {above(p.noise_m_s2, c.most_noise_m_s2),
          c.least_lag_limit_s > 0 ? 1 - p.lag_limit_s / c.least_lag_limit_s : -1.0,
          above(p.norms.rate, c.most_rate),
          above(p.effort, c.most_effort),
          limit_cycle_excess(p.margins),
          p.disturbed ? std::clamp(-p.disturbed->thrust_margin_N, -1.0, kWorst) : -1.0};
}

constexpr std::array<const char*, kNumConstraints> kConstraintNames = {"noise",  "lag_limit",   "rate",
                                                                       "effort", "limit_cycle", "thrust"};

/// Returns true if some oscillation keeps more than half of its amplitude over 10 cycles. Such a loop is no candidate,
/// and its norms are expensive.
bool rings(const AxisLoop& loop) {
  const TransferFunction y = impulse_transfer(loop, Channel::kForce);
  for (const std::complex<double>& pole : poles(sum(y.denominator, y.feedback))) {
    if (std::abs(pole.imag()) > 90 * -pole.real()) return true;
  }
  return false;
}

/// Returns the effort gain of gains with finite norms; infinite for others.
double effort_of(const SampledLoop& loop, const GainNorms& norms) {
  return std::isfinite(norms.amplitude) ? effort_gain(loop) : kInfinity;
}

/// Returns everything of evaluate_gains() but the effort, which is infinite.
TunedPoint without_effort(const SampledLoop& loop, const TuneOptions& options) {
  TunedPoint point;
  point.Kp = loop.plant.Kp;
  point.Kd = loop.plant.Kd;
  point.Ki = loop.plant.Ki;
  AxisLoop acting = loop.plant;
  acting.Ki = effective_Ki(loop);
  const bool is_candidate = spectral_radius(loop) < 1 && !rings(acting);
  point.norms = is_candidate ? sampled_norms(loop, Channel::kForce, Instants::kAll)
                             : GainNorms{kInfinity, kInfinity, kInfinity, kInfinity};
  if (options.under_disturbance)
    point.disturbed = is_candidate ? options.under_disturbance(loop) : DisturbedLoop{kInfinity, -kWorst};
  point.objective = options.objective != nullptr ? point.norms.*options.objective : point.disturbed->error_m;
  if (options.attitude) point.margins = margins_of(loop, *options.attitude);
  point.noise_m_s2 = noise_deviation(loop, 1e-3, 0.05).command_m_s2;
  point.lag_limit_s = lag_limit(acting);
  point.effort = kInfinity;
  return point;
}

class Search {
 public:
  Search(const SampledLoop& loop, const TuneOptions& options) : loop_(loop), options_(options) {}

  TunedPoint at(const double* log_gains) const {
    SampledLoop loop = loop_;
    loop.plant.Kp = std::exp(log_gains[0]);
    loop.plant.Kd = std::exp(log_gains[1]);
    loop.plant.Ki = dimension() == 3 ? std::exp(log_gains[2]) : 0;
    TunedPoint point = without_effort(loop, options_);
    if (options_.constraints.most_effort > 0) point.effort = effort_of(loop, point.norms);
    return judged(std::move(point));
  }

  bool is_cancelled() const { return options_.cancelled != nullptr && *options_.cancelled; }

  /// Two without an integrator.
  std::size_t dimension() const { return loop_.plant.Ki > 0 ? 3 : 2; }

  TunedPoint judged(TunedPoint point) const {
    const auto e = excesses(point, options_.constraints);
    point.excess = std::isfinite(point.objective) ? *std::max_element(e.begin(), e.end()) : kWorst;
    point.feasible = point.excess <= 0;
    return point;
  }

  /// Returns the point of the last evaluation, since objective and constraints request the same one in turn.
  const TunedPoint& cached(const double* x) {
    if (!std::equal(x, x + dimension(), last_.begin()) || !has_last_) {
      std::copy(x, x + dimension(), last_.begin());
      has_last_ = true;
      point_ = at(x);
      const int total = options_.global_evaluations + 3 * options_.local_evaluations;
      if (options_.progress) options_.progress(std::min(++evaluations_, total), total);
      const bool is_better = point_.feasible ? !best_.feasible || point_.objective < best_.objective
                                             : !best_.feasible && point_.excess < best_.excess;
      if (!has_best_ || is_better) {
        best_ = point_;
        best_x_ = last_;
        has_best_ = true;
      }
      if (is_cancelled() && running_ != nullptr) nlopt_force_stop(running_);
    }
    return point_;
  }

  static double cost(unsigned, const double* x, double*, void* self) {
    const double value = static_cast<Search*>(self)->cached(x).objective;
    return std::isfinite(value) ? std::log(value) : std::log(kWorst);
  }
  static void constrain(unsigned, double* result, unsigned, const double* x, double*, void* self) {
    auto* search = static_cast<Search*>(self);
    const auto e = excesses(search->cached(x), search->options_.constraints);
    std::copy(e.begin(), e.end(), result);
  }

  std::string run(nlopt_algorithm algorithm, std::array<double, 3> start, const std::array<double, 3>& low,
                  const std::array<double, 3>& high, int evaluations) {
    if (is_cancelled()) return "not run";
    const std::unique_ptr<nlopt_opt_s, decltype(&nlopt_destroy)> optimiser(
        nlopt_create(algorithm, static_cast<unsigned>(dimension())), nlopt_destroy);
    if (optimiser == nullptr) throw std::bad_alloc();
    require(nlopt_set_min_objective(optimiser.get(), cost, this));
    require(nlopt_set_lower_bounds(optimiser.get(), low.data()));
    require(nlopt_set_upper_bounds(optimiser.get(), high.data()));
    const std::array<double, kNumConstraints> tolerance{};
    require(nlopt_add_inequality_mconstraint(optimiser.get(), kNumConstraints, constrain, this,
                                             tolerance.data()));
    require(nlopt_set_maxeval(optimiser.get(), evaluations));
    require(nlopt_set_xtol_rel(optimiser.get(), 1e-7));
    double value = 0;
    running_ = optimiser.get();
    const nlopt_result result = nlopt_optimize(optimiser.get(), start.data(), &value);
    running_ = nullptr;
    return nlopt_result_to_string(result);
  }

  const TunedPoint& best() const { return best_; }
  const std::array<double, 3>& best_x() const { return best_x_; }

 private:
  SampledLoop loop_;
  TuneOptions options_;
  std::array<double, 3> last_{};
  int evaluations_ = 0;
  nlopt_opt running_ = nullptr;
  bool has_last_ = false;
  bool has_best_ = false;
  TunedPoint point_, best_;
  std::array<double, 3> best_x_{};
};

}  // namespace

TunedPoint evaluate_gains(const SampledLoop& loop, const TuneOptions& options) {
  TunedPoint point = without_effort(loop, options);
  point.effort = effort_of(loop, point.norms);
  return point;
}

CascadeMargins margins_of(const SampledLoop& loop, const Cascade& attitude) {
  Cascade cascade = attitude;
  cascade.Kp = loop.plant.Kp / attitude.ratio;
  cascade.Kd = loop.plant.Kd / attitude.ratio;
  cascade.Ki = effective_Ki(loop) / attitude.ratio;
  return cascade_margins(cascade);
}

TuneResult tune(const SampledLoop& loop, const TuneOptions& options) {
  TuneResult result;
  Search search(loop, options);
  const std::array<double, 3> given = {std::log(loop.plant.Kp), std::log(loop.plant.Kd),
                                       loop.plant.Ki > 0 ? std::log(loop.plant.Ki) : 0};
  std::array<double, 3> low = given;
  std::array<double, 3> high = given;
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] -= std::log(options.range);
    high[i] += std::log(options.range);
  }
  search.cached(given.data());
  result.shipped = search.judged(evaluate_gains(loop, options));
  const double largest_Ki = effective_Ki(loop) * options.range;
  if (options.constraints.most_rate > 0 && loop.plant.Ki > 0 &&
      1 / (loop.plant.mass_kg * largest_Ki) > options.constraints.most_rate) {
    result.infeasible = "the rate gain is at least 1/(m Ki), above the limit even at the largest Ki";
  }
  nlopt_srand(static_cast<unsigned long>(options.seed));
  const std::string global = search.run(NLOPT_GN_ISRES, given, low, high, options.global_evaluations);
  // COBYLA handles constraints by itself: start from the best point, or else from the one that violates least.
  const std::string local =
      search.run(NLOPT_LN_COBYLA, search.best_x(), low, high, options.local_evaluations);
  search.run(NLOPT_LN_COBYLA, search.best_x(), low, high, options.local_evaluations);
  search.run(NLOPT_LN_COBYLA, given, low, high, options.local_evaluations);
  result.best = search.best();
  result.stopped =
      search.is_cancelled() ? "interrupted: the best gains so far" : "global " + global + ", local " + local;
  SampledLoop tuned = loop;
  tuned.plant.Kp = result.best.Kp;
  tuned.plant.Kd = result.best.Kd;
  tuned.plant.Ki = result.best.Ki;
  result.best.effort = effort_of(tuned, result.best.norms);
  const auto e = excesses(result.best, options.constraints);
  for (std::size_t i = 0; i < e.size(); ++i) {
    if (e[i] > 0) result.violated.emplace_back(kConstraintNames[i]);
  }
  if (!result.best.feasible) return result;
  for (std::size_t i = 0; i < e.size(); ++i) {
    if (e[i] > -1e-3) result.active_constraints.emplace_back(kConstraintNames[i]);
  }
  constexpr std::array<const char*, 3> kGainNames = {"Kp", "Kd", "Ki"};
  for (std::size_t i = 0; i < search.dimension(); ++i) {
    const double x = search.best_x()[i];
    if (x < low[i] + 1e-3)
      result.active_constraints.push_back(std::string(kGainNames[i]) + " at its minimum");
    if (x > high[i] - 1e-3)
      result.active_constraints.push_back(std::string(kGainNames[i]) + " at its maximum");
  }
  return result;
}

}  // namespace swarmcert::stability
