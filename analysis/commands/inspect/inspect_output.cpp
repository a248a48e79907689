#include "analysis/commands/inspect/inspect_output.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>
#include <map>
#include <utility>

#include "analysis/cli/counted.h"
#include "analysis/gate/text.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

constexpr std::size_t kMostEvents = 60;

/// A certificate that nothing has checked may hold control characters.
void print_untrusted(Table rows) {
  for (std::vector<std::string>& row : rows.rows)
    for (std::string& text : row) text = gate::printable(text);
  fmt::print("{}", to_text(rows));
}

void print_of(const UnreadableFile&) {}

void print_of(const NetworkFile& file) {
  const files::Network& network = file.network;
  const files::Node node = files::record_of(file);
  if (!network.path.empty()) {
    fmt::print("{}: output {} in {}", network.path,
               network.output_quantity.empty() ? "not stated" : network.output_quantity,
               network.output_unit.empty() ? "no stated unit" : network.output_unit);
    if (network.gamma)
      fmt::print("; gamma {} {} per {}",
                 analysis::cell(*node.find("gamma.mode")) == "clip" ? "at most" : "equal to",
                 network.gamma->value, analysis::cell(*node.find("gamma.scope")));
    fmt::print("\n");
    for (std::size_t k = 0; k < network.input_order.size(); ++k) {
      fmt::print("  input {}: {}", k, network.input_order[k]);
      if (network.clamp)
        fmt::print(", clamped to {} .. {}", network.clamp->lower[k], network.clamp->upper[k]);
      fmt::print("\n");
    }
    for (const std::string& composition : files::silent_compositions(network))
      fmt::print("  silent: {}\n", composition);
  }
  for (const auto& [part, weights] : files::parts(network)) {
    fmt::print("{}: {} {}, sha256 {}\n", weights->path, part.name(), files::name(weights->precision),
               weights->sha256);
    for (const files::Layer& layer : weights->layers)
      fmt::print("  {:<10} {} -> {}{}\n", layer.name, layer.inputs, layer.outputs,
                 &layer == &weights->layers.back() ? "" : ", " + files::op_after(layer));
    for (const std::string& note : weights->notes) fmt::print("  {}\n", note);
  }
}

void print_of(const ModelFile& file) {
  const stability::Model& model = file.model;
  fmt::print("{}: model of kind {}: {} kg, arm {} m, at most {:.3f} N per rotor\n", file.file, model.kind,
             model.mass_kg, model.arm_m, model.thrust.largest_N(stability::kFullBattery_V));
  const files::Node node = files::record_of(file);
  fmt::print("{}", model.effects.empty()
                       ? "  no effects\n"
                       : to_text(table(*node.find("effects"), {{"effect"}, {"vehicle?"}, {"parameters"}})));
}

void print_of(const CertificateFile& certificate) {
  fmt::print("{}: certificate, not checked here ('swarmcert check' does)\n", certificate.file);
  print_untrusted(table(*files::record_of(certificate).find("bounds"), {{"function?"},
                                                                        {"rho?"},
                                                                        {"neighbours?"},
                                                                        {"block?"},
                                                                        {"domain?"},
                                                                        {"law?"},
                                                                        {"upper?", "", "{:.10g}"},
                                                                        {"upper_method?", "method"},
                                                                        {"lower?", "witnessed", "{:.10g}"},
                                                                        {"unit?"}}));
}

void print_of(const TrackingCertificateFile& certificate) {
  fmt::print("{}: certificate of tracking gains, not checked here ('swarmcert check' does)\n",
             certificate.file);
  constexpr const char* kDigits = "{:.10g}";
  print_untrusted(table(*files::record_of(certificate).find("loops"), {{"axis?"},
                                                                       {"input?"},
                                                                       {"loop"},
                                                                       {"gains.rate", "", kDigits},
                                                                       {"gains.amplitude", "", kDigits},
                                                                       {"gains.edge", "", kDigits},
                                                                       {"gains.impulse", "", kDigits}}));
  if (!certificate.left_out.empty())
    fmt::print("  without a certificate: {} loops\n", certificate.left_out.size());
}

void print_of(const LogFile& file) {
  fmt::print("{}: flight log\n", file.file);
  for (const std::string& sentence : sentences_on(file)) fmt::print("  {}\n", sentence);
  for (const Table& rows : tables_on(files::record_of(file))) fmt::print("{}", to_text(rows));
}

/// "damaged, 3.1 % lost; repaired: 12 unsorted rows"
std::string completeness_in_words(const LogFile& file) {
  std::string words = analysis::cell(files::record_of(logs::completeness_of(file.log.health)));
  if (file.lost_share > 0) words += fmt::format(", {:.2g} % lost", 100 * file.lost_share);
  const logs::Repaired& repaired = file.log.health.repaired;
  std::string list;
  for (const auto& [count, what] : {std::pair(repaired.unsorted_rows, "unsorted rows"),
                                    std::pair(repaired.repeated_rows, "repeated rows"),
                                    std::pair(repaired.unwrapped_clocks, "wraps of the clock"),
                                    std::pair(repaired.merged_blocks, "log blocks of other rates"),
                                    std::pair(repaired.journal_pages, "pages from the journal")})
    if (count > 0) list += fmt::format("{}{} {}", list.empty() ? "; repaired: " : ", ", count, what);
  return words + list;
}

