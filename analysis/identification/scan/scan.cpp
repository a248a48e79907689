#include "analysis/identification/scan/scan.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/identification/scan/abscissa.h"
#include "analysis/identification/scan/periods.h"
#include "analysis/residuals/statistics.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

constexpr double kScanQuantile90 = 1.6449;  // two-sided 90 % of the normal distribution
constexpr double kLeastShare = 0.02;        // smaller ones are of no use, accident or not
constexpr int kFlips = 20;                  // draws of the chunks' signs
constexpr Eigen::Index kManySamples = 40'000;
constexpr const char* kAxes[] = {"x", "y", "z"};

/// What is judged: the remainder about its mean, and its errors without any curve.
struct Judged {
  const ScanSamples& samples;
  Chunks chunks;
  Columns targets;             ///< [samples x 6]
  Eigen::MatrixXd none;        ///< [chunks x 6]: errors of the constant alone
  double total = 0;            ///< of the vector
  Eigen::MatrixXd body_total;  ///< [chunks x 3]: errors of a constant along the body's axes

  /// A vector of the world along the body's axes, sample by sample.
  Columns turned(const Eigen::RowVector3f& of_world) const {
    Columns result(samples.size(), 3);
    for (int axis = 0; axis < 3; ++axis)
      result.col(axis) = samples.axes.middleCols(3 * axis, 3) * of_world.transpose();
    return result;
  }

  Judged(const ScanSamples& of, Columns values)
      : samples(of), chunks(chunks_of(of)), targets(std::move(values)) {
    none = chunk_errors(targets, mean_predictions(targets, chunks), chunks);
    // Along the body's axes a constant is one of the body or one of the world, whichever leaves less.
    const Eigen::MatrixXd of_world =
        chunk_errors(targets.rightCols(3), turned(targets.leftCols(3).colwise().mean()), chunks);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (of_world.col(axis).sum() < none.col(3 + axis).sum()) none.col(3 + axis) = of_world.col(axis);
    }
    body_total = chunk_errors(targets.rightCols(3), mean_predictions(targets.rightCols(3), chunks), chunks);
    total = std::max(none.leftCols(3).sum(), 1e-300);
  }
};

/// Shares of the six components that a curve explains.
Eigen::VectorXd shares_of(const Judged& judged, CurveFit& fit) {
  fit.fit(judged.targets);
  const Eigen::MatrixXd errors = chunk_errors(judged.targets, fit.predictions(), judged.chunks);
  return (judged.none - errors).colwise().sum().transpose() / judged.total;
}

/// The number of knots that explains most, for one component.
struct Best {
  double share = -1;
  int knots = 0;
};

using BestOfComponents = std::array<Best, 6>;

BestOfComponents best_curves(const Judged& judged, const Abscissa& abscissa) {
  BestOfComponents best;
  for (const int knots : abscissa.knots) {
    const Curve curve = curve_over(judged.samples, abscissa, knots);
    if (curve.columns == 0) continue;
    CurveFit fit(curve.rows, curve.columns, judged.chunks);
    const Eigen::VectorXd shares = shares_of(judged, fit);
    for (std::size_t k = 0; k < 6; ++k) {
      if (!(k < 3 ? abscissa.in_world : abscissa.in_body)) continue;
      const double share = shares[static_cast<Eigen::Index>(k)];
      if (share > best[k].share) best[k] = {share, knots};
    }
  }
  return best;
}

/// The targets about their mean, with the sign of each chunk drawn.
Columns flipped(const Columns& targets, const Chunks& chunks, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::vector<float> sign;
  for (int c = 0; c < chunks.count(); ++c) sign.push_back((generator() & 1) != 0 ? 1.0F : -1.0F);
  const Eigen::RowVectorXf mean = targets.colwise().mean();
  Columns result = targets.rowwise() - mean;
  for (Eigen::Index i = 0; i < result.rows(); ++i)
    result.row(i) *= sign[static_cast<std::size_t>(chunks.of_sample[static_cast<std::size_t>(i)])];
  return result;
}

