#include "analysis/gate/baseline.h"

#include <cmath>

#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::gate {
namespace {

constexpr char kBaselineSchema[] = "swarmcert/baseline/3";
constexpr char kMend[] = "write it again with swarmcert gate --update-baseline";

}  // namespace

Baseline read_baseline(const std::string& path) {
  const files::Json document = files::read_json(path, kBaselineSchema);
  try {
    files::require_keys(document, {"schema", "tool", "values", "conditions", "content_sha256"},
                        "the baseline");
    if (document["content_sha256"] != files::content_sha256(document))
      throw std::invalid_argument("content_sha256 is not that of the content");
    Baseline baseline;
    for (const auto& [name, value] : document["values"].items()) baseline.values[name] = value.get<double>();
    for (const auto& [key, value] : document["conditions"].items()) baseline.conditions[key] = value;
    return baseline;
  } catch (const std::exception& error) {
    throw files::InputError({path, "", "", "", error.what(), kMend});
  }
}

void write_baseline(const std::string& path, const Checks& checks, const Conditions& conditions) {
  files::Json values = files::Json::object();
  for (const Check& check : checks) {
    const bool is_of_regression = check.name.rfind("regression", 0) == 0;
    if (!is_of_regression && check.value && std::isfinite(*check.value)) values[check.name] = *check.value;
  }
  files::Json document = {{"schema", kBaselineSchema},
                          {"tool", "swarmcert " SWARMCERT_VERSION},
                          {"values", std::move(values)},
                          {"conditions", conditions}};
  document["content_sha256"] = files::content_sha256(document);
  files::write_file(path, files::to_text(document), true);
}

}  // namespace swarmcert::gate
