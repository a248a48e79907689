#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/sources.h"

namespace swarmcert::reproduction {
namespace {

/// How a network is made to keep a bound.
struct Method {
  const char* name;
  training::Layers layers;
  bool joint;  ///< the joint bound is limited; otherwise the norm of each layer
};
constexpr Method kMethods[] = {{"spectral normalisation", training::Layers::kFree, false},
                               {"projection", training::Layers::kFree, true},
                               {"AOL", training::Layers::kAol, true},
                               {"orthogonal", training::Layers::kOrthogonal, true},
                               {"sandwich", training::Layers::kSandwich, true}};

/// Swept parameters: joint bounds in gf per unit of input, and layer norms that lead to such bounds.
struct Sweep {
  std::vector<double> limits, gammas;
  int seeds;
};

Sweep sweep_of(const Setting& setting) {
  if (setting.full) return {{10, 20, 40, 80}, {1.25, 1.5, 1.75, 2}, 3};
  return {{10, 40}, {1, 2}, 1};
}

/// Learning rate: of 2e-3 and 6e-3, the one with the smaller error of a single network on the selecting recorded
/// flights, for every method at bounds of 30 to 40.
constexpr double kRate = 6e-3;
constexpr int kEpochs = 12;

struct Point {
  double limit;
  Group group;
};

Point point_of(const Setting& setting, const Source& source, const Method& method, double limit) {
  LearnOptions options = source.options;
  options.layers = method.layers;
  options.rate = kRate;
  options.max_lipschitz = method.joint ? limit : 0;
  options.begins_within = true;
  if (!method.joint) options.gamma.value = limit;
  if (options.epochs > 0 && setting.full) options.epochs = kEpochs;
  return {limit, train_group(setting, source, source.all, options,
                             fmt::format("layers/{}-{}-{:g}", source.name, method.name, limit),
                             sweep_of(setting).seeds)};
}

/// Errors at a given bound.
struct Errors {
  double select_gf, test_gf;
};

/// Errors of networks limited to this bound; otherwise interpolated between the two networks with adjacent bounds,
/// linearly in the logarithm of the bound. Nothing outside the range.
std::optional<Errors> errors_at(double bound, const std::vector<Point>& curve, bool joint) {
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (joint && curve[i].limit == bound)
      return Errors{curve[i].group.mean_select_gf(), curve[i].group.mean_test_gf()};
    if (joint || i == 0) continue;
    const Group &below = curve[i - 1].group, &above = curve[i].group;
    if (bound < below.mean_bound() || bound > above.mean_bound()) continue;
    const double share =
        std::log(bound / below.mean_bound()) / std::log(above.mean_bound() / below.mean_bound());
    const auto between = [share](double x, double y) { return (1 - share) * x + share * y; };
    return Errors{between(below.mean_select_gf(), above.mean_select_gf()),
                  between(below.mean_test_gf(), above.mean_test_gf())};
  }
  return std::nullopt;
}

using Curves = std::map<std::string, std::vector<Point>>;  ///< by method

Curves curves_of(const Setting& setting, const Source& source, Finding& finding) {
  Curves curves;
  const Sweep sweep = sweep_of(setting);
  Table table = {
      fmt::format("{} flights: error over the proved joint bound, mean of {} seeds (standard error)",
                  source.name, sweep.seeds),
      {"method", "limit", "joint bound [gf/unit]", "selecting RMSE [gf]", "test RMSE [gf]"},
      {}};
  for (const Method& method : kMethods) {
    for (const double limit : method.joint ? sweep.limits : sweep.gammas) {
      const Point point = point_of(setting, source, method, limit);
      const Group& group = point.group;
      table.rows.push_back(
          {method.name, fmt::format("{:g}", limit), fmt::format("{:.1f}", group.mean_bound()),
           fmt::format("{:.3f}", group.mean_select_gf()),
           sweep.seeds > 1 ? fmt::format("{:.3f} ({:.3f})", group.mean_test_gf(), group.standard_error_gf())
                           : fmt::format("{:.3f}", group.mean_test_gf())});
      files::Json json = json_of(group);
      json.update({{"flights", source.name},
                   {"method", method.name},
                   {"limited", method.joint ? "joint bound" : "norm of each layer"},
                   {"limit", limit}});
      finding.json["curves"].push_back(std::move(json));
      curves[method.name].push_back(point);
    }
  }
  finding.tables.push_back(std::move(table));
  return curves;
}

/// Adds one row per bound, one column per method, and the method preferred by the selecting flights.
void add_equal_bounds(const Setting& setting, const Source& source, const Curves& curves, Finding& finding) {
  Table table = {
      source.name + " flights: test RMSE [gf] at equal proved joint bounds", {"joint bound [gf/unit]"}, {}};
  for (const Method& method : kMethods) table.header.push_back(method.name);
  table.header.push_back("least on the selecting flights");
  for (const double bound : sweep_of(setting).limits) {
    std::vector<std::string> row = {fmt::format("{:g}", bound)};
    std::string preferred;
    double least_gf = 0;
    files::Json errors = files::Json::array();
    for (const Method& method : kMethods) {
      const std::optional<Errors> found = errors_at(bound, curves.at(method.name), method.joint);
      row.push_back(found ? fmt::format("{:.3f}", found->test_gf) : "");
      if (!found) continue;
      errors.push_back(
          {{"method", method.name}, {"select_rmse_gf", found->select_gf}, {"test_rmse_gf", found->test_gf}});
      if (!preferred.empty() && found->select_gf >= least_gf) continue;
      preferred = method.name;
      least_gf = found->select_gf;
    }
    row.push_back(preferred);
    finding.json["at_equal_bounds"].push_back({{"flights", source.name},
                                               {"bound_gf_per_unit", bound},
                                               {"errors", std::move(errors)},
                                               {"preferred_by_selecting_flights", preferred}});
    table.rows.push_back(std::move(row));
  }
  finding.tables.push_back(std::move(table));
}

void add_figure(const Source& source, const Curves& curves, Finding& finding) {
  std::string data, titles;
  for (const Method& method : kMethods) {
    for (const Point& point : curves.at(method.name))
      data += fmt::format("{} {}\n", point.group.mean_bound(), point.group.mean_test_gf());
    data += "\n\n";
    titles += fmt::format(" '{}'", method.name);
  }
  const std::string name = "layers_" + source.name;
  finding.figures.push_back(
      {name, data,
       fmt::format(
           "set logscale x\nset grid\nset key top right\n"
           "set xlabel 'proved joint Lipschitz bound [gf per m or m/s]'\nset ylabel 'test RMSE [gf]'\n"
           "t = \"{}\"\nplot for [i=0:{}] '{}.dat' index i with linespoints lw 2 title word(t, i + 1)\n",
           titles, std::size(kMethods) - 1, name),
       "Test error over the proved joint bound, " + source.name + " flights."});
}

}  // namespace

Finding bounded_layers(const Setting& setting) {
  Finding finding;
  finding.json["curves"] = finding.json["at_equal_bounds"] = files::Json::array();
  const bool is_recorded = !setting.recorded.empty();
  Source source = is_recorded ? recorded_source(setting) : simulated_source(setting);
  if (is_recorded) {
    source.all = of_small_vehicles(source.all);
    add_inputs(source.all, finding);
  }
  const Curves curves = curves_of(setting, source, finding);
  add_equal_bounds(setting, source, curves, finding);
  add_figure(source, curves, finding);
  finding.notes.push_back(
      "All with rotated samples and the same epochs. The rate and the epoch of each network are chosen on "
      "the "
      "selecting flights, and nothing on the test flights. Bounds are those of the certificate, not products "
      "of norms; at equal "
      "bounds, spectral normalisation is interpolated between two gammas.");
  return finding;
}

}  // namespace swarmcert::reproduction
