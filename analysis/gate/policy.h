/// @file policy.toml: what a release consists of, and the limits that it has to keep.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/gate/check.h"
#include "nn/weights/network.h"

namespace swarmcert::files {
class TomlTable;
}

namespace swarmcert::gate {

class Evidence;

/// [release]: the files under test. Paths are those of the policy, taken from its folder. Empty: not named.
struct Release {
  files::NetworkArguments network;
  bool is_float32 = true;  ///< what flies: float32, whatever the file stores
  std::string certificate, box, gains, model, source, elf, facts, swarm;
  std::string promise;               ///< result of bound --coverage
  std::string vehicles, columns;     ///< flights.toml and columns.toml
  std::vector<std::string> flights;  ///< reference flights
  int logs = 0;                      ///< how many logs they are: a folder does not show that one is missing
  int most_neighbours = 0;           ///< of the export in `elf`; 0: as export has it by default
  double battery_V = 4.2;
  bool feed_forward = false;  ///< the network's force is part of the model that flights are held against

  bool has_network() const { return !network.file.empty() || !network.phi.empty(); }
};

/// One table of the policy, ready to run: adds its rows to those of the checks before it.
struct PlannedCheck {
  std::string name;
  int line = 0;
  std::function<void(Evidence&, Checks&)> run;
};

struct Policy {
  std::string path;
  Release release;
  int release_line = 0;
  std::vector<PlannedCheck> checks;  ///< in order of the registry
  std::vector<std::string> not_run;  ///< checks that the policy does not ask for
  RegressionLimits regression;       ///< of the table of this name
  bool judges_certificate = false;
  bool wants_guard_factor = false;  ///< flights are flown again in the closed loop
  std::vector<std::string> blocks;  ///< of inputs that have limits of their own
};

/// Reads a policy (schema swarmcert/policy/1): [release] and one table per check.
/// @throws files::InputError with line, key, value and hint: unknown tables and keys, limits that are no numbers, a
///   table without a limit, a check whose file is not named in [release].
Policy read_policy(const std::string& path);

/// A kind of check: one file, one line in check_kinds().
struct CheckKind {
  const char* name;     ///< its table
  const char* summary;  ///< one line
  /// Reads its table; may leave notes for others in the policy. @throws files::InputError
  std::function<void(Evidence&, Checks&)> (*read)(const files::TomlTable& table, Policy& policy);
};

/// Every kind, in the order in which they run.
const std::vector<CheckKind>& check_kinds();

/// The number of `key`, where the table has it.
std::optional<Limit> limit(const files::TomlTable& table, const std::string& key, const std::string& unit,
                           bool is_most = true);

/// A force, or a force per something: STEM_gf SUFFIX or STEM_N SUFFIX, or STEM alone for a network without a unit.
std::optional<Limit> force_limit(const files::TomlTable& table, const std::string& stem,
                                 const std::string& suffix = "", bool is_most = true);
/// The keys that force_limit() reads.
std::vector<std::string> force_keys(const std::string& stem, const std::string& suffix = "");

/// A whole number of at least 1 and at most 1000.
int whole_number(const files::TomlTable& table, const std::string& key, int otherwise);

/// Refuses the table unless [release] names `file`, which goes by `key` there.
void require_file(const files::TomlTable& table, const std::string& file, const std::string& key);

/// Refuses a table that states none of its limits.
[[noreturn]] void refuse_without_limit(const files::TomlTable& table, const std::string& example);

}  // namespace swarmcert::gate
