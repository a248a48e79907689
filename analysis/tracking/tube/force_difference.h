/// @file The difference of both forces, f_hat - f_a along z, over the states of one stretch.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "analysis/tracking/tube/scene.h"

namespace swarmcert::analysis {

/// f_hat(x(t - age)) - f_a(x(t)) for 0 <= age <= Scene::network_age_s(), where the network is given x with errors of
/// the estimates. On each part of a box, the network lies between linear forms by outward-rounded relaxation (Reach),
/// the truth between its mean value forms f_a(x_0) + G (x - x_0) in intervals; their difference is one linear form, so
/// that slopes which agree cancel. A form holds on its whole part: for smaller deviations its largest value over what
/// is left of the part holds as well, and costs nothing.
class ForceDifference {
 public:
  /// @param scene, stretch must outlive this. @param largest deviations for which it is made ready.
  ForceDifference(const Scene& scene, const Stretch& stretch, const Deviations& largest);

  double bound_N() const;  ///< of |f_hat - f_a|, as far as it is refined
  /// Halves the worst part until there are `boxes`, or the bound is within `tolerance_N` of a value found. Once only.
  void refine(int boxes, double tolerance_N, const std::atomic<bool>* cancelled);
  /// Contains f_hat - f_a, newton, in real arithmetic. Precondition: deviations within `largest`.
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
  std::vector<Interval> all_;  ///< every state of the stretch
  TruthForce::Rest rest_;
  std::vector<std::shared_ptr<const Part>> parts_;  ///< a heap, the worst first
};

}  // namespace swarmcert::analysis
