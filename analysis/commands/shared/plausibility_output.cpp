#include "analysis/commands/shared/plausibility_output.h"

namespace swarmcert::analysis {

files::Json json_of(const std::vector<logs::Doubt>& doubts) {
  files::Json json = files::Json::array();
  for (const logs::Doubt& doubt : doubts) {
    json.push_back({{"signal", doubt.signal},
                    {"value", doubt.value},
                    {"words", doubt.words},
                    {"refused", doubt.refuses_force}});
  }
  return json;
}

}  // namespace swarmcert::analysis
