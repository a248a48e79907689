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
constexpr double kLeastShare = 0.02;        // smaller ones are irrelevant even if significant
constexpr int kFlips = 20;                  // number of random sign draws
constexpr Eigen::Index kManySamples = 40'000;

bool is_offered(const Abscissa& abscissa, const ScanColumn& column) {
  if (column.frame[0] == 'n') return abscissa.variables.empty() && abscissa.lag == 0;
  return column.frame[0] == 'w' ? abscissa.in_world : abscissa.in_body;
}

/// The quantity being judged: the remainder about its mean, and its errors without any curve.
struct Judged {
  const ScanSamples& samples;
  Chunks chunks;
  Columns targets;             ///< [samples x columns]
  Eigen::MatrixXd none;        ///< [chunks x columns]: errors of the constant alone
  Eigen::VectorXd totals;      ///< denominators of the shares of each column: see ScanEntry::share
  Eigen::MatrixXd body_total;  ///< [chunks x 3]: errors of a constant along the body axes, for forces

  /// Returns a world vector along the body axes, sample by sample.
  Columns turned(const Eigen::RowVector3f& of_world) const {
    Columns result(samples.size(), 3);
    for (int axis = 0; axis < 3; ++axis)
      result.col(axis) = samples.axes.middleCols(3 * axis, 3) * of_world.transpose();
    return result;
  }

  const std::vector<ScanColumn>& columns() const { return scan_columns(samples.quantity); }

  Judged(const ScanSamples& of, Columns values)
      : samples(of), chunks(chunks_of(of)), targets(std::move(values)) {
    none = chunk_errors(targets, mean_predictions(targets, chunks), chunks);
    if (samples.quantity == ScanQuantity::kForce) prefer_constants();
    totals = none.colwise().sum().transpose();
    if (samples.quantity == ScanQuantity::kForce)
      totals.setConstant(totals.head<3>().sum());
    else
      totals.tail<4>().setConstant(totals.tail<4>().sum());
    totals = totals.cwiseMax(1e-300);
  }

 private:
  void prefer_constants() {
    // Along the body axes a constant is constant in the body or in the world, whichever leaves less.
    const Eigen::MatrixXd of_world =
        chunk_errors(targets.middleCols(3, 3), turned(targets.leftCols(3).colwise().mean()), chunks);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (of_world.col(axis).sum() < none.col(3 + axis).sum()) none.col(3 + axis) = of_world.col(axis);
    }
    body_total =
        chunk_errors(targets.middleCols(3, 3), mean_predictions(targets.middleCols(3, 3), chunks), chunks);
    // A constant pull of neighbours is part of the curve.
    const Columns pull = targets.col(kTowardColumn);
    none.col(kTowardColumn) = chunk_errors(pull, Columns::Zero(pull.rows(), 1), chunks);
  }
};

/// Returns the shares of the columns explained by a curve.
Eigen::VectorXd shares_of(const Judged& judged, CurveFit& fit) {
  fit.fit(judged.targets);
  const Eigen::MatrixXd errors = chunk_errors(judged.targets, fit.predictions(), judged.chunks);
  return (judged.none - errors).colwise().sum().transpose().cwiseQuotient(judged.totals);
}

/// The best number of knots for one component.
struct Best {
  double share = -1;
  int knots = 0;
};

using BestOfColumns = std::vector<Best>;

BestOfColumns best_curves(const Judged& judged, const Abscissa& abscissa) {
  const std::vector<ScanColumn>& columns = judged.columns();
  BestOfColumns best(columns.size());
  for (const int knots : abscissa.knots) {
    const Curve curve = curve_over(judged.samples, abscissa, knots);
    if (curve.columns == 0) continue;
    CurveFit fit(curve.rows, curve.columns, judged.chunks);
    const Eigen::VectorXd shares = shares_of(judged, fit);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (!is_offered(abscissa, columns[k])) continue;
      const double share = shares[static_cast<Eigen::Index>(k)];
      if (share > best[k].share) best[k] = {share, knots};
    }
  }
  return best;
}

