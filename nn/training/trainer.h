/// @file Stochastic gradient descent over a dataset, epoch by epoch.
#pragma once

#include <optional>

#include "nn/base/random.h"
#include "nn/training/adam.h"
#include "nn/training/bounded_layers.h"
#include "nn/training/deep_set_loss.h"
#include "nn/training/spectral_normalization.h"

namespace swarmcert::training {

struct TrainerOptions {
  files::GammaStatement gamma;
  Layers layers = Layers::kFree;
  double learning_rate = 1e-3;
  int batch = 1024;    ///< samples per step
  bool turns = false;  ///< rotate every sample about the vertical in every epoch: see turn_about_vertical()
  std::uint64_t seed = 1;
  int jobs = 0;  ///< number of threads; 0: all. The bits of the result do not depend on it.
};

/// Minimises deep_set_loss() / (sum of weights) with Adam, either over the parameters of bounded layers or over the
/// weights with spectral normalization after every step.
///
/// A batch is split into pieces of kPiece samples whose gradients are summed in order, so that the bits are the same
/// for any number of threads and on every processor of one instruction set. A step depends only on the parameters, the
/// state of Adam, the singular vectors of the norm estimates, the epoch number, and the arguments of weigh() and
/// tighten(); training can therefore be resumed at the end of any epoch.
class Trainer {
 public:
  /// @param layout, data must outlive the trainer.
  /// @param parameters initial values: the weights, or the parameters of bounded layers.
  Trainer(const Layout& layout, const Dataset& data, std::vector<Eigen::Index> samples, Vector parameters,
          const TrainerOptions& options);

  /// Performs one pass over the samples in an order drawn from seed and `epoch`.
  /// @returns the mean weighted squared error over the pass, each batch evaluated before its update.
  double run_epoch(int epoch, double learning_rate);

  /// Sets the weight of sample s of the dataset to weights[s].
  void weigh(std::vector<float> weights) { data_.weight = std::move(weights); }
  /// Sets the limit of every layer of part p to shares[p] times the limit that gamma implies.
  void tighten(std::vector<double> shares);

  /// Returns the weights and biases.
  const Vector& theta() const { return theta_; }

  /// Returns the state for a checkpoint as one vector: parameters, both moments, the number of steps.
  Vector state() const;
  /// @throws std::invalid_argument if `state` does not match this layout.
  void restore(const Vector& state);

 private:
  double step(const Eigen::Index* samples, Eigen::Index count, double learning_rate);
  void settle();

  const Layout& layout_;
  const Dataset& source_;
  Dataset data_;  ///< as transformed for this epoch
  std::vector<Eigen::Index> samples_;
  TrainerOptions options_;
  Vector parameters_, theta_;
  Adam adam_;
  std::vector<double> shares_;
  SpectralNormalization normalization_;  ///< used with free layers
  BoundedLayers bounded_;
  std::vector<Vector> gradients_;  ///< per piece of a batch
};

/// Returns the mean weighted squared error of some samples; the bits are the same for any number of threads.
double mean_loss(const Layout& layout, const Vector& theta, const Dataset& data,
                 const std::vector<Eigen::Index>& samples, int jobs);

}  // namespace swarmcert::training
