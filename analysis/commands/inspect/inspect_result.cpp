#include "analysis/commands/inspect/inspect_result.h"

#include <utility>

#include "analysis/commands/shared/plausibility_output.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

using files::Record;

void describe_file_and_kind(Record& record, const std::string& file, const char* kind, const char* meaning) {
  record.field("file", file, "As it was named.");
  record.constant("kind", kind, meaning);
}

/// An empty text is null.
std::optional<std::string> stated_or_null(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

// --- networks and models ---

struct LayerRow {
  files::Layer layer;
  bool is_last = false;
};

void describe_file_layer(Record& record, const LayerRow& row) {
  record.field("name", row.layer.name, "As in the file.");
  record.field("inputs", row.layer.inputs, "");
  record.field("outputs", row.layer.outputs, "");
  record.field("activation", row.is_last ? std::nullopt : std::optional(files::op_after(row.layer)),
               "What follows this layer; null after the last one.");
}

void describe_weights(Record& record, const files::Weights& weights) {
  const std::size_t num_layers = weights.layers.size();
  std::vector<LayerRow> rows;
  for (const files::Layer& layer : weights.layers) rows.push_back({layer, rows.size() + 1 == num_layers});
  record.field("file", weights.path, "");
  record.field("sha256", weights.sha256, "Of its bytes.");
  record.field("precision", files::name(weights.precision), "float32, float64, float16 or bfloat16.");
  record.field("activation", num_layers > 1 ? weights.activation_names() : "relu",
               "Between the layers, where they differ each in turn (relu, tanh); relu where the file states "
               "none and none was given.");
  record.list("layers", rows, "In order of evaluation.", describe_file_layer);
  record.field("notes", weights.notes, "What was folded, rewritten or left out when it was read.");
  record.field("rounding_of_slope", files::rounding_of_slope(weights),
               "How much steeper the file's function can be, because folded weights were rounded.", "",
               "upper bound");
}

void describe_gamma(Record& record, const files::GammaStatement& gamma) {
  using Gamma = files::GammaStatement;
  record.field("value", gamma.value, "Limit of the spectral norms.");
  record.field("scope", gamma.scope == Gamma::Scope::kLayer ? "layer" : "network", "What it limits.");
  record.field("mode", gamma.mode == Gamma::Mode::kClip ? "clip" : "equal", "clip: at most the limit.");
}

std::vector<std::pair<std::string, files::Weights>> named_parts(const files::Network& network) {
  std::vector<std::pair<std::string, files::Weights>> named;
  for (const auto& [part, weights] : files::parts(network)) named.emplace_back(part.name(), *weights);
  return named;
}

void describe_thrust_map(Record& record, const stability::ThrustMap& map) {
  record.field("c00", map.c00, "", "gf");
  record.field("c10", map.c10, "Times p = PWM/65536.", "gf");
  record.field("c01", map.c01, "Times v = V/4.2.", "gf");
  record.field("c20", map.c20, "Times p^2.", "gf");
  record.field("c11", map.c11, "Times p v.", "gf");
}

void describe_model_effect(Record& record, const stability::EffectSpec& effect) {
  record.field("effect", effect.name, "Name in model files.");
  record.field("parameters", effect.parameters, "As in the file; units stand in the names.");
  record.may("vehicle", stated_or_null(effect.vehicle), "The one vehicle that has it; absent: all.");
}

// --- certificates ---

void describe_stated_bound(Record& record, const StatedBound& bound) {
  record.may("function", bound.function, "network, phi:KIND, rho:KIND or set:PHI:RHO.");
  record.may("rho", bound.rho, "Kind of vehicle, of a bound for several moving neighbours.");
  record.may("domain", bound.domain, "global: all inputs, or box.");
  record.may("block", bound.block, "Inputs that change.");
  record.may("law", bound.law, "What moves.");
  record.may("norm", bound.norm, "l2 or weighted_l2.");
  record.may("scale", bound.scale, "Units of the inputs in the weighted norm, hex floats; empty: l2.");
  record.may("unit", bound.unit, "Output per input.");
  record.may("upper", bound.upper, "Lipschitz constant.", "", "stated upper bound");
  record.may("upper_method", bound.upper_method, "How it was proved.");
  record.may("lower", bound.lower, "Slope between two points; null: none was found.", "",
             "stated lower bound");
  record.may("neighbours", bound.neighbours, "Most neighbours of each kind.");
  record.may("status", bound.status, "finished or interrupted; bounds hold in either case.");
}

void describe_stated_gains(Record& record, const StatedGains& row) {
  record.field("loop", row.loop, "continuous or sampled.");
  record.object("gains", "null: not certified.", [&](Record& gains) {
    gains.field("rate", row.rate, "", "m per N/s", "stated upper bound");
    gains.field("amplitude", row.amplitude, "", "m per N", "stated upper bound");
    gains.field("edge", row.edge, "", "m per N", "stated upper bound");
    gains.field("impulse", row.impulse, "", "m per N s", "stated upper bound");
  });
  record.may("axis", row.axis, "x, y or z.");
  record.may("input", row.input, "Where the disturbance enters.");
}

void describe_left_out_loop(Record& record, const LeftOutLoop& row) {
  record.field("axis", row.axis, "x, y or z.");
  record.field("input", row.input, "Where the disturbance enters: force, command, velocity or position.");
  record.field("loop", row.loop, "continuous or sampled.");
  record.field("why", row.why, "Why it is not certified.");
}

// --- logs ---

void describe_signal(Record& record, const logs::SignalInfo& signal) {
  const bool is_missing = signal.source == logs::SignalInfo::Source::kMissing;
  record.field("name", signal.name, "");
  record.field("source", signal.source, "");
  record.field("from", is_missing ? std::nullopt : std::optional(signal.from),
               "Columns, or how it is derived; null: missing.");
  record.field("unit", signal.unit, "Of the stored columns or of the derived signal.");
  record.field("rate_hz", is_missing ? std::nullopt : std::optional(signal.rate_hz),
               "Of the records that contain it; null: missing.", "Hz");
  record.field("noise", signal.noise, "Standard deviation, in SI units; null: not estimated.", "",
               "estimate");
  record.field("odds_bits", signal.odds_bits,
               "Evidence for what the columns were taken as, over runner_up; null where names are known.",
               "bits");
  record.field("runner_up", stated_or_null(signal.runner_up), "What else the columns could be.");
}

void describe_missing(Record& record, const logs::MissingSignal& missing) {
  record.field("signal", missing.signal, "");
  record.field("for", missing.needed_for, "What it would make possible.");
  record.field("log_this", missing.log_this, "Lines for the vehicle's logging configuration.");
}

void describe_phase(Record& record, const logs::Phase& phase) {
  record.field("phase", phase.name, "ground, takeoff, flight or landing.");
  record.field("start_s", phase.start_s, "On the log's clock.", "s");
  record.field("end_s", phase.end_s, "", "s");
}

void describe_event(Record& record, const logs::LogEvent& event) {
  record.field("event", event.kind, "impact, dropout, wrap, saturation or limit cycle.");
  record.field("time_s", event.time_s, "On the log's clock.", "s");
  record.field("duration_s", event.duration_s, "", "s");
  record.field("what", event.what, "In words.");
}

void describe_signal_delay(Record& record, const logs::SignalDelay& delay) {
  record.field("signal", delay.signal, "");
  record.field("against", delay.against, "Another signal that shows the same motion.");
  record.field("delay_s", delay.delay_s, "Positive: signal lags.", "s", "estimate");
  record.field("correlation", delay.correlation, "At this delay.");
}

void describe_repaired(Record& record, const logs::Repaired& repaired) {
  record.field("unsorted_rows", repaired.unsorted_rows, "Sorted by time.");
  record.field("repeated_rows", repaired.repeated_rows,
               "Same time and values as another one, which is kept.");
  record.field("unwrapped_clocks", repaired.unwrapped_clocks, "Wraps of a counter or a time of day.");
  record.field("merged_blocks", repaired.merged_blocks, "Log blocks of other rates than the records.");
  record.field("journal_pages", repaired.journal_pages,
               "Pages that a recorder left in the journal of its database (-wal).");
}

void describe_left_out(Record& record, const logs::LeftOut& left_out) {
  record.field("name", left_out.name, "Of the topic, message or field.");
  record.field("records", left_out.records, "Number left out; 0: a part of each.");
  record.field("why", left_out.why, "In words.");
}

void describe_health(Record& record, const logs::LogHealth& health) {
  record.field("sound", logs::is_sound(health), "Nothing is damaged; pauses are no damage.");
  record.field("blocks", health.blocks, "Valid blocks with a checksum.");
  record.field("damaged_blocks", health.damaged_blocks, "Places where nothing valid could be read.");
  record.field("skipped_bytes", health.skipped_bytes, "There, and after the last whole record.");
  record.field("damaged_lines", health.damaged_lines, "Without one number per column.");
  record.field("not_finite", health.not_finite, "Records dropped because a value is NaN or infinite.");
  record.field("clock_jumps", health.clock_jumps, "Records dropped because their time does not follow.");
  record.field("gaps", health.gaps, "Pauses.");
  record.field("longest_gap_s", health.longest_gap_s, "", "s");
  record.field("truncated", health.truncated, "Whether the file ends inside a block, record or line.");
  record.field("checksum_failed", health.checksum_failed, "Of the whole file; its records are kept.");
}

void describe_grouped_flight(Record& record, const residuals::FlightFiles& flight) {
  record.field("name", flight.name, "Of the flight.");
  record.field("why", flight.why, "Why these logs are one flight.");
  record.list("logs", flight.logs, "One per vehicle.", [](Record& r, const auto& log) {
    r.field("vehicle", log.first, "");
    r.field("file", log.second, "");
  });
}

}  // namespace

