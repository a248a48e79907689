#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/logs/dictionary.h"
#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/suggest.h"

namespace swarmcert::logs {
namespace {

constexpr const char* kColumnsSchema = "swarmcert/columns/1";

/// A signal that columns.toml may name.
struct NamedSignal {
  int signal;
  const SignalKind* kind;
};

std::map<std::string, NamedSignal> named_signals() {
  std::map<std::string, NamedSignal> named;
  for (const SignalKind& kind : signal_kinds())
    for (std::size_t k = 0; k < kind.columns.size(); ++k)
      named.emplace(kind.columns[k], NamedSignal{kind.first + static_cast<int>(k), &kind});
  return named;
}

}  // namespace

std::optional<UnitFactor> unit_factor(int signal, const std::string& unit) {
  for (const Unit& candidate : kind_of_signal(signal).units)
    if (unit == candidate.name) return candidate.factor;
  return std::nullopt;
}

std::string columns_name(int signal) {
  const SignalKind& kind = kind_of_signal(signal);
  return kind.columns[static_cast<std::size_t>(signal - kind.first)];
}

bool is_same_scale(const UnitFactor& a, const UnitFactor& b) {
  return std::abs(a.multiply * b.divide / (b.multiply * a.divide) - 1) < 1e-9;
}

std::string unit_of_factor(int signal, const UnitFactor& factor) {
  for (const auto& [name, unit] : kind_of_signal(signal).units)
    if (is_same_scale(unit, factor) && unit.offset == factor.offset) return name;
  return "";
}

bool is_same_meaning(const SignalMap& a, const SignalMap& b) {
  const auto is_in_b = [&](const SignalSource& one) {
    return std::any_of(b.begin(), b.end(), [&](const SignalSource& other) {
      return one.signal == other.signal && one.column == other.column &&
             one.factor.offset == other.factor.offset && is_same_scale(one.factor, other.factor);
    });
  };
  return a.size() == b.size() && std::all_of(a.begin(), a.end(), is_in_b);
}

namespace {

/// The frames that a signal may state; several for the specific force.
std::vector<std::string> frames_of(const SignalKind& kind) {
  return kind.frames.empty() ? std::vector<std::string>{"world"} : kind.frames;
}

std::vector<std::string> units_of(const SignalKind& kind) {
  std::vector<std::string> units;
  for (const Unit& unit : kind.units) units.push_back(unit.name);
  return units;
}

void describe_column(files::Keys& keys, const SignalKind& kind) {
  keys.must<std::string>("column", "Its name in the header of the file.");
  keys.must("unit", "Of its values; a minus: of opposite sign.", "", files::OneOf{units_of(kind)});
  keys.may("frame", "Of its values.", "", files::OneOf{frames_of(kind)});
}

}  // namespace

void describe_columns_file(files::Keys& keys) {
  keys.schema(kColumnsSchema);
  for (const auto& [name, signal] : named_signals())
    keys.may_table(name, "The column that is this signal.",
                   [kind = signal.kind](files::Keys& column) { describe_column(column, *kind); });
}

SignalMap parse_columns(const std::string& text, const std::string& path) {
  const toml::table document = files::parse_toml(text, path);
  const files::TomlTable root(document, path);
  root.choice("schema", {kColumnsSchema});
  root.allow_only(files::key_names(describe_columns_file));
  const std::map<std::string, NamedSignal> named = named_signals();
  SignalMap map;
  std::set<bool> frames;  // of the specific force: true for the body frame
  for (const std::string& name : root.keys()) {
    if (name == "schema") continue;
    const files::TomlTable table = root.table(name);
    const auto& [signal, kind] = named.at(name);
    table.allow_only(files::key_names([kind = kind](files::Keys& keys) { describe_column(keys, *kind); }));
    const auto& [unit, factor] = kind->units[table.choice("unit", units_of(*kind))];
    const std::vector<std::string> possible = frames_of(*kind);
    const bool in_body = table.has("frame") && table.choice("frame", possible) == 1;
    if (possible.size() > 1) {
      frames.insert(in_body);
      if (frames.size() == 2)
        table.refuse("frame", "", "differs from the frame of another axis", "all three axes need one frame");
    }
    map.push_back({in_body ? signal - kForceWorld + kForceBody : signal, table.text("column"), factor, unit});
  }
  return map;
}

SignalMap read_columns(const std::string& path) { return parse_columns(files::read_file(path), path); }

}  // namespace swarmcert::logs
