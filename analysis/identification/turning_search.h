/// @file Which effects turn a vehicle: forward selection by predictions of its body rates.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/identification/turning.h"

namespace swarmcert::identification {

/// An effect that turns the vehicle, fitted jointly with those accepted before it.
struct Turned {
  std::string name;
  std::vector<stability::EffectSpec> specs;  ///< of all of them
  std::vector<RateErrors> rates;             ///< of the flights to select

  double mean_rad_s() const;  ///< of the norms
};

class TurningSearch {
 public:
  /// @param inputs with the model whose forces move the vehicles
  TurningSearch(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& fit,
                const std::vector<int>& select, int jobs);

  /// Whether flights to fit and to select show how the vehicle turns. Precondition of what follows.
  bool is_possible() const { return !fit_.empty() && !select_.empty(); }

  const Turned& accepted() const { return accepted_; }
  Turned with(const std::string& name) const;
  /// Returns the mean over flights of the errors with `next`, relative to those with what is accepted.
  double error_ratio(const Turned& next) const { return error_ratio(next, kNorm); }
  /// Returns the best of `names` that explain a motion: the error about an axis falls by 5 %, and by as much of what
  /// the rate about that axis does in flight as an effect of the force needs to be found; that of the vector does not
  /// rise.
  std::optional<Turned> best_of(const std::vector<std::string>& names) const;
  void accept(const Turned& next) { accepted_ = next; }

 private:
  static constexpr std::size_t kNorm = 3;
  double error_ratio(const Turned& next, std::size_t axis) const;
  bool explains_motion(const Turned& next) const;

  TurningFlights fit_, select_;
  Turned accepted_;
};

/// One step of a forward selection.
struct TurningStep {
  Turned found;
  double before_rad_s = 0;  ///< mean error of the body rates on the flights to select, before it
};

/// Returns the effects that turn the vehicles of one kind, the best one first, as long as one predicts the body rates
/// much better: fitted to `fit`, judged on `select`. Empty if these flights do not show how vehicles turn.
std::vector<TurningStep> turning_steps(const residuals::Inputs& inputs, const std::string& kind,
                                       const std::vector<int>& fit, const std::vector<int>& select, int jobs);

}  // namespace swarmcert::identification
