#include "nn/training/trainer.h"

#include <algorithm>
#include <stdexcept>

#include "nn/base/parallel.h"
#include "nn/training/symmetry.h"

namespace swarmcert::training {
namespace {

using Eigen::Index;

/// Number of samples whose gradient one thread computes at a time: matrices of this width stay in the cache.
constexpr Index kPiece = 128;
/// Splits a step count into two floats that are each exact.
constexpr std::uint64_t kHalf = 1u << 20;

/// Fixes the cache sizes, on which the order of the sums in Eigen's matrix products depends.
void fix_order_of_sums() { Eigen::setCpuCacheSizes(32 << 10, 256 << 10, 2 << 20); }

double sum_of_weights(const Dataset& data, const Index* samples, Index count) {
  double sum = 0;
  for (Index s = 0; s < count; ++s) sum += static_cast<double>(data.weight[samples[s]]);
  return sum;
}

}  // namespace

Trainer::Trainer(const Layout& layout, const Dataset& data, std::vector<Index> samples, Vector parameters,
                 const TrainerOptions& options)
    : layout_(layout),
      source_(data),
      data_(data),
      samples_(std::move(samples)),
      options_(options),
      parameters_(std::move(parameters)),
      adam_(layout.size()),
      shares_(layout.parts().size(), 1.0),
      normalization_(layout, options.gamma, parameters_),
      bounded_(layout, options.layers, options.gamma) {
  fix_order_of_sums();
  settle();
  gradients_.resize(static_cast<std::size_t>((options_.batch + kPiece - 1) / kPiece));
}

/// Updates the weights after a change of the parameters.
void Trainer::settle() {
  if (options_.layers == Layers::kFree) normalization_.apply(parameters_);
  theta_ = bounded_.weights(parameters_);
}

void Trainer::tighten(std::vector<double> shares) {
  shares_ = std::move(shares);
  bounded_.tighten(shares_);
  theta_ = bounded_.weights(parameters_);
}

double Trainer::step(const Index* samples, Index count, double learning_rate) {
  const double weight = sum_of_weights(data_, samples, count);
  if (!(weight > 0)) return 0;
  const int pieces = static_cast<int>((count + kPiece - 1) / kPiece);
  std::vector<double> losses(static_cast<std::size_t>(pieces));
  files::parallel_for(pieces, options_.jobs, [&](int i) {
    gradients_[i].setZero(layout_.size());
    losses[i] = deep_set_loss(layout_, theta_, data_, samples + i * kPiece,
                              std::min(kPiece, count - i * kPiece), &gradients_[i]);
  });
  double loss = losses.front();
  for (int i = 1; i < pieces; ++i) {
    gradients_[0] += gradients_[i];
    loss += losses[i];
  }
  gradients_[0] *= static_cast<float>(1 / weight);
  bounded_.pull_back(parameters_, gradients_[0]);
  adam_.step(parameters_, gradients_[0], learning_rate);
  settle();
  return loss;
}

double Trainer::run_epoch(int epoch, double learning_rate) {
  files::Random random(options_.seed * 0x9e3779b97f4a7c15u + static_cast<std::uint64_t>(epoch));
  std::vector<Index> order = samples_;
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  if (options_.turns) turn_about_vertical(layout_, source_, random, data_);
  // The power iteration is not part of the checkpoint, so restart it in every epoch, as a resumed run must.
  normalization_ = SpectralNormalization(layout_, options_.gamma, parameters_);
  normalization_.tighten(shares_);
  double loss = 0;
  const Index count = static_cast<Index>(order.size());
  for (Index at = 0; at < count; at += options_.batch) {
    loss += step(order.data() + at, std::min<Index>(options_.batch, count - at), learning_rate);
  }
  return loss / sum_of_weights(data_, order.data(), count);
}

Vector Trainer::state() const {
  Vector state(3 * layout_.size() + 2);
  const std::uint64_t high = adam_.steps / kHalf, low = adam_.steps % kHalf;
  state << parameters_, adam_.first_moment, adam_.second_moment, static_cast<float>(high),
      static_cast<float>(low);
  return state;
}

void Trainer::restore(const Vector& state) {
  const Index size = layout_.size();
  if (state.size() != 3 * size + 2)
    throw std::invalid_argument("the checkpoint does not match these networks");
  parameters_ = state.head(size);
  theta_ = bounded_.weights(parameters_);
  adam_.first_moment = state.segment(size, size);
  adam_.second_moment = state.segment(2 * size, size);
  adam_.steps =
      static_cast<std::uint64_t>(state(3 * size)) * kHalf + static_cast<std::uint64_t>(state(3 * size + 1));
}

double mean_loss(const Layout& layout, const Vector& theta, const Dataset& data,
                 const std::vector<Index>& samples, int jobs) {
  const Index count = static_cast<Index>(samples.size());
  const int pieces = static_cast<int>((count + kPiece - 1) / kPiece);
  std::vector<double> losses(static_cast<std::size_t>(pieces));
  files::parallel_for(pieces, jobs, [&](int i) {
    losses[i] = deep_set_loss(layout, theta, data, samples.data() + i * kPiece,
                              std::min(kPiece, count - i * kPiece), nullptr);
  });
  double loss = 0;
  for (const double piece : losses) loss += piece;
  return loss / sum_of_weights(data, samples.data(), count);
}

}  // namespace swarmcert::training
