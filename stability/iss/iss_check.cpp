#include "stability/iss/iss_check.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlopt.hpp>

#include "nn/base/parallel.h"
#include "nn/base/random.h"
#include "stability/bounds/saturation.h"
#include "stability/gains_matrices.h"
#include "stability/iss/iss_judge.h"

namespace swarmcert::stability {
namespace {

constexpr int kPieces = 80;  ///< of a worst-case input
constexpr double kTwoPi = 6.28318530717958647692;

Eigen::Vector3d random_direction(files::Random& random) {
  const double z = random.symmetric(), angle = kTwoPi * random.uniform(), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Adds a segment to a disturbance.
void append(RateDisturbance* disturbance, double until_s, const Eigen::Vector3d& rate) {
  disturbance->until_s.push_back(until_s);
  disturbance->rate_W_N_s.push_back(rate);
}

/// Candidate directions for the worst case: the axes, then random ones.
Eigen::Vector3d direction(int index, files::Random& random) {
  return index < 3 ? Eigen::Vector3d(Eigen::Vector3d::Unit(index)) : random_direction(random);
}

/// Returns the input that drives the linear loop farthest along `eta` at the end: rate(T - t) = -g(t) / |g(t)| with the
/// kernel g(t) from rate to eta' p~. By duality z' = A' z, z(0) = eta in p~, and g is the integral of B' z, since the
/// rate is integrated once before it acts.
RateDisturbance worst_linear(const IssJudge& judge, const Eigen::Vector3d& eta) {
  const LoopMatrix& a = judge.matrix();
  LoopState z = LoopState::Zero();
  z.head<3>() = eta;
  Eigen::Vector3d kernel = Eigen::Vector3d::Zero();
  constexpr int kSteps = 100;  // per piece
  const double piece_s = judge.duration_s() / kPieces, h = piece_s / kSteps;
  std::vector<Eigen::Vector3d> rates;
  for (int piece = 0; piece < kPieces; ++piece) {
    for (int step = 0; step < kSteps; ++step) {
      const LoopState k1 = a.transpose() * z, k2 = a.transpose() * (z + h / 2 * k1),
                      k3 = a.transpose() * (z + h / 2 * k2), k4 = a.transpose() * (z + h * k3);
      const LoopState next = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      kernel -= h / 2 * (z + next).segment<3>(3) / judge.mass_kg();
      z = next;
      if (step == kSteps / 2) rates.push_back(kernel);
    }
  }
  RateDisturbance disturbance;
  for (int piece = 0; piece < kPieces; ++piece) {
    Eigen::Vector3d rate = rates[static_cast<std::size_t>(kPieces - 1 - piece)];
    const double size = rate.norm();
    if (size > 0) rate *= judge.rate_N_s() / size;
    append(&disturbance, (piece + 1) * piece_s, rate);
  }
  return disturbance;
}

/// Switches at random times between +u and -u, or between random vectors of magnitude at most d_m.
RateDisturbance random_pieces(const IssJudge& judge, bool bang_bang, files::Random& random) {
  RateDisturbance disturbance;
  const Eigen::Vector3d axis = random_direction(random);
  const double mean_s = judge.duration_s() / (1 + 10 * random.uniform());
  double sign = 1;
  for (double t = 0; t < judge.duration_s();) {
    t += mean_s * -std::log(1 - random.uniform());
    const Eigen::Vector3d rate = bang_bang ? Eigen::Vector3d(sign * axis)
                                           : Eigen::Vector3d(random.uniform() * random_direction(random));
    append(&disturbance, std::min(t, judge.duration_s()), judge.rate_N_s() * rate);
    sign = -sign;
  }
  return disturbance;
}

IssRun make_run(const IssJudge& judge, int index, std::uint64_t seed) {
  files::Random random(files::Random(seed + 0x1000 + static_cast<std::uint64_t>(index)).bits());
  const int turn = index / 5;
  constexpr const char* kKinds[] = {"ramp", "worst_linear", "bang_bang", "random", "initial_state"};
  IssRun run;
  run.kind = kKinds[index % 5];
  if (run.kind == "ramp") {
    append(&run.disturbance, judge.duration_s(), judge.rate_N_s() * direction(turn, random));
  } else if (run.kind == "worst_linear") {
    run.disturbance = worst_linear(judge, direction(turn, random));
  } else {
    const bool starts_anywhere = run.kind == "initial_state";
    run.disturbance = random_pieces(judge, starts_anywhere ? turn % 2 == 0 : run.kind == "bang_bang", random);
    if (!starts_anywhere) return run;
    const double size = 0.02 * random.uniform();
    run.position_m = size * random_direction(random);
    run.velocity_m_s = 0.05 * random.uniform() * random_direction(random);
    run.disturbance.bias_W_N =
        0.05 * judge.mass_kg() * kGravity_m_s2 * random.uniform() * random_direction(random);
  }
  return run;
}

/// Maximises |p~| by NLopt from its own starting point, over the durations and directions of a few segments.
IssRun optimise(const IssJudge& judge, int evaluations, std::uint64_t seed) {
  constexpr int kFew = 5;
  files::Random random(seed);
  std::vector<double> x;
  for (int i = 0; i < kFew; ++i) {
    const Eigen::Vector3d u = random_direction(random);
    x.insert(x.end(), {0.1 + random.uniform(), std::acos(u.z()), std::atan2(u.y(), u.x())});
  }
  const auto run_of = [&judge](const std::vector<double>& parameters) {
    IssRun run;
    run.kind = "optimised";
    double total = 0;
    for (int i = 0; i < kFew; ++i) total += parameters[static_cast<std::size_t>(3 * i)];
    double until = 0;
    for (int i = 0; i < kFew; ++i) {
      const double* const piece = &parameters[static_cast<std::size_t>(3 * i)];
      until += piece[0];
      const Eigen::Vector3d u(std::sin(piece[1]) * std::cos(piece[2]),
                              std::sin(piece[1]) * std::sin(piece[2]), std::cos(piece[1]));
      append(&run.disturbance, judge.duration_s() * until / total, judge.rate_N_s() * u);
    }
    judge.judge(&run);
    return run;
  };
  IssRun best = run_of(x);
  nlopt::opt search(nlopt::LN_SBPLX, 3 * kFew);
  std::vector<double> lower, upper;
  for (int i = 0; i < kFew; ++i) {
    lower.insert(lower.end(), {0.02, -kTwoPi, -kTwoPi});
    upper.insert(upper.end(), {2, kTwoPi, kTwoPi});
  }
  search.set_lower_bounds(lower);
  search.set_upper_bounds(upper);
  search.set_maxeval(evaluations);
  struct Context {
    decltype(run_of)* run;
    IssRun* best;
  } context = {const_cast<decltype(run_of)*>(&run_of), &best};
  search.set_max_objective(
      [](const std::vector<double>& at, std::vector<double>&, void* data) {
        auto* const c = static_cast<Context*>(data);
        IssRun run = (*c->run)(at);
        const double value = run.ratio;
        if (run.is_violation > c->best->is_violation || value > c->best->ratio) *c->best = std::move(run);
        return value;
      },
      &context);
  double value = 0;
  try {
    search.optimize(x, value);
  } catch (const nlopt::roundoff_limited&) {
    // No further refinement is possible; the best run so far stands.
  }
  return best;
}

/// Returns the decay rate in 1/s of the slowest mode of the linear loop; not positive if it does not decay.
double slowest_decay(const FlownLoop& loop) { return -loop.matrix().eigenvalues().real().maxCoeff(); }

/// Returns what one would use as the ball without checking whether the theorem applies.
double naive_ball(const FlownLoop& flown) {
  const Gains& gains = flown.gains;
  if (gains.composite) {
    const auto least = [](const Matrix3& m) { return to_eigen(m).eigenvalues().real().minCoeff(); };
    const double lambda = least(gains.composite->Lambda_1_s), k = least(gains.composite->K_kg_s);
    return 1 / (lambda * lambda * k);
  }
  const double least_Ki = to_eigen(gains.pid->Ki_1_s3).minCoeff();
  return 1 / (flown.plant.mass_kg * least_Ki * flown.integral_share());
}

}  // namespace

Eigen::Vector3d RateDisturbance::at(double time_s) const {
  Eigen::Vector3d eps = bias_W_N;
  double from_s = 0;
  for (std::size_t i = 0; i < until_s.size() && from_s < time_s; ++i) {
    eps += (std::min(time_s, until_s[i]) - from_s) * rate_W_N_s[i];
    from_s = until_s[i];
  }
  return eps;
}

std::vector<std::string> IssCheck::why_inconclusive() const {
  std::vector<std::string> why;
  if (is_refuted()) return why;
  if (cancelled) why.emplace_back("the check was interrupted");
  if (!theorem_applies) why.emplace_back("no theorem supports the ball for these gains");
  std::map<std::string, std::pair<int, double>> by_hypothesis;  // runs, earliest time
  for (const IssRun& run : runs) {
    if (run.left.empty()) continue;
    auto& [count, earliest_s] = by_hypothesis.try_emplace(run.left, 0, run.left_at_s).first->second;
    ++count;
    earliest_s = std::min(earliest_s, run.left_at_s);
  }
  const std::string total = std::to_string(runs.size());
  for (const auto& [hypothesis, found] : by_hypothesis) {
    why.push_back("in " + std::to_string(found.first) + " of " + total + " runs " + hypothesis +
                  ", first after " + decimals(found.second) + " s");
  }
  if (failed > 0)
    why.push_back("the integration failed in " + std::to_string(failed) + " of " + total + " runs");
  return why;
}

IssCheck check_iss(const FlownLoop& flown, const IssOptions& options) {
  IssCheck check;
  const Theorem theorem = check_theorem(flown, std::nullopt);
  check.theorem_applies = theorem.applies;
  check.why_not = theorem.why_not;
  check.delay_left_out_s = flown.gains.delay_s;
  check.has_ball = theorem.composite.has_value();
  const double decay_1_s = slowest_decay(flown);
  check.unstable = !(decay_1_s > 1e-9);
  // After 14 time constants even a triple pole has settled to 1e-4.
  check.duration_s = check.unstable ? 20 : std::clamp(14 / decay_1_s, 0.1, 200.0);
  check.rate_N_s =
      options.rate_N_s > 0 ? options.rate_N_s : 0.2 * flown.plant.mass_kg * kGravity_m_s2 / check.duration_s;
  double ball_m_per_N_s = check.has_ball ? theorem.ball_per_rate() : naive_ball(flown);
  if (!(ball_m_per_N_s > 0 && std::isfinite(ball_m_per_N_s))) ball_m_per_N_s = 1;  // Ki = 0: no ball at all
  check.ball_m = std::min(check.rate_N_s * ball_m_per_N_s, std::numeric_limits<double>::max());

  const IssJudge judge(flown, check, theorem);
  // A fifth of the runs is used by optimisers, with kEvaluations runs each.
  constexpr int kEvaluations = 40;
  const int searches = options.runs / (5 * kEvaluations);
  const int plain = std::max(options.runs - searches * kEvaluations, 1);
  std::vector<IssRun> runs(static_cast<std::size_t>(plain + searches));
  std::vector<char> done(runs.size(), 0);
  std::atomic<int> finished{0};
  files::parallel_for(static_cast<int>(runs.size()), options.jobs, [&](int i) {
    if (options.cancelled != nullptr && options.cancelled->load()) return;
    IssRun& run = runs[static_cast<std::size_t>(i)];
    if (i < plain) {
      run = make_run(judge, i, options.seed);
      judge.judge(&run);
    } else {
      run = optimise(judge, kEvaluations, options.seed + 0x100000 + static_cast<std::uint64_t>(i));
    }
    done[static_cast<std::size_t>(i)] = 1;
    if (options.progress) options.progress(++finished, static_cast<int>(runs.size()));
  });
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (done[i] == 0) {
      check.cancelled = true;
      continue;
    }
    check.runs.push_back(std::move(runs[i]));
    const IssRun& run = check.runs.back();
    check.violations += run.is_violation ? 1 : 0;
    check.left += run.left.empty() ? 0 : 1;
    check.failed += run.failure.empty() ? 0 : 1;
    check.worst_transient_ratio = std::max(check.worst_transient_ratio, run.transient_ratio);
    if (check.worst < 0 || run.ratio > check.worst_ratio) {
      check.worst_ratio = run.ratio;
      check.worst = static_cast<int>(check.runs.size()) - 1;
    }
  }
  return check;
}

}  // namespace swarmcert::stability
