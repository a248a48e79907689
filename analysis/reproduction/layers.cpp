#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/sources.h"

namespace swarmcert::reproduction {
namespace {

/// How a network is made to keep a bound.
struct Method {
  const char* name = "";
  training::Layers layers = training::Layers::kFree;
  bool joint = false;  ///< the joint bound is limited; otherwise the norm of each layer
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
  Method method;
  double limit = 0;
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
  return {method, limit,
          train_group(setting, source, source.all, options,
                      fmt::format("layers/{}-{}-{:g}", source.name, method.name, limit),
                      sweep_of(setting).seeds)};
}

/// Errors at a given bound.
struct Errors {
  double select_gf = 0, test_gf = 0;
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

struct EqualBoundRow {
  double bound = 0;
  std::vector<std::pair<std::string, Errors>> errors;  ///< by method
  std::string preferred;
};

struct LayersResult {
  std::string flights;
  std::vector<Point> points;  ///< in order of methods
  std::vector<EqualBoundRow> at_equal_bounds;
};

void describe(files::Record& record, const LayersResult& result) {
  record.list("curves", result.points,
              "Networks over what is limited, the norm of each layer or the joint bound, by the method that "
              "keeps it; numbers by seed.",
              [&result](files::Record& r, const Point& point) {
                describe_group(r, point.group);
                r.field("flights", result.flights, "simulated or recorded.");
                r.field("method", point.method.name, "");
                r.field("limited", point.method.joint ? "joint bound" : "norm of each layer", "");
                r.field("limit", point.limit, "Of what is limited.");
              });
  record.list(
      "at_equal_bounds", result.at_equal_bounds,
      "Mean errors of each method at equal proved joint bounds, of spectral normalisation between two "
      "of its networks; methods without a network at this bound are left out.",
      [&result](files::Record& r, const EqualBoundRow& row) {
        r.field("flights", result.flights, "simulated or recorded.");
        r.field("bound_gf_per_unit", row.bound, "Joint Lipschitz bound.", "gf/unit", "proved upper bound");
        r.list("errors", row.errors, "", [](files::Record& one, const auto& errors) {
          one.field("method", errors.first, "");
          one.field("select_rmse_gf", errors.second.select_gf, "On the selecting flights.", "gf");
          one.field("test_rmse_gf", errors.second.test_gf, "On flights not seen.", "gf");
        });
        r.field("preferred_by_selecting_flights", row.preferred,
                "Method with the least error on the flights that select.");
      });
}

Curves curves_of(const Setting& setting, const Source& source) {
  Curves curves;
  const Sweep sweep = sweep_of(setting);
  for (const Method& method : kMethods)
    for (const double limit : method.joint ? sweep.limits : sweep.gammas)
      curves[method.name].push_back(point_of(setting, source, method, limit));
  return curves;
}

/// The errors of each method at one bound, and the method preferred by the selecting flights.
EqualBoundRow at_bound(double bound, const Curves& curves) {
  EqualBoundRow row;
  row.bound = bound;
  double least_gf = 0;
  for (const Method& method : kMethods) {
    const std::optional<Errors> found = errors_at(bound, curves.at(method.name), method.joint);
    if (!found) continue;
    row.errors.emplace_back(method.name, *found);
    if (!row.preferred.empty() && found->select_gf >= least_gf) continue;
    row.preferred = method.name;
    least_gf = found->select_gf;
  }
  return row;
}

/// One line per bound, one column per method.
Table equal_bounds_table(const LayersResult& result) {
  Table table = {result.flights + " flights: test RMSE [gf] at equal proved joint bounds",
                 {{"joint bound [gf/unit]"}, {}}};
  for (const Method& method : kMethods) table.cells.header.emplace_back(method.name);
  table.cells.header.emplace_back("least on the selecting flights");
  for (const EqualBoundRow& row : result.at_equal_bounds) {
    std::vector<std::string> cells = {fmt::format("{:g}", row.bound)};
    for (const Method& method : kMethods) {
      const auto found = std::find_if(row.errors.begin(), row.errors.end(),
                                      [&](const auto& errors) { return errors.first == method.name; });
      cells.push_back(found == row.errors.end() ? "" : fmt::format("{:.3f}", found->second.test_gf));
    }
    cells.push_back(row.preferred);
    table.cells.rows.push_back(std::move(cells));
  }
  return table;
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

Finding run_layers(const Setting& setting) {
  Finding finding;
  const bool is_recorded = !setting.recorded.empty();
  Source source = is_recorded ? recorded_source(setting) : simulated_source(setting);
  if (is_recorded) {
    source.all = of_small_vehicles(source.all);
    add_inputs(source.all, finding);
  }
  const Curves curves = curves_of(setting, source);
  LayersResult result;
  result.flights = source.name;
  for (const Method& method : kMethods)
    for (const Point& point : curves.at(method.name)) result.points.push_back(point);
  for (const double bound : sweep_of(setting).limits)
    result.at_equal_bounds.push_back(at_bound(bound, curves));
  finding.fields = files::record_of(result);
  finding.show(fmt::format("{} flights: error over the proved joint bound, mean of {} seeds", source.name,
                           sweep_of(setting).seeds),
               "curves",
               {{"method"},
                {"limit", "", "{:g}"},
                {"mean_bound_gf_per_unit", "joint bound", "{:.1f}"},
                {"mean_test_rmse_gf", "test RMSE", "{:.3f}"},
                {"test_rmse_gf", "by seed", "{:.3f}"},
                {"select_rmse_gf", "selecting RMSE by seed", "{:.3f}"}});
  finding.tables.push_back(equal_bounds_table(result));
  add_figure(source, curves, finding);
  finding.notes.push_back(
      "All with rotated samples and the same epochs. The rate and the epoch of each network are chosen on "
      "the "
      "selecting flights, and nothing on the test flights. Bounds are those of the certificate, not products "
      "of norms; at equal "
      "bounds, spectral normalisation is interpolated between two gammas.");
  return finding;
}

}  // namespace

Experiment bounded_layers() {
  return experiment<LayersResult>(
      "layers", "spectral normalisation, projection and bounded layers: test error at equal certified bounds",
      run_layers);
}

}  // namespace swarmcert::reproduction
