/// @file What every command of the tool shares: options, exit codes, result files.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/base/record.h"
#include "nn/weights/network.h"

namespace swarmcert::analysis {

/// The exit codes of the command line.
enum ExitCode : int {
  kDone = 0,          ///< done, or the claim holds
  kViolated = 1,      ///< a limit given by the user is violated, or something is refuted or rejected
  kUsage = 2,         ///< the command line cannot be parsed
  kBadInput = 3,      ///< an input file is missing or invalid
  kInconclusive = 4,  ///< neither proved nor refuted
  kInternal = 70,     ///< internal error of the tool
};

/// Options that every command takes.
struct CommonOptions {
  std::string json;  ///< destination of the JSON result; "-": standard output, without text output
  bool force = false;
  bool quiet = false;
  int jobs = 0;

  /// False if the JSON result goes to standard output, and under a host.
  bool prints_text() const;
};

/// One command: declares its options on a CLI::App, then runs.
struct Command {
  std::string name;
  std::string summary;  ///< one line for the list of commands
  std::string details;  ///< shown by the command's own --help: what it does, an example
  /// Declares the options and returns the function to run once they are parsed; that function returns an exit code.
  std::function<std::function<int(const CommonOptions&)>(CLI::App&)> declare;
  /// Describes the fields of the result after its head (see described_result()), from default values.
  std::function<void(files::Record&)> describe_result = nullptr;
};

/// An invalid combination of options, detected after parsing: exit code kUsage.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Declares --order and --select, for weight files that do not state which layers make up the network; part of
/// declare_network().
void declare_order(CLI::App& app, files::NetworkArguments& arguments);

/// Declares --activation, for weight files that do not store it; part of declare_network(). Unknown names are
/// usage errors.
void declare_activation(CLI::App& app, files::NetworkArguments& arguments);

/// Declares NET: a positional FILE, or --phi with --rho, --key and --order.
void declare_network(CLI::App& app, files::NetworkArguments& arguments);

/// Loads NET, which must have ReLU activations, or takes the host's network.
/// @throws UsageError if no network is named, or if a layer order is given for a file that is not part of the
///     network; files::InputError as files::load_network() does.
files::Network load_net(const files::NetworkArguments& arguments);
/// The same for networks with any activation.
files::Network load_any_net(const files::NetworkArguments& arguments);

/// Returns the words of a command line that name the same network, with --key, --activation and --order.
std::vector<std::string> network_words(const files::NetworkArguments& arguments);

/// Prints the command to type next, for a shell: "Next: swarmcert WORDS"; nothing where no text is printed.
void print_next(const CommonOptions& common, std::vector<std::string> words);

/// Returns what was assumed or computed when a weight file was read, one sentence each: the reader's notes, and by how
/// much rounding of folded weights can change slopes.
std::vector<std::string> reading_notes(const files::Weights& weights);

/// Returns the result of `command`: its head, then the fields that `describe_fields` describes. The head is the schema
/// "swarmcert/<command>/1", tool version, SHA-256 of every input file, seed, and the command line without options that
/// cannot change the result (--jobs, -q, --force, output paths).
/// @param seed of the random numbers; empty if none are used
files::Node described_result(const std::string& command, const std::vector<std::string>& input_files,
                             std::optional<std::uint64_t> seed,
                             const std::function<void(files::Record&)>& describe_fields);

/// The same for a struct that has a function describe().
template <class T>
files::Node result_of(const std::string& command, const std::vector<std::string>& input_files,
                      std::optional<std::uint64_t> seed, const T& result) {
  return described_result(command, input_files, seed,
                          [&result](files::Record& record) { describe(record, result); });
}

/// Returns Command::describe_result for a struct that has a function describe().
template <class T>
std::function<void(files::Record&)> fields_of() {
  return [](files::Record& record) { describe(record, T{}); };
}

/// Returns the shape of all results of `command`, for its schema.
files::Node result_shape(const std::string& command,
                         const std::function<void(files::Record&)>& describe_fields);

/// Checks an output path before the work begins.
/// @throws InputError if `path` exists and --force is not given.
void refuse_to_replace(const CommonOptions& common, const std::string& path);

/// The same for an output folder. An empty string names no folder.
/// @throws InputError if `folder` exists, is not an empty folder, and --force is not given.
void refuse_folder(const CommonOptions& common, const std::string& folder);

/// Writes `result` to the destination given by --json, if any, and passes it to the host, if there is one.
void write_result(const CommonOptions& common, const files::Node& result);

/// Returns the files from which NET was read; empty for a network supplied by the host.
std::vector<std::string> input_files(const files::Network& network);

}  // namespace swarmcert::analysis
