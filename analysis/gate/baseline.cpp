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
    const std::vector<std::string> keys = files::field_names(files::shape_of<Baseline>());
    files::require_keys(document, {keys.begin(), keys.end()}, "the baseline");
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

void describe(files::Record& record, const Baseline& baseline) {
  record.constant("schema", kBaselineSchema, "Name and version of this format.");
  record.field("tool", "swarmcert " SWARMCERT_VERSION, "Name and version of the tool that wrote this.");
  record.field("values", baseline.values, "The value of every check at the last release.");
  record.field("conditions", baseline.conditions,
               "Every condition under which the release was judged, in canonical form: the policy's entries "
               "with their defaults, the box, and the SHA-256 of the inputs, by dotted key.");
  record.field("content_sha256", baseline.content_sha256, "Over everything above.");
}

void describe_baseline_file(files::Record& record) { describe(record, Baseline{}); }

void write_baseline(const std::string& path, const Checks& checks, const Conditions& conditions) {
  Baseline baseline;
  for (const Check& check : checks) {
    const bool is_of_regression = check.name.rfind("regression", 0) == 0;
    if (!is_of_regression && check.value && std::isfinite(*check.value))
      baseline.values[check.name] = *check.value;
  }
  baseline.conditions = conditions;
  baseline.content_sha256 = files::content_sha256(files::to_json(files::record_of(baseline)));
  files::write_file(path, files::to_text(files::to_json(files::record_of(baseline))), true);
}

}  // namespace swarmcert::gate
