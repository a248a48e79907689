#include "analysis/commands/shared/prediction_output.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include "analysis/cli/command.h"
#include "analysis/report/report_drawing.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

using residuals::FlightPrediction;
using residuals::HorizonErrors;
using residuals::PredictionErrors;

struct QuantityName {
  const char *key, *words, *unit;
};
constexpr std::array<QuantityName, residuals::kNumErrors> kQuantities = {
    {{"position_m", "position", "m"},
     {"velocity_m_s", "velocity", "m/s"},
     {"rotation_rad", "rotation", "rad"},
     {"rate_rad_s", "body rate", "rad/s"}}};

void describe_quantities(files::Record& record, const PredictionErrors& errors, bool by_step) {
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    const HorizonErrors& of = errors[k];
    record.object(kQuantities[k].key, "Mean of the norm of the error.", [&](files::Record& r) {
      r.field("h1", of.at(1), "After one step.");
      r.field("h10", of.at(10), "After ten.");
      r.field("h50", of.at(50), "After fifty.");
      r.field("sum", of.sum(), "Of all steps.");
      if (by_step) r.field("by_step", of.mean, "After 1, 2, ... steps.");
    });
  }
}

/// Returns the header of an .npy file, format version 1.0, whose length is a multiple of 64.
std::string npy_header(std::size_t starts, std::size_t steps) {
  std::string text = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, {}), }}",
                                 starts, steps, residuals::kPredictedNumbers);
  constexpr std::size_t kPrefix = 10, kAlign = 64;
  text.append((kAlign - (kPrefix + text.size() + 1) % kAlign) % kAlign, ' ');
  text += '\n';
  std::string header = "\x93NUMPY\x01";
  header += '\0';
  header += static_cast<char>(text.size() & 0xff);
  header += static_cast<char>(text.size() >> 8);
  return header + text;
}

std::string npy_of(const FlightPrediction& flight) {
  static_assert(sizeof(float) == 4);
  const std::size_t steps = flight.errors[0].mean.size();
  std::string bytes = npy_header(flight.states.size() / steps / residuals::kPredictedNumbers, steps);
  bytes.append(reinterpret_cast<const char*>(flight.states.data()), flight.states.size() * sizeof(float));
  return bytes;
}

}  // namespace

std::optional<Prediction> prediction_of(std::vector<FlightPrediction> flights) {
  Prediction prediction;
  prediction.errors = residuals::mean_errors(flights, &FlightPrediction::errors);
  if (prediction.steps() == 0) return std::nullopt;
  prediction.held = residuals::mean_errors(flights, &FlightPrediction::held);
  for (const FlightPrediction& flight : flights) {
    if (!flight.refused.empty()) continue;
    prediction.starts += flight.starts;
    if (flight.errors[0].mean.size() == prediction.steps() && prediction.step_s == 0)
      prediction.step_s = flight.step_s;
  }
  prediction.flights = std::move(flights);
  return prediction;
}

void describe(files::Record& record, const Prediction& prediction) {
  record.field("steps", prediction.steps(), "");
  record.field("step_s", prediction.step_s, "", "s");
  record.field("starts", prediction.starts, "Measured states from which was predicted.");
  describe_quantities(record, prediction.errors, true);
  record.object("held", "The same of a prediction that nothing changes.",
                [&](files::Record& r) { describe_quantities(r, prediction.held, false); });
  record.list("flights", prediction.flights, "", [](files::Record& r, const FlightPrediction& flight) {
    const bool is_refused = !flight.refused.empty();
    r.field("file", flight.path, "");
    r.field("starts", flight.starts, "");
    r.may("refused", is_refused ? std::optional(flight.refused) : std::nullopt, "Why nothing was predicted.");
    r.may("torque", is_refused ? std::nullopt : std::optional(flight.has_torque),
          "The log gives the force of each rotor; otherwise rates are held.");
    r.may_fields(!is_refused,
                 [&](files::Record& inner) { describe_quantities(inner, flight.errors, false); });
  });
}

