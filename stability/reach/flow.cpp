#include "stability/reach/flow.h"

#include <stdexcept>
#include <string>

namespace swarmcert::stability {
namespace {

/// Returns the Taylor coefficients 0 .. order of the solutions from x.
std::vector<TimeSeries> taylor(const VectorField& f, const AffineVector& x, std::size_t order) {
  std::vector<TimeSeries> series(x.begin(), x.end());
  for (std::size_t k = 0; k < order; ++k) {
    const std::vector<TimeSeries> slopes = f(series);
    for (std::size_t i = 0; i < x.size(); ++i)
      series[i].c.push_back(slopes[i][k] / AffineForm(static_cast<double>(k + 1)));
  }
  return series;
}

/// Returns whether state i is proved to stay in the box from which `everywhere` was computed; see flow().
bool stays_inside(const FlowStep& step, std::size_t i, Interval time) {
  const AffineVector& c = step.everywhere[i].c;
  if (c[0].is_zero()) return c[1].is_zero() && step.x[i].c[0].is_zero();
  const Interval values = step.x[i].at(time).range(), box = c[0].range();
  return values.lower > box.lower && values.upper < box.upper;
}

}  // namespace

AffineVector FlowStep::at(Interval t) const {
  AffineVector states;
  std::size_t used = 0;
  for (const TimeSeries& one : x) {
    states.push_back(one.at(t));
    used = std::max(used, symbols(one.c));
  }
  return with_radii_as_symbols(std::move(states), used);
}

FlowStep flow(const VectorField& f, const AffineVector& x, Interval duration, std::size_t order) {
  if (order < 2) throw std::invalid_argument("flow: order " + std::to_string(order) + ", must be at least 2");
  const Interval time(0, duration.upper);
  FlowStep step{taylor(f, x, order), {}, duration};
  for (int attempt = 0; attempt < 20; ++attempt) {
    AffineVector box;
    for (const TimeSeries& one : step.x) {
      const AffineForm values = one.at(time);
      const double margin = 0.1 * values.deviation() + 1e-12 * std::abs(values.centre) + 1e-30;
      box.push_back(values.is_zero() ? values : AffineForm(values.range() + Interval(-margin, margin)));
    }
    step.everywhere = taylor(f, box, order);
    bool is_inside = true;
    for (std::size_t i = 0; i < x.size(); ++i) {
      step.x[i].c.back() = step.everywhere[i].c.back();
      is_inside = is_inside && stays_inside(step, i, time);
    }
    if (is_inside) return step;
  }
  throw std::domain_error("no box contains the solutions over a step of " + std::to_string(duration.upper) +
                          " s");
}

std::vector<FlowStep> reach(const SampledField& field, AffineVector x, Interval duration, int steps,
                            std::size_t order) {
  std::vector<FlowStep> result;
  for (int k = 0; k < steps; ++k) {
    result.push_back(flow(field(x), x, duration, order));
    x = result.back().at(duration);
  }
  return result;
}

Extreme extreme(const std::vector<FlowStep>& steps, std::size_t first, std::size_t i, Side side, int cells,
                std::size_t initial) {
  Extreme found{{-kInfinity, -kInfinity}};
  for (std::size_t k = first; k < steps.size(); ++k) {
    const double length = up(steps[k].duration.upper / cells);
    const Interval gap =
        Interval(length) + Interval(0x1p-50 * steps[k].duration.upper);  // with round-off of times
    const double bend = 2 * steps[k].everywhere[i][2].range().mag();
    const Interval sag = Interval(bend) * gap * gap / Interval(8);
    for (int cell = 0; cell <= cells; ++cell) {
      const double t = std::min(cell * length, steps[k].duration.upper);
      const AffineForm x = steps[k].x[i].at(t);
      const Interval value = (side == Side::kLargest ? x : -x).largest(initial);
      if (value.lower > found.value.lower && t <= steps[k].duration.lower)
        found = {{value.lower, found.value.upper}, k, t};
      found.value.upper = std::max(found.value.upper, up(value.upper + sag.upper));
    }
  }
  if (side == Side::kSmallest) found.value = -found.value;
  return found;
}

}  // namespace swarmcert::stability
