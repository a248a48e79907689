#include "analysis/residuals/failing_place.h"

#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace swarmcert::residuals {
namespace {

using Where = FailingPlace::Where;

double squared(double x) { return x * x; }

Eigen::Vector3d mean_of(const ErrorStatistics& s) { return {s.bias.x, s.bias.y, s.bias.z}; }

/// "towards -y" for a mean that lies mostly along one axis, else its components.
std::string direction_words(const ErrorStatistics& s, const ForceUnit& unit) {
  const Eigen::Vector3d mean = mean_of(s);
  Eigen::Index axis = 0;
  const double most = mean.cwiseAbs().maxCoeff(&axis);
  constexpr double kMostlyAlong = 0.9;
  if (most >= kMostlyAlong * mean.norm())
    return fmt::format("{:.3g} {} towards {}{}", s.bias.total * unit.per_newton(), unit.name,
                       mean[axis] > 0 ? '+' : '-', "xyz"[axis]);
  const Eigen::Vector3d shown = mean * unit.per_newton();
  return fmt::format("a mean of ({:.3g}, {:.3g}, {:.3g}) {}", shown.x(), shown.y(), shown.z(), unit.name);
}

}  // namespace

void describe(files::Record& record, Where where) {
  record.choice(where, {"nowhere", "everywhere", "region", "scattered"});
}

void describe(files::Record& record, const FailingPlace& place) {
  record.field("where", place.where, "nowhere: not above the noise; region: most in one regime of flight.");
  record.field("share", place.share, "Of the mean square of the residual vector.", "", "estimate");
  record.field("words", place.words, "The same in one line.");
}

std::string region_words(const RegionErrors& region, const ForceUnit& unit) {
  return region.name + ": " + direction_words(region.statistics, unit);
}

int failing_axis(const ErrorStatistics& s) {
  return s.rmse.z >= s.rmse.x && s.rmse.z >= s.rmse.y ? 2 : s.rmse.y >= s.rmse.x ? 1 : 0;
}

FailingPlace failing_place(const Comparison& comparison, const ForceUnit& unit) {
  constexpr double kNoise = 1.5, kMostIsMean = 0.5, kLeastOfRegion = 0.1;
  const ErrorStatistics& s = comparison.overall.statistics;
  const double square = squared(s.rmse.total), noise = comparison.overall.noise_floor_N.squaredNorm();
  FailingPlace place;
  if (s.samples == 0) {
    place.words = "no record is judged";
    return place;
  }
  const bool is_slow = (comparison.overall.low_band_to_floor.array() > Spectrum::kSlowToFloor).any();
  if (!(square > 0) || (noise > 0 && square <= kNoise * noise && !is_slow)) {
    place.words =
        fmt::format("nowhere above the noise, {:.3g} {}", std::sqrt(noise) * unit.per_newton(), unit.name);
    return place;
  }
  const double above = square - (std::isfinite(noise) ? noise : 0);
  place.share = squared(s.bias.total) / square;
  if (squared(s.bias.total) >= kMostIsMean * above) {
    place.where = Where::kEverywhere;
    place.words = fmt::format("everywhere alike: {}, {:.0f} % of the mean square", direction_words(s, unit),
                              100 * place.share);
    return place;
  }
  const auto share_of = [&](const RegionErrors& r) {
    return static_cast<double>(r.statistics.samples) / static_cast<double>(s.samples) *
           (mean_of(r.statistics) - mean_of(s)).squaredNorm() / square;
  };
  const auto rank_of = [&](const RegionErrors& r) {
    const double share = share_of(r);
    return std::make_pair(share >= kLeastOfRegion && !is_reaction(r.variable), share);
  };
  const auto worst =
      std::max_element(comparison.regions.begin(), comparison.regions.end(),
                       [&](const RegionErrors& a, const RegionErrors& b) { return rank_of(a) < rank_of(b); });
  if (worst != comparison.regions.end() && share_of(*worst) >= kLeastOfRegion) {
    place.where = Where::kRegion;
    place.variable = worst->variable;
    place.share = share_of(*worst);
    place.words =
        fmt::format("at {}, {:.0f} % of the mean square", region_words(*worst, unit), 100 * place.share);
    return place;
  }
  place.where = Where::kScattered;
  place.share = above / square;
  place.words = fmt::format("here and there: no regime holds a tenth of it, {:.0f} % is above the noise",
                            100 * place.share);
  return place;
}

std::string sentence(const FailingPlace& place) { return "It fails " + place.words + "."; }

}  // namespace swarmcert::residuals
