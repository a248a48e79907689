#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/stages.h"

namespace swarmcert::reproduction {
namespace {

/// Mean of label minus true force over one range of relative states, and its standard error from blocks of records.
struct Labels {
  std::vector<double> block_means;
  int count = 0;

  double mean() const {
    double sum = 0;
    for (const double value : block_means) sum += value;
    return sum / static_cast<double>(block_means.size());
  }
  double error() const {
    const double centre = mean();
    double squares = 0;
    for (const double value : block_means) squares += (value - centre) * (value - centre);
    const auto n = static_cast<double>(block_means.size());
    return std::sqrt(squares / (n - 1) / n);
  }
};

/// Range of lateral distance and height of the neighbour, in steps of 5 and 10 cm; "" outside the compared region.
std::string range_of(const float* x) {
  const int lateral = static_cast<int>(std::hypot(x[0], x[1]) / 0.05f);
  const int height = static_cast<int>(std::floor(x[2] / 0.1f));
  if (lateral > 3 || height < 1 || height > 5) return "";
  return fmt::format("r {:.2f} .. {:.2f} m, neighbour {:.1f} .. {:.1f} m above", 0.05 * lateral,
                     0.05 * lateral + 0.05, 0.1 * height, 0.1 * height + 0.1);
}

/// Label errors of stage 0 or 1, whose samples have one neighbour each.
std::map<std::string, Labels> labels_of(const Setting& setting, Stages& stages, int stage) {
  constexpr Eigen::Index kBlock = 100;  // records: 1 s, within which label errors are similar
  constexpr std::size_t kLeastBlocks = 4;
  const residuals::Inputs inputs = stages.inputs({stage}, "fit");
  const learning::LearningData data =
      learning::load_learning_data({&inputs, &inputs, &inputs}, stages.learn_options().sizes,
                                   learning::SplitBy::kFlights, setting.jobs, [](int, int) {});
  Interaction truth(stages.truth());
  std::map<std::string, Labels> result;
  std::map<std::pair<std::string, Eigen::Index>, std::pair<double, int>> blocks;
  for (const Eigen::Index s : data.indices(learning::Use::kFit)) {
    const float* const x = data.samples.x.data() + data.samples.first[s] * data.samples.width;
    const std::string range = range_of(x);
    if (range.empty()) continue;
    const Relative relative = {x[0], x[1], x[2], x[3], x[4], x[5]};
    auto& [sum, count] = blocks[{range, s / kBlock}];
    sum += static_cast<double>(data.samples.target[s]) - truth.force_z_gf({relative});
    ++count;
  }
  for (const auto& [where, block] : blocks) {
    result[where.first].block_means.push_back(block.first / block.second);
    result[where.first].count += block.second;
  }
  for (auto it = result.begin(); it != result.end();)
    it = it->second.block_means.size() < kLeastBlocks ? result.erase(it) : std::next(it);
  return result;
}

struct LabelRow {
  std::string range;
  double without_gf = 0, with_gf = 0, error_gf = 0;
  double difference_gf() const { return with_gf - without_gf; }
};

void describe_label_row(files::Record& record, const LabelRow& row) {
  record.field("range", row.range, "Relative states of the neighbour.");
  record.field("without_gf", row.without_gf, "Mean in flights without a network.", "gf", "estimate");
  record.field("with_gf", row.with_gf, "Mean in flights with one.", "gf", "estimate");
  record.field("difference_gf", row.difference_gf(), "", "gf", "estimate");
  record.field("standard_error_gf", row.error_gf, "Of the difference.", "gf", "estimate");
}

struct StageRow {
  Stage stage;
  StageFlights flights;
  Learned learned;
};

void describe_stage_row(files::Record& record, const StageRow& row) {
  record.field("vehicles", row.stage.vehicles, "");
  record.field("flown_with", row.stage.flown_with, "");
  record.field("drawn_in", row.stage.drawn_in, "Factor by which set points are contracted.");
  record.field("least_distance_m", row.flights.least_distance_m,
               "Between any two vehicles of a random walk, mean over walks.", "m");
  record.field("percentile_distance_m", row.flights.percentile_distance_m,
               "1 % of the distances to the nearest vehicle are below it.", "m");
  record.field("test_rmse_gf", row.learned.test_gf, "Of the stage's network on flights not seen.", "gf");
  record.field("test_rmse_of_nothing_gf", row.learned.nothing_gf, "Likewise, without a network.", "gf");
  record.field("gamma_proved", row.learned.keeps_gamma, "Whether every layer keeps gamma.", "", "proved");
  record.field("bound", row.learned.bound, "Largest Lipschitz bound.", "gf/unit", "proved upper bound");
}

struct CurriculumResult {
  std::string truth;
  std::vector<StageRow> stages;
  bool falls = true;
  std::vector<LabelRow> labels;
  double rms_difference_gf = 0;
};

void describe(files::Record& record, const CurriculumResult& result) {
  record.field("truth", result.truth, "Name of the simulated truth.");
  record.list("stages", result.stages, "The stages of training, in order.", describe_stage_row);
  record.field("least_distance_falls", result.falls, "Whether vehicles come closer from stage to stage.");
  record.list("labels", result.labels, "Labels minus true force at equal relative states.",
              describe_label_row);
  record.field("labels_rms_difference_gf", result.rms_difference_gf, "Over the ranges of labels.", "gf");
}

std::vector<LabelRow> label_rows(const Setting& setting, Stages& stages) {
  const std::map<std::string, Labels> without = labels_of(setting, stages, 0),
                                      with = labels_of(setting, stages, 1);
  std::vector<LabelRow> rows;
  for (const auto& [range, before] : without) {
    const auto after = with.find(range);
    if (after != with.end())
      rows.push_back(
          {range, before.mean(), after->second.mean(), std::hypot(before.error(), after->second.error())});
  }
  return rows;
}

Finding run_curriculum(const Setting& setting) {
  Stages stages(setting, truths(setting).front(), 0);
  CurriculumResult result;
  result.truth = stages.truth().name;
  double before_m = INFINITY;
  for (int k = 0; k < kNumStages; ++k) {
    result.stages.push_back({kStages[k], stages.flights(k), stages.learned(k)});
    const double least_m = result.stages.back().flights.least_distance_m;
    result.falls = result.falls && least_m < before_m;
    before_m = least_m;
  }
  result.labels = label_rows(setting, stages);
  int beyond = 0;
  double squares = 0;
  for (const LabelRow& row : result.labels) {
    beyond += std::abs(row.difference_gf()) > 2 * row.error_gf ? 1 : 0;
    squares += row.difference_gf() * row.difference_gf();
  }
  const std::size_t ranges = result.labels.size();
  result.rms_difference_gf = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(ranges, 1)));
  Finding finding;
  finding.fields = files::record_of(result);
  finding.show("Stages, truth \"flights\"", "stages",
               {{"vehicles"},
                {"flown_with"},
                {"drawn_in", "drawn in to", "{:g}"},
                {"least_distance_m", "", "{:.3f}"},
                {"percentile_distance_m", "1 % below", "{:.3f}"},
                {"test_rmse_gf", "test RMSE", "{:.2f}"},
                {"test_rmse_of_nothing_gf", "of nothing", "{:.2f}"},
                {"bound", "", "{:.0f}"}});
  finding.show("Labels minus true force at equal relative states", "labels",
               {{"range", "relative state"},
                {"without_gf", "without network", "{:.2f}"},
                {"with_gf", "with network", "{:.2f}"},
                {"difference_gf", "", "{:+.2f}"},
                {"standard_error_gf", "", "{:.2f}"}});
  finding.notes = {
      fmt::format("The least distance flown, as the mean of {} random walks, {} from stage to stage. Set "
                  "points are contracted in flights with a network, by factors of our choice: otherwise the "
                  "task's repulsion keeps four vehicles as far apart as two.",
                  scale_of(setting).walks, result.falls ? "falls" : "does not fall every time"),
      fmt::format("Labels with and without compensation differ by {:.2f} gf RMS over {} ranges of relative "
                  "states; {} differ by more than two standard errors.",
                  result.rms_difference_gf, ranges, beyond)};
  return finding;
}

