/// @file A gate's result as people and continuous integration read it. Names from files are escaped for each format.
#pragma once

#include <string>

#include "analysis/gate/gate.h"
#include "nn/base/json.h"

namespace swarmcert::gate {

/// A table for terminals.
std::string to_table(const GateResult& result);

/// Adds `verdict`, `checks` and `not_run` to a command's result. Numbers that are not finite are null.
void add_json(const GateResult& result, files::Json& json);

/// JUnit XML, as Jenkins, GitLab and GitHub's test reporters read it: a failed check is a failure, one that is
/// inconclusive or whose input is bad an error, one that the policy does not ask for is skipped.
std::string to_junit(const GateResult& result);

/// SARIF 2.1.0: a rule per kind of check, a result per check that does not pass, at its limit's line of the policy.
/// Level error; warning for what is inconclusive where that is allowed.
std::string to_sarif(const GateResult& result, bool allow_inconclusive);

/// GitHub workflow commands: one error or warning per check that does not pass.
std::string to_github(const GateResult& result, bool allow_inconclusive);

/// GitHub-flavoured Markdown: verdict and table.
std::string to_markdown(const GateResult& result);

}  // namespace swarmcert::gate
