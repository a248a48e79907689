/// @file Campaigns of hidden effects: flies them and judges the answers of diagnose.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hidden_effect/truths.h"

namespace swarmcert::tests {

/// The answer of diagnose for one flight.
struct Answer {
  std::string label;
  std::vector<std::string> named;  ///< in ranking order
  std::vector<double> drops;       ///< of each, relative fall of the RMSE
  bool first_right = false, exact = false, all_found = false;
  bool claims_falsely = false;  ///< reports an effect that is not present
  bool flagged = false;
  double ratio = 0;
  bool has_value = false, value_right = false, covered = false;
  double value_error = 0;  ///< relative
};

/// Simulates `hidden` effects together, with one vehicle or as many as one of them needs, and runs diagnose. The model
/// includes a motor lag if the truth has one and `knows_lag` is set.
/// @param folder scratch folder; the flights are removed
Answer ask(const std::vector<Hidden>& hidden, Program program, double duration_s, std::uint64_t seed,
           const std::string& folder, bool knows_lag);

/// Like ask(), for campaigns that take longer than one session. If the environment variable SWARMCERT_CAMPAIGN names a
/// folder, answers are stored there, one file each, and runs with an answer are not repeated. With
/// SWARMCERT_CAMPAIGN_SHARD = I/N (as for --shard) only every N-th run is simulated. Returns nothing for a run of
/// another shard without an answer. Answers depend on the version of the tool, so use a folder per commit.
std::optional<Answer> ask_once(const std::vector<Hidden>& hidden, Program program, double duration_s,
                               std::uint64_t seed, const std::string& folder, bool knows_lag);

/// Returns the 90 % Clopper-Pearson interval for `hits` in `runs`.
std::pair<double, double> clopper_pearson(int hits, int runs);

/// Returns "38 of 40 (0.95, 90 %: 0.85 .. 0.99)".
std::string share(int hits, int runs);

}  // namespace swarmcert::tests
