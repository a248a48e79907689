/// @file How much of each network's output the selecting flights support, and among which neighbours none of it.
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
  std::map<std::string, double> scales;  ///< by kind; kinds that are not here keep 1
  std::map<std::string, SupportedErrors>
      silent;  ///< compositions without a network; with it as trained, and without
  std::map<std::string, SupportedErrors> left;  ///< of every composition, with what is kept of the output

  /// Names of the silent compositions, as write_network() takes them.
  std::vector<std::string> silent_names() const;
  /// Over all samples; NaN without any.
  SupportedErrors all() const;
};

/// What output_support() may do to an output.
enum class Support { kAsTrained, kSilence, kScaleAndSilence };

/// Scale s in [0, 1] of every kind's output f and the compositions c (small+small>small, ...) in which it is silent:
/// those that minimise
///   sum_c min(mean |y|^2, mean |y - s f|^2),
/// silent where mean |y|^2 is the less, over the samples of `use` of that kind. So in no composition the network is
/// worse than none. With |y - s f|^2 = |y|^2 - 2 s <y, f> + s^2 |f|^2 it helps at s < 2 <y, f> / |f|^2. Exact up to
/// 1e-4 of s, on these samples; elsewhere it is an estimate, and only of flights that f was not fitted to.
/// @param unseen [outputs x samples] f, where it was not fitted: for <y, f>.
/// @param whole [outputs x samples] f as it is kept: for |f|^2, which no target enters. With cross_fit() `unseen` is
///   what single networks say, which is as near to y as what their mean says, in the mean, and larger.
OutputSupport output_support(const LearningData& data, const training::Matrix& unseen,
                             const training::Matrix& whole, Use use = Use::kSelect,
                             Support may = Support::kScaleAndSilence);

/// Makes f 0 in the silent compositions.
void silence(const LearningData& data, const OutputSupport& support, training::Matrix& outputs);

/// Multiplies weights and biases of the last layer of the rho of each kind by its scale. A scale of at most 1 keeps
/// every limit on norms and Lipschitz constants.
void scale_outputs(const training::Layout& layout, const std::map<std::string, double>& scales,
                   training::Vector& theta);

}  // namespace swarmcert::learning
