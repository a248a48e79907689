#include "lipschitz/checker/certificate_text.h"

#include <algorithm>
#include <charconv>
#include <sstream>
#include <stdexcept>

namespace swarmcert::check {

using files::Json;

void require(bool condition, const std::string& reason) {
  if (!condition) throw std::runtime_error(reason);
}

double number(const Json& decimal, const Json& hex, const std::string& where) {
  const double value = files::parse_hex_float(hex.get<std::string>());
  require(decimal.is_number() && decimal.get<double>() == value && value >= 0,
          where + ": negative, or decimal and hex notation differ");
  return value;
}

std::vector<double> hex_floats_in(const Json& json) {
  std::vector<double> values;
  std::istringstream text(json.get<std::string>());
  for (std::string word; text >> word;) values.push_back(files::parse_hex_float(word));
  return values;
}

std::vector<Conflict> conflicts_in(const Json& json) {
  std::vector<Conflict> conflicts;
  std::istringstream text(json.get<std::string>());
  const auto neuron = [](const std::string& word, bool& is_on) {
    std::size_t index = 0;
    const char* const last = word.data() + word.size() - 1;
    const auto [end, error] = std::from_chars(word.data(), last, index);
    require(error == std::errc() && end == last && word.size() <= 10 && (*last == '+' || *last == '-'),
            "a conflict's neuron is not a number with + or -");
    is_on = *last == '+';
    return index;
  };
  for (std::string first, second, lambda, multiplier; text >> first;) {
    require(static_cast<bool>(text >> second >> lambda >> multiplier), "a conflict lacks words");
    Conflict conflict;
    conflict.first = neuron(first, conflict.first_on);
    conflict.second = neuron(second, conflict.second_on);
    conflict.lambda = files::parse_hex_float(lambda);
    conflict.multiplier = files::parse_hex_float(multiplier);
    conflicts.push_back(conflict);
  }
  return conflicts;
}

std::optional<Factor> parse_factor(const Json& json, const std::string& where) {
  if (json.is_null()) return std::nullopt;
  files::require_keys(json, {"unit_exponent", "scale", "rows"}, where);
  Factor factor;
  factor.unit_exponent = json["unit_exponent"].get<long>();
  factor.scale = json["scale"].get<std::vector<long>>();
  const auto small = [](long e) { return -8192 <= e && e <= 8192; };  // limits the length of integers
  require(small(factor.unit_exponent) && std::all_of(factor.scale.begin(), factor.scale.end(), small),
          where + ": exponent out of range");
  for (const std::string& row : json["rows"].get<std::vector<std::string>>()) {
    std::istringstream text(row);
    factor.rows.emplace_back();
    for (std::string word; text >> word;) {
      require(word.size() <= 40, where + ": integer too long");
      factor.rows.back().emplace_back(word, 10);
    }
  }
  return factor;
}

}  // namespace swarmcert::check
