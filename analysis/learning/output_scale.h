/// @file Share of each network's output that the selecting flights support, and compositions without a network.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/learning/dataset.h"

namespace swarmcert::learning {

/// Root mean square errors in the unit of the targets.
struct SupportedErrors {
  double network = 0, nothing = 0;  ///< with the output, and without
  double samples = 0;
};

struct OutputSupport {
  std::map<std::string, double> scales;  ///< by kind; missing kinds have scale 1
  std::map<std::string, SupportedErrors>
      silent;  ///< compositions without a network: errors with the network as trained, and without it
  std::map<std::string, SupportedErrors> left;  ///< errors of every composition with the output that is kept

  /// Names of the silent compositions, in the form that write_network() accepts.
  std::vector<std::string> silent_names() const;
  /// Errors over all samples; NaN if there are none.
  SupportedErrors all() const;
};

/// What output_support() may do to an output.
enum class Support { kAsTrained, kSilence, kScaleAndSilence };

/// Finds, for every kind, the scale s in [0, 1] of its output f and the compositions c (small+small>small, ...) in
/// which it is silent. They minimise
///   sum_c min(mean |y|^2, mean |y - s f|^2)
/// over the samples of `use` of that kind; f is silent where mean |y|^2 is smaller, so in no composition is the network
/// worse than none. Since |y - s f|^2 = |y|^2 - 2 s <y, f> + s^2 |f|^2, it helps for s < 2 <y, f> / |f|^2. The result
/// is exact up to 1e-4 of s on these samples; elsewhere it is an estimate, and valid only for flights to which f was
/// not fitted.
/// @param unseen [outputs x samples] outputs of f on samples to which it was not fitted, used for <y, f>.
/// @param whole [outputs x samples] outputs of the f that is kept, used for |f|^2, which does not involve the targets.
///   With cross_fit(), `unseen` holds outputs of single networks: on average <y, f> is the same as for their mean, but
///   |f|^2 is larger.
OutputSupport output_support(const LearningData& data, const training::Matrix& unseen,
                             const training::Matrix& whole, Use use = Use::kSelect,
                             Support may = Support::kScaleAndSilence);

/// Sets the outputs of silent compositions to 0.
void silence(const LearningData& data, const OutputSupport& support, training::Matrix& outputs);

/// Multiplies the weights and biases of the last layer of each kind's rho by its scale. Scales of at most 1 preserve
/// all limits on norms and Lipschitz constants.
void scale_outputs(const training::Layout& layout, const std::map<std::string, double>& scales,
                   training::Vector& theta);

}  // namespace swarmcert::learning