/// Error of one number of vehicles after some minutes of flight.
struct MinutesRow {
  int vehicles = 0;
  double minutes = 0, test_gf = 0, nothing_gf = 0;
};

struct MinutesResult {
  std::string truth;
  std::vector<MinutesRow> curve;
};

void describe(files::Record& record, const MinutesResult& result) {
  record.field("truth", result.truth, "Name of the simulated truth.");
  record.list("curve", result.curve, "Error over minutes of data.",
              [](files::Record& r, const MinutesRow& row) {
                r.field("vehicles", row.vehicles, "");
                r.field("minutes", row.minutes, "Of flight, half random walk, half swaps.", "min");
                r.field("test_rmse_gf", row.test_gf, "On flights not seen.", "gf");
                r.field("test_rmse_of_nothing_gf", row.nothing_gf, "Likewise, without a network.", "gf");
              });
}

/// Learns from `minutes` of flight, half random walk and half swaps.
Learned learned_in(double minutes, int vehicles, const Setting& setting, Stages& stages) {
  const int stage = stage_of(vehicles);
  const std::optional<files::Network> network = stages.flown_network(stage);
  LearnOptions options = stages.learn_options();
  options.steps = setting.full ? 6000 : 600;
  const std::string key = fmt::format("{} {} {}", stages.key(stage), minutes, vehicles);
  const std::string origin =
      fmt::format("{}/../minutes/{}-{:g}", stages.flights(stage).folder, vehicles, minutes);
  return learn(setting, options, origin + "/network", key, [&] {
    for (const char* const task : {"random-walk", "swap"}) {
      Plan plan = {task, vehicles, 30 * minutes,
                   stages.seed(fmt::format("minutes {}", task), static_cast<std::uint64_t>(vehicles))};
      if (plan.task == "random-walk") plan.drawn_in = kStages[stage].drawn_in;
      fly_logged(setting, stages.truth(), plan, network ? &*network : nullptr, origin + "/fit/" + task);
    }
    const residuals::Inputs fit = read_simulated(stages.truth(), {origin + "/fit"});
    const residuals::Inputs select = stages.inputs({stage}, "select"), test = stages.inputs({stage}, "test");
    return learning::load_learning_data({&fit, &select, &test}, options.sizes, learning::SplitBy::kFlights,
                                        setting.jobs, [](int, int) {});
  });
}

