#include "stability/sweep/grid.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"
#include "nn/base/text.h"
#include "nn/base/toml.h"
#include "stability/bounds/declared_disturbance.h"

namespace swarmcert::stability {
namespace {

using files::TomlTable;

constexpr char kSchema[] = "swarmcert/grid/1";
constexpr double kMostCells = 1e7;
const std::vector<std::string> kScales = {"linear", "log"}, kAxisNames = {"x", "y", "z"};

std::vector<std::string> quantity_names() {
  std::vector<std::string> names;
  for (const Quantity& quantity : grid_quantities()) names.push_back(quantity.name);
  return names;
}

void describe_values_of_axis(files::Keys& keys) {
  keys.must<double>("from", "");
  keys.must<double>("to", "");
  keys.must<int>("steps", "Number of values.");
  keys.may("scale", "linear if absent.", "", files::OneOf{kScales});
}

void describe_limits_of(files::Keys& keys) {
  keys.may<double>("least", "");
  keys.may<double>("most", "");
}

GridAxis read_axis(const TomlTable& axes, const std::string& name) {
  const TomlTable table = axes.table(name);
  table.allow_only(files::key_names(describe_values_of_axis));
  const double from = table.number("from");
  const double to = table.number("to");
  const double steps = table.number("steps");
  if (!(steps >= 1) || steps > kMostCells || steps != std::floor(steps)) {
    table.refuse("steps", fmt::format("{:g}", steps), "must be a whole number from 1");
  }
  const bool is_log = table.has("scale") && table.choice("scale", kScales) == 1;
  for (const auto& [key, value] : {std::pair("from", from), std::pair("to", to)}) {
    if (value < 0) table.refuse(key, fmt::format("{:g}", value), "must not be negative");
    if (is_log && value == 0) table.refuse(key, "0", "must be positive on a log scale", "or omit scale");
  }
  GridAxis axis = {name, {}};
  for (int i = 0; i < static_cast<int>(steps); ++i) {
    const double share = steps > 1 ? i / (steps - 1) : 0;
    axis.values.push_back(is_log ? std::exp(std::log(from) + share * (std::log(to) - std::log(from)))
                                 : from + share * (to - from));
  }
  if (steps > 1) axis.values.back() = to;  // exactly
  const bool is_time = files::ends_with(name, "_s");
  if (is_time && to > 1) {
    table.refuse("to", fmt::format("{:g}", to), "is longer than 1 s",
                 "the value is in seconds: 20 ms are 0.02");
  }
  const bool is_count = name == "neighbours" || name == "vehicles";
  for (const double value : axis.values) {
    if (is_count && value != std::floor(value)) {
      table.refuse("steps", fmt::format("{:g}", steps), fmt::format("gives {:.3g} {}", value, name),
                   "choose steps that give whole numbers only");
    }
  }
  return axis;
}

std::vector<std::string> read_quantities(const TomlTable& top, const std::string& key) {
  const std::vector<std::string> known = quantity_names();
  std::vector<std::string> names = top.texts(key);
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      top.refuse(key, files::in_quotes(name), "is not a quantity", files::did_you_mean(name, known));
    }
  }
  if (names.empty()) top.refuse(key, "", "is empty", "name one of the quantities, e.g. \"amplitude\"");
  return names;
}

std::string beside(const std::string& grid, const std::string& file) {
  return (std::filesystem::path(grid).parent_path() / file).string();
}

Disturbance read_disturbance(const TomlTable& table, int axis) {
  table.allow_only(files::key_names(describe_classes));
  DisturbanceSource source;
  read_force_error(table, source);
  return source.axis[axis];
}

}  // namespace

long Grid::cells() const {
  long total = 1;
  for (const GridAxis& a : axes) total *= static_cast<long>(a.values.size());
  return total;
}

