#include <fmt/core.h>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/sources.h"

namespace swarmcert::reproduction {
namespace {

/// How a network is made symmetric under rotation about the vertical.
struct Symmetry {
  const char* name = "";
  bool turns = false;  ///< samples are rotated
};
constexpr Symmetry kNone = {"none", false}, kTurned = {"turned samples", true};

Group train(const Setting& setting, const Source& source, const Symmetry& symmetry, bool half,
            LearnOptions options, int seeds) {
  options.turns = symmetry.turns;
  const std::string name = fmt::format("symmetry/{}-{}-{}-{:g}-{:g}", source.name, half ? "half" : "all",
                                       symmetry.name, options.gamma.value, options.max_lipschitz);
  return train_group(setting, source, half ? source.half : source.all, options, name, seeds);
}

struct DataRow {
  std::string flights;
  Symmetry symmetry;
  bool half = false;
  Group group;
};

struct BoundRow {
  std::string flights;
  Symmetry symmetry;
  bool joint = false;  ///< the joint bound is limited; otherwise the norm of each layer
  double limit = 0;
  Group group;
};

struct SymmetryResult {
  std::vector<DataRow> by_data;
  std::vector<BoundRow> by_bound;
};

void describe_flights_and_symmetry(files::Record& record, const std::string& flights,
                                   const Symmetry& symmetry) {
  record.field("flights", flights, "simulated or recorded.");
  record.field("symmetry", symmetry.name, "none, or turned samples.");
}

void describe_data_row(files::Record& record, const DataRow& row) {
  describe_group(record, row.group);
  describe_flights_and_symmetry(record, row.flights, row.symmetry);
  record.field("half", row.half, "Whether half of the flights were left out.");
}

void describe_bound_row(files::Record& record, const BoundRow& row) {
  describe_group(record, row.group);
  describe_flights_and_symmetry(record, row.flights, row.symmetry);
  record.field("limited", row.joint ? "joint bound" : "norm of each layer", "");
  record.field("limit", row.limit, "Of what is limited.");
}

void describe(files::Record& record, const SymmetryResult& result) {
  record.list("by_data", result.by_data,
              "Networks learned from all flights, or from half of them; numbers by seed.", describe_data_row);
  record.list("by_bound", result.by_bound,
              "Networks over what is limited, the norm of each layer or the joint bound; numbers by seed.",
              describe_bound_row);
}

int seeds_over_data(const Setting& setting) { return setting.full ? 5 : 1; }
int seeds_over_bounds(const Setting& setting) { return setting.full ? 3 : 1; }

/// Test errors of each kind of symmetry, learned from all flights and from half of them.
void add_data(const Setting& setting, const Source& source, SymmetryResult& result) {
  for (const Symmetry& symmetry : {kNone, kTurned})
    for (const bool half : {false, true})
      result.by_data.push_back(
          {source.name, symmetry, half,
           train(setting, source, symmetry, half, source.options, seeds_over_data(setting))});
}

/// Test error over the largest joint bound, for each way to limit it, with samples rotated or as recorded.
void add_bounds(const Setting& setting, const Source& source, SymmetryResult& result, Finding& finding) {
  const std::vector<double> gammas =
      setting.full ? std::vector<double>{1, 1.25, 1.5, 2, 3} : std::vector<double>{1, 2};
  const std::vector<double> limits =
      setting.full ? std::vector<double>{25, 50, 100, 200, 373} : std::vector<double>{25, 100};
  std::string data;
  for (const bool joint : {false, true}) {
    for (const Symmetry& symmetry : {kNone, kTurned}) {
      for (const double limit : joint ? limits : gammas) {
        LearnOptions options = source.options;
        options.max_lipschitz = joint ? limit : 0;
        if (!joint) options.gamma.value = limit;
        const Group group = train(setting, source, symmetry, false, options, seeds_over_bounds(setting));
        result.by_bound.push_back({source.name, symmetry, joint, limit, group});
        data += fmt::format("{} {}\n", group.mean_bound(), group.mean_test_gf());
      }
      data += "\n\n";
    }
  }
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

Finding run_symmetry(const Setting& setting) {
  Finding finding;
  SymmetryResult result;
  std::vector<Source> sources = {simulated_source(setting)};
  if (!setting.recorded.empty()) sources.push_back(recorded_source(setting));
  for (const Source& source : sources) {
    add_data(setting, source, result);
    add_bounds(setting, source, result, finding);
  }
  if (!setting.recorded.empty()) add_inputs(sources.back().all, finding);
  finding.fields = files::record_of(result);
  finding.show(fmt::format("RMSE on flights not seen, mean of {} seeds", seeds_over_data(setting)), "by_data",
               {{"flights"},
                {"symmetry"},
                {"half", "half of them"},
                {"mean_test_rmse_gf", "mean", "{:.3f}"},
                {"test_rmse_gf", "by seed", "{:.3f}"}});
  finding.show(fmt::format("Error over the proved joint bound, mean of {} seeds", seeds_over_bounds(setting)),
               "by_bound",
               {{"flights"},
                {"limited", "what is limited"},
                {"symmetry"},
                {"limit", "", "{:g}"},
                {"mean_bound_gf_per_unit", "joint bound", "{:.1f}"},
                {"mean_test_rmse_gf", "test RMSE", "{:.3f}"}});
  finding.notes.push_back("Epochs are chosen on the selecting flights, and nothing on the test flights.");
  return finding;
}

}  // namespace

Experiment symmetry() {
  return experiment<SymmetryResult>(
      "symmetry", "exact symmetry, turned samples or none: test error over data and over the bound",
      run_symmetry);
}

}  // namespace swarmcert::reproduction