LogFile log_file(const std::string& path, logs::Log log) {
  LogFile file;
  file.file = path;
  file.story = logs::tell(log);
  file.doubts = logs::doubts_of(log);
  file.lost_share = logs::lost_share(log);
  if (!log.samples.empty()) {
    file.t0_s = log.samples.front().time_us * 1e-6;
    file.t1_s = log.samples.back().time_us * 1e-6;
  }
  log.samples = {};
  file.log = std::move(log);
  return file;
}

std::vector<const LogFile*> logs_of(const InspectResult& result) {
  std::vector<const LogFile*> logs;
  for (const InspectedFile& file : result.files)
    if (const auto* log = std::get_if<LogFile>(&file)) logs.push_back(log);
  return logs;
}

std::vector<std::string> force_axes(const logs::Signals& signals) {
  std::vector<std::string> axes;
  for (std::size_t k = 0; k < 3; ++k)
    if (signals.force_axes[k]) axes.emplace_back(1, "xyz"[k]);
  return axes;
}

std::vector<std::string> torque_axes(const logs::Signals& signals) {
  if (signals.torque == logs::TorqueUse::kNone) return {};
  return {"x", "y", "z"};
}

const char* name(logs::TorqueUse use) {
  static constexpr const char* kWords[] = {"none", "mean in slow flight", "dynamic"};
  return kWords[static_cast<std::size_t>(use)];
}

