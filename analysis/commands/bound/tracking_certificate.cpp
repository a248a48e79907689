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

/// Returns the certificate entry of the loop with an empty axis, or a string with the reason why there is none.
Json entry_or_reason(const stability::AxisLoop& loop, const VerifiedRow& row) {
  if (!row.norms) return row.why;
  std::string why;
  const auto found = gain_witness(loop, row.input, *row.norms, why);
  return found ? loop_entry(*found) : Json(why);
}

/// Rows of the inputs of one sampled loop: force, command, velocity and position.
using SampledRows = std::map<std::string, VerifiedRow>;

/// The same for a sampled loop.
Json sampled_entry_or_reason(const stability::SampledLoop& loop, const SampledRows& rows) {
  for (const auto& [input, row] : rows)
    if (!row.norms) return row.why;
  const auto known = [&rows](const char* input) { return *rows.at(input).between_samples; };
  std::string why;
  const auto found = sampled_gain_witness(
      loop, {known("force"), known("command"), known("velocity"), known("position")}, why);
  return found ? sampled_entry(*found) : Json(why);
}

/// Collects certificate entries, and the rows of --verified that have none.
class Entries {
 public:
  void add(const VerifiedRow& row, Json entry) {
    if (entry.is_object()) {
      entry["axis"] = stability::axis_name(row.axis);
      (row.loop == stability::Loop::kSampled ? sampled : continuous).push_back(std::move(entry));
    } else {
      leave_out(row, entry);
    }
  }
  void leave_out(const VerifiedRow& row, const Json& why) {
    left_out.push_back({{"axis", stability::axis_name(row.axis)},
                        {"input", row.input},
                        {"loop", name(row.loop)},
                        {"why", why}});
  }
  Json continuous = Json::array(), sampled = Json::array(), left_out = Json::array();
};

std::string numbers_of(const stability::AxisLoop& loop) {
  return Json({loop.mass_kg, loop.Kp, loop.Kd, loop.Ki, loop.lags_s, loop.delay_s}).dump();
}

/// Searches only once for axes with identical loops.
void add_continuous(const Tracking& input, const VerifiedGains& verified, Entries& entries) {
  std::map<std::string, Json> known;
  for (const VerifiedRow& row : verified) {
    if (row.loop != stability::Loop::kContinuous) continue;
    const stability::AxisLoop loop = *input.continuous(row.axis);
    const auto [place, is_new] = known.try_emplace(numbers_of(loop) + row.input);
    if (is_new) place->second = entry_or_reason(loop, row);
    entries.add(row, place->second);
  }
}

void add_sampled(const Tracking& input, const VerifiedGains& verified, Entries& entries) {
  std::map<int, SampledRows> rows;
  for (const VerifiedRow& row : verified)
    if (row.loop == stability::Loop::kSampled) rows[row.axis][row.input] = row;
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

Json tracking_certificate(const Tracking& input, const TrackingArguments& arguments,
                          const VerifiedGains& verified) {
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

void describe_certificate(files::Record& record, const Json& certificate) {
  struct LeftOut {
    std::string axis, input, loop, why;
  };
  const bool is_shape = certificate.is_null();
  std::vector<LeftOut> left_out;
  for (const Json& row : is_shape ? Json::array() : certificate["left_out"])
    left_out.push_back({row["axis"], row["input"], row["loop"], row["why"]});
  const auto size = [&](const char* of) { return is_shape ? std::size_t{0} : certificate[of].size(); };
  record.field("content_sha256", is_shape ? "" : certificate["content_sha256"].get<std::string>(),
               "Of the certificate.");
  record.field("loops", size("loops"), "Continuous loops whose gains it holds, by axis and input.");
  record.field(
      "sampled_loops", size("sampled_loops"),
      "Axes whose sampled loop it holds with all inputs; where there is no loop at all, no file is written.");
  record.list("left_out", left_out, "Rows of verified that it does not hold.",
              [](files::Record& r, const LeftOut& row) {
                r.field("axis", row.axis, "");
                r.field("input", row.input, "Where the disturbance enters.");
                r.field("loop", row.loop, "continuous or sampled.");
                r.field("why", row.why, "Why it is not certified.");
              });
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
