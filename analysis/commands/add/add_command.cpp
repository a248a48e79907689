#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/add/add_output.h"
#include "analysis/commands/add/add_report.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/explain/glossary.h"
#include "analysis/commands/shared/clock_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/label_output.h"
#include "analysis/commands/shared/output_folder.h"
#include "analysis/commands/shared/plausibility_output.h"
#include "analysis/identification/balance/balance_ladder.h"
#include "analysis/identification/ladder.h"
#include "analysis/identification/scan/proposal.h"
#include "analysis/identification/turning.h"
#include "nn/base/file_io.h"
#include "nn/base/suggest.h"
#include "nn/base/text.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::Ladder;

struct AddOptions {
  FlightOptions flights;
  std::string effects, output, report;
  bool keep_anyway = false, lists_effects = false;
};

std::vector<std::string> names_between_commas(const std::string& text) {
  std::vector<std::string> names = files::split_at_commas(text);
  names.erase(std::remove(names.begin(), names.end(), std::string()), names.end());
  return names;
}

void check(const std::vector<std::string>& names, const stability::Model& model) {
  if (names.empty()) throw UsageError("no effect is named: add EFFECT[,EFFECT], auto, undo or show");
  std::vector<std::string> known = identification::candidate_names(model);
  known.emplace_back(identification::rotor_effect());
  for (const std::string& name : identification::turning_effects()) known.push_back(name);
  std::vector<std::string> all = known;
  all.insert(all.end(), {"auto", "formula", "shape", "show", "undo"});
  for (const std::string& name : stability::effect_names()) {
    if (identification::is_written_by_hand(name)) all.push_back(name);
  }
  for (const std::string& name : names) {
    if (identification::is_proposal(name)) continue;
    if (identification::is_balanced(name)) {
      if (names.size() > 1)
        throw UsageError("add " + name + " by itself: it is fitted to means over a second");
      continue;
    }
    if (identification::is_written_by_hand(name))
      throw UsageError("the effect " + name +
                       " cannot be fitted to the force of a flight; write it into the model file");
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw UsageError("unknown effect " + name + ": " + effect_suggestion(name, all));
    if (identification::is_taken(name, model))
      throw UsageError("the model has the effect " + name +
                       " already; remove it from the file to fit it again");
  }
}

void report_ladders(const AddOptions& options, const CommonOptions& common, const files::Node& result,
                    const std::vector<LadderOfModel>& ladders, const residuals::ForceUnit& unit,
                    const BeforeAfter* change = nullptr) {
  if (options.report.empty()) return;
  const std::string path =
      write_ladder_report(ladders, change, unit, to_json(result), options.report, common.force);
  if (common.prints_text()) fmt::print("report: {}\n", path);
}

BeforeAfter before_and_after(const residuals::Inputs& inputs, const Ladder& ladder, bool embeds, int jobs) {
  const auto silent = [](int, int) {};
  residuals::Inputs fitted = inputs;
  fitted.models[0] = ladder.model;
  BeforeAfter change = {residuals::compare(inputs, jobs, silent),
                        residuals::compare(fitted, jobs, silent),
                        identification::picture_data(inputs, inputs.models[0], ladder.model),
                        {}};
  if (embeds) change.flights = residuals::flown_signals(inputs, &fitted, change.before.moments);
  return change;
}

/// Comment lines at the head of the model file.
std::vector<std::string> heading_of(const stability::Model& model) {
  std::vector<std::string> lines = {"Effects fitted to flights by swarmcert add."};
  for (const stability::EffectSpec& effect : model.effects) {
    if (!is_sensor_error(effect.name)) continue;
    const std::string words = sensor_words(effect.name);
    if (std::find(lines.begin(), lines.end(), words) == lines.end()) lines.push_back(words);
  }
  return lines;
}

