#include "analysis/identification/swinging_load.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/identification/cross_validation.h"
#include "analysis/identification/remainder.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

enum Place { kRatio, kPush, kLoad };

const Members kFixedLoad = {{kRatio, 0}, {kPush, 0}};

double frequency_rad_s(double length_m) { return std::sqrt(stability::kGravity_m_s2 / length_m); }

/// Returns a constant horizontal force; the vertical part is explained by the weight.
Candidate horizontal_push(const stability::Model& model, const Coverage& covered) {
  Candidate push = candidate(stability::plain_effect(stability::Family::kPush), model, covered);
  push.info.linear[2].lower = push.info.linear[2].upper = 0;
  return push;
}

/// Range of round `k` of the search about the best result of the previous round.
struct Zoom {
  double step_rad_s;
  std::vector<double> damping_factors;
};
const std::vector<Zoom> kZooms = {{0.25, {1, 0.5, 0.25}}, {0.12, {2, 1, 0.5}}, {0.06, {1.4, 1, 0.7}}};

std::vector<std::vector<double>> around(const std::vector<double>& best, const Zoom& zoom,
                                        const stability::EffectInfo& info) {
  std::vector<std::vector<double>> thetas;
  for (const int steps : {-2, -1, 0, 1, 2}) {
    const double omega = frequency_rad_s(best[0]) + steps * zoom.step_rad_s;
    for (const double factor : zoom.damping_factors) {
      thetas.push_back({stability::kGravity_m_s2 / (omega * omega), factor * best[1]});
      for (std::size_t i = 0; i < 2; ++i)
        thetas.back()[i] = std::clamp(thetas.back()[i], info.shape[i].lower, info.shape[i].upper);
    }
  }
  return thetas;
}

class PendulumSearch {
 public:
  PendulumSearch(const Passes& passes, const Coverage& covered,
                 const std::vector<stability::EffectSpec>& beside)
      : passes_(passes), inputs_(inputs_with(passes, beside)), flights_(inputs_.found.flights.size()) {
    std::iota(flights_.begin(), flights_.end(), 0);
    const stability::Model& model = *inputs_.model_of(passes.kind);
    fixed_ = {candidate(stability::plain_effect(stability::Family::kThrustScale), model, covered),
              horizontal_push(model, covered)};
    load_ = candidate(stability::effect_shown_by(stability::ShownBy::kSwing), model, covered);
    condense();
  }

  void zoom() {
    for (const Zoom& zoom : kZooms) {
      load_.thetas = around(best(), zoom, load_.info);
      condense();
    }
  }

  bool swings() const {
    constexpr double kMostDamping = 0.5;  // of the frequency: a quarter of critical damping
    return best()[1] <= kMostDamping * frequency_rad_s(best()[0]);
  }

  /// Returns the reduction of the mean square of held-out blocks.
  double gain() const {
    const CrossValidation fits(grams_);
    return 1 - fits.mean_square(with(kFixedLoad, member_)) / fits.mean_square(kFixedLoad);
  }

  /// Returns whether the load is heavy compared with the vehicle, or accounts for most of the weight of a rigid load.
  /// Recorded flights without a load showed slow oscillations of up to 3 % of the vehicle's mass.
  bool is_heavy() const {
    constexpr double kShareOfRatio = 0.5, kShareOfVehicle = 0.1;
    const CrossValidation fits(grams_);
    const double ratio = fits.coefficients(kFixedLoad)[0];
    const Eigen::VectorXd c = fits.coefficients(with(kFixedLoad, member_));
    const double load_kg = c[c.size() - 1];
    return load_kg > kShareOfVehicle * inputs_.model_of(passes_.kind)->mass_kg ||
           (load_kg > 0 && ratio < 0 && std::abs(c[0]) <= kShareOfRatio * std::abs(ratio));
  }

  Candidate found() const {
    constexpr double kLengthStep = 1.05, kDampingStep = 1.4;
    Candidate result = load_;
    const double length_m = best()[0], damping_1_s = best()[1];
    result.thetas = {best(),
                     {length_m * kLengthStep, damping_1_s},
                     {length_m / kLengthStep, damping_1_s},
                     {length_m, damping_1_s * kDampingStep}};
    return result;
  }

 private:
  const std::vector<double>& best() const { return load_.thetas[static_cast<std::size_t>(member_.theta)]; }

  void condense() {
    const Passes beside = {inputs_, passes_.kind, flights_, passes_.records, passes_.jobs, passes_.progress};
    grams_ = block_grams(beside, {fixed_[0], fixed_[1], load_});
    member_ = CrossValidation(grams_).best_theta(kFixedLoad, kLoad);
  }

  const Passes& passes_;
  const residuals::Inputs inputs_;
  std::vector<int> flights_;
  std::vector<Candidate> fixed_;
  Candidate load_;
  Grams grams_;
  Member member_;
};

}  // namespace

bool swings(const std::string& effect) {
  return stability::traits_of(effect).shown_by == stability::ShownBy::kSwing;
}

Candidate best_pendulum(const Passes& passes, const Coverage& covered,
                        const std::vector<stability::EffectSpec>& beside) {
  PendulumSearch search(passes, covered, beside);
  search.zoom();
  return search.found();
}

std::optional<Candidate> visible_pendulum(const Passes& passes, const Coverage& covered,
                                          const std::vector<stability::EffectSpec>& beside) {
  PendulumSearch search(passes, covered, beside);
  // The damping of the grid is too high for a resonance, but a resonance is visible all the same; rigid loads gained
  // 0.0001.
  constexpr double kLeastGain = 0.003;
  if (search.gain() < kLeastGain) return std::nullopt;
  search.zoom();
  if (!search.swings() || !search.is_heavy()) return std::nullopt;
  return search.found();
}

}  // namespace swarmcert::identification
