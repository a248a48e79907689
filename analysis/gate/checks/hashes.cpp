#include <algorithm>
#include <filesystem>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {

Run read_hashes(const files::TomlTable& table, Policy& policy) {
  struct Approved {
    std::string path, sha256;
    int line;
  };
  std::vector<Approved> all;
  for (const std::string& file : table.keys()) {
    const std::string sha256 = table.text(file);
    if (sha256.size() != 64 || sha256.find_first_not_of("0123456789abcdef") != std::string::npos)
      table.refuse(file, files::in_quotes(sha256), "must be a SHA-256 of 64 lower-case hex digits",
                   "sha256sum prints it");
    const std::filesystem::path folder = std::filesystem::path(policy.path).parent_path();
    all.push_back({(folder / file).lexically_normal().string(), sha256, table.line(file)});
  }
  if (all.empty()) refuse_without_limit(table, "\"gains.toml\" = \"<sha256>\"");
  return [all, line = table.line()](Evidence& evidence, Checks& checks) {
    Check check = row("hashes", line);
    pass(check);
    std::vector<std::string> released;
    for (const EvidenceFile& file : evidence_files(evidence.policy(), "")) released.push_back(file.path);
    for (const Approved& file : all) {
      const bool is_released = std::find(released.begin(), released.end(), file.path) != released.end();
      const std::string found = files::sha256_of_file(file.path);
      if (is_released && found == file.sha256) continue;
      fail(check, file.path + (is_released ? " is not the approved file" : " is not a file of this release"));
      check.line = file.line;
      check.witness = is_released ? "SHA-256 " + found : files::did_you_mean(file.path, released);
      break;
    }
    checks.push_back(std::move(check));
  };
}

}  // namespace swarmcert::gate
