#include "analysis/identification/scan/form_reach.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::identification {
namespace {

/// Returns the largest absolute value of the form's functions at one point.
double largest_at(const Form& form, const std::vector<double>& theta, const double* point) {
  double values[kMostFormFunctions] = {};
  form.values(point, theta.data(), values);
  double largest = 0;
  for (std::size_t k = 0; k < form.texts.size(); ++k) largest = std::max(largest, std::abs(values[k]));
  return largest;
}

}  // namespace

bool grows_beyond(const Form& form, const std::vector<double>& theta, const std::vector<FormRange>& ranges,
                  std::size_t input) {
  constexpr int kSteps = 20;
  constexpr double kFar = 20;    // times the range
  constexpr double kMore = 1.5;  // a peak between two steps is no growth
  double within = 0, beyond = 0;
  std::vector<double> point(2, 0);
  for (int i = 0; i <= kSteps; ++i) {
    for (std::size_t k = 0; k < ranges.size(); ++k)
      point[k] = ranges[k].lower + ranges[k].span() * i / kSteps;
    within = std::max(within, largest_at(form, theta, point.data()));
    for (const double far : {-kFar, kFar}) {
      std::vector<double> outside = point;
      outside[input] = (ranges[input].lower + ranges[input].upper) / 2 + far * ranges[input].span();
      beyond = std::max(beyond, largest_at(form, theta, outside.data()));
    }
  }
  return beyond > kMore * within;
}

}  // namespace swarmcert::identification
