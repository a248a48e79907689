#include "analysis/commands/inspect/inspect_certificate.h"

#include <fmt/core.h>

#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/weights/functions.h"
#include "stability/checker/check_tracking.h"

namespace swarmcert::analysis {
namespace {

/// A member as people read it; nothing in it can reach the terminal unescaped.
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
    if (print) print_bound_row(files::rho_name(cell(law, "rho")) + " " + cell(law, "neighbours"), law);
    bounds.push_back(std::move(line));
  }
  return {{"file", path}, {"kind", "certificate"}, {"bounds", std::move(bounds)}};
}

files::Json inspect_tracking_certificate(const std::string& path, const files::Json& certificate,
                                         bool print) {
  files::Json loops = files::Json::array();
  if (print) {
    fmt::print("{}: certificate of tracking gains, not checked here ('swarmcert check' does)\n", path);
    fmt::print("  {:<4} {:<10} {:>14} {:>14} {:>14} {:>14}\n", "axis", "input", "rate m/(N/s)",
               "amplitude m/N", "edge m/N", "impulse m/(N s)");
  }
  for (const files::Json& loop : certificate.value("loops", files::Json::array())) {
    files::Json line = files::Json::object(), gains = files::Json::object();
    for (const char* key : {"axis", "input"})
      if (loop.contains(key)) line[key] = loop[key];
    const files::Json stated = loop.is_object() ? loop.value("gains", files::Json::object()) : files::Json();
    for (const char* key : {"rate", "amplitude", "edge", "impulse"})
      gains[key] = stated.is_object() && stated.contains(key) ? stated[key] : files::Json();
    if (print)
      fmt::print("  {:<4} {:<10} {:>14} {:>14} {:>14} {:>14}\n", cell(loop, "axis"), cell(loop, "input"),
                 cell(gains, "rate"), cell(gains, "amplitude"), cell(gains, "edge"), cell(gains, "impulse"));
    line["gains"] = std::move(gains);
    loops.push_back(std::move(line));
  }
  files::Json left_out = certificate.value("left_out", files::Json::array());
  if (print && !left_out.empty()) fmt::print("  without a certificate: {} loops\n", left_out.size());
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
