#include "stability/effects/deep_set.h"

#include <filesystem>
#include <limits>

#include "nn/base/input_error.h"
#include "nn/weights/network.h"
#include "stability/effects/deep_set_force.h"

namespace swarmcert::stability {
namespace {

files::Network load(const EffectSpec& spec, const EffectContext& context) {
  if (spec.network.empty()) {
    throw files::InputError({"", "", "effect.network", "", "the effect deep_set needs a network",
                             "add network = \"network.toml\""});
  }
  return files::load_network(
      {{}, (std::filesystem::path(context.path).parent_path() / spec.network).string(), "", ""});
}

}  // namespace

EffectInfo DeepSetEffect::describe() {
  return {"deep_set",
          "f = c f_hat(own state, neighbours), or a torque",
          "the learned model of this project: a flexible candidate to try after the physical ones",
          "deep_set",
          "the flights that the network was trained for",
          {{"gain", "1 is the network itself", 1, 0, 1.5}},
          {},
          false,
          true,
          {Family::kNone, Family::kNone, ShownBy::kNothing}};
}

DeepSetEffect::DeepSetEffect(const EffectSpec& spec, const EffectContext& context)
    : Effect(describe()),
      force_(std::make_unique<DeepSetForce>(load(spec, context), context.kind, context.kinds,
                                            DeepSetOutput::kAny)) {}

DeepSetEffect::~DeepSetEffect() = default;

void DeepSetEffect::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = force_->wrench(now);
}

double DeepSetEffect::reach_m(double, const double*) const { return std::numeric_limits<double>::infinity(); }

}  // namespace swarmcert::stability
