/// @file A release that passes every check, made from bundled inputs and simulated flights.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/gate/gate.h"
#include "analysis/run.h"
#include "nn/temp_folder.h"

namespace swarmcert::tests {

/// Folder of a good release: network, certificate, source, ELF where a compiler is there, gains, model, swarm, box,
/// facts, flights. Each test has one of its own.
class ReleaseFolder {
 public:
  /// Makes the release; a test that finds it incomplete has failed already.
  ReleaseFolder();
  /// A copy, to be damaged.
  explicit ReleaseFolder(const ReleaseFolder& other);
  ReleaseFolder& operator=(const ReleaseFolder&) = delete;

  std::string operator/(const std::string& name) const { return folder_ / name; }
  const std::string& path() const { return folder_.path(); }
  bool has_elf() const { return has_elf_; }

  Outcome run(const std::string& command) const { return run_shell(command, folder_.path()); }

  /// policy.toml with every check; `change` replaces whole tables by name ("range" -> "max_abs_force_gf = 1"), an empty
  /// text removes one.
  std::string policy(const std::vector<std::pair<std::string, std::string>>& change = {}) const;
  /// policy.toml with [release] and these tables only.
  std::string policy_of(const std::vector<std::string>& tables) const;

  gate::GateResult judge(const std::string& policy, const std::string& baseline = "") const;

  /// Network, certificate, source, ELF and facts of these weights, after a weight file was changed.
  void certify_again() const;
  /// Builds the ELF from the exported source as it lies there, where the tools are installed.
  void build_elf() const;
  void write_facts(int flash_bytes) const;

  /// Files that the release rests on, relative to the folder.
  std::vector<std::string> files() const;

 private:
  std::string write_policy(const std::vector<std::pair<std::string, std::string>>& tables) const;

  TempFolder folder_;
  bool has_elf_ = false;
};

/// Names of the checks' tables that do not pass, each once.
std::vector<std::string> caught(const gate::GateResult& result);

/// Scales what `pattern` names of a weight file: tensor and factor, and adds to it.
void change_tensor(const std::string& path, const std::string& tensor, double factor, double offset = 0);

/// Everything that a run says about its result: for messages of failing tests.
std::string told(const gate::GateResult& result);

}  // namespace swarmcert::tests
