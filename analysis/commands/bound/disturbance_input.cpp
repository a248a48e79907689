#include "analysis/commands/bound/disturbance_input.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/tracking/measured_source.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "nn/base/doubles.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"
#include "stability/bounds/declared_disturbance.h"

namespace swarmcert::analysis {
namespace {

using files::InputError;
using files::Json;
using stability::DisturbanceSource;

/// Parses "0.1" for all axes, or "0.1,0,-0.2".
void read_axes(const char* option, const std::string& text, bool is_signed, double (&values)[3]) {
  if (text.empty()) return;
  const auto refuse = [&](const char* why) {
    throw UsageError(fmt::format("{} {}: {}; write one number for all axes, or X,Y,Z", option, text, why));
  };
  const char* at = text.c_str();
  int count = 0;
  while (true) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at || (*end != ',' && *end != '\0')) refuse("is not a number");
    if (!std::isfinite(value)) refuse("must be a finite number");
    if (!is_signed && value < 0) refuse("must not be negative");
    if (count == 3) refuse("has more than three numbers");
    values[count++] = value;
    if (*end == '\0') break;
    at = end + 1;
  }
  if (count == 2) refuse("has two numbers");
  if (count == 1) values[1] = values[2] = values[0];
}

/// The amplitude given for the error of an estimate replaces all that was known of it.
void read_estimate(const char* option, const std::string& text, stability::EstimateError (&errors)[3]) {
  if (text.empty()) return;
  double values[3] = {};
  read_axes(option, text, false, values);
  for (int axis = 0; axis < 3; ++axis) {
    errors[axis] = {};
    errors[axis].amplitude = values[axis];
  }
}

void declare_estimate(CLI::App& app, const std::string& estimate, const std::string& unit, const char* law,
                      std::string& argument) {
  app.add_option(
      "--" + estimate + "-error", argument,
      "sup |estimated - true " + estimate + "|, " + unit + ", which " + law + "; for all axes, or X,Y,Z");
}

/// Reads the number for `axis` from the output of compare: a number, or an object with axes, quantiles, or both.
double measured_number(const Json& value, const std::string& axis, const std::string& quantile,
                       const std::string& path, const std::string& field) {
  if (value.is_number()) return value.get<double>();
  if (value.is_object()) {
    if (value.contains(axis)) return measured_number(value[axis], axis, quantile, path, field + "." + axis);
    if (value.contains(quantile)) {
      return measured_number(value[quantile], axis, quantile, path, field + "." + quantile);
    }
  }
  throw InputError({path, "", field, value.is_object() ? "an object" : value.dump().substr(0, 40),
                    "has no number for axis " + axis + " and quantile " + quantile,
                    "use --quantile to name an existing one"});
}

/// Reads the requested quantiles of one error. A missing class is unbounded; a missing bias is zero.
MeasuredAxis measured_axis(const Json& document, const std::string& field, int axis,
                           const DisturbanceArguments& arguments) {
  const Json& error = document[field];
  const auto get = [&](const char* key) {
    if (!error.contains(key)) return kInfinity;
    return std::abs(measured_number(error[key], stability::axis_name(axis), arguments.quantile,
                                    arguments.from, field + "." + key));
  };
  return {error.contains("bias") ? get("bias") : 0, get("amplitude"), get("rate"), get("variation"),
          get("impulse")};
}

/// Window length in seconds; zero if the file does not state one.
double window_of(const Json& document, const std::string& field, const std::string& path) {
  const Json& error = document[field];
  if (!error.contains("window_s") || !error["window_s"].is_number()) return 0;
  const double window_s = error["window_s"].get<double>();
  if (!(window_s > 0)) {
    throw InputError({path, "", field + ".window_s", error["window_s"].dump(), "must be positive", ""});
  }
  return window_s;
}

void read_measured(const DisturbanceArguments& arguments, DisturbanceSource& source) {
  const Json document = files::read_json(arguments.from, "swarmcert/compare/1");
  if (!document.contains("learning_error") || !document["learning_error"].is_object()) {
    throw InputError(
        {arguments.from, "", "learning_error", "", "is missing", "write it with swarmcert compare --json"});
  }
  const double window_s = window_of(document, "learning_error", arguments.from);
  std::array<MeasuredAxis, 3> axes;
  for (int axis = 0; axis < 3; ++axis)
    axes[static_cast<std::size_t>(axis)] = measured_axis(document, "learning_error", axis, arguments);
  source = measured_source(axes, window_s);
  // Variation and impulse refer to one window: every window of the flight may contribute as much again.
  source.note = window_s > 0 ? fmt::format("{} over windows of {} s, each of which may contribute as much",
                                           arguments.quantile, window_s)
                             : arguments.quantile + " over consecutive windows of flights";
  if (!document.contains("velocity_error") || !document["velocity_error"].is_object()) return;
  const double slopes_s = window_of(document, "velocity_error", arguments.from);
  for (int axis = 0; axis < 3; ++axis) {
    source.velocity_error[axis] =
        measured_estimate(measured_axis(document, "velocity_error", axis, arguments), slopes_s);
  }
}

