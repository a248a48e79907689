/// Flies each single effect, prints the names by evidence beside those of diagnose, and counts both.
///   hidden_effect_evidence [gust_N] [first seed] [seeds]
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/evidence/explanations.h"
#include "data.h"
#include "hidden_effect/truths.h"

namespace {

using namespace swarmcert;

/// A name, then what flights cannot tell from it.
using Class = std::vector<std::string>;

struct Tally {
  int exact = 0, among = 0, wrong = 0, runs = 0;
  double seconds = 0;

  /// Runs a procedure and returns its names, with a mark.
  std::string add(const tests::Hidden& hidden, const std::function<std::vector<Class>()>& name) {
    const std::clock_t start = std::clock();
    const std::vector<Class> named = name();
    seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    const auto is_right = [&](const std::string& n) { return hidden.answers.count(n) != 0; };
    const bool first_right =
        std::all_of(named.begin(), named.end(), [&](const Class& c) { return is_right(c.front()); });
    const bool has_right = std::all_of(named.begin(), named.end(), [&](const Class& c) {
      return std::any_of(c.begin(), c.end(), is_right);
    });
    const bool is_silent = named.empty() && !hidden.answers.empty();
    ++runs;
    exact += first_right && !is_silent ? 1 : 0;
    among += has_right && !first_right ? 1 : 0;
    wrong += has_right ? 0 : 1;
    std::vector<std::string> words;
    for (const Class& c : named) words.push_back(fmt::format("{}", fmt::join(c, " or ")));
    const char* const mark = is_silent ? "silent" : first_right ? "right" : has_right ? "among" : "WRONG";
    return fmt::format("{:<6} [{}]", mark, fmt::join(words, "; "));
  }
  void print(const char* what) const {
    fmt::print(
        "{}: of {}, {} right, {} with the right name among those not told apart, {} with a wrong name, "
        "{:.1f} s of processor each\n",
        what, runs, exact, among, wrong, seconds / std::max(runs, 1));
  }
};

std::vector<Class> by_evidence(const residuals::Inputs& inputs) {
  std::vector<Class> named;
  for (const evidence::Named& next : evidence::explanations(inputs, inputs.models[0].kind, 1).effects) {
    named.push_back({next.candidate.name});
    for (const identification::Rival& rival : next.rivals) named.back().push_back(rival.effect);
  }
  return named;
}

std::vector<Class> by_diagnose(const residuals::Inputs& inputs) {
  const std::vector<int> flights = identification::every_flight(inputs);
  std::vector<Class> named;
  for (const identification::Missing& missing :
       identification::diagnose(inputs, inputs.models[0].kind, flights, 1, [](int, int) {}).ranking) {
    named.push_back({missing.effect});
    for (const std::string& rival : missing.finding.confounded_with()) named.back().push_back(rival);
  }
  return named;
}

}  // namespace

int main(int argc, char** argv) {
  const double gust_N = argc > 1 ? std::atof(argv[1]) : 0.02;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const std::uint64_t seeds = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("swarmcert-evidence-{}", getpid());
  std::vector<tests::Hidden> cases = tests::single_effects();
  cases.push_back({"nothing", {}, {}, {}, 1});
  cases.push_back({"nothing, two vehicles", {}, {}, {}, 2});
  Tally evidence, diagnose;
  for (const tests::Hidden& hidden : cases) {
    for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
      tests::Truth truth = hidden.truth;
      truth.gust_N = gust_N;
      truth.gust_time_s = 0.7;
      for (int run = 0; run < 3; ++run)
        tests::fly(truth,
                   {tests::Program::kRich, hidden.vehicles, 40, 10 * seed + static_cast<std::uint64_t>(run)},
                   folder.string(), run);
      residuals::InputArguments arguments;
      arguments.models = {tests::source_path("stability/models/crazyflie-small.toml")};
      arguments.flights = {folder.string()};
      const residuals::Inputs inputs = residuals::read_inputs(arguments);
      const std::string ours = evidence.add(hidden, [&] { return by_evidence(inputs); });
      const std::string theirs = diagnose.add(hidden, [&] { return by_diagnose(inputs); });
      fmt::print("{:<24} {:>6}  {:<44} {}\n", hidden.name, seed, ours, theirs);
      std::fflush(stdout);
      std::filesystem::remove_all(folder);
    }
  }
  evidence.print("evidence");
  diagnose.print("diagnose");
  return 0;
}
