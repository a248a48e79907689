#include "lipschitz/values/attained_values.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/values.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

constexpr int kValueSamples = 400, kValueClimbs = 200;

/// The inputs of the terms of a function, in the box.
struct BoxPoint {
  std::vector<files::FunctionId> networks;
  std::vector<std::vector<float>> inputs;
};

class ValueSearch {
 public:
  ValueSearch(const files::Network& network, const Domain& domain, const files::FunctionId& function,
              int neighbours, std::uint64_t seed)
      : network_(network),
        function_(function),
        parts_(files::parts(network)),
        domain_(domain),
        names_(function.parts()),
        neighbours_(neighbours),
        generator_(seed) {
    for (const auto& [name, weights] : parts_) evaluators_.emplace(name, files::Evaluator<double>(*weights));
  }

  int outputs() const { return parts_.at(names_.back())->outputs(); }

  /// About the point where sign * f_output is largest; no inputs where the box holds no float32.
  BoxPoint best(int output, double sign) {
    BoxPoint best;
    double largest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < kValueSamples + kValueClimbs; ++i) {
      const bool climbs = i >= kValueSamples;
      const BoxPoint point =
          climbs ? moved(best, std::exp2(-8.0 * (i - kValueSamples) / kValueClimbs)) : random_point();
      if (point.inputs.empty()) return {};
      const double value = sign * in_double(point)[static_cast<std::size_t>(output)];
      if (!(value > largest)) continue;
      largest = value;
      best = point;
    }
    return best;
  }

  /// Contains f(point).
  check::Intervals enclosed(const BoxPoint& point) const {
    if (files::is_silent_among(network_, function_, point.networks)) {
      const std::vector<check::Dyadic> zeros(static_cast<std::size_t>(outputs()));
      return {zeros, zeros};
    }
    std::vector<check::SumTerm> terms;
    for (std::size_t j = 0; j < point.inputs.size(); ++j) {
      const std::vector<float>& x = point.inputs[j];
      check::Intervals at{{x.begin(), x.end()}, {x.begin(), x.end()}};
      const files::Weights& network = *parts_.at(point.networks[j]);
      terms.push_back({{check::network_intervals(network, std::move(at)), {}}, 1, 1});
    }
    if (names_.size() == 1) return std::move(terms.front().values);
    const files::Weights& rho = *parts_.at(names_.back());
    return check::network_intervals(rho, check::sum_intervals(terms, static_cast<std::size_t>(rho.inputs())));
  }

 private:
  double share() { return std::ldexp(static_cast<double>(generator_() >> 11), -53); }

  /// Each coordinate at random, a third of them at an end.
  BoxPoint random_point() {
    BoxPoint point;
    if (names_.size() == 2) {
      const int count = 1 + static_cast<int>(generator_() % static_cast<std::uint64_t>(neighbours_));
      point.networks.assign(static_cast<std::size_t>(count), names_[0]);
      if (parts_.count(files::FunctionId::ground_phi()) == 1)
        point.networks.emplace_back(files::FunctionId::ground_phi());
    } else {
      point.networks = {names_[0]};
    }
    for (const files::FunctionId& name : point.networks) {
      const Box& box = domain_.at(name);
      std::vector<float> x;
      for (std::size_t k = 0; k < box.lower.size(); ++k) {
        const double r = std::clamp(1.5 * share() - 0.25, 0.0, 1.0);
        const std::optional<float> there =
            nearest_float(box.lower[k] + r * (box.upper[k] - box.lower[k]), box.lower[k], box.upper[k]);
        if (!there) return {};
        x.push_back(*there);
      }
      point.inputs.push_back(std::move(x));
    }
    return point;
  }

  BoxPoint moved(BoxPoint point, double scale) {
    for (std::size_t j = 0; j < point.inputs.size(); ++j) {
      const Box& box = domain_.at(point.networks[j]);
      for (std::size_t k = 0; k < box.lower.size(); ++k) {
        const double step = scale * (2 * share() - 1) * (box.upper[k] - box.lower[k]);
        float& x = point.inputs[j][k];  // one is in the box, so that there is a nearest
        x = nearest_float(static_cast<double>(x) + step, box.lower[k], box.upper[k]).value_or(x);
      }
    }
    return point;
  }

  std::vector<double> in_double(const BoxPoint& point) const {
    if (files::is_silent_among(network_, function_, point.networks))
      return std::vector<double>(static_cast<std::size_t>(outputs()));
    std::vector<double> sum;
    for (std::size_t j = 0; j < point.inputs.size(); ++j) {
      const std::vector<float>& x = point.inputs[j];
      const std::vector<double> term = evaluators_.at(point.networks[j])({x.begin(), x.end()});
      if (sum.empty()) sum.resize(term.size());
      for (std::size_t i = 0; i < term.size(); ++i) sum[i] += term[i];
    }
    return names_.size() == 1 ? sum : evaluators_.at(names_.back())(sum);
  }

  const files::Network& network_;
  files::FunctionId function_;
  files::Parts parts_;
  const Domain& domain_;
  std::vector<files::FunctionId> names_;
  int neighbours_;
  std::mt19937_64 generator_;
  std::map<files::FunctionId, files::Evaluator<double>> evaluators_;
};

}  // namespace

std::vector<AttainedEnds> attained_ends(const files::Network& network, const Domain& domain,
                                        const files::FunctionId& function, int neighbours,
                                        std::uint64_t seed) {
  ValueSearch search(network, domain, function, neighbours, seed);
  std::vector<AttainedEnds> result;
  for (int output = 0; output < search.outputs(); ++output) {
    const auto index = static_cast<std::size_t>(output);
    AttainedEnds ends;
    for (const double sign : {-1.0, 1.0}) {
      const BoxPoint point = search.best(output, sign);
      if (point.inputs.empty()) continue;
      const check::Intervals values = search.enclosed(point);
      const double value = sign > 0 ? rounded_down(values.lower[index]) : rounded_up(values.upper[index]);
      (sign > 0 ? ends.greatest : ends.least) = {value, point.networks, point.inputs};
    }
    result.push_back(std::move(ends));
  }
  return result;
}

}  // namespace swarmcert::lipschitz