double newtons(const std::string& unit, double value, const std::string& path) {
  if (unit.rfind("gf", 0) == 0) return value * stability::kGramForce_N;
  if (unit.rfind("N", 0) == 0 && unit.rfind("N_m", 0) != 0) return value;
  throw InputError({path, "", "unit", files::in_quotes(unit), "is not a unit of force",
                    "state a force and its unit as output in network.toml"});
}

/// Lipschitz constants of f_hat in newton per unit of input: with respect to the input of one neighbour and to the
/// vehicle's own state.
struct Constants {
  double neighbour = -1, own = 0;
};

/// Largest bounds over the set functions (or the plain network) of a list of bounds.
template <class Bounds, class Function, class Upper, class Unit>
Constants largest(const Bounds& bounds, const Function& function, const Upper& upper, const Unit& unit,
                  const std::string& path) {
  Constants result;
  for (const auto& bound : bounds) {
    const std::optional<files::FunctionId> of = function(bound);
    if (!of || !of->is_whole()) continue;
    const bool is_ground = of->is_set() && of->input_part().is_ground_phi();
    double& constant = is_ground ? result.own : result.neighbour;
    constant = std::max(constant, newtons(unit(bound), upper(bound), path));
  }
  if (result.neighbour < 0)
    throw InputError({path, "", "bounds", "",
                      "has no bound of a whole network for all inputs and all their coordinates",
                      "certify without --domain, --blocks and --scale"});
  return result;
}

files::Network force_network(const DisturbanceArguments& arguments, std::vector<std::string>& inputs,
                             std::vector<std::string>& notes) {
  files::Network network = load_net(arguments.network);
  files::require_force_z(network);
  for (const std::string& path : input_files(network)) inputs.push_back(path);
  for (const std::string& composition : files::silent_compositions(network))
    notes.push_back("f_hat = 0 among " + composition +
                    ": its rate holds while the set of neighbours is constant; a neighbour that appears or "
                    "disappears there causes an edge of at most the jump from certify --domain");
  return network;
}

/// Constants of a certificate, which the checker must accept for the network.
Constants certified_constants(const DisturbanceArguments& arguments, std::vector<std::string>& inputs,
                              std::vector<std::string>& notes) {
  inputs.push_back(arguments.certificate);
  const Json certificate =
      check::parse_certificate(files::read_file(arguments.certificate), arguments.certificate);
  if (arguments.network.file.empty() && arguments.network.phi.empty()) {
    throw UsageError("--certificate C proves nothing without its network: add --network NET");
  }
  const files::Network network = force_network(arguments, inputs, notes);
  const check::CheckResult verdict = check::check(certificate, network);
  if (!verdict.accepted) {
    throw InputError({arguments.certificate, "", "", "", "is rejected by the checker: " + verdict.reason,
                      "certify the network again"});
  }
  for (const auto& [part, stated] : certificate["network"]["weights"].items())
    for (const Json& guess : stated["assumed"])
      notes.push_back("assumed when " + part + " was read: " + guess.get<std::string>());
  return largest(
      certificate["bounds"],
      [](const Json& b) -> std::optional<files::FunctionId> {
        // Uses only bounds on the whole input of one neighbour, on the whole domain, in the Euclidean norm; the
        // checker verifies the rest.
        const bool is_plain = b.value("block", "all") == "all" && b.value("domain", "global") == "global" &&
                              (!b.contains("scale") || b["scale"].empty());
        if (!is_plain) return std::nullopt;
        return files::FunctionId::parse(b.value("function", ""));
      },
      [](const Json& b) { return b["upper"].get<double>(); },
      [&](const Json& b) { return files::unit(network, b["function"].get<std::string>()); },
      arguments.certificate);
}

/// Products of the spectral norms of the layers.
Constants product_constants(const DisturbanceArguments& arguments, std::vector<std::string>& inputs,
                            std::vector<std::string>& notes) {
  const files::Network network = force_network(arguments, inputs, notes);
  lipschitz::CertifyOptions options;
  options.method = lipschitz::UpperMethod::kProduct;
  options.lower.rounds = 0;
  const lipschitz::Certification found = certify(network, options);
  return largest(
      found.bounds, [](const lipschitz::CertifiedBound& b) { return std::optional(b.function); },
      [](const lipschitz::CertifiedBound& b) { return b.upper.value(); },
      [&](const lipschitz::CertifiedBound& b) { return files::unit(network, b.function); },
      arguments.network.file.empty() ? arguments.network.phi + ", " + arguments.network.rho
                                     : arguments.network.file);
}

