#include <fmt/format.h>

#include "analysis/firmware/float_blocks.h"
#include "analysis/firmware/match_artefact.h"
#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "analysis/gate/expected_app.h"
#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/json.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {

Check match_row(Evidence& evidence, const std::string& name, int line, const std::string& path, bool is_elf,
                bool needs_app) {
  Check check = row(name, line);
  if (is_elf && !firmware::is_elf(files::read_file(path))) {
    fail(check, path + " is no ELF");
    return check;
  }
  const Release& release = evidence.release();
  firmware::ArtefactOptions options;
  options.source.needs_all = true;
  for (const EvidenceFile& file : evidence_files(evidence.policy(), ""))
    options.source.other_contents.push_back(file.path);
  if (!release.certificate.empty())
    // The hash as stated; [certificate] checks that the certificate has that content.
    options.source.certificate_sha256 = evidence.certificate().value("content_sha256", "");
  if (release.most_neighbours > 0) options.most_neighbours = release.most_neighbours;
  if (!release.gains.empty() && !release.model.empty())
    options.app = [&release] { return expected_app(release.gains, release.model); };
  options.needs_app = needs_app;
  const firmware::ArtefactMatch match = match_artefact(evidence.flown(), path, options);
  switch (match.verdict) {
    case firmware::ArtefactVerdict::kEqual:
      pass(check);
      check.witness = fmt::format("compared {}", fmt::join(match.compared, "; "));
      break;
    case firmware::ArtefactVerdict::kDifferent:
      fail(check, path + " is not this network");
      check.witness = *match.first_difference;
      break;
    case firmware::ArtefactVerdict::kInconclusive:
      check.reason = fmt::format("not checked: {}", fmt::join(match.not_checked, "; "));
      check.witness = fmt::format("compared {}", fmt::join(match.compared, "; "));
      break;
  }
  return check;
}

namespace {

const std::vector<std::string> kEntries = {"network", "controller"};

}  // namespace

void describe_match_keys(files::Keys& keys) {
  keys.may("entry",
           "What the ELF must hold: the Crazyflie app, whose controller is run, or at least the exported "
           "functions.",
           "", files::OneOf{kEntries});
}

Run read_match(const files::TomlTable& table, Policy& policy) {
  if (policy.release.elf.empty()) require_file(table, policy, "source", " or elf");
  if (!policy.release.is_float32)
    table.refuse("", "", "compares float32 weights with a network that is used in float64");
  const bool needs_app = table.has("entry") && table.choice("entry", kEntries) == 1;
  if (needs_app) {
    require_file(table, policy, "elf");
    require_file(table, policy, "gains");
    require_file(table, policy, "model");
  }
  return [line = table.line(), needs_app](Evidence& evidence, Checks& checks) {
    const Release& release = evidence.release();
    if (!release.source.empty())
      checks.push_back(match_row(evidence, "match", line, release.source, false, false));
    if (!release.elf.empty())
      checks.push_back(match_row(evidence, "match.elf", line, release.elf, true, needs_app));
  };
}

}  // namespace swarmcert::gate
