/// @file The difference of the forces, f_hat - f_a along z, over the states of one stretch.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "analysis/tracking/tube/scene.h"

namespace swarmcert::analysis {

/// Encloses f_hat(x(t - age)) - f_a(x(t)) for 0 <= age <= Scene::network_age_s(), where the network receives x with
/// estimation errors. On each part of a box, outward-rounded relaxation (Reach) encloses the network between linear
/// forms, and mean value forms f_a(x_0) + G (x - x_0) in interval arithmetic enclose the truth. The difference is one
/// linear form, so that equal slopes cancel. A form holds on its whole part: for smaller deviations, its maximum over
/// the remaining subset of the part is still a valid bound and costs nothing.
class ForceDifference {
 public:
  /// @param scene, stretch must outlive this object.
  /// @param largest deviations for which the bound is prepared.
  ForceDifference(const Scene& scene, const Stretch& stretch, const Deviations& largest);

  /// Halves the worst part until there are `boxes` parts, or the bound is within `tolerance_N` of an attained value.
  /// Call at most once.
  void refine(int boxes, double tolerance_N, const std::atomic<bool>* cancelled);
  /// Encloses f_hat - f_a in newton, in real arithmetic. Precondition: deviations within `largest`.
  Interval over(const Deviations& deviations) const;

 private:
  struct Form;
  struct Part;
  struct WakeForm;
  Part part(const lipschitz::Box& box, const LearnedForce::Forms* around) const;
  WakeForm wake_form(const lipschitz::Box& box) const;
  Form difference(const lipschitz::Box& box, const WakeForm& truth, const Eigen::VectorXd& row,
                  double constant, double sign) const;
  double roughly(const Eigen::VectorXd& x) const;
  std::vector<Offset> offsets_at(const Eigen::VectorXd& x) const;

  const Scene* scene_;
  const Stretch* stretch_;
  std::vector<Interval> all_;                       ///< every state of the stretch
  Interval rest_N_;                                 ///< the true force along z without wakes
  std::vector<std::shared_ptr<const Part>> parts_;  ///< a heap, worst part first
};

}  // namespace swarmcert::analysis
