/// @file The certificate that `bound --verified -o` writes.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/bound/gain_witness.h"
#include "analysis/commands/bound/verified.h"
#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// A certificate of schema swarmcert/tracking-certificate/1: the gains of continuous and sampled loops with the witness
/// that proves them to the checker (stability/checker).
struct TrackingCertificate {
  struct Loop {
    std::string axis;
    ProvedGains proved;
  };
  struct SampledLoop {
    std::string axis;
    ProvedSampledGains proved;
  };
  /// A row of --verified that is not certified.
  struct LeftOut {
    std::string axis, input, loop, why;
  };

  std::string gains_sha256, model_sha256;
  std::vector<Loop> loops;
  std::vector<SampledLoop> sampled_loops;
  std::vector<LeftOut> left_out;
  std::string content_sha256;

  bool has_no_gain() const { return loops.empty() && sampled_loops.empty(); }
};

/// Describes the file.
void describe(files::Record& record, const TrackingCertificate& certificate);

/// Returns a certificate of the gains of every continuous and sampled loop; `left_out` lists everything else in
/// `verified`, each entry with the reason.
/// @param verified verified_gains() of the same input.
TrackingCertificate tracking_certificate(const Tracking& input, const TrackingArguments& arguments,
                                         const VerifiedGains& verified);

/// Describes the number of loops that a certificate contains, and what it leaves out.
void describe_certificate(files::Record& record, const TrackingCertificate& certificate);
void print_certificate_summary(const TrackingCertificate& certificate, const std::string& path);

}  // namespace swarmcert::analysis
