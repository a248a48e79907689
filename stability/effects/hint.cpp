#include "stability/effects/hint.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {

std::optional<double> Hint::number_of(const std::string& word) const {
  for (const auto& [name, value] : formula.parameters) {
    if (name == word || name.rfind(word + "_", 0) == 0) return value;
  }
  return std::nullopt;
}

std::optional<double> Hint::first_of(const std::vector<std::string>& words) const {
  for (const std::string& word : words) {
    if (const auto number = number_of(word)) return number;
  }
  return std::nullopt;
}

bool Hint::acts_along(const std::vector<std::string>& targets) const {
  const auto& formulas = formula.expression.formulas;
  return std::any_of(formulas.begin(), formulas.end(), [&](const auto& entry) {
    return std::find(targets.begin(), targets.end(), entry.first) != targets.end();
  });
}

std::optional<FlownRange> Hint::range_of_place() const {
  for (const auto& [name, bounds] : formula.expression.bounds) {
    const bool is_place = name == "centre_m" || name == "middle_m" || name == "at_m" || name == "from_m";
    if (!is_place || !(bounds.lower < bounds.upper)) continue;
    const double span_m = 0.5 * (bounds.upper - bounds.lower);
    return FlownRange{bounds.lower + 0.5 * span_m, bounds.upper - 0.5 * span_m, formula.parameters.at(name)};
  }
  const auto from_m = number_of("from"), length_m = number_of("length");
  if (!from_m || !length_m) return std::nullopt;
  const double span_m = 5 * *length_m;
  if (form == "growth") return FlownRange{*from_m - span_m, *from_m, *from_m};
  return FlownRange{*from_m, *from_m + span_m, *from_m};
}

void Start::hold_others(const std::vector<std::string>& free) {
  for (Parameter& p : info.linear) {
    if (std::find(free.begin(), free.end(), p.name) == free.end()) p.lower = p.upper = 0;
  }
}

void Start::free_shape(const std::vector<std::string>& free) {
  constexpr double kReach = 0.3;
  for (std::size_t i = 0; i < info.shape.size(); ++i) {
    Parameter& p = info.shape[i];
    const double value = thetas[0][i];
    p.value = value;
    if (std::find(free.begin(), free.end(), p.name) == free.end())
      p.lower = p.upper = value;
    else
      p.grid = {value, std::max(std::abs(value), kReach)};
  }
}

}  // namespace swarmcert::stability