/// `add undo`: restores the model from before the last accepted effect.
int undo(const AddOptions& options, const CommonOptions& common) {
  if (options.flights.models.size() != 1) throw UsageError("add undo takes one --model");
  if (options.output.empty()) throw UsageError("add undo writes a new model: name it with -o");
  const std::string& path = options.flights.models[0];
  const stability::Model model = identification::undone(stability::read_model(path));
  files::write_file(options.output, stability::to_toml(model, heading_of(model)), common.force);
  const LadderOfModel kept = {model.path, model.ladder, model.effects};
  const residuals::ForceUnit unit = residuals::force_unit(options.flights.unit, {model});
  const files::Node result = result_of("add", {path}, std::nullopt, AddResult{kept, {}, {}});
  write_result(common, result);
  if (common.prints_text()) {
    fmt::print("{}Written: {}\n", to_text(ladder_table(model.ladder, unit)), options.output);
  }
  report_ladders(options, common, result, {kept}, unit);
  return kDone;
}

/// `add show`: prints the ladders stored in model files, one below the other.
int show(const AddOptions& options, const CommonOptions& common) {
  std::vector<LadderOfModel> ladders;
  residuals::ForceUnit unit;
  for (const std::string& path : options.flights.models) {
    const stability::Model model = stability::read_model(path);
    // One page uses one unit, that of the first model.
    if (ladders.empty()) unit = residuals::force_unit(options.flights.unit, {model});
    ladders.push_back({path, model.ladder, model.effects});
    if (!common.prints_text()) continue;
    fmt::print("{}{}\n", path, model.ladder.empty() ? ": no ladder" : "");
    if (!model.ladder.empty()) fmt::print("{}", to_text(ladder_table(model.ladder, unit)));
  }
  const files::Node result =
      result_of("add", options.flights.models, std::nullopt, AddResult{{}, {}, ladders});
  write_result(common, result);
  report_ladders(options, common, result, ladders, unit);
  return kDone;
}

/// What was written, and the command to type next.
void print_end(const Ladder& ladder, const AddOptions& options, const residuals::Inputs& inputs) {
  if (ladder.any_accepted)
    fmt::print("Written: {}\nNext: {}\n", options.output,
               next_command("compare", {options.output}, options.flights, inputs, {"--horizon", "0.5"}));
  else
    fmt::print("No effect helped: {} is not written. --keep-anyway writes it nevertheless.\nNext: {}\n",
               options.output,
               next_command("diagnose", options.flights.models, options.flights, inputs, {"--next"}));
}

int climb(const AddOptions& options, const CommonOptions& common) {
  if (options.output.empty()) throw UsageError("add writes a new model: name it with -o");
  if (options.flights.words.empty()) throw UsageError("add needs flights: name logs or folders of them");
  refuse_to_replace(common, options.output);
  refuse_missing_folder(options.output);
  if (options.flights.models.size() != 1) throw UsageError("add takes one --model");
  residuals::Inputs inputs = read_flights(options.flights, false, false, true);
  const residuals::ForceUnit unit = unit_of(options.flights, inputs);
  const std::vector<identification::Mislabelled> labels =
      identification::find_and_correct_labels(inputs, common.jobs);
  const std::vector<identification::ClockOffset> clocks =
      identification::find_and_correct_clocks(inputs, common.jobs);
  identification::LadderOptions what;
  what.automatic = options.effects == "auto";
  if (!what.automatic) {
    what.effects = names_between_commas(options.effects);
    check(what.effects, inputs.models[0]);
  }
  what.keep_anyway = options.keep_anyway;
  Progress progress(common.quiet);
  const bool is_balanced = !what.automatic && identification::is_balanced(what.effects[0]);
  const Ladder ladder =
      is_balanced ? identification::balance_ladder(inputs, what.effects[0], what.keep_anyway, common.jobs)
                  : identification::climb(inputs, what, common.jobs, [&](int done, int total) {
                      progress.show(done, total, "flights");
                    });
  if (ladder.any_accepted) {
    files::write_file(options.output, stability::to_toml(ladder.model, heading_of(ladder.model)),
                      common.force);
  }
  const files::Node result =
      result_of("add", inputs.files(), std::nullopt,
                AddResult{LadderOfModel{"On these flights", ladder.rows, ladder.model.effects},
                          Climbed{ladder, clocks, labels},
                          {}});
  if (common.prints_text()) {
    print_clock_offsets(clocks);
    print_mislabelled(labels);
  }
  for (const std::string& problem : few_of_each(ladder.problems)) note("warning: " + problem);
  write_result(common, result);
  if (!ladder.too_poor.empty()) {
    note("inconclusive: " + ladder.too_poor + "; 'swarmcert compare' shows what was cut");
    return kInconclusive;
  }
  if (common.prints_text()) {
    print_ladder(ladder, unit);
    print_end(ladder, options, inputs);
  }
  std::vector<LadderOfModel> ladders;
  if (!ladder.earlier.empty())
    ladders.push_back({"The model's ladder so far, on the flights of then", ladder.earlier, {}});
  ladders.push_back({"On these flights", ladder.rows, ladder.model.effects});
  std::optional<BeforeAfter> change;
  if (ladder.any_accepted && !options.report.empty())
    change = before_and_after(inputs, ladder, !options.flights.no_embed, common.jobs);
  report_ladders(options, common, result, ladders, unit, change ? &*change : nullptr);
  return kDone;
}

