/// @file A learned deep set as an effect: c f_hat(own, neighbours); f_hat is a vertical force, a force or a torque.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class DeepSetForce;

class DeepSetEffect : public Effect {
 public:
  /// @throws files::InputError if `spec` names no network, or a network that is not a deep set with a rho for
  ///     context.kind.
  DeepSetEffect(const EffectSpec& spec, const EffectContext& context);
  ~DeepSetEffect() override;
  static EffectInfo describe();
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  double reach_m(double dz_m, const double* shape) const override;

 private:
  std::unique_ptr<DeepSetForce> force_;
};

}  // namespace swarmcert::stability
