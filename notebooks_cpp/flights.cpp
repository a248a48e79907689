#include "notebooks_cpp/flights.h"

#include <filesystem>
#include <memory>

#include "nn/base/file_io.h"
#include "stability/model.h"
#include "stability/simulation/simulate.h"

namespace swarmcert::notebook {

void simulate_flights(const std::string& truth, int vehicles, int runs, double duration_s,
                      const std::string& folder) {
  const stability::Gains gains = stability::load_gains("controller/gains/crazyflie-small.toml");
  for (int run = 1; run <= runs; ++run) {
    const auto seed = static_cast<std::uint64_t>(run);
    stability::Swarm swarm(stability::read_model(truth), vehicles);
    swarm.assume_lag(gains.motor_lag_s, gains.delay_s);
    stability::SimulationOptions options;
    options.loop.noise = true;
    options.loop.seed = seed;
    const std::unique_ptr<stability::Task> task =
        stability::make_task("random-walk", {vehicles, duration_s, seed});
    const stability::Simulation flown = stability::simulate(swarm, gains, *task, options);
    const std::filesystem::path path = std::filesystem::path(folder) / std::to_string(run);
    std::filesystem::create_directories(path);
    for (std::size_t i = 0; i < flown.logs.size(); ++i) {
      files::write_file((path / ("cf" + std::to_string(i + 1) + "_00")).string(),
                        stability::to_usd_log(flown.logs[i]), true);
    }
  }
}

}  // namespace swarmcert::notebook
