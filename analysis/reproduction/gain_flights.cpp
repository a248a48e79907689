#include "analysis/reproduction/gain_flights.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>

#include "analysis/logs/read_log.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"
#include "stability/model.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

/// Below this height a vehicle is standing, taking off or landing.
constexpr double kGround_m = 0.2;
/// A setpoint with a smaller range is treated as constant.
constexpr double kMoves_m = 0.1;
/// Number of initial records in which a log may pause while the recorder starts.
constexpr std::size_t kHead = 10;
constexpr std::size_t kFewestRecords = 100;

struct InfoLine {
  std::string value;
  int line = 0;
};

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r'\""), last = text.find_last_not_of(" \t\r'\"");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

class InfoFile {
 public:
  explicit InfoFile(const std::string& path) : path_(path) {
    std::istringstream lines(files::read_file(path, std::size_t{1} << 20));
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      const std::size_t colon = line.find(':');
      if (colon == std::string::npos || trimmed(line).rfind('#', 0) == 0) continue;
      lines_[trimmed(line.substr(0, colon))] = {trimmed(line.substr(colon + 1)), number};
    }
  }

  double number(const std::string& key) const {
    const auto found = lines_.find(key);
    if (found == lines_.end()) {
      throw files::InputError({path_, "", key, "", "is missing", "state it as KEY: VALUE on a line"});
    }
    const InfoLine& line = found->second;
    char* end = nullptr;
    const double value = std::strtod(line.value.c_str(), &end);
    if (line.value.empty() || *end != '\0' || !(value >= 0) || !(value < 1e6)) {
      throw files::InputError({path_, "line " + std::to_string(line.line), key, files::in_quotes(line.value),
                               "is not a number from 0 to 1e6", ""});
    }
    return value;
  }
  std::array<double, 3> of_axes(const std::string& prefix) const {
    return {number(prefix + "x"), number(prefix + "y"), number(prefix + "z")};
  }
  std::string text(const std::string& key) const {
    const auto found = lines_.find(key);
    return found == lines_.end() ? "" : found->second.value;
  }
  int line_of(const std::string& key) const { return lines_.at(key).line; }

 private:
  std::string path_;
  std::map<std::string, InfoLine> lines_;
};

/// Returns the digits of "log104_2"; empty for names of another form.
std::string digits_of(const std::string& name) {
  if (name.rfind("log", 0) != 0) return "";
  std::size_t end = 3;
  while (end < name.size() && name[end] >= '0' && name[end] <= '9') ++end;
  return end == name.size() || name[end] == '_' ? name.substr(3, end - 3) : "";
}

/// Index of the first record after the last pause near the start of the log.
std::size_t first_record(const std::vector<logs::Sample>& samples) {
  std::size_t first = 0;
  for (std::size_t k = 1; k < std::min(kHead, samples.size()); ++k)
    if (samples[k].restarts) first = k;
  return first;
}

/// The velocity of the setpoint, interpolated to equal time steps.
std::vector<double> at_equal_steps(const std::vector<logs::Sample>& samples, std::size_t first,
                                   std::size_t axis) {
  std::vector<double> result;
  const double start_us = samples[first].time_us, step_us = kSetPointStep_s * 1e6;
  const auto count = static_cast<std::size_t>((samples.back().time_us - start_us) / step_us);
  std::size_t k = first;
  for (std::size_t n = 0; n <= count; ++n) {
    const double time_us = start_us + static_cast<double>(n) * step_us;
    while (k + 2 < samples.size() && samples[k + 1].time_us < time_us) ++k;
    const double share = (time_us - samples[k].time_us) / (samples[k + 1].time_us - samples[k].time_us);
    const double from = samples[k].target_velocity_m_s[axis], to = samples[k + 1].target_velocity_m_s[axis];
    result.push_back(from + std::clamp(share, 0.0, 1.0) * (to - from));
  }
  return result;
}

FlownAxis flown_axis(const std::vector<logs::Sample>& samples, std::size_t first, std::size_t axis) {
  FlownAxis flown;
  double squares = 0, least = INFINITY, largest = -INFINITY;
  for (std::size_t k = first; k < samples.size(); ++k) {
    const double target_m = samples[k].target_position_m[axis];
    const double error_m = samples[k].position_m[axis] - target_m;
    flown.peak_m = std::max(flown.peak_m, std::abs(error_m));
    squares += error_m * error_m;
    least = std::min(least, target_m);
    largest = std::max(largest, target_m);
    flown.speed_m_s = std::max(flown.speed_m_s, std::abs(samples[k].target_velocity_m_s[axis]));
  }
  flown.rms_m = std::sqrt(squares / static_cast<double>(samples.size() - first));
  flown.range_m = largest - least;
  if (flown.range_m > kMoves_m) flown.set_point_m_s = at_equal_steps(samples, first, axis);
  return flown;
}

/// Returns why the position loop cannot be judged from this log; empty if it can.
std::string problem_of(const logs::Log& log, std::size_t first) {
  if (!log.signals.position || !log.signals.targets) return "has no position and set point";
  if (log.signals.thrust != logs::ThrustSource::kForce) return "has no commanded thrust in newtons";
  if (log.samples.size() < first + kFewestRecords) return "has fewer than 100 records";
  for (std::size_t k = first; k < log.samples.size(); ++k) {
    const logs::Sample& sample = log.samples[k];
    if (!std::isfinite(sample.target_position_m[2] + sample.target_velocity_m_s[2]))
      return "has records without a set point";
    if (std::min(sample.position_m[2], sample.target_position_m[2]) < kGround_m)
      return "stands on the ground, takes off, lands or falls: lower than 0.2 m";
  }
  return "";
}

