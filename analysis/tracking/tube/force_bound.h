/// @file Bounds of |f_hat - f_a| over a tube, per stretch: directly from both forces, or from a Lipschitz constant.
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
  /// Prepares the bound for every tube within `largest`.
  /// @returns false if cancelled.
  virtual bool prepare(const Radii& largest, const std::vector<TruthSizes>& truth) = 0;
  /// Returns the bounds in newton per stretch of the scene, in real arithmetic. Precondition: radii within the
  /// prepared ones.
  virtual std::vector<double> sizes(const Radii& radii) const = 0;
};

struct EnclosureOptions {
  int boxes = 8;  ///< maximum number of parts of each stretch's set of states
  double tolerance =
      0.04;  ///< stops refining when the bound is this close to an attained value, relative to the largest bound
  int jobs = 0;
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(int done, int total)> progress;
};

/// Bounds the difference itself, prepared per stretch for the largest tube.
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

/// Lipschitz constants of the network's force on a vehicle, in newton per m and per m/s; `together` is with respect
/// to both.
struct ForceConstants {
  double together = 0, position = 0, velocity = 0;  ///< with respect to the state of one neighbour
  double own = 0;                                   ///< with respect to the input of the ground
};

/// Bounds |f_hat - f_a| at the setpoints, and extends it by slopes: L |deviation| of each neighbour, and the gradient
/// of the truth.
class SlopeBound final : public ForceBound {
 public:
  /// @param at_set_points result of an Enclosure for radii 0.
  /// @param constants per vehicle; valid within `limit`.
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

/// Bound on the effect of a deviation of a neighbour's position and velocity; the smaller of both bounds.
double slope_cost_N(const ForceConstants& constants, double position_m, double velocity_m_s);

}  // namespace swarmcert::analysis
