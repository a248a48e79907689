#include "analysis/identification/thrust/thrust_data.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "controller/battery.h"
#include "nn/base/csv.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

constexpr double kFullPwm = 65536;

/// A header cell: the name without unit, in lower case, and the unit, which may be empty.
struct Column {
  std::string name, unit, as_written;
};

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// Returns the canonical spelling of a unit; empty if `unit` is unknown.
std::string known_unit(const std::string& unit) {
  if (unit == "gf" || unit == "g" || unit == "gram" || unit == "grams") return "gf";
  if (unit == "n" || unit == "newton") return "N";
  if (unit == "mn") return "mN";
  if (unit == "v" || unit == "volt" || unit == "volts") return "V";
  if (unit == "mv") return "mV";
  if (unit == "counts" || unit == "count") return "counts";
  if (unit == "ratio" || unit == "1") return "ratio";
  if (unit == "percent" || unit == "%") return "percent";
  return "";
}

/// "thrust [g]", "thrust(g)" and "thrust_gf" name the same column.
Column parse_column(const std::string& cell) {
  Column column{lower(cell), "", cell};
  const std::size_t open = column.name.find_first_of("[(");
  if (open != std::string::npos) {
    const std::size_t close = column.name.find_first_of("])", open);
    if (close != std::string::npos) {
      const std::string inside(
          files::without_blanks(std::string_view(column.name).substr(open + 1, close - open - 1)));
      column.unit = known_unit(inside);
      if (column.unit.empty()) column.unit = "?" + inside;
      column.name = files::without_blanks(column.name.substr(0, open));
    }
  } else if (const std::size_t under = column.name.rfind('_'); under != std::string::npos) {
    const std::string unit = known_unit(column.name.substr(under + 1));
    if (!unit.empty()) column.unit = unit, column.name = column.name.substr(0, under);
  }
  std::replace(column.name.begin(), column.name.end(), ' ', '_');
  return column;
}

class Reader {
 public:
  Reader(const std::string& text, std::string path, int rotors_together)
      : text_(text), rotors_together_(rotors_together) {
    data_.path = std::move(path);
  }