struct ReadFlight {
  std::optional<GainFlight> flight;
  std::string why;
};

ReadFlight read_gain_flight(const fs::path& path, const FlownGains& gains) {
  logs::Log log;
  try {
    log = logs::read_log(path.string());
  } catch (const files::InputError& error) {
    return {std::nullopt, error.what()};
  }
  const std::size_t first = first_record(log.samples);
  const std::string problem = problem_of(log, first);
  if (!problem.empty()) return {std::nullopt, problem};
  GainFlight flight;
  flight.log = path.filename().string();
  flight.sha256 = files::sha256_of_file(path.string());
  flight.gains = gains;
  double thrust_N = 0;
  for (std::size_t k = first; k < log.samples.size(); ++k) thrust_N += log.samples[k].given_thrust;
  thrust_N /= static_cast<double>(log.samples.size() - first);
  if (!(thrust_N > 0)) return {std::nullopt, "has no positive thrust"};
  flight.thrust_ratio = gains.mass_kg * stability::kGravity_m_s2 / thrust_N;
  for (std::size_t axis = 0; axis < 3; ++axis) flight.axes[axis] = flown_axis(log.samples, first, axis);
  return {std::move(flight), ""};
}

}  // namespace

FlownGains read_flown_gains(const std::string& path) {
  const InfoFile file(path);
  FlownGains gains;
  gains.Kp = file.of_axes("Kpos_P");
  gains.Kd = file.of_axes("Kpos_D");
  gains.Ki = file.of_axes("Kpos_I");
  gains.KR = file.of_axes("KR_");
  gains.Kw = file.of_axes("Kw_");
  gains.KI = file.of_axes("KI_");
  gains.mass_kg = file.number("mass");
  gains.motors = file.text("motors");
  const auto require_positive = [&](const std::string& key, double value) {
    if (value > 0) return;
    throw files::InputError({path, "line " + std::to_string(file.line_of(key)), key, "0",
                             "is not positive: such a loop does not hold a position", ""});
  };
  for (std::size_t k = 0; k < 3; ++k) {
    require_positive(std::string("Kpos_P") + "xyz"[k], gains.Kp[k]);
    require_positive(std::string("Kpos_D") + "xyz"[k], gains.Kd[k]);
  }
  for (std::size_t k = 0; k < 2; ++k) require_positive(std::string("KR_") + "xyz"[k], gains.KR[k]);
  require_positive("mass", gains.mass_kg);
  if (gains.mass_kg > 10)
    throw files::InputError({path, "line " + std::to_string(file.line_of("mass")), "mass", file.text("mass"),
                             "is more than 10 kg", "state it in kilograms"});
  return gains;
}

GainFolder read_gain_folder(const std::string& path, const Setting& setting) {
  const fs::path logs = fs::path(path) / "logs", info = fs::path(path) / "info";
  if (!fs::is_directory(logs) || !fs::is_directory(info)) {
    throw files::InputError({path, "", "", "", "has no folders logs/ and info/",
                             "logs/logNN[_k] are flights, info/infoNN.yaml their gains"});
  }
  GainFolder folder;
  folder.path = path;
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(logs))
    if (entry.is_regular_file()) names.push_back(entry.path());
  std::sort(names.begin(), names.end());
  std::vector<std::pair<fs::path, FlownGains>> tasks;
  for (const fs::path& name : names) {
    const std::string digits = digits_of(name.filename().string());
    const std::string gains = (info / ("info" + digits + ".yaml")).string();
    if (digits.empty() || !fs::is_regular_file(gains)) {
      folder.left_out.emplace_back(name.filename().string(), digits.empty()
                                                                 ? "is not named logNN or logNN_k"
                                                                 : "has no info/info" + digits + ".yaml");
      continue;
    }
    tasks.emplace_back(name, read_flown_gains(gains));
    folder.inputs.push_back(name.string());
    folder.inputs.push_back(gains);
  }
  std::vector<ReadFlight> read(tasks.size());
  std::mutex mutex;
  int done = 0;
  files::parallel_for(static_cast<int>(tasks.size()), setting.jobs, [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    read[i] = read_gain_flight(tasks[i].first, tasks[i].second);
    const std::lock_guard<std::mutex> lock(mutex);
    if (setting.progress) setting.progress(++done, static_cast<int>(tasks.size()), "flights read");
  });
  for (std::size_t i = 0; i < read.size(); ++i) {
    if (read[i].flight)
      folder.flights.push_back(std::move(*read[i].flight));
    else
      folder.left_out.emplace_back(tasks[i].first.filename().string(), read[i].why);
  }
  std::sort(folder.left_out.begin(), folder.left_out.end());
  std::sort(folder.inputs.begin(), folder.inputs.end());
  folder.inputs.erase(std::unique(folder.inputs.begin(), folder.inputs.end()), folder.inputs.end());
  if (folder.flights.empty()) {
    throw files::InputError({path, "", "", "", "contains no usable flight",
                             folder.left_out.empty()
                                 ? "logs/ is empty"
                                 : folder.left_out.front().first + " " + folder.left_out.front().second});
  }
  return folder;
}

}  // namespace swarmcert::reproduction
