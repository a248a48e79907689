#include "stability/checker/fixed_point.h"

#include <algorithm>

namespace swarmcert::check {

void check_numbers(const LoopNumbers& loop) {
  constexpr std::size_t kMostLags = 4;
  demand(
      is_usual(loop.mass_kg) && is_usual(loop.Kp) && is_usual(loop.Kd) && (loop.Ki == 0 || is_usual(loop.Ki)),
      "mass_kg, Kp, Kd or Ki is out of range");
  demand(loop.lags_s.size() <= kMostLags && std::all_of(loop.lags_s.begin(), loop.lags_s.end(), is_usual),
         "lags_s has more than four entries, or one is out of range");
  demand(loop.delay_s == 0 || is_usual(loop.delay_s), "delay_s is out of range");
}

std::optional<Rational> inverse_form(Square m, Row right) {
  Rational sum;
  for (std::size_t k = 0; k < m.size(); ++k) {
    if (sgn(m[k][k]) <= 0) return std::nullopt;
    sum += right[k] * right[k] / m[k][k];
    for (std::size_t i = k + 1; i < m.size(); ++i) {
      const Rational factor = m[i][k] / m[k][k];
      for (std::size_t j = k; j < m.size(); ++j) m[i][j] -= factor * m[k][j];
      right[i] -= factor * right[k];
    }
  }
  return sum;
}

Square exact_form(const std::vector<std::vector<double>>& stated, std::size_t n) {
  demand(stated.size() == n, "the size of P does not match the loop");
  Square exact(n, Row(n));
  for (std::size_t i = 0; i < n; ++i) {
    demand(stated[i].size() == n, "the size of P does not match the loop");
    for (std::size_t j = 0; j < n; ++j) {
      const double x = stated[i][j], scaled = std::ldexp(x, static_cast<int>(kFormBits));
      demand(std::abs(x) <= 0x1p64 && scaled == std::floor(scaled), "P has an entry out of range");
      exact[i][j] = x;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) demand(exact[i][j] == exact[j][i], "P is not symmetric");
  }
  return exact;
}

}  // namespace swarmcert::check
