/// @file Results of `certify`: described, and as text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/certify.h"
#include "lipschitz/upper/comparison.h"
#include "lipschitz/values/float32_error.h"
#include "lipschitz/values/range.h"
#include "nn/base/record.h"
#include "nn/weights/network.h"

namespace swarmcert::analysis {

struct CertifyOutput {
  lipschitz::Certification found;
  std::vector<std::optional<lipschitz::Comparison>>
      comparisons;  ///< one per bound of `found`; empty if not requested
  std::vector<lipschitz::CertifiedRange> ranges;
  std::vector<lipschitz::Float32Error> float32_errors;
  lipschitz::Verdict verdict = lipschitz::Verdict::kInconclusive;
  double max_lipschitz = 0;  ///< 0: no limit was given
  /// What was guessed about the function and no sample confirmed (Weights::assumed): nothing is proved of the trained
  /// network.
  std::vector<std::string> assumed;
  std::uint64_t seed = 1;
  std::string domain_file;        ///< box.toml; empty if there is none
  bool ranges_cut_short = false;  ///< ranges and float32 errors cover only a part of the box

  bool is_interrupted() const { return lipschitz::is_interrupted(found) || ranges_cut_short; }
};

/// Note for bounds over all inputs of functions with activations other than ReLU.
inline constexpr char kForReluOnly[] = "branch and bound over all inputs is for ReLU networks";

/// Note for networks that output zero in some compositions; the names of the compositions follow.
inline constexpr char kWhereSilent[] =
    "0 among these neighbours > vehicle, without a network: bounds hold while the neighbours stay the same, "
    "ranges hold this 0, and jumps hold the step to it: ";

/// Unit of the network's outputs; "output" if NET states none.
std::string output_unit(const files::Network& network);

/// The steepest slope found between two points, a lower bound; 0 if none was found.
double slope_found(const lipschitz::CertifiedBound& bound);

/// Value bounds that the certificate states for the function; null if it leaves them out.
const lipschitz::CertifiedValues* in_certificate(const CertifyOutput& output,
                                                 const files::FunctionId& function, int neighbours);

/// "set:small:large", "set:small:large position scaled", "set:small:large, at most 2 small".
std::string label(const lipschitz::CertifiedBound& bound);

/// Explains the numbers in sentences.
/// @param product product of spectral norms.
/// @param upper the best proved bound.
/// @param lower the steepest slope found; 0 if none.
std::vector<std::string> explain(const lipschitz::Comparison& comparison, double product, double upper,
                                 double lower);

/// Describes the fields of the result after its head.
void describe_certify(files::Record& record, const files::Network& network, const CertifyOutput& output);
files::Node certify_result(const files::Network& network, const CertifyOutput& output);

void print_certification(const files::Network& network, const CertifyOutput& output);

}  // namespace swarmcert::analysis
