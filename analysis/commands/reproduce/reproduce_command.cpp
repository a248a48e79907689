#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

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
  for (const reproduction::Table& table : finding.tables)
    fmt::print("{}\n{}\n", table.title, to_text(table.cells));
  for (const std::string& note : finding.notes) fmt::print("{}\n", note);
}

std::string write_report(const ReproduceOptions& options, const Finding& finding) {
  Report report("Reproduction: " + experiment(options.name).summary);
  report.made_by(command_to_copy());
  for (const std::string& note : finding.notes) report.paragraph(note);
  for (const reproduction::Table& table : finding.tables) {
    report.heading(table.title);
    report.table(table.cells);
  }
  for (const reproduction::Figure& figure : finding.figures)
    report.figure(figure.name, figure.data, figure.script, figure.caption);
  return report.write((fs::path(options.output) / options.name).string(), true);
}

void describe_setting(files::Record& record, const std::string& experiment,
                      const reproduction::Setting& setting) {
  record.field("experiment", experiment, "Decides which further fields there are.");
  record.field("size", setting.full ? "full" : "small", "small: seconds to minutes; full: that of --full.");
  record.field("updraft", setting.updraft, "Whether the simulated truth has an updraft around downwash.");
  record.field("complete", setting.shard.is_whole(), "false: one part of --shard.");
}

/// A field that results of some experiments have, with its shape in each.
struct SharedField {
  std::string experiments;
  std::vector<files::Node> shapes;  ///< that differ
};

/// Fields of all experiments, each described by one of them; where their shapes differ, by each.
void describe_any(files::Record& record) {
  std::vector<std::pair<std::string, SharedField>> fields;
  const auto schema = [](const files::Node& shape) { return files::schema_of(shape, "", "", "", true); };
  for (const Experiment& one : reproduction::experiments()) {
    files::Node shape;
    files::Record of_one(shape, true);
    one.describe_result(of_one);
    for (const files::Node& field : shape.members) {
      const auto known = std::find_if(fields.begin(), fields.end(),
                                      [&](const auto& other) { return other.first == field.name; });
      SharedField& shared =
          known != fields.end() ? known->second : fields.emplace_back(field.name, SharedField{}).second;
      shared.experiments += (shared.experiments.empty() ? "" : ", ") + one.name;
      if (std::none_of(shared.shapes.begin(), shared.shapes.end(),
                       [&](const files::Node& other) { return schema(other) == schema(field); }))
        shared.shapes.push_back(field);
    }
  }
  describe_setting(record, "", {});
  for (const auto& [name, shared] : fields) {
    files::Node any = shared.shapes[0];
    if (shared.shapes.size() > 1) {
      any = {};
      any.kind = files::Node::Kind::kOneOf;
      any.members = shared.shapes;
    }
    const files::About& about = any.about;
    const std::string meaning = shared.experiments + (*about.meaning == '\0' ? "" : ": ") + about.meaning;
    record.may(files::interned(name), std::optional(any), files::interned(meaning), about.unit,
               about.guarantee);
  }
}

/// Returns the words of the same experiment, undivided, into `output`.
std::vector<std::string> same_experiment(const ReproduceOptions& options, bool full,
                                         const std::string& output) {
  const reproduction::Setting& setting = options.setting;
  std::vector<std::string> words = {"reproduce", options.name, "-o", output};
  if (full) words.push_back("--full");
  if (setting.updraft) words.push_back("--updraft");
  if (!setting.recorded.empty()) words.insert(words.end(), {"--recorded", setting.recorded});
  if (setting.seed != reproduction::Setting().seed)
    words.insert(words.end(), {"--seed", std::to_string(setting.seed)});
  return words;
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
  const files::Node result = described_result("reproduce", inputs, setting.seed, [&](files::Record& record) {
    describe_setting(record, options.name, setting);
    for (const files::Node& field : finding.fields.members)
      record.field(field.name.c_str(), field, field.about.meaning, field.about.unit, field.about.guarantee);
  });
  write_result(common, result);
  if (common.prints_text()) print(finding);
  if (is_part) {
    if (common.prints_text()) fmt::print("Part {} is done. When all parts are, merge them.\n", options.shard);
    print_next(common, same_experiment(options, setting.full, options.output));
    return kDone;
  }
  const std::string report = write_report(options, finding);
  files::write_file(result_file.string(), files::to_text(files::to_json(result)), true);
  if (common.prints_text()) fmt::print("Report: {}\nNumbers: {}\n", report, result_file.string());
  const bool has_sizes = setting.calibrate.empty();  // what was recorded has one size
  if (!setting.full && has_sizes)
    print_next(common, same_experiment(options, true, options.output + "-full"));
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
      },
      describe_any};
}

}  // namespace swarmcert::analysis
