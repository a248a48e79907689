#include "analysis/commands/bound/tracking_certificate.h"

#include <fmt/core.h>

#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "stability/checker/check_tracking.h"

namespace swarmcert::analysis {
namespace {

using files::Record;

/// The smallest double with a 30-bit significand that is not below `exact`, so that it prints with few digits.
double short_double_above(const mpq_class& exact) {
  constexpr int kBits = 30;
  const double near = exact.get_d();
  if (near == 0) return 0;
  const int exponent = std::ilogb(near) + 1 - kBits;
  double result = std::ldexp(std::floor(std::ldexp(near, -exponent)), exponent);
  while (mpq_class(result) < exact) result += std::ldexp(1.0, exponent);
  return result;
}

std::vector<std::string> hex_floats(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double x : values) texts.push_back(files::hex_float(x));
  return texts;
}

void describe_hex(Record& record, const char* name, double value, const char* meaning,
                  const char* unit = "") {
  record.field(name, files::hex_float(value), meaning, unit);
}

void describe_gain_bounds(Record& record, const check::GainBounds& bounds) {
  const auto above = [](const mpq_class& exact) { return short_double_above(exact); };
  constexpr const char* kSame = "The same double as a hex float.";
  const auto rate = bounds.rate ? std::optional(above(*bounds.rate)) : std::nullopt;
  record.field("rate", rate, "Of |e| per sup |w'|; null where a constant input leaves an error.", "m",
               "proved upper bound");
  record.field("rate_hex", rate ? std::optional(files::hex_float(*rate)) : std::nullopt, kSame);
  record.field("amplitude", above(bounds.amplitude), "Of |e| per sup |w|.", "m", "proved upper bound");
  describe_hex(record, "amplitude_hex", above(bounds.amplitude), kSame);
  record.field("edge", above(bounds.edge), "Of |e| per total variation of w.", "m", "proved upper bound");
  describe_hex(record, "edge_hex", above(bounds.edge), kSame);
  record.field("impulse", above(bounds.impulse), "Of |e| per int |w| dt.", "m", "proved upper bound");
  describe_hex(record, "impulse_hex", above(bounds.impulse), kSame);
}

/// Members common to the entries of both kinds of loops.
void describe_loop_numbers(Record& record, const std::string& axis, const check::LoopNumbers& loop) {
  record.field("axis", axis, "x, y or z.");
  describe_hex(record, "mass_kg", loop.mass_kg, "", "kg");
  describe_hex(record, "Kp", loop.Kp, "", "1/s^2");
  describe_hex(record, "Kd", loop.Kd, "", "1/s");
  describe_hex(record, "Ki", loop.Ki, "As it acts; of a sampled loop, as the firmware states it.", "1/s^3");
  record.field("lags_s", hex_floats(loop.lags_s), "Time constants of the first-order lags.", "s");
  describe_hex(record, "delay_s", loop.delay_s, "Of the command, before the lags.", "s");
}

void describe_form(Record& record, long steps, const std::vector<std::vector<double>>& P) {
  std::vector<std::vector<std::string>> rows;
  for (const std::vector<double>& row : P) rows.push_back(hex_floats(row));
  record.field("steps", steps, "Cells or periods that are followed; the rest is bounded as the tail.");
  record.field("P", rows, "The quadratic form, rows of hex floats.");
}

void describe_loop(Record& record, const TrackingCertificate::Loop& loop) {
  const check::LoopWitness& w = loop.proved.witness;
  describe_loop_numbers(record, loop.axis, w);
  describe_form(record, w.steps, w.P);
  record.field("input", w.input, "Where w enters: force, command, velocity or position.");
  record.field("delay_order", w.delay_order, "Degree of the expansion of the delay; 0 without one.");
  record.field("time_exponent", w.time_exponent, "The unit of time of the witness is 2^-time_exponent s.");
  record.field("step_exponent", w.step_exponent, "A cell is 2^-step_exponent units of time long.");
  describe_hex(record, "decay", w.decay, "sqrt(x'Px) falls at least like exp(-decay t), t in units of time.");
  record.object("gains", "", [&](Record& gains) { describe_gain_bounds(gains, loop.proved.bounds); });
}

void describe_sampled_loop(Record& record, const TrackingCertificate::SampledLoop& loop) {
  const check::SampledWitness& w = loop.proved.witness;
  const check::SampledGainBounds& bounds = loop.proved.bounds;
  describe_loop_numbers(record, loop.axis, w);
  describe_form(record, w.steps, w.P);
  describe_hex(record, "period_s", w.period_s, "From one command to the next.", "s");
  describe_hex(record, "integrator_step_s", w.integrator_step_s,
               "What the integral grows by per period, times e.", "s");
  describe_hex(record, "contraction", w.contraction,
               "sqrt(r P r') falls at least by this factor when a row goes to the period before.");
  record.object("gains", "By input.", [&](Record& gains) {
    for (const auto& [input, of_input] : {std::pair("force", &bounds.force),
                                          {"command", &bounds.command},
                                          {"velocity", &bounds.velocity},
                                          {"position", &bounds.position}})
      gains.object(input, "", [&one = *of_input](Record& r) { describe_gain_bounds(r, one); });
  });
}

void describe_left_out(Record& record, const TrackingCertificate::LeftOut& row) {
  record.field("axis", row.axis, "x, y or z.");
  record.field("input", row.input, "Where the disturbance enters.");
  record.field("loop", row.loop, "continuous or sampled.");
  record.field("why", row.why, "Why it is not certified.");
}

/// A search, and the reason if it found nothing.
template <class Proved>
struct Found {
  std::optional<Proved> proved;
  std::string why;
};

Found<ProvedGains> found_gains(const stability::AxisLoop& loop, const VerifiedRow& row) {
  if (!row.norms) return {std::nullopt, row.why};
  Found<ProvedGains> found;
  found.proved = gain_witness(loop, row.input, *row.norms, found.why);
  return found;
}

/// Rows of the inputs of one sampled loop: force, command, velocity and position.
using SampledRows = std::map<std::string, VerifiedRow>;

Found<ProvedSampledGains> found_gains(const stability::SampledLoop& loop, const SampledRows& rows) {
  for (const auto& [input, row] : rows)
    if (!row.norms) return {std::nullopt, row.why};
  const auto known = [&rows](const char* input) { return *rows.at(input).between_samples; };
  Found<ProvedSampledGains> found;
  found.proved = sampled_gain_witness(
      loop, {known("force"), known("command"), known("velocity"), known("position")}, found.why);
  return found;
}

void leave_out(const VerifiedRow& row, const std::string& why, TrackingCertificate& certificate) {
  certificate.left_out.push_back({stability::axis_name(row.axis), row.input, name(row.loop), why});
}

std::string numbers_of(const stability::AxisLoop& loop) {
  return files::Json({loop.mass_kg, loop.Kp, loop.Kd, loop.Ki, loop.lags_s, loop.delay_s}).dump();
}

/// Searches only once for axes with identical loops.
void add_continuous(const Tracking& input, const VerifiedGains& verified, TrackingCertificate& certificate) {
  std::map<std::string, Found<ProvedGains>> known;
  for (const VerifiedRow& row : verified) {
    if (row.loop != stability::Loop::kContinuous) continue;
    const stability::AxisLoop loop = *input.continuous(row.axis);
    const auto [place, is_new] = known.try_emplace(numbers_of(loop) + row.input);
    if (is_new) place->second = found_gains(loop, row);
    const auto& [proved, why] = place->second;
    if (proved)
      certificate.loops.push_back({stability::axis_name(row.axis), *proved});
    else
      leave_out(row, why, certificate);
  }
}

void add_sampled(const Tracking& input, const VerifiedGains& verified, TrackingCertificate& certificate) {
  std::map<int, SampledRows> rows;
  for (const VerifiedRow& row : verified)
    if (row.loop == stability::Loop::kSampled) rows[row.axis][row.input] = row;
  std::map<std::string, Found<ProvedSampledGains>> known;
  for (const auto& [axis, inputs] : rows) {
    const stability::SampledLoop loop = *input.sampled(axis);
    const auto [place, is_new] = known.try_emplace(numbers_of(loop.plant));
    if (is_new) place->second = found_gains(loop, inputs);
    const auto& [proved, why] = place->second;
    if (proved)
      certificate.sampled_loops.push_back({stability::axis_name(axis), *proved});
    else
      for (const auto& [name, row] : inputs) leave_out(row, why, certificate);
  }
}

}  // namespace

