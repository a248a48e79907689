/// @file The certificate that `bound --verified -o` writes.
#pragma once

#include "analysis/commands/bound/verified.h"
#include "analysis/commands/shared/tracking_input.h"

namespace swarmcert::analysis {

/// Returns a certificate of schema swarmcert/tracking-certificate/1: the gains of every continuous and sampled loop
/// with the witness that proves them to the checker (stability/checker). `left_out` lists everything else in
/// `verified`, each entry with the reason.
/// @param verified verified_gains() of the same input.
files::Json tracking_certificate(const Tracking& input, const TrackingArguments& arguments,
                                 const VerifiedGains& verified);

/// Whether the certificate contains no gain.
bool is_empty_certificate(const files::Json& certificate);

/// Describes the number of loops that a certificate contains, and what it leaves out.
void describe_certificate(files::Record& record, const files::Json& certificate);
void print_certificate_summary(const files::Json& certificate, const std::string& path);

}  // namespace swarmcert::analysis
