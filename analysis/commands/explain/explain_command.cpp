#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "analysis/commands/commands.h"
#include "analysis/commands/explain/glossary.h"
#include "nn/base/suggest.h"

namespace swarmcert::analysis {
namespace {

constexpr std::size_t kShownPlaces = 4;

void print_line(const char* title, const std::string& text) {
  if (!text.empty()) fmt::print("  {:<12}{}\n", title, text);
}

void print(const GlossaryEntry& entry) {
  fmt::print("{} ({})\n", entry.name, entry.kind == "value" ? "field with this value" : entry.kind);
  print_line("equation", entry.equation);
  for (const std::string& parameter : entry.parameters) print_line("parameter", parameter);
  print_line("shows in", entry.looks_like);
  print_line("same as", entry.same_as);
  print_line("source", entry.source);
  print_line("meaning", entry.meaning);
  print_line("unit", entry.unit);
  print_line("guarantee", entry.guarantee);
  const std::size_t shown = std::min(kShownPlaces, entry.in.size());
  if (shown > 0)
    print_line("in", fmt::format("{}{}", fmt::join(entry.in.begin(), entry.in.begin() + shown, "; "),
                                 shown < entry.in.size()
                                     ? fmt::format("; and {} more, see --json", entry.in.size() - shown)
                                     : ""));
}

int run_explain(const std::string& word, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  const Explanation explanation = {word, explain(word)};
  if (explanation.entries.empty()) {
    const std::string nearest = files::nearest(word, glossary_words());
    throw UsageError("explain " + word + ": " +
                     (nearest.empty() ? "no such word; 'swarmcert add --list' lists the effects"
                                      : "did you mean \"" + nearest + "\"?"));
  }
  write_result(common, result_of("explain", {}, std::nullopt, explanation));
  if (!common.prints_text()) return kDone;
  for (const GlossaryEntry& entry : explanation.entries) print(entry);
  return kDone;
}

}  // namespace

Command explain_command() {
  return {
      "explain", "Explain a word: an effect, a field of a result, a verdict",
      "Effects with equation, limits, the flights in which they show and what looks the same; fields of "
      "results and\nfiles with meaning, unit and guarantee; values such as verdicts. 'swarmcert add --list' "
      "lists the effects.\n\n"
      "Example: swarmcert explain downwash\n"
      "         swarmcert explain variance_explained",
      [](CLI::App& app) {
        const auto word = std::make_shared<std::string>();
        app.add_option("WORD", *word, "The word")->required();
        return [word](const CommonOptions& common) { return run_explain(*word, common); };
      },
      fields_of<Explanation>()};
}

}  // namespace swarmcert::analysis