/// What the largest share is by accident: three standard deviations above its mean over draws of signs.
double accidental_share(const ScanSamples& all, const std::vector<Abscissa>& tried, int jobs) {
  const ScanSamples samples = thinned(all, kManySamples);
  std::vector<Judged> draws;
  for (int d = 0; d < kFlips; ++d) {
    const Chunks chunks = chunks_of(samples);
    draws.emplace_back(samples, flipped(samples.force_N, chunks, 1 + static_cast<std::uint64_t>(d)));
  }
  std::vector<std::vector<double>> largest(tried.size(), std::vector<double>(kFlips, 0));
  files::parallel_for(static_cast<int>(tried.size()), jobs, [&](int a) {
    const Abscissa& abscissa = tried[static_cast<std::size_t>(a)];
    for (const int knots : abscissa.knots) {
      const Curve curve = curve_over(samples, abscissa, knots);
      if (curve.columns == 0) continue;
      CurveFit fit(curve.rows, curve.columns, draws[0].chunks);
      for (std::size_t d = 0; d < kFlips; ++d) {
        const Eigen::VectorXd shares = shares_of(draws[d], fit);
        double& most = largest[static_cast<std::size_t>(a)][d];
        for (Eigen::Index k = 0; k < 6; ++k) {
          if (k < 3 ? abscissa.in_world : abscissa.in_body) most = std::max(most, shares[k]);
        }
      }
    }
  });
  double sum = 0, squares = 0;
  for (std::size_t d = 0; d < kFlips; ++d) {
    double most = 0;
    for (const auto& of_abscissa : largest) most = std::max(most, of_abscissa[d]);
    sum += most;
    squares += most * most;
  }
  const double mean = sum / kFlips;
  return mean + 3 * std::sqrt(std::max(squares / kFlips - mean * mean, 0.0));
}

Interval resampled(const Eigen::VectorXd& gains, const std::vector<int>& group, int groups, double total) {
  std::vector<double> of_group(static_cast<std::size_t>(groups), 0);
  for (std::size_t c = 0; c < group.size(); ++c)
    of_group[static_cast<std::size_t>(group[c])] += gains[static_cast<Eigen::Index>(c)];
  std::mt19937_64 generator(1);
  std::vector<double> shares;
  for (int draw = 0; draw < 400; ++draw) {
    double sum = 0;
    for (int g = 0; g < groups; ++g) sum += of_group[generator() % static_cast<std::size_t>(groups)];
    shares.push_back(sum / total);
  }
  return {residuals::quantile(shares, 0.05), residuals::quantile(shares, 0.95)};
}

/// 90 % interval of a share: flights are resampled where there are five, else chunks.
Interval share_interval(const Judged& judged, const Eigen::VectorXd& gains) {
  constexpr int kFewestFlights = 5;
  if (judged.samples.flights >= kFewestFlights)
    return resampled(gains, judged.chunks.flight, judged.samples.flights, judged.total);
  std::vector<int> each;
  for (int c = 0; c < judged.chunks.count(); ++c) each.push_back(c);
  return resampled(gains, each, judged.chunks.count(), judged.total);
}

/// Slope of the remainder over the curve f(v), with the instrument f(v as commanded).
InstrumentedValue slope_of(const Judged& judged, int column, const Columns& curve, const Columns& commanded) {
  const Columns constant = mean_predictions(judged.targets.col(column), judged.chunks);
  const double mean_p = curve.mean(), mean_q = commanded.mean();
  Eigen::VectorXd qp = Eigen::VectorXd::Zero(judged.chunks.count()), qr = qp;
  for (Eigen::Index i = 0; i < curve.rows(); ++i) {
    const int c = judged.chunks.of_sample[static_cast<std::size_t>(i)];
    const double q = commanded(i, 0) - mean_q;
    qp[c] += q * (curve(i, 0) - mean_p);
    qr[c] += q * (judged.targets(i, column) - constant(i, 0));
  }
  InstrumentedValue slope;
  slope.least_squares = 1;
  const double information = qp.sum();
  if (!(information > 0)) {
    slope.interval = {-INFINITY, INFINITY};
    return slope;
  }
  slope.instrument = qr.sum() / information;
  const Eigen::VectorXd influence = (qr - slope.instrument * qp) / information;
  const double half = kScanQuantile90 * influence.norm();
  slope.interval = {slope.instrument - half, slope.instrument + half};
  slope.difference_z = half > 0 ? (slope.instrument - 1) * kScanQuantile90 / half : 0;
  return slope;
}