void print_prediction(const std::optional<Prediction>& prediction) {
  if (!prediction) {
    fmt::print("\nNo flight could be predicted: that takes position, velocity, attitude and rates.\n");
    return;
  }
  const auto steps = static_cast<double>(prediction->steps());
  fmt::print("\nPredicted from {} measured states, {} steps of {:.3g} ms\n", prediction->starts,
             prediction->steps(), 1000 * prediction->step_s);
  fmt::print("  {:18}  after {:.3g} s   mean of all steps   nothing changes\n", "",
             steps * prediction->step_s);
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    fmt::print("  {:18}  {:10.4g}   {:17.4g}   {:15.4g}\n",
               fmt::format("{} [{}]", kQuantities[k].words, kQuantities[k].unit),
               prediction->errors[k].mean.back(), prediction->errors[k].sum() / steps,
               prediction->held[k].sum() / steps);
  }
  for (const FlightPrediction& flight : prediction->flights) {
    if (!flight.refused.empty())
      fmt::print("  {}: {}\n", flight.path, flight.refused);
    else if (!flight.has_torque)
      fmt::print("  {}: without the force of each rotor, rates are held\n", flight.path);
  }
}

void add_prediction(Report& report, const std::vector<NamedPrediction>& named) {
  if (named.empty() || !named[0].prediction) return;
  const Prediction& first = *named[0].prediction;
  std::string data,
      script =
          "if (exists('narrow')) { set terminal svg size 400,1100 dynamic noenhanced font 'sans-serif,13'; "
          "set multiplot layout 4,1 } else { set multiplot layout 2,2 }\n"
          "set xlabel 'horizon [s]'\nset yrange [0:*]\n";
  const double horizon_s = static_cast<double>(first.steps()) * first.step_s;
  script += fmt::format("set xrange [0:{:.6g}]\nset xtics {:g}\n", horizon_s, tick_step(horizon_s));
  for (std::size_t h = 0; h < first.steps(); ++h) {
    data += fmt::format("{:.6g}", static_cast<double>(h + 1) * first.step_s);
    for (std::size_t k = 0; k < kQuantities.size(); ++k) {
      for (const NamedPrediction& one : named) {
        const bool has_step = one.prediction && h < one.prediction->steps();
        data += fmt::format(" {:.6g}", has_step ? one.prediction->errors[k].mean[h] : NAN);
      }
    }
    data += "\n";
  }
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    script += fmt::format("set ylabel '{} [{}]'\nplot ", kQuantities[k].words, kQuantities[k].unit);
    for (std::size_t i = 0; i < named.size(); ++i)
      script += fmt::format("{}'prediction.dat' using 1:{} with lines {}", i == 0 ? "" : ", ",
                            2 + k * named.size() + i,
                            named.size() == 1 ? "notitle" : fmt::format("title '{}'", named[i].name));
    script += "\n";
  }
  report.figure("prediction", data, script + "unset multiplot\n",
                fmt::format("Error of predictions against their horizon: means over {} measured states from "
                            "which the logged inputs were applied.",
                            first.starts),
                640);
}

void write_predictions(const std::vector<FlightPrediction>& flights, const std::string& folder,
                       bool overwrite) {
  namespace fs = std::filesystem;
  fs::create_directories(folder);
  std::set<std::string> names;
  for (const FlightPrediction& flight : flights) {
    if (flight.states.empty()) continue;
    const fs::path log(flight.path);
    const std::string name = (log.extension() == ".csv" ? log.stem() : log.filename()).string() + ".npy";
    if (!names.insert(name).second)
      throw UsageError("--predictions would write two flights to " + name +
                       ": predict them one after the other, into folders of their own");
    files::write_file((fs::path(folder) / name).string(), npy_of(flight), overwrite);
  }
}

}  // namespace swarmcert::analysis