std::string axes_in_words(const std::vector<std::string>& axes) {
  return axes.empty() ? "none" : fmt::format("{}", fmt::join(axes, " "));
}

}  // namespace

void print_file(const InspectedFile& file) {
  std::visit([](const auto& held) { print_of(held); }, file);
}

Table log_list(const std::vector<const LogFile*>& logs) {
  files::Node list;
  for (const LogFile* const log : logs) list.members.push_back(files::record_of(*log));
  return table(list, {{"file", "log"},
                      {"format"},
                      {"records"},
                      {"in_the_air_s", "in the air", "{:.1f}"},
                      {"judged.force"},
                      {"judged_torque", "torque"},
                      {"no_flight"}});
}

std::vector<std::string> sentences_on(const LogFile& file) {
  const logs::Log& log = file.log;
  const logs::FlightStory& story = file.story;
  std::vector<std::string> sentences = {
      fmt::format("{}, {} records from {:.3f} to {:.3f} s, {:.1f} s in the air", log.format,
                  log.health.records, file.t0_s, file.t1_s, story.air_s)};
  if (!story.no_flight.empty()) sentences.push_back("no flight: " + story.no_flight);
  sentences.push_back(completeness_in_words(file));
  for (const std::string& finding : logs::findings(log.health)) sentences.push_back(finding);
  for (const logs::Doubt& doubt : file.doubts) sentences.push_back("implausible: " + doubt.words);
  for (const std::string& words : log.interpretation) sentences.push_back("seen: " + words);
  for (const logs::SignalDelay& delay : log.delays)
    sentences.push_back(fmt::format("{} is {:.0f} ms {} {}", delay.signal, 1000 * std::abs(delay.delay_s),
                                    delay.delay_s < 0 ? "ahead of" : "behind", delay.against));
  if (story.battery_first_V > 0)
    sentences.push_back(fmt::format("battery in the air {:.2f} to {:.2f} V, least {:.2f} V",
                                    story.battery_first_V, story.battery_last_V, story.battery_least_V));
  sentences.push_back(fmt::format("can be judged: force {}; torque {} ({})",
                                  axes_in_words(force_axes(log.signals)),
                                  axes_in_words(torque_axes(log.signals)), name(log.signals.torque)));
  return sentences;
}

std::vector<Table> tables_on(const files::Node& log) {
  const auto rows = [&log](const char* list, const std::vector<Column>& columns) {
    return table(*log.find(list), columns);
  };
  std::vector<Table> tables = {
      rows("signals", {{"name", "signal"},
                       {"source"},
                       {"rate_hz", "rate", "{:.1f}"},
                       {"unit"},
                       {"noise", "", "{:.2g}"},
                       {"odds_bits", "odds", "{:.0f}"},
                       {"runner_up", "against"},
                       {"from"}}),
      rows("missing", {{"for", "to judge"}, {"signal", "the log lacks"}, {"log_this", "log next time"}}),
      rows("left_out", {{"name", "left out"}, {"records"}, {"why"}}),
      rows("phases", {{"phase"}, {"start_s", "from", "{:.2f}"}, {"end_s", "to", "{:.2f}"}}),
      rows("events", {{"event"}, {"time_s", "at", "{:.2f}"}, {"duration_s", "for", "{:.3f}"}, {"what"}})};
  std::vector<std::vector<std::string>>& events = tables.back().rows;
  if (events.size() > kMostEvents) {
    const std::string more = fmt::format("{} more, all in --json", events.size() - kMostEvents);
    events.resize(kMostEvents);
    events.push_back({"...", "", "", more});
  }
  std::vector<Table> filled;
  for (Table& one : tables)
    if (!one.rows.empty()) filled.push_back(std::move(one));
  return filled;
}

void print_grouping(const residuals::FoundFlights& found) {
  if (found.flights.empty()) return;
  std::map<std::string, std::size_t> reasons;
  for (const residuals::FlightFiles& flight : found.flights) {
    ++reasons[flight.why];
    if (flight.logs.size() < 2) continue;
    fmt::print("one flight, {}: {} of {} vehicles\n", flight.why, flight.name, flight.logs.size());
  }
  for (const auto& [why, count] : reasons) fmt::print("{}: {}\n", counted(count, "flight"), why);
  if (reasons["one file"] > 1)
    fmt::print(
        "(If some of these vehicles flew together, effects of neighbours need their logs as one flight: name "
        "them [<prefix>_]cf<id>_<run>, or group them in a flights.toml.)\n");
  if (!found.skipped.empty())
    fmt::print("Skipped, no flight logs: {}\n", counted(found.skipped.size(), "file"));
}

}  // namespace swarmcert::analysis
