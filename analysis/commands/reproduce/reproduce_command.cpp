#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "analysis/cli/bundled.h"
#include "analysis/cli/command_line.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/shard_option.h"
#include "analysis/report/report.h"
#include "analysis/reproduction/experiments.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::analysis {
namespace {

namespace fs = std::filesystem;
using reproduction::Experiment;
using reproduction::Finding;

struct ReproduceOptions {
  std::string name, output, shard = "0/1";
  reproduction::Setting setting;
};

const Experiment& experiment(const std::string& name) {
  std::vector<std::string> names;
  for (const Experiment& known : reproduction::experiments()) {
    if (known.name == name) return known;
    names.push_back(known.name);
  }
  throw UsageError("unknown experiment " + name + ": " + files::did_you_mean(name, names));
}

void print(const Finding& finding) {
  for (const reproduction::Table& table : finding.tables) {
    fmt::print("{}\n", table.title);
    std::vector<std::size_t> widths(table.header.size());
    for (std::size_t c = 0; c < widths.size(); ++c) {
      widths[c] = table.header[c].size();
      for (const auto& row : table.rows) widths[c] = std::max(widths[c], row[c].size());
    }
    const auto line = [&](const std::vector<std::string>& row) {
      std::string text = "  ";
      for (std::size_t c = 0; c < row.size(); ++c)
        text +=
            c == 0 ? fmt::format("{:<{}}", row[c], widths[c]) : fmt::format("  {:>{}}", row[c], widths[c]);
      fmt::print("{}\n", text);
    };
    line(table.header);
    for (const auto& row : table.rows) line(row);
    fmt::print("\n");
  }
  for (const std::string& note : finding.notes) fmt::print("{}\n", note);
}

std::string write_report(const ReproduceOptions& options, const Finding& finding) {
  Report report("Reproduction: " + experiment(options.name).summary);
  report.made_by(command_to_copy());
  for (const std::string& note : finding.notes) report.paragraph(note);
  for (const reproduction::Table& table : finding.tables) {
    report.heading(table.title);
    report.table(table.header, table.rows);
  }
  for (const reproduction::Figure& figure : finding.figures)
    report.figure(figure.name, figure.data, figure.script, figure.caption);
  return report.write((fs::path(options.output) / options.name).string(), true);
}

int run_reproduce(ReproduceOptions options, const CommonOptions& common) {
  const Experiment& chosen = experiment(options.name);
  options.setting.shard = parse_shard(options.shard);
  const fs::path result_file = fs::path(options.output) / options.name / "result.json";
  refuse_to_replace(common, common.json);
  reproduction::Setting& setting = options.setting;
  const bool is_part = !setting.shard.is_whole();
  if (!is_part) refuse_to_replace(common, result_file.string());
  if (!setting.recorded.empty() && !fs::is_directory(setting.recorded))
    throw files::InputError({setting.recorded, "", "--recorded", "", "is not a folder",
                             "name the one of the published data, with flights/ and weights/"});
  for (const auto& [name, folder] :
       {std::pair("--calibrate", &setting.calibrate), {"--flights", &setting.flights}}) {
    if (!folder->empty() && !fs::is_directory(*folder))
      throw files::InputError(
          {*folder, "", name, "", "is not a folder", "name one with logs/logNN and info/infoNN.yaml"});
  }
  setting.jobs = common.jobs;
  setting.work = (fs::path(options.output) / (setting.full ? "full" : "small")).string();
  setting.models = bundled_folder("models", "stability/models");
  setting.gains = bundled_folder("gains", "controller/gains") + "/crazyflie-small.toml";
  setting.fleet = bundled_folder("analysis/flights", "analysis/flights") + "/flights.toml";
  std::unique_ptr<Progress> progress;
  std::string part;
  double share = 0;
  setting.progress = [&](int done, int total, const std::string& what) {
    // A new stage starts a new line: its text differs, or its progress starts over.
    const std::string begins = what.substr(0, what.find(','));
    const double now = static_cast<double>(done) / std::max(total, 1);
    if (!progress || begins != part || now < share) progress = std::make_unique<Progress>(common.quiet);
    part = begins;
    share = now;
    progress->show(done, total, what);
  };
  const Finding finding = chosen.run(setting);
  progress.reset();

  std::vector<std::string> inputs = {setting.gains, setting.models + "/crazyflie-small-effects.toml"};
  inputs.insert(inputs.end(), finding.inputs.begin(), finding.inputs.end());
  files::Json result = result_head("reproduce", inputs);
  result["seed"] = setting.seed;
  result["experiment"] = options.name;
  result["size"] = setting.full ? "full" : "small";
  result["updraft"] = setting.updraft;
  result["complete"] = !is_part;
  result.update(finding.json);
  write_result(common, result);
  if (common.prints_text()) print(finding);
  if (is_part) {
    if (common.prints_text())
      fmt::print("Part {} is done. When all parts are, the same command without --shard merges them.\n",
                 options.shard);
    return kDone;
  }
  const std::string report = write_report(options, finding);
  files::write_file(result_file.string(), files::to_text(result), true);
  if (common.prints_text()) fmt::print("Report: {}\nNumbers: {}\n", report, result_file.string());
  return kDone;
}

}  // namespace

Command reproduce_command() {
  std::string names;
  std::vector<std::string> words;
  for (const Experiment& known : reproduction::experiments()) {
    words.push_back(known.name);
    names += fmt::format("  {:<14} {}\n", known.name, known.summary);
  }
  return {
      "reproduce", "Reproduce the paper's table and figures, and experiments beyond them",
      "Experiments\n" + names +
          "\nWrites DIR/EXPERIMENT/: report.html, its plots with their data, result.json. Flights and "
          "networks in\nDIR/small or DIR/full are shared: existing ones are reused, and an interrupted run "
          "continues.\nResults are shown as found, with their seeds. Interaction torques are learned by "
          "train --quantity\ntorque, and flown by simulate --torque-network.\n\nExample: swarmcert reproduce "
          "table -o reproduced\n"
          "         swarmcert reproduce table --full --shard 1/2 -o reproduced\n"
          "         swarmcert reproduce gains-in-flight --calibrate flown --flights new -o reproduced",
      [words](CLI::App& app) {
        const auto options = std::make_shared<ReproduceOptions>();
        app.add_option("EXPERIMENT", options->name, "Experiment to run, see Experiments below")
            ->type_name(fmt::format("{{{}}}", fmt::join(words, ",")))
            ->required();
        add_output(app, "-o,--output", options->output, "Output folder")->required();
        app.add_flag("--full", options->setting.full, "Full size: a minute per task, more seeds");
        app.add_option("--shard", options->shard, "i/N: only this part, for several machines");
        app.add_option("--seed", options->setting.seed, "Seed of flights, noise and networks")
            ->capture_default_str();
        app.add_flag("--updraft", options->setting.updraft,
                     "The simulated truth has an updraft around downwash");
        app.add_option("--recorded", options->setting.recorded,
                       "Folder of the published data, with flights/ and weights/");
        app.add_option("--calibrate", options->setting.calibrate,
                       "gains-in-flight: folder with logs/logNN[_k] and info/infoNN.yaml to calibrate on");
        app.add_option("--flights", options->setting.flights,
                       "gains-in-flight: such a folder to report on; naming the same folder again judges "
                       "each gain set by the others");
        app.add_option("--coverage", options->setting.coverage,
                       "gains-in-flight: probability with which a flight stays below its bound")
            ->check(CLI::Range(0.5, 0.99))
            ->capture_default_str();
        return [options](const CommonOptions& common) { return run_reproduce(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
