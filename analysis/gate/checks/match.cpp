#include "analysis/firmware/match.h"

#include <fmt/core.h>

#include "analysis/firmware/float_blocks.h"
#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {
Check match_row(Evidence& evidence, const std::string& name, int line, const std::string& path, bool is_elf) {
  Check check = row(name, line);
  const std::string bytes = files::read_file(path);
  if (is_elf && !firmware::is_elf(bytes)) {
    fail(check, path + " is no ELF");
    return check;
  }
  const firmware::MatchResult result =
      match(evidence.flown(), firmware::is_elf(bytes) ? firmware::blocks_in_elf(bytes, path)
                                                      : firmware::blocks_in_source(bytes, path));
  if (result.equal) {
    pass(check);
    check.witness =
        fmt::format("{} weights and biases in {} arrays, bit for bit", result.numbers, result.arrays);
  } else {
    fail(check, path + " does not hold these weights");
    const firmware::Difference& d = *result.first_difference;
    check.witness = d.found ? fmt::format("{} {} {} is {} in the network, {} in {} ({})", d.part, d.layer,
                                          d.entry, files::hex_float(static_cast<double>(d.expected)),
                                          files::hex_float(static_cast<double>(*d.found)), d.name, d.place)
                            : fmt::format("nothing resembles {} {} {}", d.part, d.layer, d.entry);
  }
  return check;
}

Run read_match(const files::TomlTable& table, Policy& policy) {
  table.allow_only({});
  if (!policy.release.has_network()) require_file(table, "", "network");
  if (policy.release.source.empty()) require_file(table, policy.release.elf, "source or elf");
  if (!policy.release.is_float32)
    table.refuse("", "", "holds float32 weights against a network that flies in float64");
  return [line = table.line()](Evidence& evidence, Checks& checks) {
    const Release& release = evidence.release();
    if (!release.source.empty()) checks.push_back(match_row(evidence, "match", line, release.source, false));
    if (!release.elf.empty()) checks.push_back(match_row(evidence, "match.elf", line, release.elf, true));
  };
}

}  // namespace swarmcert::gate
