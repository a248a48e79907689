/// @file Fitted parameters of effects in the results and texts of diagnose and add.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "nn/base/record.h"
#include "stability/model.h"

namespace swarmcert::analysis {

/// Offset between a parameter as shown in results and as stored in the model file: 1 for the ratio of thrust_ratio,
/// which results give as a factor (1 is nominal) and model files as the excess over 1; else 0.
double shown_beyond_file(const std::string& effect, const std::string& parameter);

/// Formats an interval as in results, "0.05 .. 0.07"; empty if there is no interval.
std::string interval_words(const std::string& effect, const std::string& parameter,
                           const std::map<std::string, Interval>& intervals);

/// A fitted parameter as results show it.
struct FittedValue {
  double value = 0;
  std::optional<Interval> interval_90;
};
void describe(files::Record& record, const FittedValue& fitted);

/// Fitted parameters by name.
using FittedValues = std::map<std::string, FittedValue>;
FittedValues fitted_values(const std::string& effect, const std::map<std::string, double>& values,
                           const std::map<std::string, Interval>& intervals);

/// Whether `effect` is an error of a logged signal rather than a force on the vehicle.
bool is_sensor_error(const std::string& effect);
/// Returns "accelerometer_scale is an error of a sensor, not a force". Precondition: is_sensor_error(effect).
std::string sensor_words(const std::string& effect);

/// Describes an effect of a model file with its fitted parameters.
void describe_effect(files::Record& record, const stability::EffectSpec& effect);

/// Prints one line per parameter, each after `prefix`: "tau_s = 0.06, 90 % 0.05 .. 0.07".
void print_values(const std::string& effect, const std::string& prefix,
                  const std::map<std::string, double>& values,
                  const std::map<std::string, Interval>& intervals);

}  // namespace swarmcert::analysis
