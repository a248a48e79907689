/// @file Bounds of |f_hat - f_a| over a tube, stretch by stretch: straight from both forces, or from a Lipschitz
/// constant.
#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "analysis/tracking/tube/force_difference.h"

namespace swarmcert::analysis {

/// Bounds sup |f_hat(x(t - age)) - f_a(x(t))| along z, 0 <= age <= Scene::network_age_s().
class ForceBound {
 public:
  virtual ~ForceBound() = default;
  /// Makes ready for every tube within `largest`. @returns false where it was cancelled.
  virtual bool prepare(const Radii& largest, const std::vector<TruthSizes>& truth) = 0;
  /// Newton, per stretch of the scene, in real arithmetic. Precondition: radii within what was prepared.
  virtual std::vector<double> sizes(const Radii& radii) const = 0;
};

struct EnclosureOptions {
  int boxes = 8;  ///< at most so many parts of each stretch's set of states
  double tolerance =
      0.04;  ///< no further where the bound is this near to a value found, of the largest bound of all
  int jobs = 0;
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(int done, int total)> progress;
};

/// From the difference itself, made ready stretch by stretch for the largest tube.
class Enclosure final : public ForceBound {
 public:
  Enclosure(const Scene& scene, EnclosureOptions options) : scene_(scene), options_(std::move(options)) {}
  bool prepare(const Radii& largest, const std::vector<TruthSizes>& truth) override;
  std::vector<double> sizes(const Radii& radii) const override;

 private:
  std::vector<ForceDifference> differences_;  ///< per stretch
  const Scene& scene_;
  EnclosureOptions options_;
};

/// Constants of the network's force on a vehicle, newton per m and per m/s; `together` with respect to both at once.
struct ForceConstants {
  double together = 0, position = 0, velocity = 0;  ///< of one neighbour's state
  double own = 0;                                   ///< of the ground's input, together
};

/// |f_hat - f_a| at the set points, and from there by slopes: L |deviation| of each neighbour, and the truth's own
/// gradient.
class SlopeBound final : public ForceBound {
 public:
  /// @param at_set_points what an Enclosure says of radii 0.
  /// @param constants per vehicle; they hold within `limit`.
  SlopeBound(const Scene& scene, std::vector<double> at_set_points, std::vector<ForceConstants> constants)
      : scene_(scene), at_set_points_(std::move(at_set_points)), constants_(std::move(constants)) {}
  bool prepare(const Radii& largest, const std::vector<TruthSizes>& truth) override;
  std::vector<double> sizes(const Radii& radii) const override;

 private:
  const Scene& scene_;
  std::vector<double> at_set_points_;
  std::vector<ForceConstants> constants_;
  std::vector<TruthSizes> truth_;
};

/// What a deviation of a neighbour's position and velocity costs, the smaller of both bounds.
double slope_cost_N(const ForceConstants& constants, double position_m, double velocity_m_s);

}  // namespace swarmcert::analysis
