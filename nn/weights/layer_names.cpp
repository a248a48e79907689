#include "nn/weights/layer_names.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>

namespace swarmcert::files {
namespace {

bool is_decimal(char c) { return c >= '0' && c <= '9'; }

/// Returns the number at `at` without leading zeros and advances `at` past it.
std::string number_at(const std::string& text, std::size_t& at) {
  while (at < text.size() && text[at] == '0') ++at;
  const std::size_t first = at;
  while (at < text.size() && is_decimal(text[at])) ++at;
  return text.substr(first, at - first);
}

struct Comparison {
  int sign = 0;               ///< negative: a comes first; 0: equal up to leading zeros
  bool is_by_number = false;  ///< at the first difference both have a number
};

Comparison compare(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_decimal(a[i]) || !is_decimal(b[j])) {
      if (a[i] != b[j]) return {a[i] < b[j] ? -1 : 1, false};
      ++i, ++j;
      continue;
    }
    const std::string m = number_at(a, i);
    const std::string n = number_at(b, j);
    if (m.size() != n.size()) return {m.size() < n.size() ? -1 : 1, true};
    if (m != n) return {m < n ? -1 : 1, true};
  }
  const std::size_t left_a = a.size() - i, left_b = b.size() - j;
  return {left_a < left_b ? -1 : left_a > left_b ? 1 : 0, false};
}

/// A name with '#' in place of each number, and the numbers.
struct Series {
  std::string pattern;
  std::vector<unsigned long> numbers;
};

Series series_of(const std::string& name) {
  constexpr std::size_t kMostDigits = 9;
  Series series;
  for (std::size_t at = 0; at < name.size();) {
    if (!is_decimal(name[at])) {
      series.pattern += name[at++];
      continue;
    }
    const std::string digits = number_at(name, at).substr(0, kMostDigits);
    series.numbers.push_back(digits.empty() ? 0 : std::stoul(digits));
    series.pattern += '#';
  }
  return series;
}

/// Returns what comes before the last component, without numbered components at its end: "net" for "net.3.fc".
std::string parent_of(const std::string& layer) {
  std::size_t end = layer.rfind('.');
  while (end != std::string::npos) {
    const std::size_t dot = end == 0 ? std::string::npos : layer.rfind('.', end - 1);
    const std::size_t first = dot == std::string::npos ? 0 : dot + 1;
    if (first == end || !std::all_of(layer.begin() + static_cast<std::ptrdiff_t>(first),
                                     layer.begin() + static_cast<std::ptrdiff_t>(end), is_decimal))
      return layer.substr(0, end);
    end = dot;
  }
  return {};
}

}  // namespace

bool naturally_before(const std::string& a, const std::string& b) { return compare(a, b).sign < 0; }

bool numbered_before(const std::string& a, const std::string& b) {
  const Comparison result = compare(a, b);
  return result.sign < 0 && result.is_by_number;
}

bool has_prefix(const std::string& name, const std::string& prefix) {
  if (prefix.empty() || name.compare(0, prefix.size(), prefix) != 0) return false;
  if (name.size() == prefix.size() || name[prefix.size()] == '.' || prefix.back() == '.') return true;
  return is_decimal(name[prefix.size()]) && !is_decimal(prefix.back());
}

std::vector<std::string> modules_of(const std::vector<std::string>& layers) {
  const auto pattern_of = [](const std::string& text) { return series_of(text).pattern; };
  std::map<std::string, std::string> parents;  // by pattern
  std::set<std::string> stems, top;
  for (const std::string& layer : layers) {
    const std::string parent = parent_of(layer);
    parents.emplace(pattern_of(parent), parent);
    const std::string pattern = pattern_of(layer);
    const std::size_t number = pattern.find('#');
    if (number != std::string::npos) stems.insert(pattern);
    if (parent.empty()) top.insert(number == std::string::npos ? layer : layer.substr(0, number));
  }
  std::vector<std::string> modules;
  if (parents.size() > 1) {
    for (const auto& [pattern, parent] : parents)
      if (!parent.empty()) modules.push_back(parent);
    modules.insert(modules.end(), top.begin(), top.end());
  } else if (stems.size() > 1) {
    for (const std::string& stem : stems) modules.push_back(stem.substr(0, stem.find('#')));
  } else {
    modules.push_back(parents.empty() ? "" : parents.begin()->second);
  }
  return modules;
}

std::string gap_in_numbers(const std::vector<std::string>& layers) {
  std::vector<std::vector<unsigned long>> numbers;
  std::string pattern;
  for (const std::string& layer : layers) {
    Series series = series_of(layer);
    if (series.numbers.empty()) continue;
    if (!pattern.empty() && series.pattern != pattern) return "the names count in different ways";
    pattern = series.pattern;
    numbers.push_back(std::move(series.numbers));
  }
  if (numbers.empty()) return {};
  std::set<std::size_t> places;  // those whose number differs between names
  for (std::size_t place = 0; place < numbers.front().size(); ++place)
    for (const auto& one : numbers)
      if (one[place] != numbers.front()[place]) places.insert(place);
  if (places.size() > 1) return "the names count in several places";
  std::vector<unsigned long> counted;
  for (const auto& one : numbers) counted.push_back(one[places.empty() ? one.size() - 1 : *places.begin()]);
  std::sort(counted.begin(), counted.end());
  const bool is_alone = counted.size() == 1;
  if (counted.front() > 1 && !is_alone)
    return "the numbers of the layers begin with " + std::to_string(counted.front());
  for (std::size_t k = 2; k < counted.size(); ++k) {
    if (counted[k] - counted[k - 1] == counted[1] - counted[0]) continue;
    std::string list;
    for (const unsigned long number : counted) list += (list.empty() ? "" : ", ") + std::to_string(number);
    return "the numbers of the layers have a gap: " + list;
  }
  return {};
}

}  // namespace swarmcert::files