  ThrustData read() {
    std::string line;
    while (next_line(line) && files::without_blanks(line).empty()) {
    }
    read_header(line);
    while (next_line(line)) {
      const std::string_view row = files::without_blanks(line);
      if (row.empty() || row[0] == '#') continue;
      read_row(line);
    }
    if (data_.samples.empty()) refuse("", "", "the table has no rows", "one row per measurement");
    settle_pwm_unit();
    return std::move(data_);
  }

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& what,
                           const std::string& hint) const {
    throw files::InputError({data_.path, fmt::format("line {}", line_number_), field, value, what, hint});
  }

  bool next_line(std::string& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++line_number_;
    return true;
  }

  void read_header(std::string line) {
    line = std::string(files::without_blanks(line));
    if (!line.empty() && line[0] == '#') line.erase(0, 1);
    separator_ = files::csv_separator(line, ',');
    for (const std::string_view cell : files::csv_cells(line, separator_))
      columns_.push_back(parse_column(std::string(cell)));
    pwm_ = find({"pwm", "motor_pwm", "u"}, "pwm", {"counts", "ratio", "percent"}, data_.pwm, true);
    const auto voltage = find({"vbat", "voltage", "battery", "battery_voltage", "bat"}, "vbat", {"V", "mV"},
                              data_.voltage, false);
    const auto thrust = find({"thrust", "force", "load"}, "thrust", {"gf", "N", "mN"}, data_.thrust, false);
    voltage_ = voltage.front();
    thrust_ = thrust.front();
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const std::string& name = columns_[i].name;
      if (name == "run" || name == "ramp" || name == "sweep") run_ = i, data_.has_runs = true;
    }
  }

  /// Returns the columns of one signal: one or, with `several`, those whose names end in 1 to 4.
  std::vector<std::size_t> find(const std::vector<std::string>& names, const std::string& signal,
                                const std::vector<std::string>& units, SignalSource& source,
                                bool several) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      std::string name = columns_[i].name;
      const bool numbered = several && !name.empty() && name.back() >= '1' && name.back() <= '4';
      if (numbered) name.pop_back();
      if (numbered && !name.empty() && name.back() == '_') name.pop_back();
      if (std::find(names.begin(), names.end(), name) != names.end()) found.push_back(i);
    }
    if (found.empty()) {
      std::string there;
      for (const Column& column : columns_) there += (there.empty() ? "" : ", ") + column.as_written;
      refuse(signal, files::in_quotes(there), "no column of the header matches this signal",
             fmt::format("name one '{}'", signal == "thrust" ? "thrust_gf" : signal));
    }
    for (const std::size_t i : found) {
      const Column& column = columns_[i];
      const std::string& unit = column.unit.empty() ? units.front() : column.unit;
      if (std::find(units.begin(), units.end(), unit) == units.end()) {
        std::string choice;
        for (const std::string& u : units) choice += (choice.empty() ? "" : ", ") + u;
        refuse(signal, files::in_quotes(column.as_written), "the unit does not fit this signal", choice);
      }
      if (i != found.front() &&
          (!several || unit != source.unit || column.name == columns_[found.front()].name)) {
        refuse(signal, files::in_quotes(columns_[found.front()].as_written + ", " + column.as_written),
               "more than one column matches this signal", "rename or remove all but one");
      }
      source.column += (source.column.empty() ? "" : ", ") + column.as_written;
      source.unit = unit;
    }
    return found;
  }

  double number(const std::vector<std::string_view>& cells, std::size_t column) const {
    const std::string& name = columns_[column].as_written;
    if (column >= cells.size()) {
      refuse(name, "", fmt::format("the row has {} cells, the header {}", cells.size(), columns_.size()),
             "complete or remove the row");
    }
    double value = 0;
    if (!files::csv_number(cells[column], value) || !std::isfinite(value)) {
      refuse(name, files::in_quotes(cells[column]), "not a finite number", "correct or remove the row");
    }
    return value;
  }

  void read_row(const std::string& line) {
    const std::vector<std::string_view> cells = files::csv_cells(line, separator_);
    if (cells.size() > columns_.size()) {
      refuse("", "", fmt::format("the row has {} cells, the header {}", cells.size(), columns_.size()),
             "one cell per column");
    }
    ThrustSample sample;
    sample.line = line_number_;
    for (const std::size_t i : pwm_) {
      const double value = number(cells, i);
      const double most = data_.pwm.unit == "ratio" ? 1 : data_.pwm.unit == "percent" ? 100 : kFullPwm;
      if (value < 0 || value > most) {
        refuse(columns_[i].as_written, fmt::format("{}", value), fmt::format("PWM is between 0 and {}", most),
               "name the unit in the header: counts, ratio or percent");
      }
      sample.p += value / static_cast<double>(pwm_.size());
    }
    const double volts = number(cells, voltage_) * (data_.voltage.unit == "mV" ? 1e-3 : 1.0);
    if (volts < controller::kLowestVoltage_V || volts > controller::kHighestVoltage_V) {
      refuse(
          columns_[voltage_].as_written, fmt::format("{} V", volts),
          fmt::format("a cell has {} to {} V", controller::kLowestVoltage_V, controller::kHighestVoltage_V),
          "name the unit in the header, V or mV");
    }
    sample.v = volts / controller::kReferenceVoltage_V;
    const double force = number(cells, thrust_);
    const double gf = data_.thrust.unit == "gf"  ? 1.0
                      : data_.thrust.unit == "N" ? 1.0 / controller::kNewtonPerGramForce
                                                 : 1e-3 / controller::kNewtonPerGramForce;
    sample.thrust_gf = force * gf / rotors_together_;
    if (run_ != kNone) sample.run = std::lround(number(cells, run_));
    data_.samples.push_back(sample);
  }

  /// Counts unless the header says otherwise; a table whose largest value is at most 1 must be ratios.
  void settle_pwm_unit() {
    double largest = 0;
    for (const ThrustSample& sample : data_.samples) largest = std::max(largest, sample.p);
    const bool unit_is_written = !columns_[pwm_.front()].unit.empty();
    if (!unit_is_written && largest <= 1) data_.pwm.unit = "ratio";
    const double divisor = data_.pwm.unit == "counts" ? kFullPwm : data_.pwm.unit == "percent" ? 100 : 1;
    for (ThrustSample& sample : data_.samples) sample.p /= divisor;
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  const std::string& text_;
  const int rotors_together_;
  std::size_t at_ = 0;
  int line_number_ = 0;
  char separator_ = ',';
  std::vector<Column> columns_;
  std::vector<std::size_t> pwm_;
  std::size_t voltage_ = 0, thrust_ = 0, run_ = kNone;
  ThrustData data_;
};

}  // namespace

ThrustData load_thrust_data(const std::string& path, int rotors_together) {
  return parse_thrust_data(files::read_file(path), path, rotors_together);
}

ThrustData parse_thrust_data(const std::string& text, const std::string& path, int rotors_together) {
  return Reader(text, path, rotors_together).read();
}

}  // namespace swarmcert::analysis
