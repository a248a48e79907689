#include "stability/gains.h"

#include <cmath>
#include <sstream>

#include "controller/gain_conversion.h"
#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/toml.h"

namespace swarmcert::stability {
namespace {

using files::TomlTable;

constexpr char kSchema[] = "swarmcert/gains/1";

/// Limits for the numbers of a multirotor's loop, far beyond those in use. A position loop with poles at 1000 1/s has
/// Kp = 3e6, Kd = 3e3 and Ki = 1e9; rates beyond 100 kHz or below 1 Hz are periods or in other units.
constexpr double kLargestAttitudeGain = 1e4;
constexpr double kLargestKp_1_s2 = 1e7, kLargestKd_1_s = 1e5, kLargestKi_1_s3 = 1e10;
constexpr double kLargestLambda_1_s = 1e3, kLargestK_kg_s = 1e5;
constexpr double kLeastRate_hz = 1, kLargestRate_hz = 1e5;
constexpr double kLongestIntegral_m_s = 1e6;

const std::vector<std::string> kAttitudeLaws = {"lee", "robust"};

void describe_position(files::Keys& keys) {
  using files::NumberOrThree;
  using DiagonalOrRows = std::variant<double, std::array<double, 3>, std::array<std::array<double, 3>, 3>>;
  keys.may<NumberOrThree>("Kp", "Of the position.", "1/s^2");
  keys.may<NumberOrThree>("Kd", "Of the velocity.", "1/s");
  keys.may<NumberOrThree>("Ki", "Of the integral.", "1/s^3");
  keys.may<DiagonalOrRows>("Lambda", "In place of Kp, Kd, Ki: diagonal or rows.", "1/s");
  keys.may<DiagonalOrRows>("K", "With Lambda: diagonal or rows.", "kg/s");
  keys.may<NumberOrThree>("integrator_limit", "Of the integral.", "m s");
  keys.may<double>("rate_hz", "Of the commands; absent: continuous.", "Hz");
  keys.may<double>("integrator_step_s", "What the integral grows by per command, times the error.", "s");
  for (const char* const axis : {"xy", "z"}) {
    const std::string of = axis;
    keys.may<double>("kp_" + of, "Of the Mellinger controller, divided by mass.", "N/m");
    keys.may<double>("kd_" + of, "Likewise.", "N s/m");
    keys.may<double>("ki_" + of, "Likewise.", "N/(m s)");
    keys.may<double>("i_range_" + of, "Of its integral.", "m s");
  }
  keys.may<double>("mass", "That the Mellinger controller is told.", "kg");
  keys.may<double>("massThrust", "PWM per newton; not used.");
}

void describe_attitude(files::Keys& keys) {
  using files::NumberOrThree;
  keys.may("law", "Which attitude law.", "", files::OneOf{kAttitudeLaws});
  keys.may<NumberOrThree>("KR", "About the axes of the body.", "N m");
  keys.may<NumberOrThree>("Kw", "Likewise.", "N m s");
  keys.may<NumberOrThree>("KI", "Likewise.", "N m/s");
}

void describe_lag(files::Keys& keys) {
  keys.may<double>("motor_s", "Time constant of the motors.", "s");
  keys.may<double>("attitude_s", "Of the attitude loop.", "s");
  keys.may<double>("body_rate_s", "Of the measured body rates.", "s");
  keys.may<double>("delay_s", "Of the command.", "s");
}

void describe_feed(files::Keys& keys) {
  keys.may<double>("rate_hz", "Of the predicted force; absent: continuous.", "Hz");
  keys.may<double>("latency_s", "From the state to its force.", "s");
}

std::string text_of(double value) {
  if (std::abs(value) >= 1e6 || (value != 0 && std::abs(value) < 1e-4)) {
    std::ostringstream text;
    text << value;
    return text.str();
  }
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

double non_negative(const TomlTable& table, const std::string& key) {
  const double value = table.number(key);
  if (value < 0) table.refuse(key, text_of(value), "must not be negative");
  return value;
}

double positive(const TomlTable& table, const std::string& key) {
  const double value = table.number(key);
  if (!(value > 0)) table.refuse(key, text_of(value), "must be positive", "omit the key if there is none");
  return value;
}

/// Rejects implausible magnitudes: overflow, or a number in another unit.
void check_size(const TomlTable& table, const std::string& key, double value, double largest,
                const std::string& unit) {
  if (std::abs(value) > largest) {
    table.refuse(key, text_of(value),
                 "exceeds " + text_of(largest) + " " + unit + ", more than any vehicle can follow",
                 "the value is in " + unit);
  }
}

/// Reads the rate of a loop, in hertz.
double loop_rate_hz(const TomlTable& table) {
  const double value = positive(table, "rate_hz");
  if (value > kLargestRate_hz) {
    table.refuse("rate_hz", text_of(value),
                 "exceeds " + text_of(kLargestRate_hz) + " Hz, faster than any controller",
                 "the value is in hertz");
  }
  if (value < kLeastRate_hz) {
    table.refuse("rate_hz", text_of(value),
                 "is below " + text_of(kLeastRate_hz) + " Hz; a period was probably meant",
                 "the value is in hertz: a period of " + text_of(value) + " s is " + text_of(1 / value));
  }
  return value;
}

/// Checks a time constant of the loop. None in use is longer than a second; longer ones were written in milliseconds.
double seconds(const TomlTable& table, const std::string& key, double value) {
  constexpr double kLongest_s = 1;
  if (value > kLongest_s) {
    table.refuse(key, text_of(value), "is longer than " + text_of(kLongest_s) + " s",
                 "the value is in seconds: 20 ms are 0.02");
  }
  return value;
}

/// Reads three numbers, or one for all axes; none negative.
PerAxis per_axis(const TomlTable& table, const std::string& key, bool may_be_zero, double largest,
                 const std::string& unit) {
  PerAxis result{};
  if (!table.is_list(key)) {
    result.fill(table.number(key));
  } else {
    const std::vector<double> numbers = table.numbers(key);
    if (numbers.size() != 3) {
      table.refuse(key, std::to_string(numbers.size()) + " numbers", "must be three numbers, for x, y and z",
                   "or one number for all axes");
    }
    for (std::size_t i = 0; i < 3; ++i) result[i] = numbers[i];
  }
  for (const double value : result) {
    if (value < 0)
      table.refuse(key, text_of(value), "must not be negative", "the control law already has the signs");
    if (value == 0 && !may_be_zero) table.refuse(key, text_of(value), "must be positive");
    check_size(table, key, value, largest, unit);
  }
  return result;
}

/// Reads a matrix: three rows, three numbers for the diagonal, or one number for a multiple of the identity.
Matrix3 read_matrix(const TomlTable& table, const std::string& key) {
  Matrix3 result{};
  if (!table.is_list(key)) {
    for (std::size_t i = 0; i < 3; ++i) result[i][i] = table.number(key);
    return result;
  }
  if (!table.is_list_of_lists(key)) {
    const std::vector<double> diagonal = table.numbers(key);
    if (diagonal.size() != 3) {
      table.refuse(key, std::to_string(diagonal.size()) + " numbers", "must be three numbers, the diagonal",
                   "or three rows of three, or one number");
    }
    for (std::size_t i = 0; i < 3; ++i) result[i][i] = diagonal[i];
    return result;
  }
  const std::vector<std::vector<double>> rows = table.rows(key);
  if (rows.size() != 3) table.refuse(key, std::to_string(rows.size()) + " rows", "must have three rows");
  for (std::size_t i = 0; i < 3; ++i) {
    if (rows[i].size() != 3) {
      table.refuse(key, std::to_string(rows[i].size()) + " numbers in row " + std::to_string(i + 1),
                   "must have three numbers in each row");
    }
    for (std::size_t j = 0; j < 3; ++j) result[i][j] = rows[i][j];
  }
  return result;
}

Matrix3 matrix(const TomlTable& table, const std::string& key, double largest, const std::string& unit) {
  const Matrix3 result = read_matrix(table, key);
  for (const auto& row : {result.x, result.y, result.z})
    for (const double value : {row.x, row.y, row.z}) check_size(table, key, value, largest, unit);
  return result;
}

controller::Vector3<double> vector(const PerAxis& v) { return {v[0], v[1], v[2]}; }

/// Reads gains in newton, by the names of the Crazyflie firmware's parameters ctrlMel.*.
void read_mellinger(const TomlTable& position, Gains& gains) {
  for (const char* const key : {"Kp", "Kd", "Ki", "Lambda", "K", "integrator_limit"}) {
    if (position.has(key))
      position.refuse(key, "", "cannot be combined with kp_xy, kp_z, ... of the Mellinger controller",
                      "give one form");
  }
  if (!position.has("mass"))
    position.refuse("mass", "", "is missing: kp_xy, ... are in N/m and are divided by the mass",
                    "give the mass that the firmware is told, ctrlMel.mass, in kg");
  const double mass_told_kg = positive(position, "mass");
  if (position.has("massThrust"))
    positive(position, "massThrust");  // PWM per newton: no part of the position law
  const auto of_axis = [&](const std::string& axis) {
    const auto in_newton = [&](const char* gain, bool may_be_left_out, double largest, const char* unit) {
      const std::string key = gain + axis;
      if (may_be_left_out && !position.has(key)) return 0.0;
      const double value = may_be_left_out ? non_negative(position, key) : positive(position, key);
      if (value / mass_told_kg > largest)
        position.refuse(key, text_of(value), "exceeds " + text_of(largest * mass_told_kg) + " " + unit,
                        "the value is in " + std::string(unit));
      return value;
    };
    return controller::to_pid(
        controller::AxisForceGains<double>{in_newton("kp_", false, kLargestKp_1_s2, "N/m"),
                                           in_newton("kd_", false, kLargestKd_1_s, "N s/m"),
                                           in_newton("ki_", true, kLargestKi_1_s3, "N/(m s)")},
        mass_told_kg);
  };
  const controller::AxisPid<double> xy = of_axis("xy"), z = of_axis("z");
  gains.pid = PidGains{{xy.Kp_1_s2, xy.Kp_1_s2, z.Kp_1_s2},
                       {xy.Kd_1_s, xy.Kd_1_s, z.Kd_1_s},
                       {xy.Ki_1_s3, xy.Ki_1_s3, z.Ki_1_s3}};
  if (position.has("i_range_xy"))
    gains.integrator_limit_m_s[0] = gains.integrator_limit_m_s[1] = non_negative(position, "i_range_xy");
  if (position.has("i_range_z")) gains.integrator_limit_m_s[2] = non_negative(position, "i_range_z");
}

void read_position(const TomlTable& position, Gains& gains) {
  position.allow_only(files::key_names(describe_position));
  const bool is_mellinger = position.has("kp_xy") || position.has("kp_z");
  const bool is_pid = position.has("Kp") || position.has("Kd") || position.has("Ki");
  const bool is_composite = position.has("Lambda") || position.has("K");
  if (is_pid && is_composite) {
    position.refuse(position.has("Lambda") ? "Lambda" : "K", "", "cannot be combined with Kp, Kd or Ki",
                    "give Kp, Kd, Ki or Lambda, K");
  }
  if (!is_pid && !is_composite && !is_mellinger)
    position.refuse("", "", "has no gains", "give Kp, Kd, Ki or Lambda, K");
  if (is_mellinger) {
    read_mellinger(position, gains);
  } else if (is_pid) {
    gains.pid = PidGains{vector(per_axis(position, "Kp", false, kLargestKp_1_s2, "1/s^2")),
                         vector(per_axis(position, "Kd", false, kLargestKd_1_s, "1/s")),
                         vector(per_axis(position, "Ki", true, kLargestKi_1_s3, "1/s^3"))};
  } else {
    gains.composite = CompositeGains{matrix(position, "Lambda", kLargestLambda_1_s, "1/s"),
                                     matrix(position, "K", kLargestK_kg_s, "kg/s")};
  }
  if (position.has("integrator_limit")) {
    gains.integrator_limit_m_s = per_axis(position, "integrator_limit", true, kLongestIntegral_m_s, "m s");
  }
  if (position.has("rate_hz")) {
    gains.rate_hz = loop_rate_hz(position);
    gains.integrator_step_s = 1 / gains.rate_hz;
  }
  if (position.has("integrator_step_s")) {
    if (gains.rate_hz == 0) {
      position.refuse("integrator_step_s", text_of(position.number("integrator_step_s")),
                      "applies only to a sampled loop", "add rate_hz");
    }
    gains.integrator_step_s = seconds(position, "integrator_step_s", positive(position, "integrator_step_s"));
  }
}

void read_attitude(const TomlTable& table, Gains& gains) {
  const bool has_gains = table.has("KR") || table.has("Kw") || table.has("KI");
  if (table.has("law") || !has_gains) {
    gains.attitude_law = table.choice("law", kAttitudeLaws) == 0 ? AttitudeLaw::kLee : AttitudeLaw::kRobust;
  }
  if (!has_gains) return;
  for (const char* const key : {"KR", "Kw"})
    if (!table.has(key))
      table.refuse(key, "", "is missing, but other gains of the attitude law are given", "add it");
  gains.attitude = AttitudeGains{per_axis(table, "KR", false, kLargestAttitudeGain, "N m"),
                                 per_axis(table, "Kw", false, kLargestAttitudeGain, "N m s"),
                                 {0, 0, 0}};
  if (table.has("KI"))
    gains.attitude->KI_Nm_per_s = per_axis(table, "KI", true, kLargestAttitudeGain, "N m/s");
}

}  // namespace

void describe_gains_file(files::Keys& keys) {
  keys.schema(kSchema);
  keys.must_table("position", "The position loop; three numbers are of x, y and z.", describe_position);
  keys.may_table("attitude", "The attitude law and its gains.", describe_attitude);
  keys.may_table("lag", "Lags and delay that the loop has.", describe_lag);
  keys.may_table("network", "Rate and latency of the network's force.", describe_feed);
}

Gains parse_gains(const std::string& text, const std::string& path) {
  const toml::table document = files::parse_toml(text, path);
  const TomlTable top(document, path);
  top.require_schema(kSchema);
  top.allow_only(files::key_names(describe_gains_file));
  Gains gains;
  gains.path = path;
  gains.sha256 = files::sha256(text);
  read_position(top.table("position"), gains);
  if (top.has("attitude")) {
    const TomlTable attitude = top.table("attitude");
    attitude.allow_only(files::key_names(describe_attitude));
    read_attitude(attitude, gains);
  }
  if (top.has("lag")) {
    const TomlTable lag = top.table("lag");
    lag.allow_only(files::key_names(describe_lag));
    const auto time = [&lag](const char* key) {
      return lag.has(key) ? seconds(lag, key, non_negative(lag, key)) : 0;
    };
    gains.motor_lag_s = time("motor_s");
    gains.attitude_lag_s = time("attitude_s");
    gains.body_rate_lag_s = time("body_rate_s");
    gains.delay_s = time("delay_s");
  }
  if (top.has("network")) {
    const TomlTable network = top.table("network");
    network.allow_only(files::key_names(describe_feed));
    if (network.has("rate_hz")) gains.network_rate_hz = loop_rate_hz(network);
    if (network.has("latency_s"))
      gains.network_latency_s = seconds(network, "latency_s", non_negative(network, "latency_s"));
  }
  return gains;
}

Gains load_gains(const std::string& path) { return parse_gains(files::read_file(path), path); }

}  // namespace swarmcert::stability
