#include "analysis/commands/bound/tracking_certificate.h"

#include <fmt/core.h>

#include <cmath>
#include <map>

#include "analysis/commands/bound/gain_witness.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "stability/checker/check_tracking.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

/// The least double of 30 bits that is not below `exact`, so that its notation is short.
double short_double_above(const mpq_class& exact) {
  constexpr int kBits = 30;
  const double near = exact.get_d();
  const int exponent = std::ilogb(near) + 1 - kBits;
  double result = std::ldexp(std::floor(std::ldexp(near, -exponent)), exponent);
  while (mpq_class(result) < exact) result += std::ldexp(1.0, exponent);
  return result;
}

Json hex_array(const std::vector<double>& values) {
  Json result = Json::array();
  for (const double x : values) result.push_back(files::hex_float(x));
  return result;
}

Json gains_of(const check::GainBounds& bounds) {
  Json gains;
  const auto add = [&gains](const std::string& key, const std::optional<mpq_class>& exact) {
    const double above = exact ? short_double_above(*exact) : 0;
    gains[key] = exact ? Json(above) : Json();
    gains[key + "_hex"] = exact ? Json(files::hex_float(above)) : Json();
  };
  add("rate", bounds.rate);
  add("amplitude", bounds.amplitude);
  add("edge", bounds.edge);
  add("impulse", bounds.impulse);
  return gains;
}

Json loop_entry(const ProvedGains& found) {
  const check::LoopWitness& w = found.witness;
  Json P = Json::array();
  for (const std::vector<double>& row : w.P) P.push_back(hex_array(row));
  return {{"axis", ""},
          {"input", w.input},
          {"mass_kg", files::hex_float(w.mass_kg)},
          {"Kp", files::hex_float(w.Kp)},
          {"Kd", files::hex_float(w.Kd)},
          {"Ki", files::hex_float(w.Ki)},
          {"lags_s", hex_array(w.lags_s)},
          {"delay_s", files::hex_float(w.delay_s)},
          {"delay_order", w.delay_order},
          {"time_exponent", w.time_exponent},
          {"step_exponent", w.step_exponent},
          {"steps", w.steps},
          {"decay", files::hex_float(w.decay)},
          {"P", std::move(P)},
          {"gains", gains_of(found.bounds)}};
}

stability::VerifiedNorms enclosures_of(const Json& row) {
  stability::VerifiedNorms known;
  const auto upper = [&row](const char* key) {
    const Json& x = row.at(key).at(1);
    return x.is_null() ? std::numeric_limits<double>::infinity() : x.get<double>();
  };
  known.rate.hi = upper("rate"), known.amplitude.hi = upper("amplitude");
  known.edge.hi = upper("edge"), known.impulse.hi = upper("impulse");
  return known;
}

/// The certificate entry of this loop, with its axis left empty; or a string with the reason why it has none.
Json entry_or_reason(const stability::AxisLoop& loop, const Json& row) {
  if (row["status"] != "proved") return row["why"];
  if (row["loop"] != "continuous") return "sampled loops are not certified, only enclosed";
  std::string why;
  const auto found = gain_witness(loop, row["channel"].get<std::string>(), enclosures_of(row), why);
  return found ? loop_entry(*found) : Json(why);
}

}  // namespace

Json tracking_certificate(const Tracking& input, const TrackingArguments& arguments, const Json& verified) {
  Json loops = Json::array(), left_out = Json::array();
  std::map<std::string, Json> known;  // axes that are the same are searched once
  for (const Json& row : verified) {
    int axis = 0;
    while (stability::axis_name(axis) != row["axis"].get<std::string>()) ++axis;
    const stability::AxisLoop loop = *axis_loop(input.gains, input.plant, axis);
    Json numbers = {loop.mass_kg, loop.Kp,      loop.Kd,        loop.Ki,
                    loop.lags_s,  loop.delay_s, row["channel"], row["loop"]};
    const auto [place, is_new] = known.try_emplace(numbers.dump());
    if (is_new) place->second = entry_or_reason(loop, row);
    Json entry = place->second;
    if (entry.is_object()) {
      entry["axis"] = row["axis"];
      loops.push_back(std::move(entry));
    } else {
      left_out.push_back({{"axis", row["axis"]},
                          {"input", row["channel"]},
                          {"loop", row["loop"]},
                          {"why", std::move(entry)}});
    }
  }
  Json result = {{"schema", check::kTrackingSchema},
                 {"tool", "swarmcert " SWARMCERT_VERSION},
                 {"statement", check::kTrackingStatement},
                 {"gains_sha256", files::sha256(files::read_file(arguments.gains))},
                 {"model_sha256", files::sha256(files::read_file(arguments.model))},
                 {"loops", std::move(loops)},
                 {"left_out", std::move(left_out)}};
  result["content_sha256"] = files::content_sha256(result);
  return result;
}

Json certificate_summary(const Json& certificate) {
  return {{"content_sha256", certificate["content_sha256"]},
          {"loops", certificate["loops"].size()},
          {"left_out", certificate["left_out"]}};
}

void print_certificate_summary(const Json& certificate, const std::string& path) {
  if (certificate["loops"].empty()) {
    fmt::print("\nno certificate: none of these gains could be certified\n");
  } else {
    fmt::print("\ncertificate of the gains of {} loops: {}\n", certificate["loops"].size(), path);
  }
  std::map<std::string, std::string> reasons;
  for (const Json& row : certificate["left_out"]) {
    std::string& rows = reasons[row["why"].get<std::string>()];
    rows += (rows.empty() ? "" : ", ") + row["axis"].get<std::string>() + " " +
            row["input"].get<std::string>() + " " + row["loop"].get<std::string>();
  }
  for (const auto& [why, rows] : reasons) fmt::print("  not in it: {} ({})\n", rows, why);
}

}  // namespace swarmcert::analysis
