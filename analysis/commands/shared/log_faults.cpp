#include "analysis/commands/shared/log_faults.h"

#include "analysis/identification/verdict.h"

namespace swarmcert::analysis {

files::Json fault_entry(files::Json own) {
  own.update({{"drop_ci", {nullptr, nullptr}},
              {"per_vehicle", true},
              {"model_form", files::Json::object()},
              {"instrument", files::Json::object()},
              {"wald_z", nullptr},
              {"sensor", true}});
  return own;
}

bool rank_faults(const std::vector<files::Json>& entries, files::Json& result) {
  for (const files::Json& entry : entries) result["ranking"].push_back(entry);
  if (entries.empty()) return false;
  if (result["verdict"] != identification::name(identification::Verdict::kInconclusive)) {
    result["verdict"] = identification::name(identification::Verdict::kMissingEffect);
    result.erase("reason");
  }
  return true;
}

}  // namespace swarmcert::analysis