void describe(Record& record, const UnreadableFile& unreadable) {
  describe_file_and_kind(record, unreadable.file, "unreadable", "It cannot be read.");
  record.field("reason", unreadable.reason, "What is wrong, and where.");
}

void describe(Record& record, const NetworkFile& file) {
  const files::Network& network = file.network;
  describe_file_and_kind(record, file.file, "network", "A network or weight file.");
  record.object("output", "Empty: not stated.", [&](Record& output) {
    output.field("quantity", network.output_quantity, "force_z, force or torque.");
    output.field("unit", network.output_unit, "");
  });
  record.object_or_null(network.gamma.has_value(), "gamma", "null: not stated.", [&](Record& gamma) {
    describe_gamma(gamma, network.gamma.value_or(files::GammaStatement{}));
  });
  record.field("silent", files::silent_compositions(network),
               "Compositions of vehicles in which there is no network.");
  record.object("input", "As network.toml states it.", [&](Record& input) {
    input.field("order", network.input_order, "Names of the inputs, with their units.");
    input.object_or_null(network.clamp.has_value(), "clamp", "null: none.", [&](Record& clamp) {
      const files::InputClamp sides = network.clamp.value_or(files::InputClamp{});
      clamp.field("lower", sides.lower, "");
      clamp.field("upper", sides.upper, "");
    });
  });
  record.entries("networks", named_parts(network), "By function: network, phi:KIND or rho:KIND.",
                 describe_weights);
}

void describe(Record& record, const ModelFile& file) {
  const stability::Model& model = file.model;
  describe_file_and_kind(record, file.file, "model", "A model of a vehicle.");
  record.object("vehicle", "", [&](Record& vehicle) {
    vehicle.field("kind", model.kind, "");
    vehicle.field("mass_kg", model.mass_kg, "", "kg");
    vehicle.field("inertia_kg_m2", model.inertia_kg_m2, "Diagonal, body axes.", "kg m^2");
    vehicle.field("arm_m", model.arm_m, "Mean distance of the rotors from the centre.", "m");
    vehicle.field("torque_per_thrust_m", model.torque_per_thrust_m, "Yaw torque of a rotor.", "m");
    vehicle.object("thrust", "Force of one rotor, by its command and the battery's voltage.",
                   [&](Record& thrust) { describe_thrust_map(thrust, model.thrust); });
  });
  record.list("effects", model.effects, "In the order of the file.", describe_model_effect);
}

