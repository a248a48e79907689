/// @file Campaigns of hidden effects: how the answers of diagnose are judged.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hidden_effect/truths.h"

namespace swarmcert::tests {

/// What diagnose said of one flight.
struct Answer {
  std::string label;
  std::vector<std::string> named;  ///< in the ranking's order
  std::vector<double> drops;       ///< of each, relative fall of the RMSE
  bool first_right = false, exact = false, all_found = false;
  bool claims_falsely = false;  ///< names something that is not there
  bool flagged = false;
  double ratio = 0;
  bool has_value = false, value_right = false, covered = false;
  double value_error = 0;  ///< relative
};

/// Flies `hidden` together, one vehicle or as many as one of them needs, and asks diagnose. The model knows of a lag
/// of the motors where the truth has one and `knows_lag`.
/// @param folder scratch; the flights are removed.
Answer ask(const std::vector<Hidden>& hidden, Program program, double duration_s, std::uint64_t seed,
           const std::string& folder, bool knows_lag);

/// As ask(), for campaigns that take longer than one sitting. Where the environment variable SWARMCERT_CAMPAIGN names a
/// folder, answers are kept there, one file each, and what has one is not flown again; with SWARMCERT_CAMPAIGN_SHARD =
/// I/N (as for --shard) only every N-th run is flown. Empty for a run that belongs to another shard and has no answer
/// yet. Answers are of the tool that gave them: a folder for each commit.
std::optional<Answer> ask_once(const std::vector<Hidden>& hidden, Program program, double duration_s,
                               std::uint64_t seed, const std::string& folder, bool knows_lag);

/// Clopper-Pearson interval at 90 % of `hits` in `runs`.
std::pair<double, double> clopper_pearson(int hits, int runs);

/// "38 of 40 (0.95, 90 %: 0.85 .. 0.99)".
std::string share(int hits, int runs);

}  // namespace swarmcert::tests
