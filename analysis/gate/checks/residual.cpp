#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "analysis/residuals/comparison.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"
#include "stability/model.h"

namespace swarmcert::gate {
namespace {

using residuals::ErrorStatistics;
using ResidualQuantity = double (*)(const ErrorStatistics&);

struct WantedResidual {
  std::string name;
  ResidualQuantity quantity;
  Limit limit;
};

double largest_bias(const ErrorStatistics& s) {
  return std::max({std::abs(s.bias.x), std::abs(s.bias.y), std::abs(s.bias.z)});
}

/// Names the flight with the largest error, for a row that fails.
std::string worst_track(const residuals::Comparison& comparison) {
  const residuals::TrackErrors* worst = nullptr;
  for (const residuals::TrackErrors& track : comparison.tracks) {
    if (track.errors.statistics.samples == 0) continue;
    if (worst == nullptr || track.errors.statistics.rmse.total > worst->errors.statistics.rmse.total)
      worst = &track;
  }
  if (worst == nullptr) return "no record could be used";
  return fmt::format("worst: {} {}, RMSE {:.4g} N", worst->flight, worst->vehicle,
                     worst->errors.statistics.rmse.total);
}

}  // namespace

void describe_residual_keys(files::Keys& keys) {
  for (const char* stem : {"max_rmse", "max_rmse_z", "max_bias", "max_p95"}) {
    keys.may<double>(std::string(stem) + "_N", "Of the force that the model leaves.", "N");
    keys.may<double>(std::string(stem) + "_gf", "Of the force that the model leaves.", "gf");
  }
  keys.may<int>("min_records", "On which it is judged.");
}

Run read_residual(const files::TomlTable& table, Policy&) {
  std::vector<WantedResidual> all;
  const auto add = [&](const char* name, const char* stem, ResidualQuantity quantity) {
    if (const auto limit = force_limit(table, stem)) all.push_back({name, quantity, *limit});
  };
  add("residual", "max_rmse", [](const ErrorStatistics& s) { return s.rmse.total; });
  add("residual.rmse_z", "max_rmse_z", [](const ErrorStatistics& s) { return s.rmse.z; });
  add("residual.bias", "max_bias", largest_bias);
  add("residual.p95", "max_p95", [](const ErrorStatistics& s) { return s.p95.total; });
  if (all.empty()) refuse_without_limit(table, "max_rmse_N = 0.03");
  if (const auto least = limit(table, "min_records", "records", false))
    all.push_back({"residual.records", [](const ErrorStatistics& s) { return double(s.samples); }, *least});
  return [all](Evidence& evidence, Checks& checks) {
    const residuals::Comparison& comparison = evidence.residual_comparison();
    const ErrorStatistics& s = comparison.overall.statistics;
    for (const WantedResidual& wanted : all) {
      Check check = row(wanted.name, wanted.limit);
      check.witness = worst_track(comparison);
      const double in_unit = wanted.limit.unit_N > 0 ? wanted.limit.unit_N : 1;
      const double value = wanted.quantity(s) / in_unit;
      if (s.samples == 0) {
        check.value = 0;
        check.reason = "no usable record: nothing was compared";
      } else {
        judge(check, wanted.limit, value, value);
      }
      checks.push_back(std::move(check));
    }
  };
}

}  // namespace swarmcert::gate