void read_lipschitz(const DisturbanceArguments& arguments, DisturbanceSource& source,
                    std::vector<std::string>& inputs, std::vector<std::string>& notes) {
  if (arguments.speed < 0) {
    throw UsageError(
        "a Lipschitz constant gives a rate only with --speed V (and --accel A) of a neighbour "
        "relative to the vehicle");
  }
  const Constants lipschitz_N = arguments.certificate.empty() ? product_constants(arguments, inputs, notes)
                                                              : certified_constants(arguments, inputs, notes);
  // The input of a neighbour changes at rate |(v_rel, a_rel)|, and the rates of all neighbours add up; the input for
  // the ground is the own state.
  if (arguments.acceleration < 0) notes.emplace_back("neighbours fly at constant velocity: no --accel");
  double rate = arguments.neighbours * lipschitz_N.neighbour *
                std::hypot(arguments.speed, std::max(0.0, arguments.acceleration));
  if (lipschitz_N.own > 0) {
    if (arguments.own_speed < 0) notes.emplace_back("own speed at most --speed: no --own-speed");
    if (arguments.own_accel < 0) notes.emplace_back("own acceleration at most --accel: no --own-accel");
    rate += lipschitz_N.own *
            std::hypot(arguments.own_speed < 0 ? arguments.speed : arguments.own_speed,
                       std::max(0.0, arguments.own_accel < 0 ? arguments.acceleration : arguments.own_accel));
  }
  source.f_hat_rate_N_s = rate * (1 + 1e-15 * 8);  // for the rounding of the operations above
  source.f_hat_rate_known = true;
  if (source.kind != "none") return;
  source.kind = "rate of f_hat";
  source.axis[2].rate_N_s = source.f_hat_rate_N_s;  // the network's output is the force along z
}

/// Declares the disturbance itself: classes of the force error, its bias, errors of the estimates.
void declare_force(CLI::App& app, DisturbanceArguments& arguments) {
  app.add_option("--rate", arguments.rate, "sup |eps'|, N/s: how fast the force error changes")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--amplitude", arguments.amplitude, "sup |eps|, N")->check(CLI::NonNegativeNumber);
  app.add_option("--edge", arguments.edge, "Total variation of eps, N")->check(CLI::NonNegativeNumber);
  app.add_option("--impulse", arguments.impulse, "int |eps| dt of one pass, N s")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--bias", arguments.bias,
                 "Constant part of the force error, N, on top of the rest; for all axes, or X,Y,Z");
  declare_estimate(app, "velocity", "m/s", "the law sees through Kd", arguments.velocity_error);
  declare_estimate(app, "position", "m", "the law sees through Kp and Ki", arguments.position_error);
  app.add_option(
      "--disturbance", arguments.file,
      "disturbance.toml: these and further parts, such as passes, a moving set point, an error of the "
      "thrust ratio, rates of the errors of the estimates");
}

/// Declares the sources of numbers that the user does not give.
void declare_sources(CLI::App& app, DisturbanceArguments& arguments) {
  auto* from =
      app.add_option("--from", arguments.from, "Result of compare: measured quantiles of the learning error");
  app.add_option("--quantile", arguments.quantile, "Which quantile of --from (default p99)")->needs(from);
  app.add_option("--certificate", arguments.certificate,
                 "Certificate of --network: bounds the rate of f_hat");
  app.add_option("--network", arguments.network.file, "network.toml or weight file of f_hat");
  app.add_option("--phi", arguments.network.phi, "Weight file of phi, with --rho");
  app.add_option("--rho", arguments.network.rho, "Weight file of rho, with --phi");
  declare_order(app, arguments.network);
}

/// Declares the motion of the vehicles, for a learned force or a declared truth.
void declare_motions(CLI::App& app, DisturbanceArguments& arguments) {
  app.add_option("--speed", arguments.speed, "Largest relative speed of a neighbour, m/s")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--accel", arguments.acceleration, "Largest relative acceleration of a neighbour, m/s^2")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--neighbours", arguments.neighbours, "How many neighbours at once (default 1)")
      ->check(CLI::PositiveNumber);
  auto* truth = app.add_option("--truth", arguments.truth,
                               "model.toml whose effects are declared to be the true force");
  app.add_option("--gap", arguments.gap, "Height differences between vehicles, FROM:TO in m (with --truth)")
      ->needs(truth);
  app.add_option("--own-speed", arguments.own_speed, "Largest speed of any vehicle, m/s")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--own-accel", arguments.own_accel, "Largest acceleration of any vehicle, m/s^2")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--thrust-rate", arguments.thrust_rate, "sup |d/dt (thrust vector)|, N/s (with --truth)")
      ->check(CLI::NonNegativeNumber)
      ->needs(truth);
  app.add_option("--least-height", arguments.least_height, "Lowest height, m (with --truth; default 0)")
      ->check(CLI::NonNegativeNumber)
      ->needs(truth);
  app.add_option("--largest-height", arguments.largest_height, "Largest height, m (with --truth)")
      ->check(CLI::NonNegativeNumber)
      ->needs(truth);
  app.add_option("--neighbour-mass", arguments.neighbour_mass,
                 "Mass of the heaviest neighbour, kg (with --truth; default: that of the truth's vehicle)")
      ->check(CLI::PositiveNumber)
      ->needs(truth);
}

}  // namespace