Finding run_minutes(const Setting& setting) {
  Stages stages(setting, truths(setting).front(), 0);
  MinutesResult result{stages.truth().name, {}};
  const std::vector<double> minutes =
      setting.full ? std::vector<double>{0.125, 0.25, 0.5, 1, 2, 4} : std::vector<double>{0.125, 0.5};
  std::string data;
  for (int vehicles = 2; vehicles <= 4; ++vehicles) {
    for (const double some : minutes) {
      const Learned learned = learned_in(some, vehicles, setting, stages);
      result.curve.push_back({vehicles, some, learned.test_gf, learned.nothing_gf});
      data += fmt::format("{} {}\n", some, learned.test_gf);
    }
    data += "\n\n";
  }
  Finding finding;
  finding.fields = files::record_of(result);
  finding.show("RMSE on flights not seen", "curve",
               {{"vehicles"},
                {"minutes", "", "{:g}"},
                {"test_rmse_gf", "RMSE", "{:.2f}"},
                {"test_rmse_of_nothing_gf", "of nothing", "{:.2f}"}});
  finding.figures.push_back(
      {"minutes", data,
       "set logscale x\nset grid\nset xlabel 'minutes of flight, half random walk, half swaps'\n"
       "set ylabel 'RMSE on flights not seen [gf]'\nset yrange [0:*]\nset key top right\nplot for "
       "[i=0:2] 'minutes.dat' index i with linespoints lw 2 title sprintf('%d vehicles', i + 2)\n",
       "Test error over minutes of flight, networks of the paper's size."});
  return finding;
}

}  // namespace

Experiment curriculum() {
  return experiment<CurriculumResult>("curriculum", "section III-C: distances and labels from stage to stage",
                                      run_curriculum);
}

Experiment minutes_of_data() {
  return experiment<MinutesResult>("data", "section V-B: test error over minutes of data", run_minutes);
}

}  // namespace swarmcert::reproduction
