/// @file Fitted parameters of effects in the results and texts of diagnose and add.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "stability/model.h"

namespace swarmcert::analysis {

/// Offset between a parameter as shown in results and as stored in the model file: 1 for the ratio of thrust_ratio,
/// which results give as a factor (1 is nominal) and model files as the excess over 1; else 0.
double shown_beyond_file(const std::string& effect, const std::string& parameter);

/// Formats an interval as in results, "0.05 .. 0.07"; empty if there is no interval.
std::string interval_words(const std::string& effect, const std::string& parameter,
                           const std::map<std::string, Interval>& intervals);

/// Returns {"tau_s": {"value": 0.06, "interval_90": [0.05, 0.07]}}; without the interval if there is none.
files::Json values_json(const std::string& effect, const std::map<std::string, double>& values,
                        const std::map<std::string, Interval>& intervals);

/// Whether `effect` is an error of a logged signal rather than a force on the vehicle.
bool is_sensor_error(const std::string& effect);
/// Returns "accelerometer_scale is an error of a sensor, not a force". Precondition: is_sensor_error(effect).
std::string sensor_words(const std::string& effect);

/// Returns one entry per effect with its parameters and their intervals.
files::Json effects_json(const std::vector<stability::EffectSpec>& effects);

/// Prints one line per parameter, each after `prefix`: "tau_s = 0.06, 90 % 0.05 .. 0.07".
void print_values(const std::string& effect, const std::string& prefix,
                  const std::map<std::string, double>& values,
                  const std::map<std::string, Interval>& intervals);

}  // namespace swarmcert::analysis
