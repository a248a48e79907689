#include "stability/checker/check_tracking.h"

#include <map>
#include <set>
#include <stdexcept>

#include "nn/base/content_hash.h"

namespace swarmcert::check {
namespace {

using files::Json;

void demand_field(bool condition, const std::string& reason) {
  if (!condition) throw std::runtime_error(reason);
}

double hex_number(const Json& entry, const char* key) {
  return files::parse_hex_float(entry[key].get<std::string>());
}

int small_integer(const Json& entry, const char* key) {
  demand_field(entry[key].is_number_integer(), std::string(key) + " is not an integer");
  const double value = entry[key].get<double>();
  demand_field(value >= -1e9 && value <= 1e9, std::string(key) + " is out of range");
  return entry[key].get<int>();
}

void check_axis(const Json& entry) {
  demand_field(entry["axis"] == "x" || entry["axis"] == "y" || entry["axis"] == "z", "axis is unknown");
}

std::vector<std::vector<double>> parse_form(const Json& entry) {
  demand_field(entry["P"].is_array(), "P is not an array");
  std::vector<std::vector<double>> P;
  for (const Json& row : entry["P"]) P.push_back(files::parse_hex_floats(row));
  return P;
}

void read_numbers(const Json& entry, LoopNumbers& loop) {
  loop.mass_kg = hex_number(entry, "mass_kg");
  loop.Kp = hex_number(entry, "Kp");
  loop.Kd = hex_number(entry, "Kd");
  loop.Ki = hex_number(entry, "Ki");
  loop.lags_s = files::parse_hex_floats(entry["lags_s"]);
  loop.delay_s = hex_number(entry, "delay_s");
}

LoopWitness parse_loop(const Json& entry) {
  files::require_keys(entry,
                      {"axis", "input", "mass_kg", "Kp", "Kd", "Ki", "lags_s", "delay_s", "delay_order",
                       "time_exponent", "step_exponent", "steps", "decay", "P", "gains"},
                      "loop");
  check_axis(entry);
  LoopWitness loop;
  loop.input = entry["input"].get<std::string>();
  read_numbers(entry, loop);
  loop.delay_order = small_integer(entry, "delay_order");
  loop.time_exponent = small_integer(entry, "time_exponent");
  loop.step_exponent = small_integer(entry, "step_exponent");
  loop.steps = small_integer(entry, "steps");
  loop.decay = hex_number(entry, "decay");
  loop.P = parse_form(entry);
  return loop;
}

SampledWitness parse_sampled(const Json& entry) {
  files::require_keys(entry,
                      {"axis", "mass_kg", "Kp", "Kd", "Ki", "lags_s", "delay_s", "period_s",
                       "integrator_step_s", "steps", "contraction", "P", "gains"},
                      "sampled loop");
  check_axis(entry);
  SampledWitness loop;
  read_numbers(entry, loop);
  loop.period_s = hex_number(entry, "period_s");
  loop.integrator_step_s = hex_number(entry, "integrator_step_s");
  loop.steps = small_integer(entry, "steps");
  loop.contraction = hex_number(entry, "contraction");
  loop.P = parse_form(entry);
  return loop;
}

/// Returns the text of an entry that determines its bounds: everything except axis and claims.
std::string witness_text(Json entry) {
  entry.erase("axis");
  entry.erase("gains");
  return entry.dump();
}

/// @returns whether a number is claimed.
bool check_gain(const Json& gains, const std::string& name, const std::optional<mpq_class>& proved) {
  const Json& decimal = gains[name];
  const Json& hex = gains[name + "_hex"];
  if (decimal.is_null() && hex.is_null()) {
    demand_field(name == "rate" && !proved, "gains." + name + " is missing");
    return false;
  }
  const double claimed = files::parse_hex_float(hex.get<std::string>());
  demand_field(decimal.is_number() && decimal.get<double>() == claimed,
               "gains." + name + ": decimal and hex notation differ");
  demand_field(proved.has_value(),
               "gains." + name + " is claimed, but a constant input leaves a steady-state error");
  demand_field(mpq_class(claimed) >= *proved, "gains." + name + " is below what the witness proves");
  return true;
}

/// @returns the number of claimed numbers.
int check_gains(const Json& gains, const GainBounds& proved) {
  files::require_keys(
      gains, {"rate", "rate_hex", "amplitude", "amplitude_hex", "edge", "edge_hex", "impulse", "impulse_hex"},
      "gains");
  int count = 0;
  for (const bool is_claimed :
       {check_gain(gains, "rate", proved.rate), check_gain(gains, "amplitude", proved.amplitude),
        check_gain(gains, "edge", proved.edge), check_gain(gains, "impulse", proved.impulse)})
    count += is_claimed ? 1 : 0;
  return count;
}

void check_loops(const Json& loops, TrackingVerdict& verdict) {
  demand_field(loops.is_array() && loops.size() <= 12, "there are more than 12 loops");
  std::set<std::string> seen;
  std::map<std::string, GainBounds> known;  // identical axes are computed once
  for (const Json& entry : loops) {
    const LoopWitness loop = parse_loop(entry);
    demand_field(seen.insert(entry["axis"].get<std::string>() + " " + loop.input).second,
                 "loops: one appears twice");
    const auto [place, is_new] = known.try_emplace(witness_text(entry));
    if (is_new) place->second = upper_gains(loop);
    verdict.gains += check_gains(entry["gains"], place->second);
    ++verdict.loops;
  }
}

void check_sampled_loops(const Json& loops, TrackingVerdict& verdict) {
  demand_field(loops.is_array() && loops.size() <= 3, "there are more than 3 sampled_loops");
  std::set<std::string> seen;
  std::map<std::string, SampledGainBounds> known;
  for (const Json& entry : loops) {
    const SampledWitness loop = parse_sampled(entry);
    demand_field(seen.insert(entry["axis"].get<std::string>()).second, "sampled_loops: one appears twice");
    const auto [place, is_new] = known.try_emplace(witness_text(entry));
    if (is_new) place->second = sampled_upper_gains(loop);
    const Json& gains = entry["gains"];
    files::require_keys(gains, {"force", "command", "velocity", "position"}, "gains");
    const SampledGainBounds& proved = place->second;
    verdict.gains += check_gains(gains["force"], proved.force);
    verdict.gains += check_gains(gains["command"], proved.command);
    verdict.gains += check_gains(gains["velocity"], proved.velocity);
    verdict.gains += check_gains(gains["position"], proved.position);
    ++verdict.loops;
  }
}

void check_left_out(const Json& left_out) {
  demand_field(left_out.is_array(), "left_out is not an array");
  for (const Json& entry : left_out) {
    files::require_keys(entry, {"axis", "input", "loop", "why"}, "left_out");
    check_axis(entry);
    demand_field(entry["input"].is_string() && entry["loop"].is_string() && entry["why"].is_string(),
                 "left_out: an entry is not a string");
  }
}

TrackingVerdict verified(const Json& certificate, const std::string& gains_sha256,
                         const std::string& model_sha256) {
  files::require_keys(certificate,
                      {"schema", "tool", "statement", "gains_sha256", "model_sha256", "loops",
                       "sampled_loops", "left_out", "content_sha256"},
                      "certificate");
  demand_field(certificate["schema"] == kTrackingSchema, "schema is not " + std::string(kTrackingSchema));
  demand_field(certificate["statement"] == kTrackingStatement, "statement is not the one that is checked");
  demand_field(certificate["content_sha256"] == files::content_sha256(certificate),
               "content_sha256 does not match: the certificate was changed after it was written");
  demand_field(certificate["tool"].is_string(), "tool is not text");
  demand_field(certificate["gains_sha256"].is_string() && certificate["model_sha256"].is_string(),
               "gains_sha256 or model_sha256 is not text");
  demand_field(gains_sha256.empty() || certificate["gains_sha256"] == gains_sha256,
               "gains_sha256 belongs to another file");
  demand_field(model_sha256.empty() || certificate["model_sha256"] == model_sha256,
               "model_sha256 belongs to another file");
  check_left_out(certificate["left_out"]);
  TrackingVerdict verdict;
  check_loops(certificate["loops"], verdict);
  check_sampled_loops(certificate["sampled_loops"], verdict);
  demand_field(verdict.loops > 0, "there is no loop");
  verdict.accepted = true;
  verdict.reason = "every gain verified from its witness";
  return verdict;
}

}  // namespace

TrackingVerdict check_tracking(const Json& certificate, const std::string& gains_sha256,
                               const std::string& model_sha256) {
  try {
    return verified(certificate, gains_sha256, model_sha256);
  } catch (const std::exception& fault) {
    return {false, fault.what(), 0, 0};
  }
}

}  // namespace swarmcert::check
