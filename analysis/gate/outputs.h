/// @file The result of a gate in formats for people and continuous integration. Names from files are escaped per
/// format.
#pragma once

#include <string>

#include "analysis/gate/gate.h"
#include "nn/base/record.h"

namespace swarmcert::gate {

/// Returns a table for terminals.
std::string to_table(const GateResult& result);

/// Describes policy, verdict, rows, changes of conditions, and checks that are not asked for.
void describe(files::Record& record, const GateResult& result);

/// Returns JUnit XML as read by Jenkins, GitLab and GitHub's test reporters. A failed check is a failure; a check
/// that is inconclusive or has bad input is an error; a check that the policy does not request is skipped.
std::string to_junit(const GateResult& result);

/// Returns SARIF 2.1.0: a rule per kind of check, and a result per check that does not pass, located at the line of
/// its limit in the policy. The level is error, or warning for inconclusive checks if these are allowed.
std::string to_sarif(const GateResult& result, bool allow_inconclusive);

/// Returns GitHub workflow commands: one error or warning per check that does not pass.
std::string to_github(const GateResult& result, bool allow_inconclusive);

/// Returns GitHub-flavoured Markdown: verdict and table.
std::string to_markdown(const GateResult& result);

}  // namespace swarmcert::gate
