/// @file The report of `tune`: what changes against the gains given.
#pragma once

#include <string>
#include <vector>

#include "nn/base/json.h"

namespace swarmcert::analysis {

/// One quantity under the gains given and under the tuned ones.
struct TunedQuantity {
  std::string name;
  double shipped, tuned;
  std::string unit;
};

/// Writes FOLDER/report.html with a bar per quantity and the JSON `result`; returns its path.
/// @param verdict what was found, in a sentence; `quantities` is empty where nothing was.
/// @throws files::InputError as Report::write().
std::string write_tune_report(const std::string& verdict, const std::vector<TunedQuantity>& quantities,
                              const files::Json& result, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
