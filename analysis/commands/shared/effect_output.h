/// @file Fitted numbers of effects in the results and texts of diagnose and add.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "stability/model.h"

namespace swarmcert::analysis {

/// What results show of a number beyond what the model file holds: 1 for the ratio of thrust_ratio, which results give
/// as a factor (1 is nominal) and model files as the excess over 1; else 0.
double shown_beyond_file(const std::string& effect, const std::string& parameter);

/// "0.05 .. 0.07" as results show it; empty where there is no interval.
std::string interval_words(const std::string& effect, const std::string& parameter,
                           const std::map<std::string, Interval>& intervals);

/// {"tau_s": {"value": 0.06, "interval_90": [0.05, 0.07]}}; without the interval where there is none.
files::Json values_json(const std::string& effect, const std::map<std::string, double>& values,
                        const std::map<std::string, Interval>& intervals);

/// Whether `effect` is an error of what the log says, and no force on the vehicle.
bool is_sensor_error(const std::string& effect);
/// "accelerometer_scale is an error of a sensor, not a force". Precondition: is_sensor_error(effect).
std::string sensor_words(const std::string& effect);

/// One entry per effect with its parameters and their intervals.
files::Json effects_json(const std::vector<stability::EffectSpec>& effects);

/// A line per number, each after `prefix`: "tau_s = 0.06, 90 % 0.05 .. 0.07".
void print_values(const std::string& effect, const std::string& prefix,
                  const std::map<std::string, double>& values,
                  const std::map<std::string, Interval>& intervals);

}  // namespace swarmcert::analysis