/// The registered effects, one line each; their JSON is that of `explain`.
int list_effects(const CommonOptions& common) {
  if (common.prints_text()) {
    for (const GlossaryEntry& effect : effect_entries())
      fmt::print("{:<22}{}{}\n", effect.name, effect.equation,
                 effect.same_as.empty() ? "" : "; shows like " + effect.same_as);
    fmt::print("'swarmcert explain EFFECT' says more; formula and shape need no effect\n");
  }
  write_result(common, result_of("explain", {}, std::nullopt, Explanation{"effects", effect_entries()}));
  return kDone;
}

int run_add(const AddOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  if (options.lists_effects) return list_effects(common);
  if (options.effects.empty()) throw UsageError("EFFECT is missing: add EFFECT[,EFFECT], auto, undo or show");
  if (options.flights.models.empty()) throw UsageError("--model is missing: name the model.toml to add to");
  if (options.effects == "undo") return undo(options, common);
  if (options.effects == "show") return show(options, common);
  return climb(options, common);
}

}  // namespace

Command add_command() {
  return {
      "add", "Fit effects to flights and add them to a model, with the errors before and after",
      "EFFECT is one name, several with commas, or auto: the effects that diagnose finds on the fitted "
      "flights. An effect\nis accepted if it lowers the error on flights not used in the fit; the test "
      "flights are only reported.\nformula is the best formula for the residual, as shown by diagnose "
      "(formula:2 is the second best); shape\nis a smooth or monotone curve if no formula fits. "
      "vehicle_offset is a constant force of each vehicle; rotor_thrust a factor for each rotor, from its "
      "duty in slow\n"
      "flight; com_offset and torque_bias are fitted to the rotors' mean torques, accelerometer_scale to\n"
      "the change of the velocity: that and imu_tilt correct a sensor. torque_ratio, rate_damping,\n"
      "flow_torque and rotor_momentum are fitted to predictions of half a second, from measured rotor\n"
      "speeds. undo goes back by one accepted effect; show prints the ladders of all --model files.\n\n"
      "Examples: swarmcert add auto --model stability/models/crazyflie-small.toml flights/ -o fitted.toml\n"
      "          swarmcert add undo --model fitted.toml -o before.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<AddOptions>();
        app.add_option("EFFECT", options->effects,
                       "Names of effects separated by commas, formula, shape, auto, undo or show");
        app.add_flag("--list", options->lists_effects, "List all effects");
        declare_flights(app, options->flights, false);
        add_output(app, "-o,--output", options->output, "The new model.toml");
        app.add_flag("--keep-anyway", options->keep_anyway, "Also add effects that do not reduce the error");
        add_output(
            app, "--report", options->report,
            "Write an HTML report into this folder: the error ladder, and maps, curves and worst moments "
            "before and after");
        declare_unit(app, options->flights);
        declare_no_embed(app, options->flights);
        return [options](const CommonOptions& common) { return run_add(*options, common); };
      },
      fields_of<AddResult>()};
}

}  // namespace swarmcert::analysis
