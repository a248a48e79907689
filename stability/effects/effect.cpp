#include "stability/effects/effect.h"

#include "stability/effects/hint.h"
#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

/// The columns of an effect without a memory.
class InstantStream : public ColumnStream {
 public:
  InstantStream(const Effect& effect, std::vector<double> shape)
      : effect_(effect), shape_(std::move(shape)) {}
  void advance(const Instant& now, Wrench* columns) override { effect_.columns(now, shape_.data(), columns); }
  void advance_along(const Instant* instants, int count, int, Wrench* columns) override {
    effect_.columns_along(instants, count, shape_.data(), columns);
  }

 private:
  const Effect& effect_;
  const std::vector<double> shape_;
};

}  // namespace

void ColumnStream::advance_along(const Instant* instants, int count, int width, Wrench* columns) {
  for (int i = 0; i < count; ++i) advance(instants[i], columns + i * width);
}

void Effect::columns_along(const Instant* instants, int count, const double* shape, Wrench* columns) const {
  for (int i = 0; i < count; ++i) this->columns(instants[i], shape, columns + i * num_columns());
}

std::unique_ptr<ColumnStream> Effect::stream(const double* shape) const {
  return std::make_unique<InstantStream>(*this, std::vector<double>(shape, shape + info_.shape.size()));
}

bool Effect::in_support(const Instant&, const double*) const { return true; }

std::vector<std::vector<double>> Effect::grid(const FlightRange&) const {
  std::vector<std::vector<double>> thetas = {{}};
  for (const Parameter& parameter : info_.shape) {
    std::vector<std::vector<double>> longer;
    const std::vector<double> values =
        parameter.grid.empty() ? std::vector<double>{parameter.value} : parameter.grid;
    for (const std::vector<double>& theta : thetas) {
      for (const double value : values) {
        longer.push_back(theta);
        longer.back().push_back(value);
      }
    }
    thetas = std::move(longer);
  }
  return thetas;
}

bool Effect::start_at(const Hint& hint, Start&) const { return hint.is_vertical(); }

void Effect::add_to(SignalPath&, const double*, const double*) const {}

bool Effect::pairs_need_velocity(const double*) const { return true; }

double Effect::pair_constant(double, const double*) const { return 0; }

void Effect::add_force_z(const SwarmPairs&, const double* const*, int, const double*, double, double*,
                         const ForceRows&) const {}

double Effect::reach_m(double, const double*) const { return 0; }

AppliedEffect::AppliedEffect(const EffectSpec& spec, const EffectContext& context)
    : effect_(make_effect(spec, context)) {
  EffectValues values = effect_values(effect_->info(), spec);
  coefficients_ = std::move(values.linear);
  shape_ = std::move(values.shape);
  columns_.resize(coefficients_.size());
}

Wrench AppliedEffect::wrench(const Instant& now) const {
  effect_->columns(now, shape_.data(), columns_.data());
  Wrench sum;
  for (std::size_t k = 0; k < coefficients_.size(); ++k) {
    sum.force_W_N += coefficients_[k] * columns_[k].force_W_N;
    sum.torque_B_Nm += coefficients_[k] * columns_[k].torque_B_Nm;
  }
  return sum;
}

}  // namespace swarmcert::stability
