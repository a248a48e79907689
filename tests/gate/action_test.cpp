// The GitHub action: runs its step as GitHub does.
#include <gtest/gtest.h>

#include "data.h"
#include "gate/release.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

/// The environment that action.yml gives its step through its `env:` lines, for these inputs.
std::string environment(const std::string& action, const std::map<std::string, std::string>& inputs) {
  std::string words;
  std::istringstream lines(action);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t name = line.find("GATE_"), colon = line.find(": ${{ inputs.");
    if (name == std::string::npos || colon == std::string::npos) continue;
    const std::size_t from = colon + 13;
    const std::string input = line.substr(from, line.find(" }}", from) - from);
    EXPECT_NE(action.find("\n  " + input + ":\n"), std::string::npos)
        << input << " is no input of the action";
    const auto given = inputs.find(input);
    words += line.substr(name, colon - name) + "='" + (given == inputs.end() ? "" : given->second) + "' ";
  }
  return words;
}

/// The shell line of the action's step.
std::string run_line(const std::string& action) {
  const std::size_t at = action.find("      run: '");
  if (at == std::string::npos) return "";
  return action.substr(at + 12, action.find("'\n", at) - at - 12);
}

TEST(GateAction, RunsAsGitHubRunsItAndLeavesAnnotationsSummaryAndBundle) {
  const std::string action = read_text(source_path("analysis/ci/action.yml"));
  ASSERT_FALSE(run_line(action).empty());
  const ReleaseFolder release;
  release.policy({{"regression", ""}, {"float32_error", ""}, {"range", ""}});
  const std::string github = "GITHUB_ACTIONS=true GITHUB_ACTION_PATH='" + source_path("analysis/ci") +
                             "' GITHUB_STEP_SUMMARY=summary.md GITHUB_OUTPUT=out.txt ";
  const auto step = [&](const std::map<std::string, std::string>& inputs) {
    return release.run("env " + github + environment(action, inputs) + "bash -c '" + run_line(action) + "'");
  };
  const Outcome good = step({{"policy", "policy.toml"}, {"output", "my gate"}});
  EXPECT_EQ(good.exit_code, 0) << good.output;
  EXPECT_EQ(good.output.find("::error"), std::string::npos) << good.output;
  EXPECT_EQ(read_text(release / "out.txt"), "verdict=pass\n");
  EXPECT_NE(read_text(release / "summary.md").find("| pass | certificate |"), std::string::npos);
  for (const std::string file : {"gate.json", "gate.xml", "gate.sarif", "gate.md", "bundle/statement.json"})
    EXPECT_TRUE(std::filesystem::exists(release / ("my gate/" + file))) << file;

  release.write_facts(70000);
  const Outcome bad = step({{"policy", "policy.toml"}});
  EXPECT_EQ(bad.exit_code, 1) << bad.output;
  EXPECT_NE(bad.output.find("::error file=policy.toml,line="), std::string::npos) << bad.output;
  EXPECT_NE(bad.output.find("title=swarmcert gate%3A firmware_facts.flash::"), std::string::npos)
      << bad.output;
  EXPECT_NE(bad.output.find("the network's weights take"), std::string::npos) << bad.output;
  EXPECT_NE(bad.output.find("fewer --folds"), std::string::npos) << bad.output;
  EXPECT_EQ(read_text(release / "out.txt"), "verdict=pass\nverdict=fail\n");
  EXPECT_FALSE(std::filesystem::exists(release / "gate/bundle"));
  EXPECT_EQ(step({{"policy", "nothing.toml"}}).exit_code, 3);
  EXPECT_NE(read_text(release / "gate/gate.xml").find("<error type=\"bad input\""), std::string::npos);
  EXPECT_NE(step({}).exit_code, 0);

  // The tool is not found and cannot be had: results are left all the same.
  write_text(release / "gate.sh", read_text(source_path("analysis/ci/gate.sh")));
  const Outcome without =
      release.run("env GATE_POLICY=policy.toml GATE_SWARMCERT=absent GATE_CACHE=cache bash gate.sh");
  EXPECT_NE(without.exit_code, 0) << without.output;
  for (const std::string file : {"gate/gate.xml", "gate/gate.sarif"})
    EXPECT_NE(read_text(release / file).find("did not run to its end"), std::string::npos) << file;
  files::parse_json(read_text(release / "gate/gate.sarif"), "gate.sarif");
}

TEST(GateAction, InstallsTheReleasedPackageOfItsDistribution) {
  const ReleaseFolder release;
  release.policy({{"regression", ""}, {"float32_error", ""}, {"range", ""}});
  std::filesystem::create_directory(release / "bin");
  const auto program = [&release](const std::string& name, const std::string& script) {
    write_text(release / ("bin/" + name), "#!/bin/sh\n" + script);
    std::filesystem::permissions(release / ("bin/" + name), std::filesystem::perms::owner_all);
  };
  // Stands for GitHub's program: writes the package that the pattern asks for into the folder asked for.
  program("gh", "echo \"$*\" >gh.txt; for last; do :; done; : >\"$last/of_release.deb\"\n");
  program("sudo", "exec \"$@\"\n");
  // Stands for the package manager: the tool is found afterwards.
  program("apt-get",
          "echo \"$*\" >apt.txt; ln -s \"$TOOL\" bin/installed-swarmcert; mv bin/installed-swarmcert "
          "bin/swarmcert\n");
  write_text(release / "gate.sh", read_text(source_path("analysis/ci/gate.sh")));
  const Outcome outcome = release.run(
      "env TOOL=\"$(command -v swarmcert)\" PATH=\"$PWD/bin:/usr/bin:/bin\" GATE_POLICY=policy.toml "
      "GATE_SWARMCERT=absent GATE_CACHE=cache GATE_RELEASE=owner/fleet@v1.2.0 bash gate.sh");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::string asked = read_text(release / "gh.txt"), installed = read_text(release / "apt.txt");
  EXPECT_NE(asked.find("release download v1.2.0 --repo owner/fleet"), std::string::npos) << asked;
  EXPECT_NE(asked.find("--pattern swarmcert_*_"), std::string::npos) << asked;
  EXPECT_NE(installed.find("cache/download/of_release.deb"), std::string::npos) << installed;
  EXPECT_NE(read_text(release / "gate/gate.xml").find("failures=\"0\""), std::string::npos);
}

}  // namespace
}  // namespace swarmcert::tests
