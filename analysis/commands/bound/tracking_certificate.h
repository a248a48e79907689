/// @file The certificate that `bound --verified -o` writes.
#pragma once

#include "analysis/commands/shared/tracking_input.h"

namespace swarmcert::analysis {

/// Schema swarmcert/tracking-certificate/1: the gains of every continuous and sampled loop, with what proves them to
/// the checker (stability/checker), and under left_out what `verified` holds besides, each with the reason.
/// @param verified verified_json() of the same input.
files::Json tracking_certificate(const Tracking& input, const TrackingArguments& arguments,
                                 const files::Json& verified);

/// Whether it would hold no gain.
bool is_empty_certificate(const files::Json& certificate);

/// How many loops a certificate holds and how many it leaves out, for the result.
files::Json certificate_summary(const files::Json& certificate);
void print_certificate_summary(const files::Json& certificate, const std::string& path);

}  // namespace swarmcert::analysis
