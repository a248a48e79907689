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

void add_label_agreement(const Setting& setting, Stages& stages, Finding& finding) {
  const std::map<std::string, Labels> without = labels_of(setting, stages, 0),
                                      with = labels_of(setting, stages, 1);
  Table table = {"Labels minus true force at equal relative states [gf]",
                 {"relative state", "without network", "with network", "difference", "standard error"},
                 {}};
  finding.json["labels"] = files::Json::array();
  int beyond = 0;
  double squares = 0;
  for (const auto& [range, before] : without) {
    const auto after = with.find(range);
    if (after == with.end()) continue;
    const double difference = after->second.mean() - before.mean();
    const double error = std::hypot(before.error(), after->second.error());
    beyond += std::abs(difference) > 2 * error ? 1 : 0;
    squares += difference * difference;
    table.rows.push_back({range, fmt::format("{:.2f}", before.mean()),
                          fmt::format("{:.2f}", after->second.mean()), fmt::format("{:+.2f}", difference),
                          fmt::format("{:.2f}", error)});
    finding.json["labels"].push_back({{"range", range},
                                      {"without_gf", before.mean()},
                                      {"with_gf", after->second.mean()},
                                      {"difference_gf", difference},
                                      {"standard_error_gf", error}});
  }
  const double rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(table.rows.size(), 1)));
  finding.json["labels_rms_difference_gf"] = rms;
  finding.notes.push_back(fmt::format(
      "Labels with and without compensation differ by {:.2f} gf RMS over {} ranges of relative states; {} "
      "differ by more than two standard errors.",
      rms, table.rows.size(), beyond));
  finding.tables.push_back(std::move(table));
}

}  // namespace

Finding curriculum(const Setting& setting) {
  Finding finding;
  Stages stages(setting, truths(setting).front(), 0);
  Table table = {"Stages, truth \"flights\"",
                 {"vehicles", "flown with", "drawn in to", "least distance [m]", "1 % below [m]",
                  "test RMSE [gf]", "of nothing [gf]", "bound [gf/unit]"},
                 {}};
  finding.json["truth"] = stages.truth().name;
  finding.json["stages"] = files::Json::array();
  bool falls = true;
  double before_m = INFINITY;
  for (int k = 0; k < kNumStages; ++k) {
    const StageFlights flights = stages.flights(k);
    const Learned learned = stages.learned(k);
    falls = falls && flights.least_distance_m < before_m;
    before_m = flights.least_distance_m;
    table.rows.push_back(
        {std::to_string(kStages[k].vehicles), kStages[k].flown_with, fmt::format("{:g}", kStages[k].drawn_in),
         fmt::format("{:.3f}", flights.least_distance_m),
         fmt::format("{:.3f}", flights.percentile_distance_m), fmt::format("{:.2f}", learned.test_gf),
         fmt::format("{:.2f}", learned.nothing_gf), fmt::format("{:.0f}", learned.bound)});
    finding.json["stages"].push_back({{"vehicles", kStages[k].vehicles},
                                      {"flown_with", kStages[k].flown_with},
                                      {"drawn_in", kStages[k].drawn_in},
                                      {"least_distance_m", flights.least_distance_m},
                                      {"percentile_distance_m", flights.percentile_distance_m},
                                      {"test_rmse_gf", learned.test_gf},
                                      {"test_rmse_of_nothing_gf", learned.nothing_gf},
                                      {"gamma_proved", learned.keeps_gamma},
                                      {"bound", learned.bound}});
  }
  finding.tables.push_back(std::move(table));
  finding.json["least_distance_falls"] = falls;
  finding.notes.push_back(
      fmt::format("The least distance flown, as the mean of {} random walks, {} from stage to stage. Set "
                  "points are contracted in flights with a network, by factors of our choice: otherwise the "
                  "task's repulsion keeps four vehicles as far apart as two.",
                  scale_of(setting).walks, falls ? "falls" : "does not fall every time"));
  add_label_agreement(setting, stages, finding);
  return finding;
}

Finding minutes_of_data(const Setting& setting) {
  Finding finding;
  Stages stages(setting, truths(setting).front(), 0);
  const std::vector<double> minutes =
      setting.full ? std::vector<double>{0.125, 0.25, 0.5, 1, 2, 4} : std::vector<double>{0.125, 0.5};
  finding.json["truth"] = stages.truth().name;
  finding.json["curve"] = files::Json::array();
  Table table = {"RMSE on flights not seen [gf]", {"minutes", "2 vehicles", "3 vehicles", "4 vehicles"}, {}};
  std::string data;
  for (const double some : minutes) table.rows.push_back({fmt::format("{:g}", some)});
  for (int vehicles = 2; vehicles <= 4; ++vehicles) {
    const int stage = stage_of(vehicles);
    const std::optional<files::Network> network = stages.flown_network(stage);
    const std::string root = stages.flights(stage).folder + "/../minutes";
    const auto folder = [&](double some) { return fmt::format("{}/{}-{:g}", root, vehicles, some); };
    // Each duration is half random walk and half swaps.
    for (const double some : minutes) {
      LearnOptions options = stages.learn_options();
      options.steps = setting.full ? 6000 : 600;
      const std::string key = fmt::format("{} {} {}", stages.key(stage), some, vehicles);
      const std::string origin = folder(some);
      const Learned learned = learn(setting, options, origin + "/network", key, [&] {
        for (const char* const task : {"random-walk", "swap"}) {
          Plan plan = {task, vehicles, 30 * some,
                       stages.seed(fmt::format("minutes {}", task), static_cast<std::uint64_t>(vehicles))};
          if (plan.task == "random-walk") plan.drawn_in = kStages[stage].drawn_in;
          fly_logged(setting, stages.truth(), plan, network ? &*network : nullptr, origin + "/fit/" + task);
        }
        const residuals::Inputs fit = read_simulated(stages.truth(), {origin + "/fit"});
        const residuals::Inputs select = stages.inputs({stage}, "select"),
                                test = stages.inputs({stage}, "test");
        return learning::load_learning_data({&fit, &select, &test}, options.sizes,
                                            learning::SplitBy::kFlights, setting.jobs, [](int, int) {});
      });
      const std::size_t row =
          static_cast<std::size_t>(std::find(minutes.begin(), minutes.end(), some) - minutes.begin());
      table.rows[row].push_back(fmt::format("{:.2f}", learned.test_gf));
      finding.json["curve"].push_back({{"vehicles", vehicles},
                                       {"minutes", some},
                                       {"test_rmse_gf", learned.test_gf},
                                       {"test_rmse_of_nothing_gf", learned.nothing_gf}});
      data += fmt::format("{} {}\n", some, learned.test_gf);
    }
    data += "\n\n";
  }
  finding.tables.push_back(std::move(table));
  finding.figures.push_back(
      {"minutes", data,
       "set logscale x\nset grid\nset xlabel 'minutes of flight, half random walk, half swaps'\n"
       "set ylabel 'RMSE on flights not seen [gf]'\nset yrange [0:*]\nset key top right\nplot for "
       "[i=0:2] 'minutes.dat' index i with linespoints lw 2 title sprintf('%d vehicles', i + 2)\n",
       "Test error over minutes of flight, networks of the paper's size."});
  return finding;
}

}  // namespace swarmcert::reproduction
