/// Runs the campaigns of hidden effects and prints each answer and the success rates: singles, pairs, singles in gusts,
/// foreign forces, nulls.
///   hidden_effect_campaign [singles|pairs|disturbed|foreign|null] [first seed] [seeds] [program]
#include <fmt/core.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "hidden_effect/campaign.h"

namespace {

using namespace swarmcert::tests;

struct Tally {
  int runs = 0, first = 0, exact = 0, found = 0, flagged = 0, claims = 0, valued = 0, right = 0;
  void add(const Answer& answer, std::uint64_t seed) {
    ++runs;
    first += answer.first_right ? 1 : 0;
    exact += answer.exact ? 1 : 0;
    found += answer.all_found ? 1 : 0;
    flagged += answer.flagged ? 1 : 0;
    claims += answer.claims_falsely ? 1 : 0;
    valued += answer.has_value ? 1 : 0;
    right += answer.value_right ? 1 : 0;
    std::string named;
    for (std::size_t i = 0; i < answer.named.size(); ++i)
      named += fmt::format(" {} {:.1f} %", answer.named[i], 100 * answer.drops[i]);
    fmt::print("{:<40} {:>6} {} {} {} ratio {:.2f}{}  [{} ]{}\n", answer.label, seed,
               answer.first_right ? "first" : "-----", answer.exact ? "exact" : "-----",
               answer.flagged ? "FLAG" : "    ", answer.ratio,
               answer.has_value ? fmt::format(" value {:+.1f} %{}", 100 * answer.value_error,
                                              answer.value_right ? "" : " OFF")
                                : "",
               named, answer.exact ? "" : "   <---");
    std::fflush(stdout);
  }
  void print(const char* what) const {
    fmt::print("{}: first {}; exact {}; all found {}; flagged {}; false claims {}; values {}\n", what,
               share(first, runs), share(exact, runs), share(found, runs), share(flagged, runs),
               share(claims, runs), share(right, valued));
  }
};

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "singles";
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const std::uint64_t seeds = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
  const std::string word = argc > 4 ? argv[4] : "rich";
  const std::string only = argc > 5 ? argv[5] : "";
  const Program program = word == "hover"  ? Program::kHover
                          : word == "slow" ? Program::kSlow
                                           : Program::kRich;
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("swarmcert-campaign-{}", getpid());
  std::filesystem::create_directories(folder);
  std::vector<std::vector<Hidden>> cases;
  if (what == "pairs") cases = pairs();
  if (what == "disturbed") cases = disturbed();
  if (what == "singles")
    for (const Hidden& h : single_effects()) cases.push_back({h});
  if (what == "foreign")
    for (const Hidden& h : foreign_forces()) cases.push_back({h});
  if (what == "null") {
    cases.push_back({{"nothing, one", {}, {}, {}, 1}});
    cases.push_back({{"nothing, two", {}, {}, {}, 2}});
  }
  Tally tally;
  for (const auto& hidden : cases) {
    if (!only.empty() && hidden[0].name.find(only) == std::string::npos) continue;
    for (std::uint64_t seed = first; seed < first + seeds; ++seed)
      tally.add(ask(hidden, program, 40, seed, folder.string(), seed % 2 == 1), seed);
  }
  tally.print(what.c_str());
  std::filesystem::remove_all(folder);
  return 0;
}