/// How much of a curve counts: an answer of the controller only what set points confirm, a motion all of it unless
/// they clearly say less.
double counted_slope(const ScanEntry& entry, bool is_answer) {
  constexpr double kStrong = 0.5;  // half width of the interval
  const bool is_strong =
      entry.is_checked && entry.slope.interval.second - entry.slope.interval.first < 2 * kStrong;
  if (is_answer) return is_strong ? std::clamp(entry.slope.instrument, 0.0, 1.0) : 0;
  return is_strong ? std::clamp(entry.slope.interval.second, 0.0, 1.0) : 1;
}

void set_curve(const CurveFit& fit, const Curve& curve, int component, ScanEntry& entry) {
  const Eigen::VectorXd all = fit.coefficients(Chunks::kFolds).col(component);
  const Eigen::VectorXd count = fit.samples_at_columns();
  const double constant = all[all.size() - 1];
  const std::size_t width = curve.knots.size() == 2 ? curve.knots[1].size() : 1;
  for (int k = 0; k < curve.columns; ++k) {
    if (count[k] < 1) continue;  // nothing was flown there
    CurvePoint point;
    const auto at = static_cast<std::size_t>(k);
    point.at = width == 1 ? std::vector<double>{curve.knots[0][at]}
                          : std::vector<double>{curve.knots[0][at / width], curve.knots[1][at % width]};
    point.force_N = all[k] + constant;
    double squares = 0;
    for (int f = 0; f < Chunks::kFolds; ++f) {
      const Eigen::MatrixXd& c = fit.coefficients(f);
      const double gap = c(k, component) + c(c.rows() - 1, component) - point.force_N;
      squares += gap * gap;
    }
    const double half = kScanQuantile90 * std::sqrt(squares * (Chunks::kFolds - 1) / Chunks::kFolds);
    point.interval = {point.force_N - half, point.force_N + half};
    entry.curve.push_back(std::move(point));
  }
}

ScanEntry entry_of(const Judged& judged, const Abscissa& abscissa, int component, int knots) {
  const Curve curve = curve_over(judged.samples, abscissa, knots);
  CurveFit fit(curve.rows, curve.columns, judged.chunks);
  fit.fit(judged.targets);
  const Columns predictions = fit.predictions().col(component);
  ScanEntry entry;
  entry.variable = abscissa.name;
  entry.frame = component < 3 ? "world" : "body";
  entry.axis = kAxes[component % 3];
  entry.variables = abscissa.variables;
  entry.column = component;
  entry.lag_s = abscissa.lag * NeighbourPlaces::kLag_s;
  if (!curve.commanded.empty()) {
    entry.is_checked = true;
    entry.slope = slope_of(judged, component, predictions, fit.predictions(curve.commanded).col(component));
  } else {
    entry.slope = {1, 1, {1, 1}, 0};
  }
  const Columns target = judged.targets.col(component);
  const Eigen::VectorXd gains =
      judged.none.col(component) - chunk_errors(target, predictions, judged.chunks).col(0);
  entry.uncorrected_share = gains.sum() / judged.total;
  const double beta = counted_slope(entry, abscissa.is_answer);
  const double counts = beta * (2 - beta);
  entry.share = counts * entry.uncorrected_share;
  const Interval interval = share_interval(judged, gains);
  entry.share_interval = {counts * interval.first, counts * interval.second};
  set_curve(fit, curve, component, entry);
  return entry;
}

void set_errors(const Judged& judged, ScanEntry& entry) {
  const double before = judged.samples.mean_square_N2;
  // A curve holds the mean of its component as well.
  const double mean = judged.targets.col(entry.column).mean();
  const double explained =
      mean * mean + entry.share * judged.total / static_cast<double>(judged.samples.size());
  entry.rmse_before_N = std::sqrt(before);
  entry.rmse_after_N = std::sqrt(std::max(before - explained, 0.0));
}

