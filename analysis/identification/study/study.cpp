#include "analysis/identification/study/study.h"

#include <algorithm>
#include <stdexcept>

#include "analysis/identification/rotors/lone_rotor.h"

namespace swarmcert::identification {
namespace {

residuals::Inputs with_flights(const residuals::Inputs& inputs, const std::vector<int>& which) {
  residuals::Inputs chosen = inputs;
  chosen.found.flights.clear();
  for (const int i : which) chosen.found.flights.push_back(inputs.found.flights[static_cast<std::size_t>(i)]);
  return chosen;
}

residuals::Inputs with_model(const residuals::Inputs& inputs, const stability::Model& model) {
  residuals::Inputs changed = inputs;
  changed.models[0] = model;
  return changed;
}

/// @param divided the same inputs, with the flights or parts that `split` refers to
StudyErrors errors_of(const residuals::Inputs& inputs, const residuals::Inputs& divided, const Split& split,
                      const stability::Model& model, int jobs) {
  const auto silent = [](int, int) {};
  StudyErrors errors;
  errors.all = residuals::compare(with_model(inputs, model), jobs, silent);
  const bool is_held_out = split.by != Split::By::kNothing;
  const residuals::Inputs judged = with_flights(with_model(divided, model), split.test);
  if (is_held_out) errors.test = residuals::compare(judged, jobs, silent);
  errors.predictions = residuals::predict(judged, kHorizon_s, false, jobs);
  return errors;
}

std::vector<int> not_for_test(const residuals::Inputs& inputs, const Split& split) {
  std::vector<int> which;
  for (const int i : every_flight(inputs)) {
    const bool is_test = std::find(split.test.begin(), split.test.end(), i) != split.test.end();
    if (!is_test || split.by == Split::By::kNothing) which.push_back(i);
  }
  return which;
}

}  // namespace

Study study(const residuals::Inputs& inputs, const std::optional<Split>& split, int jobs,
            const StudyProgress& progress) {
  if (inputs.models.size() != 1) throw std::invalid_argument("study: exactly one model is studied");
  constexpr int kSteps = 5;
  const auto silent = [](int, int) {};
  residuals::Inputs divided = inputs;
  const Split chosen = split ? *split : split_flights(divided);
  const stability::Model& given = inputs.models[0];
  Study result;
  progress(0, kSteps, "errors of the given model");
  result.before = errors_of(inputs, divided, chosen, given, jobs);
  progress(1, kSteps, "missing effects");
  const std::vector<int> seen = not_for_test(divided, chosen);
  result.diagnosis = diagnose(divided, given.kind, seen, jobs, silent);
  name_lone_rotor(divided, given.kind, seen, jobs, result.diagnosis.ranking);
  progress(2, kSteps, "adding effects, formulas and shapes");
  LadderOptions options;
  options.split = chosen;
  result.ladder = climb(divided, options, jobs, silent);
  const stability::Model& fitted = result.ladder.any_accepted ? result.ladder.model : given;
  progress(3, kSteps, "errors of the fitted model");
  result.after = errors_of(inputs, divided, chosen, fitted, jobs);
  progress(4, kSteps, "pictures");
  result.pictures = picture_data(inputs, given, fitted);
  progress(kSteps, kSteps, "done");
  return result;
}

}  // namespace swarmcert::identification
