#include "stability/bounds/swarms/coupled_swarm.h"

#include <cmath>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/toml.h"
#include "stability/bounds/swarms/estimate_motion.h"

namespace swarmcert::stability {
namespace {

constexpr const char* kSwarmSchema = "swarmcert/swarm/1";
const std::vector<std::string> kDirections = {"apart", "together"};

void describe_coupling(files::Keys& keys) {
  keys.must<int>("on", "The vehicle that is disturbed, from 0.");
  keys.must<int>("by", "The other vehicle.");
  keys.may<double>("position_N_m", "Force per relative position.", "N/m");
  keys.may<double>("velocity_N_s_m", "Force per relative velocity.", "N s/m");
  keys.may<double>("speed_m_s", "Largest relative speed.", "m/s");
  keys.may<double>("acceleration_m_s2", "Largest relative acceleration.", "m/s^2");
  keys.may<double>("cross_rate_N_s", "Largest rate of what else the force depends on.", "N/s");
  keys.may("direction", "Of the force, where its sign is known.", "", files::OneOf{kDirections});
}

}  // namespace

void describe_swarm_file(files::Keys& keys) {
  keys.schema(kSwarmSchema);
  keys.must<int>("vehicles", "Number of vehicles.");
  keys.may_tables("coupling", "Who disturbs whom, and how much.", describe_coupling);
}

CoupledSwarm read_coupled_swarm(const std::string& path) {
  const std::string text = files::read_file(path);
  const auto document = files::parse_toml(text, path);
  const files::TomlTable top(document, path);
  top.require_schema(kSwarmSchema);
  top.allow_only(files::key_names(describe_swarm_file));
  const double vehicles = top.number("vehicles");
  if (!(vehicles >= 1 && vehicles <= 200) || vehicles != std::floor(vehicles)) {
    top.refuse("vehicles", decimals(vehicles), "must be a whole number from 1 to 200");
  }
  CoupledSwarm swarm;
  swarm.vehicles = static_cast<int>(vehicles);
  for (const files::TomlTable& table : top.tables("coupling")) {
    table.allow_only(files::key_names(describe_coupling));
    const auto vehicle = [&](const char* key) {
      const double value = table.number(key);
      if (!(value >= 0 && value < vehicles) || value != std::floor(value)) {
        table.refuse(key, decimals(value), "must be a vehicle from 0 to " + decimals(vehicles - 1));
      }
      return static_cast<int>(value);
    };
    const auto number = [&](const char* key) {
      const double value = table.has(key) ? table.number(key) : 0;
      if (value < 0) table.refuse(key, decimals(value), "must not be negative");
      return value;
    };
    Coupling c{vehicle("on"),           vehicle("by"),
               number("position_N_m"),  number("velocity_N_s_m"),
               number("speed_m_s"),     number("acceleration_m_s2"),
               number("cross_rate_N_s")};
    if (table.has("direction")) c.direction = table.choice("direction", kDirections) == 0 ? 1 : -1;
    if (c.on == c.by) table.refuse("by", std::to_string(c.by), "is the vehicle itself");
    swarm.couplings.push_back(c);
  }
  return swarm;
}

Disturbance no_force() {
  Disturbance none;
  none.amplitude_N = none.rate_N_s = none.variation_N = none.impulse_N_s = 0;
  return none;
}

CoupledVerdict couple(const CoupledSwarm& swarm, const FlownLoop& flown, const OtherErrors& others,
                      const Disturbance& force) {
  const std::optional<AxisLoop> loop = flown.continuous(2);
  if (!loop) throw std::invalid_argument("Lambda or K couples the z axis to others");
  const RateGains rate = rate_gains(*loop);
  const auto vehicles = static_cast<std::size_t>(swarm.vehicles);
  const std::vector<LoopGains> loops(vehicles, {rate.position, rate.velocity, rate.acceleration});
  CoupledVerdict verdict;
  verdict.of_estimates = estimate_motion(*loop, others);
  verdict.of_force = force_motion(*loop, force, others.bias_N);
  const OwnMotion own = {verdict.of_estimates.error_m + verdict.of_force.error_m,
                         verdict.of_estimates.speed_m_s + verdict.of_force.speed_m_s,
                         verdict.of_estimates.acceleration_m_s2 + verdict.of_force.acceleration_m_s2};
  verdict.small_gain = small_gain(loops, swarm.couplings, std::vector<OwnMotion>(vehicles, own));
  if (!verdict.small_gain.proved)
    verdict.unstable = find_unstable_swarm(*loop, swarm.vehicles, swarm.couplings);
  return verdict;
}

}  // namespace swarmcert::stability
