#include "analysis/commands/explain/glossary.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <map>

#include "analysis/commands/commands.h"
#include "analysis/commands/schema/file_kinds.h"
#include "nn/base/suggest.h"
#include "nn/base/text.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

/// What the texts of the tool call so, beside effects, fields and values.
struct Term {
  const char *word, *meaning;
};
constexpr Term kTerms[] = {
    {"residual",
     "The force that the model does not explain: mass times the measured specific force, less thrust and "
     "effects of "
     "the model, in the world frame."},
    {"RMSE", "Root mean square of an error. Of a force: of the residual vector, unless an axis is named."},
    {"noise", "The white part of the residual's spectrum: no model can explain it. Also called noise floor."},
    {"noise floor", "See noise."},
    {"fit", "Flights, or parts of them, to which parameters are fitted."},
    {"select", "Flights that no fit has seen and that decide whether a step is accepted."},
    {"test", "Flights that decide nothing: errors on them say how well the model does on flights to come."},
    {"held out",
     "Not seen by any fit: the flights called select and test. A dash: nothing could be held out."},
    {"ladder",
     "The errors of a model step by step, as effects are added to it. 'swarmcert add show' prints it."},
    {"formula",
     "A short expression of measured variables for a force without a name, found by 'add formula'."},
    {"shape", "A smooth or monotone curve over one variable, for a force that no formula describes."},
    {"scan", "The search for variables with which what is left of the force varies."},
    {"set point",
     "The position or velocity that the controller was told to reach. A gust moves the vehicle and its "
     "thrust, but not "
     "its set points, so they tell causes from the controller's reaction."},
    {"instrument", "A value estimated along the set points, free of the controller's reaction."},
    {"injection",
     "A trial in which an effect of known size is added to the residual of these flights, to see whether it "
     "is found."},
    {"vibration",
     "Force at one frequency above 4 Hz, as of a bent propeller or a loose part. It is named with its "
     "frequency; no "
     "effect describes it: repair the vehicle, or log at a higher rate."},
    {"saturation",
     "Rotors at their largest force: what is asked beyond is not given. The effect thrust_saturation "
     "describes it, and "
     "'swarmcert bound' says whether a loop comes to it."},
    {"witness",
     "Two inputs, or one, at which a bound is attained as far as stated: no bound can be smaller."},
    {"golden vectors",
     "Inputs with the exact outputs of a network, by which compiled code is compared with it."}};

std::string parameter_text(const stability::Parameter& parameter) {
  const std::string size = stability::size_words(parameter.unit);
  return fmt::format("{}: {}, between {:g} and {:g}{}", parameter.name, parameter.meaning, parameter.lower,
                     parameter.upper, size.empty() ? "" : " times " + size);
}

GlossaryEntry entry_of(const stability::EffectInfo& info) {
  GlossaryEntry entry;
  entry.kind = "effect";
  entry.name = info.name;
  entry.equation = info.equation;
  entry.source = info.source;
  entry.looks_like = info.excitation;
  if (info.equivalence_class != info.name) entry.same_as = info.equivalence_class;
  for (const stability::Parameter& parameter : info.linear)
    entry.parameters.push_back(parameter_text(parameter));
  for (const stability::Parameter& parameter : info.shape)
    entry.parameters.push_back(parameter_text(parameter));
  return entry;
}

/// Calls `visit` with every field of a shape and its path.
void for_each_field(const files::Node& shape, const std::string& path,
                    const std::function<void(const files::Node&, const std::string&)>& visit) {
  for (const files::Node& member : shape.members) {
    const std::string at = member.name.empty() ? path : path.empty() ? member.name : path + "." + member.name;
    if (!member.name.empty()) visit(member, at);
    for_each_field(member, at, visit);
  }
}

/// The same for every described result and file; the place names the result too.
void for_each_described_field(const std::function<void(const files::Node&, const std::string&)>& visit) {
  const auto go_through = [&visit](const std::string& name, const files::Node& shape) {
    for_each_field(shape, "", [&](const files::Node& field, const std::string& path) {
      visit(field, name + ": " + path);
    });
  };
  for (const Command& command : commands())
    if (command.describe_result)
      go_through(command.name, result_shape(command.name, command.describe_result));
  for (const FileKind& kind : file_kinds()) {
    files::Node shape;
    files::Record record(shape, true);
    kind.describes(record);
    go_through(kind.name, shape);
  }
}

