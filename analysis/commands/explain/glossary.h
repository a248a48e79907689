/// @file The words of the tool, from the descriptions that the registry of effects, results and files already have.
#pragma once

#include <string>
#include <vector>

#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Where a word stands, and what is said of it there. Texts that do not apply are empty.
struct GlossaryEntry {
  std::string kind;  ///< "word", "effect", "field" or "value"
  std::string name;
  std::string meaning, unit, guarantee;
  std::vector<std::string> in;  ///< results and files whose field it is, as "compare: overall.rmse"
  std::string equation, source;
  std::string looks_like;               ///< of effects: the flights in which it shows
  std::string same_as;                  ///< of effects: what flights cannot tell from it
  std::vector<std::string> parameters;  ///< of effects: "name: meaning, between lower and upper"
};
void describe(files::Record& record, const GlossaryEntry& entry);

/// The result of `explain` and of `add --list`.
struct Explanation {
  std::string word;
  std::vector<GlossaryEntry> entries;
};
void describe(files::Record& record, const Explanation& explanation);

/// Returns every entry about `word`: a term of the texts, the effect of that name or class, fields of that name, and
/// fields whose description mentions it as a value. Empty if no entry matches.
std::vector<GlossaryEntry> explain(const std::string& word);

/// Returns all words that explain() knows by name, for suggestions.
std::vector<std::string> glossary_words();

/// Returns every registered effect.
std::vector<GlossaryEntry> effect_entries();

/// Returns what may have been meant by an unknown effect: a name of similar spelling, or the effect that is also known
/// as `name`, as constant_force is as wind.
std::string effect_suggestion(const std::string& name, const std::vector<std::string>& known);

}  // namespace swarmcert::analysis