/// A constant along the body's axes, beside a constant along the world's.
void add_body_constant(const Judged& judged, double least, std::vector<ScanEntry>& entries) {
  const double body = judged.body_total.sum();
  ScanEntry entry;
  entry.share = entry.uncorrected_share = (judged.total - body) / judged.total;
  if (entry.share < least) return;
  const Eigen::RowVector3f mean = judged.targets.rightCols(3).colwise().mean();
  int axis = 0;
  mean.cwiseAbs().maxCoeff(&axis);
  entry.variable = "body_constant";
  entry.frame = "body";
  entry.axis = kAxes[axis];
  entry.column = 3 + axis;
  entry.slope = {1, 1, {1, 1}, 0};
  entry.share_interval =
      share_interval(judged, judged.none.leftCols(3).rowwise().sum() - judged.body_total.rowwise().sum());
  entry.curve.push_back({{}, mean[axis], {mean[axis], mean[axis]}});
  entries.push_back(std::move(entry));
}

/// Of neighbours at several lags only the one that explains most.
void keep_best_lags(std::vector<ScanEntry>& entries) {
  std::vector<ScanEntry> kept;
  for (ScanEntry& entry : entries) {
    const auto same = std::find_if(kept.begin(), kept.end(), [&](const ScanEntry& other) {
      return entry.variable == "neighbour" && other.variable == "neighbour" && other.axis == entry.axis;
    });
    if (same == kept.end())
      kept.push_back(std::move(entry));
    else if (entry.share > same->share)
      *same = std::move(entry);
  }
  entries = std::move(kept);
}

/// Best first. What vehicles do comes before what they were asked to do, and before single rotors, where both explain
/// about as much.
void sort_entries(std::vector<ScanEntry>& entries) {
  constexpr double kAlike = 0.95;
  const auto weight = [](const ScanEntry& entry) {
    const bool is_proxy = entry.variable.rfind("set_point", 0) == 0 || entry.variable.rfind("duty", 0) == 0;
    return (is_proxy ? kAlike : 1) * entry.share;
  };
  std::stable_sort(entries.begin(), entries.end(),
                   [&](const ScanEntry& a, const ScanEntry& b) { return weight(a) > weight(b); });
}

}  // namespace

Scan scan(const ScanSamples& samples, int jobs) {
  constexpr double kBodyBetter = 1.05;  // the world's axes, unless the body's explain more by so much
  Scan result;
  if (samples.blocks < static_cast<int>(kFewestBlocks)) return result;
  const Judged judged(samples, samples.force_N);
  const std::vector<Abscissa> tried = abscissas(samples);
  for (const Abscissa& a : tried) result.tried += 3 * (int{a.in_world} + int{a.in_body});
  result.least_share = std::max(kLeastShare, accidental_share(samples, tried, jobs));
  std::vector<std::vector<ScanEntry>> found(tried.size());
  files::parallel_for(static_cast<int>(tried.size()), jobs, [&](int a) {
    const Abscissa& abscissa = tried[static_cast<std::size_t>(a)];
    const BestOfComponents best = best_curves(judged, abscissa);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool body = best[3 + axis].share > kBodyBetter * std::max(best[axis].share, 0.0);
      const std::size_t k = body ? 3 + axis : axis;
      if (best[k].share < result.least_share) continue;
      ScanEntry entry = entry_of(judged, abscissa, static_cast<int>(k), best[k].knots);
      if (entry.share >= result.least_share) found[static_cast<std::size_t>(a)].push_back(std::move(entry));
    }
  });
  for (auto& entries : found) {
    for (ScanEntry& entry : entries) result.entries.push_back(std::move(entry));
  }
  add_body_constant(judged, result.least_share, result.entries);
  add_periods(samples, judged.chunks, result);
  keep_best_lags(result.entries);
  for (ScanEntry& entry : result.entries) set_errors(judged, entry);
  sort_entries(result.entries);
  return result;
}

}  // namespace swarmcert::identification
