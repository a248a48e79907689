#include "analysis/commands/inspect/inspect_certificate.h"

#include <fmt/core.h>

#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/weights/functions.h"
#include "stability/checker/check_tracking.h"

namespace swarmcert::analysis {
namespace {

/// Formats a member for display; control characters are escaped before they reach the terminal.
std::string cell(const files::Json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || object[key].is_null()) return "-";
  const files::Json& value = object[key];
  if (value.is_number_float()) return fmt::format("{:.10g}", value.get<double>());
  const std::string text = value.dump();
  return value.is_string() ? text.substr(1, text.size() - 2) : text;
}

void print_bound_row(const std::string& function, const files::Json& bound) {
  fmt::print("  {:<22} {:<10} {:<8} {:<14} {:>14} {:<8} {:>14}  {}\n", function, cell(bound, "block"),
             cell(bound, "domain"), cell(bound, "law"), cell(bound, "upper"), cell(bound, "upper_method"),
             cell(bound, "lower"), cell(bound, "unit"));
}

files::Json inspect_network_certificate(const std::string& path, const files::Json& certificate, bool print) {
  files::Json bounds = files::Json::array();
  if (print) {
    fmt::print("{}: certificate, not checked here ('swarmcert check' does)\n", path);
    fmt::print("  {:<22} {:<10} {:<8} {:<14} {:>14} {:<8} {:>14}  {}\n", "function", "block", "domain", "law",
               "upper", "method", "witnessed", "unit");
  }
  for (const files::Json& bound : certificate.value("bounds", files::Json::array())) {
    files::Json line = files::Json::object();
    for (const char* key : {"function", "domain", "block", "law", "norm", "scale", "unit", "upper",
                            "upper_method", "lower", "neighbours"}) {
      if (bound.contains(key)) line[key] = bound[key];
    }
    if (print) print_bound_row(cell(bound, "function"), bound);
    bounds.push_back(std::move(line));
  }
  for (const files::Json& law : certificate.value("laws", files::Json::array())) {
    files::Json line = law;
    if (line.is_object()) line.erase("upper_hex");
    if (print)
      print_bound_row(files::FunctionId::rho(cell(law, "rho")).name() + " " + cell(law, "neighbours"), law);
    bounds.push_back(std::move(line));
  }
  return {{"file", path}, {"kind", "certificate"}, {"bounds", std::move(bounds)}};
}

/// The gains of one loop with respect to one input, from a certificate that has not been checked.
files::Json gain_row(const files::Json& loop, const char* kind, const files::Json& input,
                     const files::Json& stated) {
  files::Json row = {{"loop", kind}, {"gains", files::Json::object()}};
  if (loop.is_object() && loop.contains("axis")) row["axis"] = loop["axis"];
  if (!input.is_null()) row["input"] = input;
  for (const char* key : {"rate", "amplitude", "edge", "impulse"})
    row["gains"][key] = stated.is_object() && stated.contains(key) ? stated[key] : files::Json();
  return row;
}

files::Json gain_rows(const files::Json& certificate) {
  const auto member = [](const files::Json& object, const char* key) {
    return object.is_object() ? object.value(key, files::Json()) : files::Json();
  };
  files::Json rows = files::Json::array();
  for (const files::Json& loop : certificate.value("loops", files::Json::array()))
    rows.push_back(gain_row(loop, "continuous", member(loop, "input"), member(loop, "gains")));
  for (const files::Json& loop : certificate.value("sampled_loops", files::Json::array())) {
    for (const char* input : {"force", "command", "velocity", "position"})
      rows.push_back(gain_row(loop, "sampled", input, member(member(loop, "gains"), input)));
  }
  return rows;
}

files::Json inspect_tracking_certificate(const std::string& path, const files::Json& certificate,
                                         bool print) {
  files::Json loops = gain_rows(certificate);
  files::Json left_out = certificate.value("left_out", files::Json::array());
  if (print) {
    fmt::print("{}: certificate of tracking gains, not checked here ('swarmcert check' does)\n", path);
    fmt::print("  {:<4} {:<10} {:<10} {:>14} {:>14} {:>14} {:>15}\n", "axis", "input", "loop", "rate m/(N/s)",
               "amplitude m/N", "edge m/N", "impulse m/(N s)");
    for (const files::Json& row : loops)
      fmt::print("  {:<4} {:<10} {:<10} {:>14} {:>14} {:>14} {:>15}\n", cell(row, "axis"), cell(row, "input"),
                 cell(row, "loop"), cell(row["gains"], "rate"), cell(row["gains"], "amplitude"),
                 cell(row["gains"], "edge"), cell(row["gains"], "impulse"));
    if (!left_out.empty()) fmt::print("  without a certificate: {} loops\n", left_out.size());
  }
  return {{"file", path},
          {"kind", "tracking_certificate"},
          {"loops", std::move(loops)},
          {"left_out", std::move(left_out)}};
}

}  // namespace

files::Json inspect_certificate(const std::string& path, bool print) {
  const files::Json any = files::parse_json(files::read_file(path), path);
  if (any.is_object() && any.value("schema", files::Json()) == check::kTrackingSchema)
    return inspect_tracking_certificate(path, any, print);
  return inspect_network_certificate(path, files::read_json(path, check::kCertificateSchema), print);
}

}  // namespace swarmcert::analysis