/// Returns 1 or -1 for each draw and chunk.
Eigen::MatrixXd drawn_signs(const Chunks& chunks) {
  Eigen::MatrixXd signs(kFlips, chunks.count());
  for (Eigen::Index d = 0; d < kFlips; ++d) {
    std::mt19937_64 generator(1 + static_cast<std::uint64_t>(d));
    for (Eigen::Index c = 0; c < signs.cols(); ++c) signs(d, c) = (generator() & 1) != 0 ? 1 : -1;
  }
  return signs;
}

/// Returns `targets` multiplied by the sign of each chunk.
Columns flipped(const Columns& targets, const Chunks& chunks, const Eigen::RowVectorXd& signs) {
  Columns result = targets;
  for (Eigen::Index i = 0; i < result.rows(); ++i)
    result.row(i) *= static_cast<float>(signs[chunks.of_sample[static_cast<std::size_t>(i)]]);
  return result;
}

/// Statistics of the largest share under random signs.
struct Accidents {
  double mean = 0, deviation = 0;
};

Accidents accidental_share(const ScanSamples& all, const std::vector<Abscissa>& tried, int jobs) {
  const ScanSamples samples = thinned(all, kManySamples);
  const Chunks chunks = chunks_of(samples);
  const Eigen::MatrixXd signs = drawn_signs(chunks);
  const Columns about_mean = samples.residual.rowwise() - samples.residual.colwise().mean();
  const std::vector<ScanColumn>& columns = scan_columns(samples.quantity);
  Eigen::MatrixXd none(kFlips, about_mean.cols()), totals = none;
  for (Eigen::Index d = 0; d < kFlips; ++d) {
    const Judged judged(samples, flipped(about_mean, chunks, signs.row(d)));
    none.row(d) = judged.none.colwise().sum();
    totals.row(d) = judged.totals;
  }
  std::vector<std::vector<double>> largest(tried.size(), std::vector<double>(kFlips, 0));
  files::parallel_for(static_cast<int>(tried.size()), jobs, [&](int a) {
    const Abscissa& abscissa = tried[static_cast<std::size_t>(a)];
    for (const int knots : abscissa.knots) {
      const Curve curve = curve_over(samples, abscissa, knots);
      if (curve.columns == 0) continue;
      const CurveFit fit(curve.rows, curve.columns, chunks);
      const Eigen::MatrixXd shares = (none - fit.errors_of_flipped(about_mean, signs)).cwiseQuotient(totals);
      for (std::size_t d = 0; d < kFlips; ++d) {
        double& most = largest[static_cast<std::size_t>(a)][d];
        for (std::size_t k = 0; k < columns.size(); ++k) {
          if (is_offered(abscissa, columns[k]))
            most = std::max(most, shares(static_cast<Eigen::Index>(d), static_cast<Eigen::Index>(k)));
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
  return {mean, std::sqrt(std::max(squares / kFlips - mean * mean, 0.0))};
}

/// Returns the smallest share that is reported.
double least_share_of(const Accidents& accidents, Judges judges) {
  constexpr double kHalf = 0.5;
  const double sure = accidents.mean + 3 * accidents.deviation;
  const double least = judges == Judges::kThisScan ? sure : std::min(sure, std::max(accidents.mean, kHalf));
  return std::max(kLeastShare, least);
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

/// Returns the 90 % interval of a share by resampling flights if there are at least five, else chunks.
Interval share_interval(const Judged& judged, const Eigen::VectorXd& gains, double total) {
  constexpr int kFewestFlights = 5;
  if (judged.samples.flights >= kFewestFlights)
    return resampled(gains, judged.chunks.flight, judged.samples.flights, total);
  std::vector<int> each;
  for (int c = 0; c < judged.chunks.count(); ++c) each.push_back(c);
  return resampled(gains, each, judged.chunks.count(), total);
}

/// Returns the slope of the remainder over the curve f(v), with the instrument f(v as commanded).
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

/// Returns the fraction of a curve that counts: for the controller's reaction only what setpoints confirm, for a motion
/// all of it unless setpoints clearly give less.
double counted_slope(const ScanEntry& entry, bool is_answer) {
  constexpr double kStrong = 0.5;  // half-width of the interval
  const bool is_strong =
      entry.is_checked && entry.slope.interval.upper - entry.slope.interval.lower < 2 * kStrong;
  if (is_answer) return is_strong ? std::clamp(entry.slope.instrument, 0.0, 1.0) : 0;
  return is_strong ? std::clamp(entry.slope.interval.upper, 0.0, 1.0) : 1;
}

void set_curve(const CurveFit& fit, const Curve& curve, int component, ScanEntry& entry) {
  const Eigen::VectorXd all = fit.coefficients(Chunks::kFolds).col(component);
  const Eigen::VectorXd count = fit.samples_at_columns();
  const double constant = all[all.size() - 1];
  const std::size_t width = curve.knots.size() == 2 ? curve.knots[1].size() : 1;
  for (int k = 0; k < curve.columns; ++k) {
    if (count[k] < 1) continue;  // no samples there
    CurvePoint point;
    const auto at = static_cast<std::size_t>(k);
    point.at = width == 1 ? std::vector<double>{curve.knots[0][at]}
                          : std::vector<double>{curve.knots[0][at / width], curve.knots[1][at % width]};
    point.value = all[k] + constant;
    double squares = 0;
    for (int f = 0; f < Chunks::kFolds; ++f) {
      const Eigen::MatrixXd& c = fit.coefficients(f);
      const double gap = c(k, component) + c(c.rows() - 1, component) - point.value;
      squares += gap * gap;
    }
    const double half = kScanQuantile90 * std::sqrt(squares * (Chunks::kFolds - 1) / Chunks::kFolds);
    point.interval = {point.value - half, point.value + half};
    entry.curve.push_back(std::move(point));
  }
}

void set_column(const Judged& judged, int component, ScanEntry& entry) {
  const ScanColumn& column = judged.columns()[static_cast<std::size_t>(component)];
  entry.quantity = column.quantity;
  entry.frame = column.frame;
  entry.axis = column.axis;
  entry.unit = column.unit;
  entry.column = component;
}

ScanEntry entry_of(const Judged& judged, const Abscissa& abscissa, int component, int knots) {
  const Curve curve = curve_over(judged.samples, abscissa, knots);
  CurveFit fit(curve.rows, curve.columns, judged.chunks);
  fit.fit(judged.targets);
  const Columns predictions = fit.predictions().col(component);
  ScanEntry entry;
  entry.variable = abscissa.name;
  set_column(judged, component, entry);
  entry.variables = abscissa.variables;
  entry.lag_s = abscissa.lag * NeighbourPlaces::kLag_s;
  entry.over_ground = abscissa.over_ground;
  if (!curve.commanded.empty()) {
    entry.is_checked = true;
    entry.slope = slope_of(judged, component, predictions, fit.predictions(curve.commanded).col(component));
  } else {
    entry.slope = {1, 1, {1, 1}, 0};
  }
  const Columns target = judged.targets.col(component);
  const Eigen::VectorXd gains =
      judged.none.col(component) - chunk_errors(target, predictions, judged.chunks).col(0);
  const double total = judged.totals[component];
  entry.uncorrected_share = gains.sum() / total;
  const double beta = counted_slope(entry, abscissa.is_answer);
  const double counts = beta * (2 - beta);
  entry.share = counts * entry.uncorrected_share;
  const Interval interval = share_interval(judged, gains, total);
  entry.share_interval = {counts * interval.lower, counts * interval.upper};
  set_curve(fit, curve, component, entry);
  return entry;
}

void set_errors(const Judged& judged, ScanEntry& entry) {
  const auto column = judged.targets.col(entry.column).cast<double>();
  const double before = judged.samples.quantity == ScanQuantity::kForce
                            ? judged.samples.mean_square_N2
                            : column.squaredNorm() / static_cast<double>(column.size());
  // A curve includes the mean of its component; for a pull the share includes it.
  const bool is_pull = entry.frame == "neighbour";
  const double mean = is_pull ? 0.0 : static_cast<double>(column.mean());
  const double explained =
      mean * mean + entry.share * judged.totals[entry.column] / static_cast<double>(judged.samples.size());
  entry.rmse_before = std::sqrt(before);
  entry.rmse_after = std::sqrt(std::max(before - explained, 0.0));
}

/// Adds a constant along the body axes, beside a constant along the world axes.
void add_body_constant(const Judged& judged, double least, std::vector<ScanEntry>& entries) {
  const double body = judged.body_total.sum();
  ScanEntry entry;
  entry.share = entry.uncorrected_share = (judged.totals[0] - body) / judged.totals[0];
  if (entry.share < least) return;
  const Eigen::RowVector3f mean = judged.targets.middleCols(3, 3).colwise().mean();
  int axis = 0;
  mean.cwiseAbs().maxCoeff(&axis);
  entry.variable = "body_constant";
  set_column(judged, 3 + axis, entry);
  entry.slope = {1, 1, {1, 1}, 0};
  entry.share_interval = share_interval(
      judged, judged.none.leftCols(3).rowwise().sum() - judged.body_total.rowwise().sum(), judged.totals[0]);
  entry.curve.push_back({{}, mean[axis], {mean[axis], mean[axis]}});
  entries.push_back(std::move(entry));
}

/// Keeps, of the entries of neighbours at several lags, relative or absolute, only the one that explains most.
void keep_best_lags(std::vector<ScanEntry>& entries) {
  std::vector<ScanEntry> kept;
  for (ScanEntry& entry : entries) {
    const auto same = std::find_if(kept.begin(), kept.end(), [&](const ScanEntry& other) {
      return entry.variable.rfind("neighbour", 0) == 0 && other.variable == entry.variable &&
             other.axis == entry.axis;
    });
    if (same == kept.end())
      kept.push_back(std::move(entry));
    else if (entry.share > same->share)
      *same = std::move(entry);
  }
  entries = std::move(kept);
}

/// For each variable, replaces torques that a single rotor explains by that rotor.
void prefer_rotor(std::vector<ScanEntry>& entries) {
  constexpr double kLeastOfTorque = 0.5;
  const auto is_rotor = [](const ScanEntry& entry) { return entry.quantity == "rotor_force"; };
  const auto rotor = std::find_if(entries.begin(), entries.end(), is_rotor);
  if (rotor == entries.end()) return;
  double torque = 0;
  for (const ScanEntry& entry : entries) torque = is_rotor(entry) ? torque : std::max(torque, entry.share);
  const bool keeps_rotor = rotor->share >= kLeastOfTorque * torque;
  entries.erase(std::remove_if(entries.begin(), entries.end(),
                               [&](const ScanEntry& entry) { return is_rotor(entry) != keeps_rotor; }),
                entries.end());
}

/// Sorts the entries, best first. If several explain about as much, the motion of the vehicle comes before its
/// setpoints, the motion of neighbours and the duties of rotors; a rotor's own duty precedes other thrust variables.
void sort_entries(std::vector<ScanEntry>& entries) {
  constexpr double kAlike = 0.95;
  const auto weight = [](const ScanEntry& entry) {
    const bool is_duty = entry.variable.rfind("duty", 0) == 0;
    const bool is_own =
        is_duty && entry.quantity == "rotor_force" && entry.variable.back() == entry.axis.back();
    const bool is_proxy = entry.variable.rfind("set_point", 0) == 0 || (is_duty && !is_own) ||
                          entry.variable.rfind("neighbour_v", 0) == 0 ||
                          (entry.quantity == "rotor_force" && entry.variable == "thrust");
    return (is_proxy ? kAlike : 1) * entry.share;
  };
  std::stable_sort(entries.begin(), entries.end(),
                   [&](const ScanEntry& a, const ScanEntry& b) { return weight(a) > weight(b); });
}

/// Returns the better of the world and body axes for forces; otherwise all columns, but rotors only if they stand out.
std::vector<std::size_t> judged_columns(ScanQuantity quantity, const BestOfColumns& best) {
  constexpr double kBodyBetter = 1.05;  // factor by which the body axes must be better than the world axes
  constexpr double kMostOfOthers = 0.5;
  constexpr std::size_t kAxes = 3;
  std::vector<std::size_t> columns;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const bool body = quantity == ScanQuantity::kForce &&
                      best[kAxes + axis].share > kBodyBetter * std::max(best[axis].share, 0.0);
    columns.push_back(body ? kAxes + axis : axis);
  }
  if (quantity == ScanQuantity::kForce) {
    columns.push_back(kTowardColumn);
    return columns;
  }
  for (std::size_t rotor = kAxes; rotor < best.size(); ++rotor) {
    double others = 0;
    for (std::size_t k = kAxes; k < best.size(); ++k)
      others = k == rotor ? others : std::max(others, best[k].share);
    if (others < kMostOfOthers * best[rotor].share) columns.push_back(rotor);
  }
  return columns;
}

}  // namespace

Scan scan(const ScanSamples& samples, int jobs, Judges judges) {
  Scan result;
  if (samples.blocks < static_cast<int>(kFewestBlocks)) return result;
  const Judged judged(samples, samples.residual);
  const std::vector<Abscissa> tried = abscissas(samples);
  for (const Abscissa& a : tried) {
    for (const ScanColumn& column : judged.columns()) result.tried += is_offered(a, column) ? 1 : 0;
  }
  result.least_share = least_share_of(accidental_share(samples, tried, jobs), judges);
  std::vector<std::vector<ScanEntry>> found(tried.size());
  files::parallel_for(static_cast<int>(tried.size()), jobs, [&](int a) {
    const Abscissa& abscissa = tried[static_cast<std::size_t>(a)];
    const BestOfColumns best = best_curves(judged, abscissa);
    for (const std::size_t k : judged_columns(samples.quantity, best)) {
      if (best[k].share < result.least_share) continue;
      ScanEntry entry = entry_of(judged, abscissa, static_cast<int>(k), best[k].knots);
      // A result carried by only a few flights or chunks is not general.
      if (entry.share >= result.least_share && entry.share_interval.lower > 0)
        found[static_cast<std::size_t>(a)].push_back(std::move(entry));
    }
    prefer_rotor(found[static_cast<std::size_t>(a)]);
  });
  for (auto& entries : found) {
    for (ScanEntry& entry : entries) result.entries.push_back(std::move(entry));
  }
  if (samples.quantity == ScanQuantity::kForce) {
    add_body_constant(judged, result.least_share, result.entries);
    add_periods(samples, judged.chunks, result);
  }
  keep_best_lags(result.entries);
  for (ScanEntry& entry : result.entries) set_errors(judged, entry);
  sort_entries(result.entries);
  return result;
}

ScanEntry along_velocity(const ScanSamples& samples) {
  // The force along the velocity takes the column of the force towards a neighbour.
  ScanSamples along = samples;
  for (Eigen::Index i = 0; i < along.size(); ++i) {
    const auto v_m_s = along.values.row(i).segment<3>(static_cast<Eigen::Index>(ScanVariable::kVx));
    along.residual(i, kTowardColumn) =
        along.residual.row(i).head<3>().dot(v_m_s) / std::max(v_m_s.norm(), 1e-3F);
  }
  const Judged judged(along, along.residual);
  const std::vector<Abscissa> all = abscissas(along);
  const auto speed =
      std::find_if(all.begin(), all.end(), [](const Abscissa& a) { return a.name == "speed"; });
  ScanEntry best;
  for (const int knots : speed == all.end() ? std::vector<int>{} : speed->knots) {
    if (curve_over(along, *speed, knots).columns == 0) continue;
    ScanEntry entry = entry_of(judged, *speed, kTowardColumn, knots);
    if (best.curve.empty() || entry.share > best.share) best = std::move(entry);
  }
  if (best.curve.empty()) return best;
  set_errors(judged, best);
  best.frame = "velocity";
  best.axis = "along";
  best.column = kTowardColumn;
  return best;
}

}  // namespace swarmcert::identification
