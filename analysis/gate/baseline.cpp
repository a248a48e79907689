#include "analysis/gate/baseline.h"

#include <cmath>
#include <filesystem>

#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::gate {
namespace {

constexpr char kBaselineSchema[] = "swarmcert/baseline/1";
constexpr char kMend[] = "write it anew with swarmcert gate --update-baseline";

}  // namespace

std::unique_ptr<std::map<std::string, double>> read_baseline(const std::string& path, bool may_lack) {
  if (may_lack && !std::filesystem::exists(path)) return nullptr;
  const files::Json document = files::read_json(path, kBaselineSchema);
  try {
    files::require_keys(document, {"schema", "tool", "values", "content_sha256"}, "the baseline");
    if (document["content_sha256"] != files::content_sha256(document))
      throw std::invalid_argument("content_sha256 is not that of the content");
    auto values = std::make_unique<std::map<std::string, double>>();
    for (const auto& [name, value] : document["values"].items()) (*values)[name] = value.get<double>();
    return values;
  } catch (const std::exception& error) {
    throw files::InputError({path, "", "", "", error.what(), kMend});
  }
}

void write_baseline(const std::string& path, const Checks& checks) {
  files::Json values = files::Json::object();
  for (const Check& check : checks) {
    if (check.name != "regression" && check.value && std::isfinite(*check.value))
      values[check.name] = *check.value;
  }
  files::Json document = {
      {"schema", kBaselineSchema}, {"tool", "swarmcert " SWARMCERT_VERSION}, {"values", std::move(values)}};
  document["content_sha256"] = files::content_sha256(document);
  files::write_file(path, files::to_text(document), true);
}

}  // namespace swarmcert::gate
