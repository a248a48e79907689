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

/// The smallest double with a 30-bit significand that is not below `exact`, so that it prints with few digits.
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

Json hex_rows(const std::vector<std::vector<double>>& matrix) {
  Json result = Json::array();
  for (const std::vector<double>& row : matrix) result.push_back(hex_array(row));
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

/// Members common to the entries of both kinds of loops; the axis is left empty.
Json entry_of(const check::LoopNumbers& loop, const std::vector<std::vector<double>>& P, long steps) {
  return {{"axis", ""},
          {"mass_kg", files::hex_float(loop.mass_kg)},
          {"Kp", files::hex_float(loop.Kp)},
          {"Kd", files::hex_float(loop.Kd)},
          {"Ki", files::hex_float(loop.Ki)},
          {"lags_s", hex_array(loop.lags_s)},
          {"delay_s", files::hex_float(loop.delay_s)},
          {"steps", steps},
          {"P", hex_rows(P)}};
}

Json loop_entry(const ProvedGains& found) {
  const check::LoopWitness& w = found.witness;
  Json entry = entry_of(w, w.P, w.steps);
  entry.update({{"input", w.input},
                {"delay_order", w.delay_order},
                {"time_exponent", w.time_exponent},
                {"step_exponent", w.step_exponent},
                {"decay", files::hex_float(w.decay)},
                {"gains", gains_of(found.bounds)}});
  return entry;
}

Json sampled_entry(const ProvedSampledGains& found) {
  const check::SampledWitness& w = found.witness;
  Json entry = entry_of(w, w.P, w.steps);
  entry.update({{"period_s", files::hex_float(w.period_s)},
                {"integrator_step_s", files::hex_float(w.integrator_step_s)},
                {"contraction", files::hex_float(w.contraction)},
                {"gains",
                 {{"force", gains_of(found.bounds.force)},
                  {"command", gains_of(found.bounds.command)},
                  {"velocity", gains_of(found.bounds.velocity)},
                  {"position", gains_of(found.bounds.position)}}}});
  return entry;
}

stability::VerifiedNorms enclosures_of(const Json& gains) {
  stability::VerifiedNorms known;
  const auto upper = [&gains](const char* key) {
    const Json& x = gains.at(key).at(1);
    return x.is_null() ? std::numeric_limits<double>::infinity() : x.get<double>();
  };
  known.rate.upper = upper("rate"), known.amplitude.upper = upper("amplitude");
  known.edge.upper = upper("edge"), known.impulse.upper = upper("impulse");
  return known;
}

/// Returns the certificate entry of the loop with an empty axis, or a string with the reason why there is none.
Json entry_or_reason(const stability::AxisLoop& loop, const Json& row) {
  if (row["status"] != "proved") return row["why"];
  std::string why;
  const auto found = gain_witness(loop, row["channel"].get<std::string>(), enclosures_of(row), why);
  return found ? loop_entry(*found) : Json(why);
}

/// The same for a sampled loop.
/// @param rows rows of its inputs: force, command, velocity and position.
Json sampled_entry_or_reason(const stability::SampledLoop& loop, const std::map<std::string, Json>& rows) {
  for (const auto& [input, row] : rows) {
    if (row["status"] != "proved") return row["why"];
  }
  const auto known = [&rows](const char* input) { return enclosures_of(rows.at(input)["between_samples"]); };
  std::string why;
  const auto found = sampled_gain_witness(
      loop, {known("force"), known("command"), known("velocity"), known("position")}, why);
  return found ? sampled_entry(*found) : Json(why);
}

/// Collects certificate entries, and the rows of --verified that have none.
class Entries {
 public:
  void add(const Json& row, Json entry) {
    if (entry.is_object()) {
      entry["axis"] = row["axis"];
      (row["loop"] == "sampled" ? sampled : continuous).push_back(std::move(entry));
    } else {
      leave_out(row, entry);
    }
  }
  void leave_out(const Json& row, const Json& why) {
    left_out.push_back(
        {{"axis", row["axis"]}, {"input", row["channel"]}, {"loop", row["loop"]}, {"why", why}});
  }
  Json continuous = Json::array(), sampled = Json::array(), left_out = Json::array();
};

std::string numbers_of(const stability::AxisLoop& loop) {
  return Json({loop.mass_kg, loop.Kp, loop.Kd, loop.Ki, loop.lags_s, loop.delay_s}).dump();
}

/// Searches only once for axes with identical loops.
void add_continuous(const Tracking& input, const Json& verified, Entries& entries) {
  std::map<std::string, Json> known;
  for (const Json& row : verified) {
    if (row["loop"] != "continuous") continue;
    const stability::AxisLoop loop =
        *input.continuous(stability::axis_of_name(row["axis"].get<std::string>()));
    const auto [place, is_new] = known.try_emplace(numbers_of(loop) + row["channel"].get<std::string>());
    if (is_new) place->second = entry_or_reason(loop, row);
    entries.add(row, place->second);
  }
}

void add_sampled(const Tracking& input, const Json& verified, Entries& entries) {
  std::map<int, std::map<std::string, Json>> rows;
  for (const Json& row : verified) {
    if (row["loop"] == "sampled")
      rows[stability::axis_of_name(row["axis"].get<std::string>())][row["channel"].get<std::string>()] = row;
  }
  std::map<std::string, Json> known;
  for (const auto& [axis, inputs] : rows) {
    const stability::SampledLoop loop = *input.sampled(axis);
    const auto [place, is_new] = known.try_emplace(numbers_of(loop.plant));
    if (is_new) place->second = sampled_entry_or_reason(loop, inputs);
    if (place->second.is_object()) {
      entries.add(inputs.begin()->second, place->second);
    } else {
      for (const auto& [name, row] : inputs) entries.leave_out(row, place->second);
    }
  }
}

}  // namespace

Json tracking_certificate(const Tracking& input, const TrackingArguments& arguments, const Json& verified) {
  Entries entries;
  add_continuous(input, verified, entries);
  add_sampled(input, verified, entries);
  Json result = {{"schema", check::kTrackingSchema},
                 {"tool", "swarmcert " SWARMCERT_VERSION},
                 {"statement", check::kTrackingStatement},
                 {"gains_sha256", files::sha256(files::read_file(arguments.gains))},
                 {"model_sha256", files::sha256(files::read_file(arguments.model))},
                 {"loops", std::move(entries.continuous)},
                 {"sampled_loops", std::move(entries.sampled)},
                 {"left_out", std::move(entries.left_out)}};
  result["content_sha256"] = files::content_sha256(result);
  return result;
}

bool is_empty_certificate(const Json& certificate) {
  return certificate["loops"].empty() && certificate["sampled_loops"].empty();
}

Json certificate_summary(const Json& certificate) {
  return {{"content_sha256", certificate["content_sha256"]},
          {"loops", certificate["loops"].size()},
          {"sampled_loops", certificate["sampled_loops"].size()},
          {"left_out", certificate["left_out"]}};
}

void print_certificate_summary(const Json& certificate, const std::string& path) {
  if (is_empty_certificate(certificate)) {
    fmt::print("\nno certificate: none of these gains could be certified\n");
  } else {
    fmt::print("\ncertificate of the gains of {} continuous loops and of {} sampled axes: {}\n",
               certificate["loops"].size(), certificate["sampled_loops"].size(), path);
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
