#include "analysis/commands/inspect/inspect_certificate.h"

#include <limits>

#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "stability/checker/check_tracking.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

constexpr double kNotStated = std::numeric_limits<double>::quiet_NaN();

Json member(const Json& object, const char* key) {
  return object.is_object() ? object.value(key, Json()) : Json();
}

/// The value of a member; empty if there is none of this type.
template <class T>
std::optional<T> stated(const Json& object, const char* key) {
  try {
    return member(object, key).get<T>();
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

/// Likewise; NaN for null.
std::optional<double> stated_number(const Json& object, const char* key) {
  if (!object.is_object() || !object.contains(key)) return std::nullopt;
  return stated<double>(object, key).value_or(kNotStated);
}

StatedBound stated_bound(const Json& bound) {
  StatedBound stated_here;
  for (const auto& [key, text] : {std::pair("function", &stated_here.function),
                                  {"rho", &stated_here.rho},
                                  {"domain", &stated_here.domain},
                                  {"block", &stated_here.block},
                                  {"law", &stated_here.law},
                                  {"norm", &stated_here.norm},
                                  {"unit", &stated_here.unit},
                                  {"upper_method", &stated_here.upper_method}})
    *text = stated<std::string>(bound, key);
  stated_here.scale = stated<std::vector<std::string>>(bound, "scale");
  stated_here.neighbours = stated<std::map<std::string, std::int64_t>>(bound, "neighbours");
  stated_here.upper = stated_number(bound, "upper");
  stated_here.lower = stated_number(bound, "lower");
  return stated_here;
}

CertificateFile network_certificate(const std::string& path, const Json& certificate) {
  CertificateFile file{path, {}};
  for (const Json& bound : member(certificate, "bounds")) file.bounds.push_back(stated_bound(bound));
  for (const Json& law : member(certificate, "laws")) {
    file.bounds.push_back(stated_bound(law));
    file.bounds.back().status = stated<std::string>(law, "status");
  }
  return file;
}

StatedGains gains_of_loop(const Json& loop, const char* kind, std::optional<std::string> input,
                          const Json& gains) {
  const auto gain = [&gains](const char* key) { return stated<double>(gains, key).value_or(kNotStated); };
  return {stated<std::string>(loop, "axis"),
          std::move(input),
          kind,
          gain("rate"),
          gain("amplitude"),
          gain("edge"),
          gain("impulse")};
}

TrackingCertificateFile tracking_certificate_file(const std::string& path, const Json& certificate) {
  TrackingCertificateFile file{path, {}, {}};
  for (const Json& loop : member(certificate, "loops"))
    file.loops.push_back(
        gains_of_loop(loop, "continuous", stated<std::string>(loop, "input"), member(loop, "gains")));
  for (const Json& loop : member(certificate, "sampled_loops")) {
    const Json gains = member(loop, "gains");
    for (const char* input : {"force", "command", "velocity", "position"})
      file.loops.push_back(gains_of_loop(loop, "sampled", input, member(gains, input)));
  }
  for (const Json& row : member(certificate, "left_out")) {
    const auto text = [&row](const char* key) { return stated<std::string>(row, key).value_or(""); };
    file.left_out.push_back({text("axis"), text("input"), text("loop"), text("why")});
  }
  return file;
}

}  // namespace

InspectedFile stated_by_certificate(const std::string& path) {
  const Json any = files::parse_json(files::read_file(path), path);
  if (member(any, "schema") == check::kTrackingSchema) return tracking_certificate_file(path, any);
  return network_certificate(path, files::read_json(path, check::kCertificateSchema));
}

}  // namespace swarmcert::analysis
