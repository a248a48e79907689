#include "analysis/logs/column_names.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>

#include "analysis/logs/dictionary.h"
#include "nn/base/text.h"

namespace swarmcert::logs {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

constexpr double kNamed = 10,
                 kNamedOther = 20;   ///< bits for the quantity that a word names, and against the others
constexpr double kUnknownWord = 12;  ///< bits against a word that may be any thing's
constexpr double kForeign = 25;      ///< bits against the vehicle's own motion

using WordBits = std::map<int, double>;

/// Words that name a quantity; other quantities lose kNamedOther bits.
const std::map<std::string, WordBits>& quantity_words() {
  static const std::map<std::string, WordBits> words = [] {
    const std::vector<std::string> names = {"position",   "velocity", "specific_force", "rates",
                                            "quaternion", "angles",   "motors",         "battery"};
    std::map<std::string, WordBits> all;
    for (const files::TomlTable& entry : dictionary_table("words.toml").tables("quantity")) {
      const files::TomlTable stated = entry.table("bits");
      stated.allow_only(names);
      WordBits bits;
      for (int q = 0; q < static_cast<int>(names.size()); ++q)
        if (stated.has(names[static_cast<std::size_t>(q)]))
          bits[q] = stated.number(names[static_cast<std::size_t>(q)]);
      for (const std::string& word : entry.texts("words")) all[word] = bits;
    }
    return all;
  }();
  return words;
}

struct Index {
  IndexKind kind;
  int index;
};

std::optional<Index> index_of(const std::string& word) {
  static const std::map<std::string, Index> known = [] {
    std::map<std::string, Index> all;
    for (const files::TomlTable& entry : dictionary_table("words.toml").tables("index")) {
      const IndexKind kinds[] = {IndexKind::kAxis, IndexKind::kCompass, IndexKind::kAngle};
      const IndexKind kind = kinds[entry.choice("kind", {"axis", "compass", "angle"})];
      int index = 0;
      for (const std::string& spelling : entry.texts("words")) all[spelling] = {kind, index++};
    }
    return all;
  }();
  const auto found = known.find(word);
  if (found != known.end()) return found->second;
  bool is_number = !word.empty() && word.size() < 3;
  for (const char c : word) is_number = is_number && std::isdigit(static_cast<unsigned char>(c)) != 0;
  if (is_number) return Index{IndexKind::kNumber, std::stoi(word)};
  return std::nullopt;
}

bool is_known(const std::string& word) {
  return quantity_words().count(word) > 0 || is_word_of("wish", word) || is_word_of("foreign", word) ||
         is_word_of("neutral", word) || is_word_of("silent", word);
}

/// Returns the words of a name; glued ones are split where both parts are known: "posx", "qw", "pwm1", "xdot".
std::vector<std::string> words_of(const std::string& plain) {
  std::vector<std::string> words;
  for (const std::string& word : files::split_at(plain, ".")) {
    const std::string head = word.substr(0, word.size() - 1), tail = word.substr(word.size() - 1);
    if (word.size() == 1 || is_known(word) || index_of(word)) {
      words.push_back(word);
    } else if (index_of(tail) && is_known(head)) {
      words.insert(words.end(), {head, tail});
    } else if (index_of(word.substr(0, 1)) && is_known(word.substr(1))) {
      words.insert(words.end(), {word.substr(1), word.substr(0, 1)});
    } else if (index_of(tail)) {
      words.insert(words.end(), {head, tail});
    } else {
      words.push_back(word);
    }
  }
  return words;
}

/// "PosX" becomes "Pos_X", "batteryVoltage" "battery_Voltage"; "mV" is a unit.
std::string with_words_apart(const std::string& column) {
  std::string apart;
  for (std::size_t i = 0; i < column.size(); ++i) {
    const auto is = [&](std::size_t at, int (*test)(int)) {
      return test(static_cast<unsigned char>(column[at])) != 0;
    };
    if (i > 1 && is(i, std::isupper) && is(i - 1, std::islower) && is(i - 2, std::isalpha)) apart += '_';
    apart += column[i];
  }
  return apart;
}

/// Takes the last word that can be an index out of `words`.
std::optional<Index> take_index(std::vector<std::string>& words) {
  const std::vector<std::string>& rates = words_of_kind("body_rate");
  const auto rate = std::find(rates.begin(), rates.end(), words.size() == 1 ? words[0] : "");
  if (rate != rates.end()) {
    words.clear();
    return Index{IndexKind::kRate, static_cast<int>(rate - rates.begin())};
  }
  for (std::size_t i = words.size(); i-- > 0;) {
    const std::optional<Index> index = index_of(words[i]);
    if (!index) continue;
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(i));
    return index;
  }
  return std::nullopt;
}

void add_bits(const WordBits& bits, NameReading& name) {
  for (int q = 0; q < kNumQuantities; ++q) {
    const auto found = bits.find(q);
    name.bits[static_cast<std::size_t>(q)] += found != bits.end() ? found->second : -kNamedOther;
  }
}

/// The index alone tells a quantity where no word does: x is a position, roll an angle, p a rate.
void add_index_bits(const Index& index, NameReading& name) {
  if (index.kind == IndexKind::kAxis || index.kind == IndexKind::kCompass)
    add_bits({{kIsPosition, kNamed}}, name);
  if (index.kind == IndexKind::kAngle) add_bits({{kIsAngles, kNamed}}, name);
  if (index.kind == IndexKind::kRate) add_bits({{kIsRates, kNamed}}, name);
}

