#include "analysis/gate/checks/force_unit.h"

#include <cmath>
#include <limits>

#include "stability/model.h"

namespace swarmcert::gate {

double force_scale(Evidence& evidence, const Limit& limit) {
  if (limit.unit_N == 0) return 1;
  const std::string& unit = evidence.flown().output_unit;
  if (unit.empty())
    throw Unfounded("network.toml states no output.unit, so a limit in " + limit.unit + " has no meaning");
  if (unit == limit.unit) return 1;
  if (unit != "gf" && unit != "N")
    throw Unfounded("the network's output is not a force: its unit is " + unit);
  return (unit == "gf" ? stability::kGramForce_N : 1.0) / limit.unit_N;
}

// The three roundings (gf in newton, the quotient, the product) have a relative error below 2^-51.
double round_up(double value) { return value + std::abs(value) * 0x1p-50; }
double round_down(double value) { return value - std::abs(value) * 0x1p-50; }

}  // namespace swarmcert::gate
