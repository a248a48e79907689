/// @file The conditions under which a release is judged, in canonical form, and which change of them asks for less.
///
/// A condition is an entry of the policy, with its default if it is left out, a file on which the judgement rests, or a
/// limit stated in one of these files. Every condition has one order of strength (conditions.cpp); an entry without one
/// counts as changed for the worse whenever it changes, so that a new key cannot open a hole.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/base/json.h"

namespace swarmcert::gate {

class Evidence;

/// Values by dotted key: "tracking.amplitude_N", "box.phi:small", "inputs.model.crazyflie.toml"; `true` for the
/// presence of a table. A number without bound is "infinite".
using Conditions = std::map<std::string, files::Json>;

/// Returns the entries of the policy with the contents `text`, which read_policy() has accepted.
Conditions conditions_of_policy(const std::string& text, const std::string& path);

/// Returns the conditions of a whole release: those of the policy, its box, the gamma against which the layers are
/// judged, the network's unit, what gains.toml says of the vehicle, and the SHA-256 of every input.
Conditions conditions_of(Evidence& evidence);

struct Change {
  enum class Claim {
    kWeaker,    ///< the release claims less
    kOpen,      ///< nothing shows that it claims as much
    kStronger,  ///< it claims more
    kSame       ///< another file is released under the same conditions
  };
  std::string key;
  files::Json before, now;  ///< null: not there
  Claim claim = Claim::kOpen;

  bool asks_for_less() const { return claim == Claim::kWeaker || claim == Claim::kOpen; }
};
/// Returns "weaker", "open", "stronger" or "same".
const char* name(Change::Claim claim);
/// Returns "tracking.amplitude_N: 0.1 before, 0.01 now".
std::string words(const Change& change);

/// Returns every difference, in order of the keys. Of a table that was dropped or added only the table is named.
std::vector<Change> changes(const Conditions& before, const Conditions& now);

}  // namespace swarmcert::gate
