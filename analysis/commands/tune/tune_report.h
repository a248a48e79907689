/// @file The report of `tune`: changes relative to the given gains.
#pragma once

#include <string>
#include <vector>

#include "nn/base/record.h"

namespace swarmcert::analysis {

/// One quantity under the given gains and under the tuned gains.
struct TunedQuantity {
  std::string name;
  double shipped, tuned;
  std::string unit;
};

/// Writes FOLDER/report.html with a bar per quantity and the described `result`. Returns its path.
/// @param verdict one sentence stating what was found; `quantities` is empty if nothing was found.
/// @throws files::InputError as Report::write().
std::string write_tune_report(const std::string& verdict, const std::vector<TunedQuantity>& quantities,
                              const files::Node& result, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
