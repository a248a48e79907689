#include "analysis/commands/train/train_report.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <map>

#include "analysis/cli/command_line.h"
#include "analysis/report/report.h"
#include "nn/weights/compositions.h"
#include "nn/weights/function_id.h"

namespace swarmcert::analysis {
namespace {

using Eigen::Index;
using learning::LearningData;
using learning::Use;

/// "vertical force [gf]", "force along x [gf]"
std::string label_of(const LearningData& data, int component) {
  const learning::TargetInfo& target = learning::info(data.target);
  if (target.components == 1) return fmt::format("{} [{}]", target.words, target.unit);
  return fmt::format("{} {} {} [{}]", target.words,
                     data.target == learning::Target::kTorque ? "about" : "along", "xyz"[component],
                     target.unit);
}

void add_curve(Report& report, const LearningData& data, const learning::Run& run, std::size_t teachers) {
  std::string text;
  for (std::size_t e = 0; e < run.epochs.size(); ++e)
    text += fmt::format("{} {} {}\n", e + 1, run.epochs[e].fit_rmse, run.epochs[e].select_rmse);
  report.figure(
      "epochs", text,
      fmt::format("set xlabel 'epoch'\nset ylabel 'RMSE [{}]'\nset yrange [0:*]\n",
                  learning::info(data.target).unit) +
          "plot 'epochs.dat' using 1:2 with linespoints lw 2 title 'flights to fit', '' using 1:3 with "
          "linespoints lw 2 title 'flights to select'\n",
      fmt::format("Error over epochs{}. Kept: epoch {}.",
                  teachers > 0 ? fmt::format(", to fit against the mean of {} teachers", teachers) : "",
                  run.best_epoch + 1));
}

/// Plots the share of the test samples per bin of one component of the target, before and after.
void add_histogram(Report& report, const LearningData& data, const training::Matrix& outputs, int component) {
  const std::vector<Index> samples = data.indices(Use::kTest);
  if (samples.empty()) return;
  constexpr int kBins = 81, kMiddle = kBins / 2;
  const double width = data.target == learning::Target::kTorque ? 0.02 : 0.5;
  std::array<std::array<double, kBins>, 2> share{};
  const auto count = [&](int which, double value) {
    const double bin = std::round(value / width) + kMiddle;
    if (bin >= 0 && bin < kBins)
      share[which][static_cast<std::size_t>(bin)] += 100.0 / static_cast<double>(samples.size());
  };
  for (const Index s : samples) {
    const auto target = static_cast<double>(data.samples.target_of(s)[component]);
    count(0, target);
    count(1, target - static_cast<double>(outputs(component, s)));
  }
  std::string text;
  for (int b = 0; b < kBins; ++b)
    text += fmt::format("{} {} {}\n", (b - kMiddle) * width, share[0][b], share[1][b]);
  const std::string name = fmt::format("residuals_{}", component), label = label_of(data, component);
  report.figure(
      name, text,
      fmt::format("set xlabel '{}'\nset ylabel 'samples [%]'\nplot '{}.dat' using 1:2 with steps lw 2 "
                  "lc 'gray' title 'without the network', '' using 1:3 with steps lw 2 title 'left by "
                  "the network'\n",
                  label, name),
      fmt::format("Residual of the model on the test flights: {}, in bins of {}.", label, width));
}

/// Plots the force of one neighbour at rest on a vehicle at the origin, over the neighbour's position in the plane y
/// = 0.
void add_map(Report& report, const LearningData& data, const learning::Run& run, int phi, int rho,
             int component) {
  training::Dataset grid;
  grid.outputs = data.samples.outputs;
  constexpr int kSteps = 61;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const float x = -0.5f + static_cast<float>(i) / (kSteps - 1);
      const float z = -0.3f + 1.2f * static_cast<float>(j) / (kSteps - 1);
      const int ground = data.layout.find(files::FunctionId::ground_phi());
      if (ground >= 0) grid.add_input(ground, {-0.6f, 0, 0, 0});
      grid.add_input(phi, {x, 0, z, 0, 0, 0});
      grid.add_sample(rho, std::vector<float>(static_cast<std::size_t>(grid.outputs), 0.0f));
    }
  }
  std::vector<Index> all(static_cast<std::size_t>(grid.samples()));
  for (std::size_t s = 0; s < all.size(); ++s) all[s] = static_cast<Index>(s);
  const training::Matrix force = training::predict(data.layout, run.theta, grid, all.data(), grid.samples());
  std::string text;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      text += fmt::format("{} {} {}\n", -0.5 + i / (kSteps - 1.0), -0.3 + 1.2 * j / (kSteps - 1.0),
                          force(component, static_cast<Index>(i) * kSteps + j));
    }
    text += "\n";
  }
  const std::string name = fmt::format("map_{}_{}_{}", phi, rho, component);
  report.figure(name, text,
                "set view map\nset xlabel 'neighbour to the side [m]'\nset ylabel 'neighbour above [m]'\n"
                "set cblabel '" +
                    label_of(data, component) +
                    "'\nset palette @signed_colours\n"
                    "stats '" +
                    name +
                    ".dat' using 3 nooutput\nm = (abs(STATS_min) > abs(STATS_max)) ? abs(STATS_min) : "
                    "abs(STATS_max)\nset cbrange [-m:m]\nset size ratio 1.2\nplot '" +
                    name + ".dat' using 1:2:3 with image notitle\n",
                data.layout.parts()[rho].id.name() + " with one neighbour of " +
                    data.layout.parts()[phi].id.name() + " at rest, 0.6 m above the ground.");
}

}  // namespace