void declare_disturbance(CLI::App& app, DisturbanceArguments& arguments) {
  declare_force(app, arguments);
  declare_sources(app, arguments);
  declare_motions(app, arguments);
}

namespace {

/// Rejects options that would have no effect, because a user who gives them expects one.
void refuse_alone(const DisturbanceArguments& arguments) {
  const bool has_network = !arguments.network.file.empty() || !arguments.network.phi.empty();
  if (!has_network && arguments.certificate.empty() && arguments.truth.empty()) {
    const std::pair<const char*, bool> motions[] = {{"--speed", arguments.speed >= 0},
                                                    {"--accel", arguments.acceleration >= 0},
                                                    {"--own-speed", arguments.own_speed >= 0},
                                                    {"--own-accel", arguments.own_accel >= 0},
                                                    {"--neighbours", arguments.neighbours != 1}};
    for (const auto& [option, is_given] : motions) {
      if (is_given) {
        throw UsageError(std::string(option) +
                         " states how vehicles move, which affects only a learned or a declared force: add "
                         "--network NET or --truth MODEL");
      }
    }
  }
}

}  // namespace

LoadedDisturbance load_disturbance(const DisturbanceArguments& arguments, const Tracking& tracking) {
  refuse_alone(arguments);
  LoadedDisturbance result;
  DisturbanceSource& source = result.source;
  const bool has_class =
      std::max({arguments.rate, arguments.amplitude, arguments.edge, arguments.impulse}) >= 0;
  if (!arguments.from.empty()) {
    result.inputs.push_back(arguments.from);
    read_measured(arguments, source);
  }
  // What is declared adds to what was measured.
  if (!arguments.file.empty()) {
    result.inputs.push_back(arguments.file);
    stability::read_disturbance_file(arguments.file, source);
  }
  const bool is_declared = has_class || source.kind == "declared";
  if (int{is_declared} + int{!arguments.from.empty()} + int{!arguments.truth.empty()} > 1) {
    throw UsageError(
        "--from, --truth and a declared force error (--rate, --amplitude, --edge, --impulse, or those of "
        "--disturbance) each define the disturbance: give only one");
  }
  if (has_class) {
    source.kind = "declared";
    source.note = "as given";
  }
  for (stability::Disturbance& d : source.axis) {
    if (arguments.rate >= 0) d.rate_N_s = arguments.rate;
    if (arguments.amplitude >= 0) d.amplitude_N = arguments.amplitude;
    if (arguments.edge >= 0) d.variation_N = arguments.edge;
    if (arguments.impulse >= 0) d.impulse_N_s = arguments.impulse;
  }
  if (arguments.rate >= 0) source.rate_norm_N_s = arguments.rate;
  if (!arguments.bias.empty()) {
    double bias_N[3] = {0, 0, 0};
    read_axes("--bias", arguments.bias, true, bias_N);
    // Adds to the measured bias regardless of sign; the measured amplitude contains the measured bias but not this one.
    for (int axis = 0; axis < 3; ++axis)
      source.bias_N[axis] = std::abs(source.bias_N[axis]) + std::abs(bias_N[axis]);
    source.classes_contain_bias = false;
  }
  source.declares_velocity_error = source.declares_velocity_error || !arguments.velocity_error.empty();
  read_estimate("--velocity-error", arguments.velocity_error, source.velocity_error);
  read_estimate("--position-error", arguments.position_error, source.position_error);
  const bool has_network = !arguments.network.file.empty() || !arguments.network.phi.empty();
  if (!arguments.certificate.empty() || has_network) {
    read_lipschitz(arguments, source, result.inputs, source.further_assumptions);
  }
  if (!arguments.truth.empty()) {
    result.inputs.push_back(arguments.truth);
    result.truth = read_truth(arguments, tracking);
    add_truth(*result.truth, source);
  }
  const bool has_others = !arguments.bias.empty() || !arguments.velocity_error.empty() ||
                          !arguments.position_error.empty() || !arguments.file.empty();
  if (has_others && source.kind == "none") declare_no_class(source);
  return result;
}

}  // namespace swarmcert::analysis
