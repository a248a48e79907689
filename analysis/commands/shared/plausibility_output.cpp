#include "analysis/commands/shared/plausibility_output.h"

#include <fmt/core.h>

#include <map>

namespace swarmcert::analysis {

namespace {

/// WHAT of "PATH: WHAT: ..."; empty for lines of any other form, which have no kind.
std::string kind_of(const std::string& line) {
  const std::size_t path_end = line.find(": ");
  if (path_end == std::string::npos) return "";
  const std::size_t start = path_end + 2, end = line.find(": ", start);
  return end == std::string::npos ? "" : line.substr(start, end - start);
}

}  // namespace

std::vector<std::string> few_of_each(const std::vector<std::string>& lines) {
  constexpr int kShown = 3;
  std::vector<std::string> shown;
  std::map<std::string, int> found;
  for (const std::string& line : lines) {
    const std::string kind = kind_of(line);
    if (kind.empty() || ++found[kind] <= kShown) shown.push_back(line);
  }
  for (const auto& [kind, count] : found)
    if (count > kShown)
      shown.push_back(fmt::format("{}: {} more like these, all in --json", kind, count - kShown));
  return shown;
}

}  // namespace swarmcert::analysis

namespace swarmcert::logs {

void describe(files::Record& record, const Doubt& doubt) {
  record.field("signal", doubt.signal, "");
  record.field("value", doubt.value, "That is implausible.");
  record.field("words", doubt.words, "");
  record.field("refused", doubt.refuses_force, "Whether no force is judged for it.");
}

}  // namespace swarmcert::logs
