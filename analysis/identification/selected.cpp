#include "analysis/identification/selected.h"

#include "stability/effects/registry.h"

namespace swarmcert::identification {

using stability::Family;

bool is_scale(const std::string& effect) {
  return stability::traits_of(effect).family == Family::kThrustScale;
}

bool is_push(const std::string& effect) { return stability::traits_of(effect).family == Family::kPush; }

std::vector<Candidate> candidates_of(const std::vector<Refined>& effects) {
  std::vector<Candidate> candidates;
  for (const Refined& r : effects) {
    candidates.push_back(r.candidate);
    if (r.candidate.info.remembers) candidates.back().info.linear[0].lower = 0;
  }
  return candidates;
}

}  // namespace swarmcert::identification
