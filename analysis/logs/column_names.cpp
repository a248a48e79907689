#include "analysis/logs/column_names.h"

#include <cctype>
#include <map>

#include "analysis/logs/dictionary.h"

namespace swarmcert::logs {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

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

StatedUnit stated_unit(const std::string& column) {
  static const std::map<std::string, std::string> spelled = [] {
    std::map<std::string, std::string> all;
    const files::TomlTable table = dictionary_table("words.toml").table("spelled");
    for (const std::string& unit : table.keys())
      for (const std::string& spelling : table.texts(unit)) all[spelling] = unit;
    return all;
  }();
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

std::vector<std::string> called_names(const std::string& column) {
  std::vector<std::string> names = {column};
  const std::size_t dot = column.find('.');
  if (dot == std::string::npos || column.find('.', dot + 1) == std::string::npos) return names;
  names.push_back(column.substr(dot + 1));
  return names;
}

}  // namespace swarmcert::logs
