/// @file What every command of the tool shares: options, exit codes, result files.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::analysis {

/// The exit codes of the command line.
enum ExitCode : int {
  kDone = 0,          ///< done, or the claim holds
  kViolated = 1,      ///< a limit that the user gave is violated, or something is refuted or rejected
  kUsage = 2,         ///< the command line cannot be understood
  kBadInput = 3,      ///< a file is wrong
  kInconclusive = 4,  ///< neither proved nor refuted
  kInternal = 70,     ///< a fault of the tool
};

/// Options that every command takes.
struct CommonOptions {
  std::string json;  ///< where the result goes as JSON; "-": standard output, which silences the text
  bool force = false;
  bool quiet = false;
  int jobs = 0;

  /// Not where the result goes to standard output, nor under a host.
  bool prints_text() const;
};

/// One command: declares its options on a CLI::App, then runs.
struct Command {
  std::string name;
  std::string summary;  ///< one line for the list of commands
  std::string details;  ///< for its own --help: what it does, an example
  /// Declares options; returns what to run once they are parsed, which returns an exit code.
  std::function<std::function<int(const CommonOptions&)>(CLI::App&)> declare;
};

/// Options that make no sense together, found after parsing: exit code kUsage.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Declares --order, for weight files that do not tell the order of their layers; part of declare_network().
void declare_order(CLI::App& app, files::NetworkArguments& arguments);

/// Declares --activation, for weight files that do not tell it; part of declare_network(). Unknown names are usage
/// errors.
void declare_activation(CLI::App& app, files::NetworkArguments& arguments);

/// Declares NET: a positional FILE, or --phi with --rho, --key and --order.
void declare_network(CLI::App& app, files::NetworkArguments& arguments);

/// Loads NET, whose activation is ReLU and whose inputs are relative states, or takes the host's. @throws UsageError if
/// nothing was named, or an order for a file that was not; files::InputError as files::load_network() does.
files::Network load_net(const files::NetworkArguments& arguments);
/// The same of relative states or invariants: what the evaluator runs (nn/deep_set.h).
files::Network load_evaluated_net(const files::NetworkArguments& arguments);
/// The same of networks with any activation.
files::Network load_any_net(const files::NetworkArguments& arguments);

/// Head of a result: schema "swarmcert/<command>/1", tool version, sha256 of every input, and the command line
/// without what may not change the result (--jobs, -q, --force and where output goes). `seed` is null until it is set.
files::Json result_head(const std::string& command, const std::vector<std::string>& input_files);

/// Refuses early, before work that would be lost: throws InputError if `path` exists and --force is not given.
void refuse_to_replace(const CommonOptions& common, const std::string& path);

/// The same for a folder that is to be written into: throws InputError if `folder` is there, is not an empty folder,
/// and
/// --force is not given. "" is no folder.
void refuse_folder(const CommonOptions& common, const std::string& folder);

/// Writes `result` where --json says, if it says, and hands it to the host, if there is one.
void write_result(const CommonOptions& common, const files::Json& result);

/// Files that NET was read from; none where it is a host's.
std::vector<std::string> input_files(const files::Network& network);

}  // namespace swarmcert::analysis
