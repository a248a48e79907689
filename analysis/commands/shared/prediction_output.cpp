#include "analysis/commands/shared/prediction_output.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include "analysis/cli/command.h"
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

files::Json json_of_horizon(const HorizonErrors& errors) {
  const auto at = [&errors](int step) {
    const double value = errors.at(step);
    return std::isfinite(value) ? files::Json(value) : files::Json();
  };
  return {{"h1", at(1)}, {"h10", at(10)}, {"h50", at(50)}, {"sum", errors.sum()}};
}

void add_quantities(const PredictionErrors& errors, bool by_step, files::Json& json) {
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    json[kQuantities[k].key] = json_of_horizon(errors[k]);
    if (by_step) json[kQuantities[k].key]["by_step"] = errors[k].mean;
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

files::Json json_of(const std::vector<FlightPrediction>& flights) {
  const PredictionErrors errors = residuals::mean_errors(flights, &FlightPrediction::errors);
  const std::size_t steps = errors[0].mean.size();
  if (steps == 0) return nullptr;
  files::Json json = {{"steps", steps}, {"step_s", nullptr}, {"starts", 0}};
  add_quantities(errors, true, json);
  json["held"] = files::Json::object();
  add_quantities(residuals::mean_errors(flights, &FlightPrediction::held), false, json["held"]);
  std::size_t starts = 0;
  json["flights"] = files::Json::array();
  for (const FlightPrediction& flight : flights) {
    files::Json entry = {{"file", flight.path}, {"starts", flight.starts}};
    if (!flight.refused.empty()) {
      entry["refused"] = flight.refused;
    } else {
      entry["torque"] = flight.has_torque;
      add_quantities(flight.errors, false, entry);
      starts += flight.starts;
      if (flight.errors[0].mean.size() == steps && json["step_s"].is_null()) json["step_s"] = flight.step_s;
    }
    json["flights"].push_back(std::move(entry));
  }
  json["starts"] = starts;
  return json;
}

void print_prediction(const files::Json& prediction) {
  if (prediction.is_null()) {
    fmt::print("\nNo flight could be predicted: that takes position, velocity, attitude and rates.\n");
    return;
  }
  const double step_s = prediction["step_s"].get<double>();
  const int steps = prediction["steps"].get<int>();
  fmt::print("\nPredicted from {} measured states, {} steps of {:.3g} ms\n", prediction["starts"].get<long>(),
             steps, 1000 * step_s);
  fmt::print("  {:18}  after {:.3g} s   mean of all steps   nothing changes\n", "", steps * step_s);
  for (const QuantityName& quantity : kQuantities) {
    const files::Json& errors = prediction[quantity.key];
    fmt::print("  {:18}  {:10.4g}   {:17.4g}   {:15.4g}\n",
               fmt::format("{} [{}]", quantity.words, quantity.unit), errors["by_step"].back().get<double>(),
               errors["sum"].get<double>() / steps,
               prediction["held"][quantity.key]["sum"].get<double>() / steps);
  }
  for (const files::Json& flight : prediction["flights"]) {
    if (flight.contains("refused"))
      fmt::print("  {}: {}\n", flight["file"].get<std::string>(), flight["refused"].get<std::string>());
    else if (!flight["torque"].get<bool>())
      fmt::print("  {}: without the force of each rotor, rates are held\n",
                 flight["file"].get<std::string>());
  }
}

void add_prediction(Report& report, const files::Json& prediction) {
  if (prediction.is_null()) return;
  report.heading("Prediction");
  std::string data;
  for (std::size_t h = 0; h < prediction["steps"].get<std::size_t>(); ++h) {
    data += fmt::format("{}", static_cast<double>(h + 1) * prediction["step_s"].get<double>());
    for (const QuantityName& quantity : kQuantities)
      data += fmt::format(" {}", prediction[quantity.key]["by_step"][h].get<double>());
    data += "\n";
  }
  std::string script = "set xlabel 'horizon [s]'\nset ylabel 'mean error'\nset logscale y\nplot ";
  for (std::size_t k = 0; k < kQuantities.size(); ++k) {
    script += fmt::format("{}'prediction.dat' using 1:{} with lines title '{} [{}]'", k == 0 ? "" : ", ",
                          k + 2, kQuantities[k].words, kQuantities[k].unit);
  }
  report.figure("prediction", data, script + "\n",
                "Error of the multi-step prediction over its horizon: mean over all measured states.");
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
