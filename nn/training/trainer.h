/// @file Epochs of stochastic gradient descent over a dataset.
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
  bool turns = false;  ///< every epoch sees every sample turned about the vertical: see turn_about_vertical()
  std::uint64_t seed = 1;
  int jobs = 0;  ///< threads; 0: all. The bits of the result do not depend on it.
};

/// Minimises deep_set_loss() / (sum of weights) with Adam, over the parameters of bounded layers, or over the weights
/// with spectral normalisation after every step.
///
/// A batch is cut into pieces of kPiece samples, whose gradients are summed in their order: the same bits for any
/// number of threads and on every processor of one instruction set. Everything that a step depends on is in the
/// parameters, adam, the norms' vectors, the epoch's number, and what weigh() and tighten() were told, so that a run
/// can be taken up again at the end of any epoch.
class Trainer {
 public:
  /// @param layout, data must outlive the trainer.
  /// @param parameters where the optimiser begins: the weights, but for bounded layers.
  Trainer(const Layout& layout, const Dataset& data, std::vector<Eigen::Index> samples, Vector parameters,
          const TrainerOptions& options);

  /// One pass over the samples in an order drawn from seed and `epoch`.
  /// @returns the mean weighted squared error met on the way, before each step's update.
  double run_epoch(int epoch, double learning_rate);

  /// From now on sample s of the dataset counts weights[s].
  void weigh(std::vector<float> weights) { data_.weight = std::move(weights); }
  /// From now on the limit of every layer of part p is shares[p] of gamma's.
  void tighten(std::vector<double> shares);

  /// Weights and biases.
  const Vector& theta() const { return theta_; }

  /// What a checkpoint must hold, as one vector: parameters, both moments, the number of steps.
  Vector state() const;
  /// @throws std::invalid_argument if `state` is not of this layout.
  void restore(const Vector& state);

 private:
  double step(const Eigen::Index* samples, Eigen::Index count, double learning_rate);
  void settle();

  const Layout& layout_;
  const Dataset& source_;
  Dataset data_;  ///< as this epoch sees it
  std::vector<Eigen::Index> samples_;
  TrainerOptions options_;
  Vector parameters_, theta_;
  Adam adam_;
  std::vector<double> shares_;
  SpectralNormalization normalization_;  ///< of free layers
  BoundedLayers bounded_;
  std::vector<Vector> gradients_;  ///< per piece of a batch
};

/// Mean weighted squared error of some samples, without a gradient; the same bits for any number of threads.
double mean_loss(const Layout& layout, const Vector& theta, const Dataset& data,
                 const std::vector<Eigen::Index>& samples, int jobs);

}  // namespace swarmcert::training
