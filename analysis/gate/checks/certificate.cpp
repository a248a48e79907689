#include <fmt/core.h>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "lipschitz/checker/check.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {

void describe_certificate_keys(files::Keys&) {}

Run read_certificate(const files::TomlTable& table, Policy& policy) {
  policy.judges_certificate = true;
  return [line = table.line()](Evidence& evidence, Checks& checks) {
    Check check = row("certificate", line);
    const std::string why_not = evidence.why_not_certified();
    const check::CheckResult& verdict = evidence.certificate_verdict();
    if (why_not.empty()) {
      pass(check);
      check.witness = fmt::format("{} spectral norms, {} upper bounds, {} lower bounds verified",
                                  verdict.spectral_norms, verdict.upper_bounds, verdict.lower_bounds);
    } else {
      fail(check, why_not);
    }
    checks.push_back(std::move(check));
  };
}

}  // namespace swarmcert::gate
