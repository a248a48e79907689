#include "analysis/tracking/kept_promise.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/tracking/conformal.h"
#include "nn/base/doubles.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

/// The 5 % and 95 % limits of the confidence interval for `held` out of `flights`.
Interval clopper_pearson_90(int held, int flights) {
  if (flights == 0) return {0, 1};
  return {held == 0 ? 0 : beta_quantile(held, flights - held + 1, 0.05),
          held == flights ? 1 : beta_quantile(held + 1, flights - held, 0.95)};
}

}  // namespace

Promise read_promise(const std::string& path) {
  const Json document = files::read_json(path, "swarmcert/bound/1");
  const auto refuse = [&path](const std::string& field) {
    throw files::InputError({path, "", field, "", "is missing or not what bound --coverage writes",
                             "write the file with swarmcert bound --from compare.json --coverage P --json"});
  };
  if (!document.contains("coverage") || !document["coverage"].is_object()) refuse("coverage");
  const Json& coverage = document["coverage"];
  for (const char* const field : {"made_from", "bounds"})
    if (!coverage.contains(field) || !coverage[field].is_array()) refuse(std::string("coverage.") + field);
  if (!coverage.contains("level") || !coverage["level"].is_number()) refuse("coverage.level");
  Promise promise;
  promise.path = path;
  promise.level = coverage["level"].get<double>();
  promise.bound_m.fill(kInfinity);
  for (const Json& hash : coverage["made_from"]) {
    if (!hash.is_string()) refuse("coverage.made_from");
    promise.made_from.push_back(hash.get<std::string>());
  }
  const auto has_text = [](const Json& row, const char* key) {
    return row.is_object() && row.contains(key) && row[key].is_string();
  };
  // Rows of the sampled loop follow those of the continuous loop and replace them.
  for (const Json& row : coverage["bounds"]) {
    if (!has_text(row, "axis") || !has_text(row, "channel")) refuse("coverage.bounds");
    if (row["channel"] != stability::name(stability::Channel::kForce)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (row["axis"] != stability::axis_name(axis)) continue;
      const bool has_total = row.contains("total") && row["total"].is_number();
      promise.bound_m[static_cast<std::size_t>(axis)] = has_total ? row["total"].get<double>() : kInfinity;
    }
  }
  return promise;
}

int KeptPromise::worst_axis() const {
  int worst = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const KeptAlong& along = axes[static_cast<std::size_t>(axis)];
    if (along.flights == 0) continue;
    if (worst < 0 || along.share() < axes[static_cast<std::size_t>(worst)].share()) worst = axis;
  }
  return worst;
}

KeptPromise kept_promise(const Promise& promise, const std::vector<residuals::FlightPeak>& peaks) {
  KeptPromise kept;
  const std::set<std::string> made_from(promise.made_from.begin(), promise.made_from.end());
  std::set<std::string> used_flights;
  for (const residuals::FlightPeak& peak : peaks) {
    if (made_from.count(files::sha256_of_file(peak.path)) == 0) continue;
    kept.used.push_back(peak.path);
    used_flights.insert(peak.flight);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::map<std::string, bool> holds;
    for (const residuals::FlightPeak& peak : peaks) {
      if (used_flights.count(peak.flight) > 0 || std::isnan(peak.peak_m[axis])) continue;
      const bool one = peak.peak_m[axis] <= promise.bound_m[axis];
      holds.emplace(peak.flight, true).first->second &= one;
    }
    KeptAlong& along = kept.axes[axis];
    along.flights = static_cast<int>(holds.size());
    along.held = static_cast<int>(
        std::count_if(holds.begin(), holds.end(), [](const auto& flight) { return flight.second; }));
    along.interval_90 = clopper_pearson_90(along.held, along.flights);
  }
  return kept;
}

}  // namespace swarmcert::analysis
