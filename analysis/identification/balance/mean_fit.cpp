#include "analysis/identification/balance/mean_fit.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace swarmcert::identification {

MeanFit fit_through_origin(const std::vector<double>& x, const std::vector<double>& y) {
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += x[i] * x[i];
    xy += x[i] * y[i];
  }
  MeanFit fit;
  fit.value = xy / xx;
  double own = 0, pairs = 0, before = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double score = x[i] * (y[i] - fit.value * x[i]);
    own += score * score;
    pairs += score * before;
    before = score;
  }
  const double freedom = static_cast<double>(x.size()) - 1;
  const double variance = std::max(own + pairs, own) / (xx * xx) * (freedom + 1) / freedom;
  fit.half = std::sqrt(variance) * boost::math::quantile(boost::math::students_t(freedom), 0.95);
  return fit;
}

double mean_z(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / count;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return squares > 0 ? mean / std::sqrt(squares / (count * (count - 1))) : 0;
}

bool surely_positive(const std::vector<double>& differences, int tried) {
  constexpr std::size_t kFewest = 8;
  if (differences.size() < kFewest) return false;
  const MeanFit fit = fit_through_origin(std::vector<double>(differences.size(), 1), differences);
  const boost::math::students_t student(static_cast<double>(differences.size()) - 1);
  const double deviation = fit.half / boost::math::quantile(student, 0.95);
  return fit.value > deviation * boost::math::quantile(student, 1 - 0.01 / std::max(tried, 1));
}

}  // namespace swarmcert::identification