std::vector<double> Grid::at(long cell) const {
  std::vector<double> result(axes.size());
  for (std::size_t i = axes.size(); i-- > 0;) {
    const auto size = static_cast<long>(axes[i].values.size());
    result[i] = axes[i].values[static_cast<std::size_t>(cell % size)];
    cell /= size;
  }
  return result;
}

std::vector<std::string> grid_parameters() {
  return {"Kp",        "Kd",      "Ki",         "Lambda",  "K",       "mass_kg",           "thrust_scale",
          "battery_V", "motor_s", "attitude_s", "delay_s", "rate_hz", "integrator_step_s", "neighbours",
          "vehicles"};
}

const std::vector<Quantity>& grid_quantities() {
  static const std::vector<Quantity> all = {
      {"rate", "m per N/s", -1, "worst error per rate of force, |h|_1"},
      {"amplitude", "m/N", -1, "worst error per amplitude of force, |h'|_1"},
      {"edge", "m/N", -1, "worst error per variation of force, |h|_oo"},
      {"impulse", "m per N s", -1, "worst error per impulse, |h'|_oo"},
      {"error_m", "m", -1, "smallest bound for [disturbance], with the clamp"},
      {"lag_limit_s", "s", 1, "additional first-order lag that the loop tolerates"},
      {"delay_limit_s", "s", 1, "delay that the loop tolerates"},
      {"lag_floor", "m per N/s", -1, "error that remains with perfect feedforward, due to the lag"},
      {"effort", "N/N", -1, "feedback force per amplitude of force"},
      {"noise_command_m_s2", "m/s^2", -1, "jitter of the command for 1 mm and 0.05 m/s of noise"},
      {"noise_error_m", "m", -1, "error from the same noise"},
      {"spectral_radius", "1", -1, "of the sampled loop"},
      {"integral_authority_N", "N", 1, "constant force that the clamped integrator can cancel"},
      {"thrust_margin_N", "N", 1, "distance of the commanded thrust from its limits under [disturbance]"}};
  return all;
}

/// Returns why no vehicle of the grid can have `value` of the parameter `name`; empty if one can.
std::string parameter_problem(const Grid& grid, const std::string& name, double value) {
  constexpr double kLeast_hz = 1, kLargest_hz = 1e5;
  if (name == "battery_V") return battery_problem(grid.model, value);
  if (name == "rate_hz" && (value < kLeast_hz || value > kLargest_hz))
    return fmt::format("{:g} Hz is not a plausible rate; the value is in hertz: write 100 for 100 Hz", value);
  const double lifted_kg = grid.model.largest_thrust_N(grid.model.full_battery_V()) / kGravity_m_s2;
  if (name == "mass_kg" && value > 100 * lifted_kg)
    return fmt::format("{:g} kg, but the rotors lift only {:.3g} kg; the value is in kg: {:g} g is {:g}",
                       value, lifted_kg, value, value / 1000);
  return "";
}

