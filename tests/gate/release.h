/// @file A release that passes every check, made from bundled inputs and simulated flights.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/gate/gate.h"
#include "analysis/run.h"
#include "nn/temp_folder.h"

namespace swarmcert::tests {

/// Folder of a good release: network, certificate, source, ELF file if a compiler is available, gains, model, swarm,
/// box, facts, flights. Each test has its own.
class ReleaseFolder {
 public:
  /// Creates the release; if it is incomplete, the test has failed already.
  ReleaseFolder();
  /// Copies a release so that it can be damaged.
  explicit ReleaseFolder(const ReleaseFolder& other);
  ReleaseFolder& operator=(const ReleaseFolder&) = delete;

  std::string operator/(const std::string& name) const { return folder_ / name; }
  const std::string& path() const { return folder_.path(); }
  bool has_elf() const { return has_elf_; }

  Outcome run(const std::string& command) const { return run_shell(command, folder_.path()); }

  /// Writes policy.toml with every check; `change` replaces whole tables by name ("range" -> "max_abs_force_gf = 1"),
  /// and an empty text removes one.
  std::string policy(const std::vector<std::pair<std::string, std::string>>& change = {}) const;
  /// Writes policy.toml with only [release] and these tables.
  std::string policy_of(const std::vector<std::string>& tables) const;

  gate::GateResult judge(const std::string& policy, const std::string& baseline = "") const;

  /// Renews network, certificate, source, ELF file and facts after a weight file was changed.
  void certify_again() const;
  /// Builds the ELF file from the present exported source, if the tools are installed.
  void build_elf() const;
  void write_facts(int flash_bytes) const;

  /// Files on which the release depends, relative to the folder.
  std::vector<std::string> files() const;

 private:
  std::string write_policy(const std::vector<std::pair<std::string, std::string>>& tables) const;

  TempFolder folder_;
  bool has_elf_ = false;
};

/// Names of the tables with checks that do not pass, without duplicates.
std::vector<std::string> caught(const gate::GateResult& result);

/// Multiplies a tensor of a weight file by `factor` and adds `offset`.
void change_tensor(const std::string& path, const std::string& tensor, double factor, double offset = 0);

/// The complete result of a run as text, for messages of failing tests.
std::string told(const gate::GateResult& result);

}  // namespace swarmcert::tests
