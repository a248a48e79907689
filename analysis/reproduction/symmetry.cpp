#include <fmt/core.h>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/sources.h"

namespace swarmcert::reproduction {
namespace {

/// How a network is made symmetric under rotation about the vertical.
struct Symmetry {
  const char* name;
  bool turns;  ///< samples are rotated
};
constexpr Symmetry kNone = {"none", false}, kTurned = {"turned samples", true};

Group train(const Setting& setting, const Source& source, const Symmetry& symmetry, bool half,
            LearnOptions options, int seeds) {
  options.turns = symmetry.turns;
  const std::string name = fmt::format("symmetry/{}-{}-{}-{:g}-{:g}", source.name, half ? "half" : "all",
                                       symmetry.name, options.gamma.value, options.max_lipschitz);
  return train_group(setting, source, half ? source.half : source.all, options, name, seeds);
}

/// Test errors of each kind of symmetry, learned from all flights and from half of them.
void add_data(const Setting& setting, const Source& source, Finding& finding) {
  const int seeds = setting.full ? 5 : 1;
  Table table = {fmt::format("{} flights: RMSE on flights not seen [gf], mean of {} seeds (standard error)",
                             source.name, seeds),
                 {"symmetry", "all flights", "half of them"},
                 {}};
  for (const Symmetry& symmetry : {kNone, kTurned}) {
    std::vector<std::string> row = {symmetry.name};
    for (const bool half : {false, true}) {
      const Group group = train(setting, source, symmetry, half, source.options, seeds);
      row.push_back(seeds > 1
                        ? fmt::format("{:.3f} ({:.3f})", group.mean_test_gf(), group.standard_error_gf())
                        : fmt::format("{:.3f}", group.mean_test_gf()));
      files::Json json = json_of(group);
      json.update({{"flights", source.name}, {"symmetry", symmetry.name}, {"half", half}});
      finding.json["by_data"].push_back(std::move(json));
    }
    table.rows.push_back(std::move(row));
  }
  finding.tables.push_back(std::move(table));
}

/// Test error over the largest joint bound, for each way to limit it, with samples rotated or as recorded.
void add_bounds(const Setting& setting, const Source& source, Finding& finding) {
  const int seeds = setting.full ? 3 : 1;
  const std::vector<double> gammas =
      setting.full ? std::vector<double>{1, 1.25, 1.5, 2, 3} : std::vector<double>{1, 2};
  const std::vector<double> limits =
      setting.full ? std::vector<double>{25, 50, 100, 200, 373} : std::vector<double>{25, 100};
  Table table = {
      fmt::format("{} flights: error over the proved joint bound, mean of {} seeds", source.name, seeds),
      {"what is limited", "symmetry", "limit", "joint bound [gf/unit]", "test RMSE [gf]"},
      {}};
  std::string data;
  for (const bool joint : {false, true}) {
    const char* const method = joint ? "joint bound" : "norm of each layer";
    for (const Symmetry& symmetry : {kNone, kTurned}) {
      for (const double limit : joint ? limits : gammas) {
        LearnOptions options = source.options;
        options.max_lipschitz = joint ? limit : 0;
        if (!joint) options.gamma.value = limit;
        const Group group = train(setting, source, symmetry, false, options, seeds);
        table.rows.push_back({method, symmetry.name, fmt::format("{:g}", limit),
                              fmt::format("{:.1f}", group.mean_bound()),
                              fmt::format("{:.3f}", group.mean_test_gf())});
        files::Json json = json_of(group);
        json.update(
            {{"flights", source.name}, {"limited", method}, {"symmetry", symmetry.name}, {"limit", limit}});
        finding.json["by_bound"].push_back(std::move(json));
        data += fmt::format("{} {}\n", group.mean_bound(), group.mean_test_gf());
      }
      data += "\n\n";
    }
  }
  finding.tables.push_back(std::move(table));
  const std::string name = "symmetry_" + source.name;
  finding.figures.push_back(
      {name, data,
       fmt::format(
           "set logscale x\nset grid\nset key top right\n"
           "set xlabel 'proved joint Lipschitz bound [gf per m or m/s]'\nset ylabel 'test RMSE [gf]'\n"
           "t = \"'norm of each layer, as recorded' 'norm of each layer, rotated' 'joint bound, as recorded' "
           "'joint bound, rotated'\"\n"
           "plot for [i=0:3] '{}.dat' index i with linespoints lw 2 title word(t, i + 1)\n",
           name),
       "Test error over the proved joint bound, " + source.name + " flights."});
}

}  // namespace

Finding symmetry(const Setting& setting) {
  Finding finding;
  finding.json["by_data"] = finding.json["by_bound"] = files::Json::array();
  std::vector<Source> sources = {simulated_source(setting)};
  if (!setting.recorded.empty()) sources.push_back(recorded_source(setting));
  for (const Source& source : sources) {
    add_data(setting, source, finding);
    add_bounds(setting, source, finding);
  }
  if (!setting.recorded.empty()) add_inputs(sources.back().all, finding);
  finding.notes.push_back("Epochs are chosen on the selecting flights, and nothing on the test flights.");
  return finding;
}

}  // namespace swarmcert::reproduction