std::string write_train_report(const LearningData& data, const learning::Run& run,
                               const learning::OutputSupport& support, const files::Node& result,
                               const std::string& folder, bool overwrite) {
  Report report("Training of a deep set");
  report.made_by(command_to_copy());
  report.result(result);
  report.heading("Learning curve");
  const bool was_taught = result.find("kept_seed")->value == result.find("seed")->value;
  add_curve(report, data, run, was_taught ? result.find("teachers")->members.size() : 0);
  report.heading("What is left");
  const int components = data.samples.outputs;
  training::Matrix outputs = learning::outputs_for(data, run.theta, Use::kTest);
  learning::silence(data, support, outputs);
  for (int c = 0; c < components; ++c) add_histogram(report, data, outputs, c);
  report.heading(std::string("The learned ") + learning::info(data.target).words);
  for (const auto& [composition, errors] : support.silent)
    report.paragraph(
        fmt::format("No network for {}: {:.3f} {} on the selecting flights with the output as trained, "
                    "{:.3f} without.",
                    composition, errors.network, learning::info(data.target).unit, errors.nothing));
  // By symmetry the other component vanishes in the plane y = 0.
  std::vector<int> in_plane = {0};
  if (data.target == learning::Target::kForce) in_plane = {0, 2};
  if (data.target == learning::Target::kTorque) in_plane = {1};
  const std::vector<training::Part>& parts = data.layout.parts();
  for (std::size_t phi = 0; phi < parts.size(); ++phi) {
    if (!parts[phi].id.is_phi() || parts[phi].id.is_ground_phi()) continue;
    for (std::size_t rho = 0; rho < parts.size(); ++rho) {
      if (!parts[rho].id.is_rho()) continue;
      const std::string own = parts[rho].id.kind();
      const auto scale = support.scales.find(own);
      if (scale != support.scales.end() && scale->second == 0) continue;
      if (support.silent.count(files::composition_name({parts[phi].id.kind()}, own)) == 1) continue;
      for (const int c : in_plane)
        add_map(report, data, run, static_cast<int>(phi), static_cast<int>(rho), c);
    }
  }
  report.heading("Flights");
  std::map<std::vector<std::string>, Index> samples;  // blocks of one flight are added up
  for (const learning::TrackSamples& track : data.tracks)
    samples[{track.flight, track.vehicle, track.composition, name(track.use)}] += track.end - track.begin;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [words, count] : samples) {
    rows.push_back(words);
    rows.back().push_back(std::to_string(count));
  }
  report.table({"flight", "vehicle", "neighbours > vehicle", "use", "samples"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
