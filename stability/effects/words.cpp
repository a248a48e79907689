#include "stability/effects/words.h"

#include <fmt/core.h>

#include <cmath>
#include <iterator>

namespace swarmcert::stability {
namespace {

constexpr Phrase kPhrases[] = {
    {"accelerometer_scale", "scale", "an accelerometer that reads {scale} times the force", nullptr},
    {"battery", "sensitivity_1_V", "a thrust that changes with the battery's voltage, by {sensitivity_1_V}",
     nullptr},
    {"ceiling", "amplitude",
     "a ceiling at {height_m} that adds {amplitude} of the thrust there, less over {decay_m}", nullptr},
    {"com_offset", "offset_x_m",
     "a centre of mass ({offset_x_m}, {offset_y_m}) beside the middle of the rotors", nullptr},
    {"com_offset", "offset_y_m", "a centre of mass {offset_y_m} beside the middle of the rotors", nullptr},
    {"constant_force", "force_x_N", "a steady force of ({force_x_N}, {force_y_N}, {force_z_N})", nullptr},
    {"constant_force", "force_y_N", "a steady force of ({force_x_N}, {force_y_N}, {force_z_N})", nullptr},
    {"constant_force", "force_z_N", "a steady force of {force_z_N} upwards",
     "a steady force of {force_z_N} downwards"},
    {"deep_set", "gain", "the force of its network, times {gain}", nullptr},
    {"delay", "delay_s", "commands that act {delay_s} late", nullptr},
    {"downwash", "amplitude_N", "a wake that pushes down with {amplitude_N} at 0.3 m below a vehicle of 34 g",
     nullptr},
    {"downwash_torque", "amplitude_N",
     "a wake of {amplitude_N} at 0.3 m below a vehicle of 34 g, which tilts those at its edge", nullptr},
    {"drag_linear", "drag_N_s_m", "a drag of {drag_N_s_m} times the velocity", nullptr},
    {"drag_quadratic", "drag_N_s2_m2", "a drag of {drag_N_s2_m2} times the squared speed", nullptr},
    {"drag_rotor", "drag_N_s_m",
     "a drag of the rotors, {drag_N_s_m} times the velocity across them and in proportion to the thrust",
     nullptr},
    {"flow_torque", "moment_N_s", "air that tilts the moving vehicle back, with {moment_N_s} times the speed",
     "air that tilts the moving vehicle forwards, with {moment_N_s} times the speed"},
    {"ground", "amplitude",
     "a cushion of air over the ground that adds {amplitude} of the thrust at {height_reference_m}, less "
     "over "
     "{decay_m}",
     nullptr},
    {"imu_tilt", "tilt_x_rad",
     "rotors tilted by ({tilt_x_rad}, {tilt_y_rad}) against the inertial unit, about body x and y", nullptr},
    {"imu_tilt", "tilt_y_rad", "rotors tilted by {tilt_y_rad} against the inertial unit, about body y",
     nullptr},
    {"inflow", "loss_s_m", "rotors that lose {loss_s_m} of their thrust per climb speed", nullptr},
    {"motor_lag", "tau_s", "rotors that follow their commands with a lag of {tau_s}", nullptr},
    {"payload_step", "time_s", "a load that changes from {mass_before_kg} to {mass_after_kg} at {time_s}",
     nullptr},
    {"pendulum", "mass_kg", "a load of {mass_kg} that swings on a string of {length_m}", nullptr},
    {"rate_damping", "damping_xy_N_m_s",
     "rotors that damp roll and pitch with {damping_xy_N_m_s} times the rate", nullptr},
    {"rate_damping", "damping_z_N_m_s", "rotors that damp the yaw with {damping_z_N_m_s} times its rate",
     nullptr},
    {"rotor_momentum", "inertia_kg_m2",
     "rotors of inertia {inertia_kg_m2} each, which turn the vehicle as they change speed", nullptr},
    {"rotor_thrust", "rotor_1",
     "rotors that give {rotor_1} (front right), {rotor_2} (back right), {rotor_3} (back left) and "
     "{rotor_4} "
     "(front left) times their thrust",
     nullptr},
    {"sensor_delay", "delay_s", "an accelerometer that answers {delay_s} late", nullptr},
    {"tether", "stiffness_N_m",
     "a line of {slack_m} to ({anchor_x_m}, {anchor_y_m}, {anchor_z_m}) that pulls with {stiffness_N_m} "
     "once "
     "it is taut",
     nullptr},
    {"thrust_ratio", "ratio", "a thrust of {ratio} times the model's, or a mass as much smaller", nullptr},
    {"thrust_saturation", "loss", "rotors that lose {loss} of what they give beyond {knee_weights}", nullptr},
    {"torque_bias", "torque_x_Nm", "a steady torque of ({torque_x_Nm}, {torque_y_Nm}, {torque_z_Nm})",
     nullptr},
    {"torque_bias", "torque_y_Nm", "a steady torque of ({torque_x_Nm}, {torque_y_Nm}, {torque_z_Nm})",
     nullptr},
    {"torque_bias", "torque_z_Nm", "a steady torque of {torque_z_Nm} about the thrust axis", nullptr},
    {"torque_ratio", "change_x",
     "rotors whose torque differs from the model's by ({change_x}, {change_y}, {change_z}) of it about x, "
     "y, z",
     nullptr},
    {"torque_ratio", "change_y",
     "rotors whose torque differs from the model's by ({change_y}, {change_z}) of it about y, z", nullptr},
    {"torque_ratio", "change_z", "rotors whose yaw torque differs from the model's by {change_z} of it",
     nullptr},
    {"translational_lift", "gain", "rotors that gain {gain} of their thrust beyond a speed of {speed_m_s}",
     nullptr},
    {"upper_lift", "amplitude_N", "a lift of {amplitude_N} at 0.3 m above another vehicle", nullptr},
    {"voltage_sag", "sag", "a supply that sags under load, by {sag} of the thrust per hovering power",
     nullptr},
    {"vortex_ring", "loss",
     "rotors that lose {loss} of their thrust at a descent of {descent_m_s}, in their own wake", nullptr},
    {"wake_delay", "amplitude_N",
     "a wake that pushes down with {amplitude_N} at 0.3 m below a vehicle of 34 g, {delay_s} late", nullptr},
    {"wall", "push", "a wall {place_m} from the origin that pushes away with {push} of the thrust",
     "a wall {place_m} from the origin that attracts with {push} of the thrust"},
    {"wind_field", "thermal_N", "an updraft of {thermal_N} at x {x_m}, y {y_m}, radius {radius_m}",
     "a downdraft of {thermal_N} at x {x_m}, y {y_m}, radius {radius_m}"},
    {"wind_field", "shear_x_N", "a wind of ({shear_x_N}, {shear_y_N}) above {height_m}", nullptr},
    {"wind_field", "shear_y_N", "a wind of ({shear_x_N}, {shear_y_N}) above {height_m}", nullptr}};

bool ends_with(const std::string& name, const std::string& end) {
  return name.size() >= end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
}

/// "35.2 mN", "0.31 m": the unit is the end of the name, the longest one that fits.
std::string quantity(const std::string& name, double value, const ForceWords& force) {
  const std::pair<const char*, const char*> kUnits[] = {
      {"_N_s2_m2", "N s^2/m^2"}, {"_N_m_s", "N m s"}, {"_kg_m2", "kg m^2"}, {"_N_s_m", "N s/m"},
      {"_m_s", "m/s"},           {"_N_m", "N/m"},     {"_N_s", "N s"},      {"_s_m", "s/m"},
      {"_1_s", "1/s"},           {"_1_V", "1/V"},     {"_Nm", "N m"},       {"_rad", "rad"},
      {"_weights", "weights"},   {"_kg", "kg"},       {"_m", "m"},          {"_s", "s"}};
  for (const auto& [end, unit] : kUnits) {
    if (ends_with(name, end)) return fmt::format("{:.3g} {}", value, unit);
  }
  if (ends_with(name, "_N")) return fmt::format("{:.3g} {}", value * force.per_newton, force.name);
  return fmt::format("{:.3g}", value);
}

std::string filled(const Phrase& phrase, const std::map<std::string, double>& values,
                   const ForceWords& force) {
  const bool is_negative = values.at(phrase.leading) < 0 && phrase.if_negative != nullptr;
  std::string text = is_negative ? phrase.if_negative : phrase.text;
  for (const auto& [name, value] : values) {
    const bool is_size = is_negative && name == phrase.leading;
    const std::string token = "{" + name + "}";
    const std::size_t at = text.find(token);
    if (at != std::string::npos)
      text.replace(at, token.size(), quantity(name, is_size ? -value : value, force));
  }
  return text;
}

}  // namespace

std::vector<Phrase> phrases() { return {std::begin(kPhrases), std::end(kPhrases)}; }

std::string in_words(const std::string& effect, const std::map<std::string, double>& values,
                     const ForceWords& force) {
  for (const Phrase& phrase : kPhrases) {
    const auto leading = values.find(phrase.leading);
    if (effect == phrase.effect && leading != values.end() && leading->second != 0)
      return filled(phrase, values, force);
  }
  return "";
}

}  // namespace swarmcert::stability
