#include "analysis/commands/shared/tracking_input.h"

namespace swarmcert::analysis {

void declare_tracking(CLI::App& app, TrackingArguments& arguments) {
  app.add_option("--gains", arguments.gains, "gains.toml: position gains, loop rate, lags")->required();
  app.add_option("--model", arguments.model, "model.toml of the vehicle")->required();
  app.add_option("--battery", arguments.battery_V, "Battery voltage, for the largest thrust (default 4.2)")
      ->check(CLI::PositiveNumber);
}

Tracking load_tracking(const TrackingArguments& arguments) {
  Tracking tracking = stability::load_flown_loop(arguments.gains, arguments.model, arguments.battery_V);
  const std::string problem = stability::battery_problem(tracking.model, arguments.battery_V);
  if (!problem.empty()) throw UsageError("--battery: " + problem);
  return tracking;
}

stability::DisturbanceSource load_disturbance_file(const std::string& path) {
  stability::DisturbanceSource source;
  if (!path.empty()) stability::read_disturbance_file(path, source);
  if (source.kind == "none") declare_no_class(source);
  return source;
}

}  // namespace swarmcert::analysis