void describe(Record& record, const CertificateFile& certificate) {
  describe_file_and_kind(record, certificate.file, "certificate",
                         "A certificate of a network; not checked here.");
  record.list("bounds", certificate.bounds, "What it states.", describe_stated_bound);
}

void describe(Record& record, const TrackingCertificateFile& certificate) {
  describe_file_and_kind(record, certificate.file, "tracking_certificate",
                         "A certificate of the gains of position loops; not checked here.");
  record.list("loops", certificate.loops, "The gains of every loop, as stated.", describe_stated_gains);
  record.list("left_out", certificate.left_out, "Loops that it says nothing about.", describe_left_out_loop);
}

void describe(Record& record, const LogFile& file) {
  const logs::Log& log = file.log;
  const logs::FlightStory& story = file.story;
  describe_file_and_kind(record, file.file, "log", "A flight log of one vehicle.");
  record.field("format", log.format, "usd, csv, ulog, ..., with its version.");
  record.field("channels", log.channels, "As the file names them.");
  record.field("records", log.health.records, "That are kept.");
  record.field("t0_s", file.t0_s, "First time, on the log's clock.", "s");
  record.field("t1_s", file.t1_s, "Last time.", "s");
  record.field("epoch_s", log.epoch_s, "From 1970 to time 0 of the log; 0: unknown.", "s");
  record.field("in_the_air_s", story.air_s, "", "s", "estimate");
  record.field("no_flight", stated_or_null(story.no_flight), "Why it is no flight; null: it is one.");
  record.list("signals", log.sources, "Where each signal comes from.", describe_signal);
  record.object("judged", "Axes along which a force and a torque can be judged.", [&](Record& judged) {
    judged.field("force", force_axes(log.signals), "Axes of the world.");
    judged.field("torque", torque_axes(log.signals), "Axes of the body.");
  });
  record.field("judged_torque", name(log.signals.torque), "none, mean in slow flight or dynamic.");
  record.field(
      "hover_command", log.hover_command,
      "Mean command of a motor that carries the weight; 0: none ran; null: thrust has another source.", "",
      "estimate");
  record.list("missing", story.missing, "Signals to log next time.", describe_missing);
  record.list("phases", story.phases, "In order of time.", describe_phase);
  record.list("events", story.events, "In order of time.", describe_event);
  record.list("delays", log.delays, "Between signals that show the same motion.", describe_signal_delay);
  record.may_object(story.battery_first_V > 0, "battery", "In the air; absent: not logged.", [&](Record& r) {
    r.field("first_V", story.battery_first_V, "", "V");
    r.field("last_V", story.battery_last_V, "", "V");
    r.field("least_V", story.battery_least_V, "", "V");
  });
  record.field("interpretation", log.interpretation,
               "What was decided from the data rather than from names, and why.");
  record.field("completeness", logs::completeness_of(log.health),
               "Whether everything that the vehicle logged is there. cut: the recording ends early or has "
               "pauses in which the vehicle could not write, and the rest is sound.");
  record.field("lost_share", file.lost_share, "Of the records; null: it cannot be counted.");
  record.object("repaired", "Without loss.", [&](Record& r) { describe_repaired(r, log.health.repaired); });
  record.list("left_out", log.left_out, "What the reader of the format did not pass on.", describe_left_out);
  record.object("health", "Damage, which is skipped and counted.",
                [&](Record& r) { describe_health(r, log.health); });
  record.field("plausibility", file.doubts, "Values that no flight has.");
}

void describe(Record& record, const InspectResult& result) {
  record.field("files", result.files, "One entry per file; its fields depend on kind.");
  record.may_fields(!result.found.flights.empty(), [&](Record& r) {
    r.list("flights", result.found.flights, "Logs that are one flight.", describe_grouped_flight);
    r.field("skipped", result.found.skipped, "Files in the folders that are no logs.");
  });
  record.may("collections", result.collections.empty() ? std::nullopt : std::optional(result.collections),
             "Per folder: logs, how many can be judged along which axis, and why others cannot.");
}

}  // namespace swarmcert::analysis

namespace swarmcert::logs {

void describe(files::Record& record, SignalInfo::Source source) {
  record.choice(source, {"measured", "derived", "missing"});
}

void describe(files::Record& record, Completeness completeness) {
  record.choice(completeness, {"complete", "cut", "damaged"});
}

}  // namespace swarmcert::logs
