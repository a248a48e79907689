/// @file Campaigns of hidden effects: who flies with what, and how the answers of diagnose are judged.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "hidden_effect/other_simulator.h"

namespace swarmcert::tests {

/// One hidden effect, or none.
struct Hidden {
  std::string name;
  Truth truth;
  std::set<std::string> answers;  ///< names that are right, any of them
  std::set<std::string> allowed =
      {};  ///< may be named besides: what the library's form leaves of another form
  int vehicles = 1;
  bool is_foreign = false;  ///< gust, or a force outside the library: must be flagged as unexplained
  /// Same-form truths: the parameter and its true value.
  std::string parameter = {};
  double value = 0;
  double tolerance = 0.1;
};

/// At least ten single effects, of the library's form and of others.
std::vector<Hidden> single_effects();
/// Gusts and forces that no effect of the library has.
std::vector<Hidden> foreign_forces();
/// Single effects in a gust: both must be said.
std::vector<std::vector<Hidden>> disturbed();
/// Pairs of `single_effects()` at once.
std::vector<std::vector<Hidden>> pairs();

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

/// Clopper-Pearson interval at 90 % of `hits` in `runs`.
std::pair<double, double> clopper_pearson(int hits, int runs);

/// "38 of 40 (0.95, 90 %: 0.85 .. 0.99)".
std::string share(int hits, int runs);

}  // namespace swarmcert::tests
