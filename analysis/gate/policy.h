/// @file policy.toml: the files of a release, and the limits that it must keep.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "analysis/gate/check.h"
#include "analysis/gate/conditions.h"
#include "nn/weights/network.h"

namespace swarmcert::files {
class Keys;
class TomlTable;
}  // namespace swarmcert::files

namespace swarmcert::gate {

class Evidence;

/// [release]: the files under test. Paths are relative to the folder of the policy. Empty: not named.
struct Release {
  files::NetworkArguments network;
  bool is_float32 = true;  ///< precision in flight: float32, whatever the file stores
  std::string certificate, box, gains, model, source, elf, facts, swarm;
  std::string promise;               ///< result of bound --coverage
  std::string vehicles, columns;     ///< flights.toml and columns.toml
  std::vector<std::string> flights;  ///< reference flights
  int logs = 0;             ///< expected number of logs, because a folder does not show that one is missing
  int most_neighbours = 0;  ///< of the export in `elf`; 0: the default of export
  double battery_V = 4.2;
  bool feed_forward = false;  ///< the network's force is added to the model that is compared with the flights

  bool has_network() const { return !network.file.empty() || !network.phi.empty(); }
};

/// One table of the policy, ready to run. `run` appends its rows and can read those of earlier checks.
struct PlannedCheck {
  std::string name;
  int line = 0;
  std::function<void(Evidence&, Checks&)> run;
};

struct Policy {
  std::string path;
  Release release;
  int release_line = 0;
  std::set<std::string> named;       ///< keys of [release]
  std::vector<PlannedCheck> checks;  ///< in order of the registry
  std::vector<std::string> not_run;  ///< checks that the policy does not request
  Conditions conditions;             ///< its entries, with the defaults of those that are left out
  bool judges_certificate = false;
  bool wants_guard_factor = false;  ///< flights are simulated again in the closed loop
  std::vector<std::string> blocks;  ///< input blocks with limits of their own
};

/// Describes policy.toml.
void describe_policy_file(files::Keys& keys);

/// Reads a policy (schema swarmcert/policy/1): [release] and one table per check.
/// @throws files::InputError with line, key, value and hint for unknown tables and keys, limits that are not numbers,
///     a table without a limit, and a check whose file is not named in [release].
Policy read_policy(const std::string& path);

/// A kind of check: one source file, one line in check_kinds().
struct CheckKind {
  const char* name;     ///< name of its table
  const char* summary;  ///< one-line description
  const char* needs;    ///< keys of [release] without which it cannot run, between commas
  /// Describes the keys of the table; nullptr: they are names that the policy chooses.
  void (*describe_keys)(files::Keys& keys);
  /// Reads the table, which has no other keys; may store information for other checks in the policy.
  /// @throws files::InputError
  std::function<void(Evidence&, Checks&)> (*read)(const files::TomlTable& table, Policy& policy);
};

/// Returns all kinds in the order in which they run.
const std::vector<CheckKind>& check_kinds();

/// Returns the limit stated under `key`, if the table has that key.
std::optional<Limit> limit(const files::TomlTable& table, const std::string& key, const std::string& unit,
                           bool is_most = true);

/// Reads a limit on a force, or on a force per unit: key STEM_gf SUFFIX or STEM_N SUFFIX, or STEM alone for a network
/// without a unit.
std::optional<Limit> force_limit(const files::TomlTable& table, const std::string& stem,
                                 const std::string& suffix = "", bool is_most = true);
/// Describes the keys that force_limit() reads.
void describe_force_limit(files::Keys& keys, const char* meaning, const std::string& stem,
                          const std::string& suffix = "");

/// Reads an integer from 1 to 1000.
int whole_number(const files::TomlTable& table, const std::string& key, int otherwise);

/// Rejects the table unless [release] has `key`. @param otherwise what could be done instead.
void require_file(const files::TomlTable& table, const Policy& policy, const std::string& key,
                  const std::string& otherwise = "");

/// Rejects a table that states none of its limits.
[[noreturn]] void refuse_without_limit(const files::TomlTable& table, const std::string& example);

}  // namespace swarmcert::gate