void describe(Record& record, const TrackingCertificate& certificate) {
  record.constant("schema", check::kTrackingSchema, "Name and version of this format.");
  record.field("tool", "swarmcert " SWARMCERT_VERSION, "Name and version of the tool that wrote this.");
  record.field("statement", check::kTrackingStatement, "What the certificate claims, in words.");
  record.field("gains_sha256", certificate.gains_sha256, "Of gains.toml.");
  record.field("model_sha256", certificate.model_sha256, "Of model.toml.");
  record.list("loops", certificate.loops, "Continuous loops, one entry per axis and input.", describe_loop);
  record.list("sampled_loops", certificate.sampled_loops, "Sampled loops, one entry per axis.",
              describe_sampled_loop);
  record.list("left_out", certificate.left_out, "Rows of --verified that are not certified.",
              describe_left_out);
  record.field("content_sha256", certificate.content_sha256,
               "Over everything else, independent of formatting.");
}

TrackingCertificate tracking_certificate(const Tracking& input, const TrackingArguments& arguments,
                                         const VerifiedGains& verified) {
  TrackingCertificate certificate;
  certificate.gains_sha256 = files::sha256(files::read_file(arguments.gains));
  certificate.model_sha256 = files::sha256(files::read_file(arguments.model));
  add_continuous(input, verified, certificate);
  add_sampled(input, verified, certificate);
  certificate.content_sha256 = files::content_sha256(files::to_json(files::record_of(certificate)));
  return certificate;
}

void describe_certificate(Record& record, const TrackingCertificate& certificate) {
  record.field("content_sha256", certificate.content_sha256, "Of the certificate.");
  record.field("loops", certificate.loops.size(),
               "Continuous loops whose gains it holds, by axis and input.");
  record.field(
      "sampled_loops", certificate.sampled_loops.size(),
      "Axes whose sampled loop it holds with all inputs; where there is no loop at all, no file is written.");
  record.list("left_out", certificate.left_out, "Rows of verified that it does not hold.", describe_left_out);
}

void print_certificate_summary(const TrackingCertificate& certificate, const std::string& path) {
  if (certificate.has_no_gain()) {
    fmt::print("\nno certificate: none of these gains could be certified\n");
  } else {
    fmt::print("\ncertificate of the gains of {} continuous loops and of {} sampled axes: {}\n",
               certificate.loops.size(), certificate.sampled_loops.size(), path);
  }
  std::map<std::string, std::string> reasons;
  for (const TrackingCertificate::LeftOut& row : certificate.left_out) {
    std::string& rows = reasons[row.why];
    rows += (rows.empty() ? "" : ", ") + row.axis + " " + row.input + " " + row.loop;
  }
  for (const auto& [why, rows] : reasons) fmt::print("  not in it: {} ({})\n", rows, why);
}

}  // namespace swarmcert::analysis