/// A stated unit rules out the quantities that do not have it.
void add_unit_bits(NameReading& name) {
  if (name.unit.empty()) return;
  for (std::size_t q = kIsPosition; q <= kIsAngles; ++q)
    name.bits[q] += !unit_factor(kSignalOfQuantity[q], name.unit) ? -kForeign : name.bits[q] < 0 ? 4 : -0.5;
}

/// A set point is the target's position or velocity where the other words are those of the vehicle's.
void make_wish(NameReading& name) {
  name.bits[kIsTargetPosition] = name.bits[kIsPosition];
  name.bits[kIsTargetVelocity] = name.bits[kIsVelocity];
  for (int q = kIsPosition; q <= kIsAngles; ++q) name.bits[static_cast<std::size_t>(q)] -= kForeign;
}

}  // namespace

std::string plain_name(const std::string& column) {
  std::string plain;
  bool in_word = false;
  for (const char c : column.substr(0, column.find_first_of("[(", 1))) {
    if (is_word(c)) {
      if (!in_word && !plain.empty()) plain += '.';
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    in_word = is_word(c);
  }
  // Array elements keep their index: q[0] becomes "q.0".
  const std::size_t bracket = column.find('[', 1);
  if (bracket != std::string::npos && bracket + 1 < column.size() &&
      std::isdigit(static_cast<unsigned char>(column[bracket + 1])) != 0)
    plain += "." + plain_name(column.substr(bracket + 1));
  return plain;
}

StatedUnit stated_unit(const std::string& column, bool is_clock) {
  using Spellings = std::map<std::string, std::string>;
  static const auto spellings_in = [](const char* key) {
    Spellings all;
    const files::TomlTable table = dictionary_table("words.toml").table(key);
    for (const std::string& unit : table.keys())
      for (const std::string& spelling : table.texts(unit)) all[spelling] = unit;
    return all;
  };
  static const Spellings of_clocks = spellings_in("spelled_of_clocks"), of_others = spellings_in("spelled");
  const Spellings& spelled = is_clock ? of_clocks : of_others;
  const std::string plain = plain_name(column);
  const std::size_t open = column.find_last_of("[("), close = column.find_last_of("])");
  if (open != std::string::npos && close != std::string::npos && close > open) {
    const std::string inside = column.substr(open + 1, close - open - 1);
    const auto known = spelled.find(plain_name(inside));
    return {known != spelled.end() ? known->second : inside == "%" ? "%" : "", plain};
  }
  // The longest unit first: "vx.mm.s" is in mm/s. A name must remain before it.
  for (std::size_t dot = plain.find('.'); dot != std::string::npos; dot = plain.find('.', dot + 1)) {
    const auto known = spelled.find(plain.substr(dot + 1));
    if (known != spelled.end()) return {known->second, plain.substr(0, dot)};
  }
  return {"", plain};
}

NameReading read_name(const std::string& column) {
  NameReading name;
  const StatedUnit stated = stated_unit(with_words_apart(column));
  name.unit = stated.unit;
  std::vector<std::string> words = words_of(stated.plain);
  const std::optional<Index> index = take_index(words);
  if (index) {
    name.kind = index->kind;
    name.index = index->index;
  }
  bool is_quantity = false, is_angular = false;
  for (const std::string& word : words) {
    name.family += (name.family.empty() ? "" : ".") + word;
    const auto quantity = quantity_words().find(word);
    name.says_down = name.says_down || is_word_of("down", word);
    name.says_up = name.says_up || is_word_of("up", word);
    if (is_word_of("angular", word)) {
      is_angular = true;
    } else if (quantity != quantity_words().end() && (index || word.size() > 1)) {
      add_bits(quantity->second, name);
      is_quantity = true;
    } else if (is_word_of("wish", word)) {
      name.is_wish = true;
    } else if (is_word_of("foreign", word)) {
      name.is_foreign = true;
    } else if (!is_word_of("silent", word)) {
      const bool is_neutral = is_word_of("neutral", word) || index_of(word);
      for (double& bits : name.bits) bits -= is_neutral ? 1 : kUnknownWord;
    }
  }
  if (index && !is_quantity && !is_angular) add_index_bits(*index, name);
  if (index && index->kind == IndexKind::kAngle) {
    if (name.bits[kIsVelocity] > 0) std::swap(name.bits[kIsVelocity], name.bits[kIsRates]);    // phi_dot
    if (unit_factor(kRates, name.unit)) std::swap(name.bits[kIsAngles], name.bits[kIsRates]);  // roll_deg_s
  }
  if (is_angular) {
    if (!is_quantity) name.bits[kIsAngles] += kNamed;
    if (name.bits[kIsVelocity] > 0) std::swap(name.bits[kIsVelocity], name.bits[kIsRates]);
    name.bits[kIsVelocity] -= kForeign;
    name.bits[kIsSpecificForce] -= kForeign;
  }
  add_unit_bits(name);
  name.bits[kIsTargetPosition] = name.bits[kIsTargetVelocity] = -kForeign;
  if (name.is_wish) make_wish(name);
  if (name.is_foreign)
    for (double& bits : name.bits) bits -= kForeign;
  return name;
}

}  // namespace swarmcert::logs
