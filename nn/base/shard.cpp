#include "nn/base/shard.h"

#include <filesystem>

#include "nn/base/file_io.h"

namespace swarmcert::files {

Json kept_unit(const std::string& file, const std::string& schema, const std::string& key,
               const std::function<Json()>& compute) {
  const std::string hash = sha256(key);
  if (std::filesystem::exists(file)) {
    Json kept = read_json(file, schema);
    if (kept.contains("key") && kept["key"] == hash) return kept;
  }
  Json unit = {{"schema", schema}, {"key", hash}};
  unit.update(compute());
  std::filesystem::create_directories(std::filesystem::absolute(file).parent_path());
  write_file(file, to_text(unit), true);
  return unit;
}

}  // namespace swarmcert::files