namespace {

/// Requires axes that the gains have, and that make sense for them.
void require_fitting_axes(const TomlTable& axes, const Gains& gains) {
  const bool pid_axis = axes.has("Kp") || axes.has("Kd") || axes.has("Ki");
  const bool composite_axis = axes.has("Lambda") || axes.has("K");
  if (pid_axis && (composite_axis || !gains.pid)) {
    axes.refuse("", "", "varies Kp, Kd or Ki, but the gains are Lambda, K", "vary Lambda and K");
  }
  if (composite_axis && !gains.composite) {
    axes.refuse("", "", "varies Lambda or K, but the gains are Kp, Kd, Ki", "vary Kp, Kd and Ki");
  }
  if (axes.has("integrator_step_s") && gains.rate_hz == 0 && !axes.has("rate_hz")) {
    axes.refuse("integrator_step_s", "", "needs a sampled loop", "add rate_hz to the gains");
  }
}

void read_axes(const TomlTable& axes, Grid& grid) {
  axes.allow_only(grid_parameters());
  double cells = 1;
  for (const std::string& name : axes.keys()) {
    grid.axes.push_back(read_axis(axes, name));
    for (const double value : grid.axes.back().values) {
      const std::string problem = parameter_problem(grid, name, value);
      if (!problem.empty()) axes.refuse(name, "", problem);
    }
    cells *= static_cast<double>(grid.axes.back().values.size());
  }
  if (grid.axes.empty()) axes.refuse("", "", "has no axis", "e.g. [axes.Kp] from = 5, to = 20, steps = 50");
  if (cells > kMostCells) axes.refuse("", fmt::format("{:.0f} cells", cells), "are more than ten million");
  require_fitting_axes(axes, grid.gains);
}

/// Must be called after grid.compute is read.
void read_pareto(const TomlTable& top, Grid& grid) {
  grid.pareto = read_quantities(top, "pareto");
  for (const std::string& name : grid.pareto) {
    if (std::find(grid.compute.begin(), grid.compute.end(), name) == grid.compute.end()) {
      top.refuse("pareto", files::in_quotes(name), "is not computed", "add it to compute");
    }
  }
}

void read_limits(const TomlTable& limits, Grid& grid) {
  limits.allow_only(quantity_names());
  for (const std::string& name : limits.keys()) {
    const TomlTable limit = limits.table(name);
    limit.allow_only(files::key_names(describe_limits_of));
    const double least = limit.has("least") ? limit.number("least") : -INFINITY;
    const double most = limit.has("most") ? limit.number("most") : INFINITY;
    if (least > most) {
      limit.refuse("least", fmt::format("{:g}", least), fmt::format("is more than most = {:g}", most),
                   "no cell can satisfy both");
    }
    grid.limits.push_back({name, least, most});
  }
}

}  // namespace

void describe_grid_file(files::Keys& keys) {
  const std::vector<files::OneOf> quantities = {files::OneOf{quantity_names()}};
  keys.schema(kSchema);
  keys.must<std::string>("gains", "The gains.toml that is varied.");
  keys.must<std::string>("model", "The model.toml.");
  keys.may("axis", "Of the loop; z if absent.", "", files::OneOf{kAxisNames});
  keys.must_table("axes", "The numbers that are varied.", [](files::Keys& axes) {
    for (const std::string& name : grid_parameters())
      axes.may_table(name, "Its values.", describe_values_of_axis);
  });
  keys.must("compute", "What is computed at every point.", "", quantities);
  keys.may("pareto", "The numbers whose front is wanted.", "", quantities);
  keys.may_table("limits", "Beyond which a point is not feasible.", [](files::Keys& limits) {
    for (const std::string& name : quantity_names()) limits.may_table(name, "", describe_limits_of);
  });
  keys.may_table("disturbance", "The declared disturbance.", describe_classes);
}

Grid load_grid(const std::string& path) {
  const std::string text = files::read_file(path);
  const toml::table document = files::parse_toml(text, path);
  const TomlTable top(document, path);
  top.require_schema(kSchema);
  top.allow_only(files::key_names(describe_grid_file));
  Grid grid;
  grid.path = path;
  grid.sha256 = files::sha256(text);
  const std::string gains = beside(path, top.text("gains"));
  const std::string model = beside(path, top.text("model"));
  grid.gains = load_gains(gains);
  grid.model = read_model(model);
  grid.inputs = {path, gains, model};
  if (top.has("axis")) grid.axis = static_cast<int>(top.choice("axis", kAxisNames));
  read_axes(top.table("axes"), grid);
  grid.compute = read_quantities(top, "compute");
  if (top.has("pareto")) read_pareto(top, grid);
  if (top.has("limits")) read_limits(top.table("limits"), grid);
  if (top.has("disturbance")) grid.disturbance = read_disturbance(top.table("disturbance"), grid.axis);
  return grid;
}

}  // namespace swarmcert::stability