/// Whether `text` contains `word` between other characters than those of names.
bool mentions(const std::string& text, const std::string& word) {
  const auto is_part = [&text](std::size_t i) {
    return i < text.size() && (std::isalnum(static_cast<unsigned char>(text[i])) != 0 || text[i] == '_');
  };
  for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1))
    if ((at == 0 || !is_part(at - 1)) && !is_part(at + word.size())) return true;
  return false;
}

bool is_value(const files::Node& field, const std::string& word) {
  return std::find(field.choices.begin(), field.choices.end(), word) != field.choices.end();
}

void add_fields(const std::string& word, bool by_name, std::vector<GlossaryEntry>& entries) {
  std::map<std::string, std::size_t> known;  // by meaning, which several results share
  for_each_described_field([&](const files::Node& field, const std::string& place) {
    const bool fits = by_name ? field.name == word
                              : is_value(field, word) || (field.kind == files::Node::Kind::kText &&
                                                          mentions(field.about.meaning, word));
    if (!fits || *field.about.meaning == '\0') return;
    const auto [found, is_new] = known.emplace(field.about.meaning, entries.size());
    if (is_new) {
      GlossaryEntry entry;
      entry.kind = by_name ? "field" : "value";
      entry.name = field.name;
      entry.meaning = field.about.meaning;
      entry.unit = field.about.unit;
      entry.guarantee = field.about.guarantee;
      entries.push_back(std::move(entry));
    }
    entries[found->second].in.push_back(place);
  });
}

}  // namespace

void describe(files::Record& record, const GlossaryEntry& entry) {
  record.field("kind", entry.kind, "word, effect, field (of a result or file) or value (of a field).");
  record.field("name", entry.name, "Of the effect or field.");
  record.field("meaning", entry.meaning, "What the field says.");
  record.field("unit", entry.unit, "Of the field; empty: none, or part of the meaning.");
  record.field("guarantee", entry.guarantee, "Of the field: exact, a bound, an estimate.");
  record.field("in", entry.in, "Results and files that have the field.");
  record.field("equation", entry.equation, "Of the effect.");
  record.field("parameters", entry.parameters, "Of the effect, with their limits.");
  record.field("looks_like", entry.looks_like, "Flights in which the effect shows.");
  record.field("same_as", entry.same_as, "Causes that flights alone cannot tell from the effect.");
  record.field("source", entry.source, "Of the equation.");
}

void describe(files::Record& record, const Explanation& explanation) {
  record.field("word", explanation.word, "What was asked for.");
  record.field("entries", explanation.entries, "Everything that the tool calls so.");
}

std::vector<GlossaryEntry> effect_entries() {
  std::vector<GlossaryEntry> entries;
  for (const std::string& name : stability::effect_names())
    entries.push_back(entry_of(stability::effect_info(name)));
  return entries;
}

std::vector<GlossaryEntry> explain(const std::string& word) {
  std::vector<GlossaryEntry> entries;
  for (const Term& term : kTerms) {
    if (word != term.word) continue;
    entries.emplace_back();
    entries.back().kind = "word";
    entries.back().name = word;
    entries.back().meaning = term.meaning;
  }
  for (const GlossaryEntry& effect : effect_entries()) {
    const std::vector<std::string> others = files::split_at(effect.same_as, " / ");
    if (effect.name == word || std::find(others.begin(), others.end(), word) != others.end())
      entries.push_back(effect);
  }
  add_fields(word, true, entries);
  add_fields(word, false, entries);
  return entries;
}

std::vector<std::string> glossary_words() {
  std::vector<std::string> words;
  for (const Term& term : kTerms) words.emplace_back(term.word);
  for (const GlossaryEntry& effect : effect_entries()) {
    words.push_back(effect.name);
    for (const std::string& name : files::split_at(effect.same_as, " / ")) words.push_back(name);
  }
  for_each_described_field([&words](const files::Node& field, const std::string&) {
    words.push_back(field.name);
    words.insert(words.end(), field.choices.begin(), field.choices.end());
  });
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  return words;
}

std::string effect_suggestion(const std::string& name, const std::vector<std::string>& known) {
  std::vector<std::string> words = known;
  std::map<std::string, std::string> effect_of;
  for (const GlossaryEntry& effect : effect_entries()) {
    for (const std::string& other : files::split_at(effect.same_as, " / ")) {
      words.push_back(other);
      effect_of[other] = effect.name;
    }
  }
  const std::string nearest = files::nearest(name, words);
  const auto found = effect_of.find(nearest);
  if (found != effect_of.end())
    return fmt::format("did you mean {}, which flights show as {}?", nearest, found->second);
  return files::did_you_mean(name, known);
}

}  // namespace swarmcert::analysis
