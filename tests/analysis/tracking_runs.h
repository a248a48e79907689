/// @file Commands on the shipped vehicle and its gains.
#pragma once

#include <string>

#include "analysis/run.h"
#include "nn/base/json.h"

namespace swarmcert::tests {

inline const std::string kSourceFolder = SWARMCERT_SOURCE_DIR;
inline const std::string kModel = " --model " + kSourceFolder + "/stability/models/crazyflie-small.toml";
inline const std::string kFlown =
    " --gains " + kSourceFolder + "/controller/gains/crazyflie-small.toml" + kModel;

/// Returns the result of `swarmcert COMMAND`, which must end with exit code 0; `bound` with the one of its answer.
inline files::Json json_of(const ScratchFolder& folder, const std::string& command) {
  const Outcome outcome = run_shell("swarmcert " + command + " --force --json out.json", folder.path());
  const bool answers = command.rfind("bound", 0) == 0 && (outcome.exit_code == 1 || outcome.exit_code == 4);
  EXPECT_TRUE(outcome.exit_code == 0 || answers) << outcome.exit_code << outcome.output;
  return files::parse_json(read_text(folder / "out.json"), "out.json");
}

/// Options that name a gains.toml with this body, and the shipped vehicle.
inline std::string gains_file(const ScratchFolder& folder, const std::string& body) {
  write_text(folder / "gains.toml", "schema = \"swarmcert/gains/1\"\n" + body);
  return " --gains gains.toml" + kModel;
}

/// Writes disturbance.toml and returns the option that reads it.
inline std::string disturbance_file(const ScratchFolder& folder, const std::string& body) {
  write_text(folder / "disturbance.toml", "schema = \"swarmcert/disturbance/1\"\n" + body + "\n");
  return " --disturbance disturbance.toml";
}

}  // namespace swarmcert::tests
