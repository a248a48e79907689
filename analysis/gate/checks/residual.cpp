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

enum class ResidualQuantity { kRmse, kRmseZ, kBias, kP95, kRecords };

struct WantedResidual {
  std::string name;
  ResidualQuantity quantity;
  Limit limit;
};

double value_of(const residuals::ErrorStatistics& s, ResidualQuantity quantity) {
  switch (quantity) {
    case ResidualQuantity::kRmse:
      return s.rmse.total;
    case ResidualQuantity::kRmseZ:
      return s.rmse.z;
    case ResidualQuantity::kBias:
      return std::max({std::abs(s.bias.x), std::abs(s.bias.y), std::abs(s.bias.z)});
    case ResidualQuantity::kP95:
      return s.p95.total;
    case ResidualQuantity::kRecords:
      break;
  }
  return static_cast<double>(s.samples);
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

Run read_residual(const files::TomlTable& table, Policy& policy) {
  require_file(table, policy.release.model, "model");
  require_file(table, policy.release.flights.empty() ? "" : policy.release.flights.front(), "flights");
  std::vector<WantedResidual> all;
  const auto add = [&](const char* name, const char* stem, ResidualQuantity quantity) {
    if (const auto limit = force_limit(table, stem)) all.push_back({name, quantity, *limit});
  };
  add("residual", "max_rmse", ResidualQuantity::kRmse);
  add("residual.rmse_z", "max_rmse_z", ResidualQuantity::kRmseZ);
  add("residual.bias", "max_bias", ResidualQuantity::kBias);
  add("residual.p95", "max_p95", ResidualQuantity::kP95);
  if (all.empty()) refuse_without_limit(table, "max_rmse_N = 0.03");
  if (const auto least = limit(table, "min_records", "records", false))
    all.push_back({"residual.records", ResidualQuantity::kRecords, *least});
  return [all](Evidence& evidence, Checks& checks) {
    const residuals::Comparison& comparison = evidence.residual_comparison();
    const residuals::ErrorStatistics& s = comparison.overall.statistics;
    for (const WantedResidual& wanted : all) {
      Check check = row(wanted.name, wanted.limit);
      check.witness = worst_track(comparison);
      const double in_unit = wanted.limit.unit_N > 0 ? wanted.limit.unit_N : 1;
      const double value = value_of(s, wanted.quantity) / in_unit;
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
