/// @file The result of `study` as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/study/study_result.h"

namespace swarmcert::analysis {

/// Whether something was added that the search for named effects in the force does not name: the diagnosis then speaks
/// of less than the fitted model.
bool adds_forms(const StudyResult& result);

/// Returns the whole answer in two sentences, with its numbers.
std::string headline(const StudyResult& result, const residuals::ForceUnit& unit);

/// Returns two lines per cause, the reason for which nothing further was added, and what to do next.
std::vector<std::string> conclusions(const StudyResult& result, const residuals::ForceUnit& unit);

/// Returns the command to type next: a check of the fitted model, else a search for what is left, else the errors from
/// which `bound` computes.
/// @param output folder of the study
std::string next_of_study(const identification::Study& study, const FlightOptions& options,
                          const residuals::Inputs& inputs, const std::string& output);

/// Prints about ten lines for the terminal.
void print_study(const StudyResult& result, const residuals::ForceUnit& unit);

/// Compares with the flights of --against.
Changes changes_of(std::vector<identification::Difference> differences, const residuals::Inputs& inputs,
                   const residuals::Inputs& others, const std::vector<std::string>& other_files, int jobs);

/// Returns one sentence per vehicle, and one per rotor that is named.
std::vector<std::string> in_words(const Changes& changes);

void print_changes(const Changes& changes);

}  // namespace swarmcert::analysis
