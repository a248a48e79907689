#include "analysis/python/flights.h"

#include <pybind11/numpy.h>

#include <algorithm>
#include <array>
#include <functional>

#include "analysis/commands/shared/flight_options.h"
#include "analysis/logs/read_log.h"
#include "analysis/residuals/force_residual.h"

namespace py = pybind11;

namespace swarmcert::python {
namespace {

using logs::Sample;

template <typename Items, typename Get>
py::array_t<double> column(const Items& items, const Get& get) {
  py::array_t<double> result(static_cast<py::ssize_t>(items.size()));
  double* to = result.mutable_data();
  for (const auto& item : items) *to++ = get(item);
  return result;
}

/// @param get returns an object with kWidth entries.
template <std::size_t kWidth, typename Items, typename Get>
py::array_t<double> columns_of(const Items& items, const Get& get) {
  py::array_t<double> result({static_cast<py::ssize_t>(items.size()), static_cast<py::ssize_t>(kWidth)});
  double* to = result.mutable_data();
  for (const auto& item : items) {
    const auto& values = get(item);
    for (std::size_t k = 0; k < kWidth; ++k) *to++ = values[k];
  }
  return result;
}

const char* source_name(logs::SignalInfo::Source source) {
  const char* const kWords[] = {"measured", "derived", "missing"};
  return kWords[static_cast<int>(source)];
}

bool has(const logs::Log& log, const char* signal) {
  return std::any_of(log.sources.begin(), log.sources.end(), [signal](const logs::SignalInfo& info) {
    return info.name == signal && info.source != logs::SignalInfo::Source::kMissing;
  });
}

py::dict signals_of(const logs::Log& log) {
  const std::vector<Sample>& all = log.samples;
  py::dict signals;
  signals["time_s"] = column(all, [](const Sample& s) { return s.time_us * 1e-6; });
  if (log.signals.position)
    signals["position_m"] = columns_of<3>(all, [](const Sample& s) { return s.position_m; });
  if (has(log, "velocity"))
    signals["velocity_m_s"] = columns_of<3>(all, [](const Sample& s) { return s.velocity_m_s; });
  if (has(log, "specific_force"))
    signals["specific_force_m_s2"] =
        columns_of<3>(all, [](const Sample& s) { return s.specific_force_m_s2; });
  if (log.signals.attitude)
    signals["attitude"] = columns_of<4>(all, [](const Sample& s) { return s.attitude.xyzw(); });
  if (log.signals.rates)
    signals["rates_rad_s"] = columns_of<3>(all, [](const Sample& s) { return s.rates_rad_s; });
  if (log.signals.thrust == logs::ThrustSource::kDuty) {
    signals["duty"] = columns_of<4>(all, [](const Sample& s) { return s.duty; });
    signals["battery_V"] = column(all, [](const Sample& s) { return s.battery_V; });
  } else if (log.signals.thrust != logs::ThrustSource::kNone) {
    const bool is_force = log.signals.thrust == logs::ThrustSource::kForce;
    signals[is_force ? "thrust_N" : "thrust_over_hover"] =
        column(all, [](const Sample& s) { return s.given_thrust; });
  }
  if (log.signals.targets) {
    signals["target_position_m"] = columns_of<3>(all, [](const Sample& s) { return s.target_position_m; });
    signals["target_velocity_m_s"] =
        columns_of<3>(all, [](const Sample& s) { return s.target_velocity_m_s; });
  }
  if (log.signals.commands) {
    signals["motor_force_N"] = columns_of<4>(all, [](const Sample& s) { return s.motor_force_N; });
    signals["thrust_command_N"] = column(all, [](const Sample& s) { return s.thrust_command_N; });
    signals["torque_command_N_m"] = columns_of<3>(all, [](const Sample& s) { return s.torque_command_Nm; });
  }
  return signals;
}

py::dict arrays_of(const residuals::Inputs& inputs, const residuals::Track& track) {
  using stability::Instant;
  const stability::Model model = inputs.model_for(track);
  const std::vector<Eigen::Vector3d> r = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  const auto three = [](const Eigen::Vector3d& v) { return std::array<double, 3>{v[0], v[1], v[2]}; };
  py::dict result;
  result["flight"] = track.flight;
  result["vehicle"] = track.vehicle;
  result["kind"] = track.kind;
  result["file"] = track.path;
  result["judged"] = three(track.judged);
  result["time_s"] = column(track.instants, [](const Instant& i) { return i.time_s; });
  result["residual_N"] = columns_of<3>(r, three);
  result["position_m"] = columns_of<3>(track.instants, [&](const Instant& i) { return three(i.p_W_m); });
  result["velocity_m_s"] = columns_of<3>(track.instants, [&](const Instant& i) { return three(i.v_W_m_s); });
  result["thrust_N"] = column(track.instants, [](const Instant& i) { return i.thrust_N; });
  py::array_t<bool> used(static_cast<py::ssize_t>(track.cut.size()));
  py::list cut;
  for (std::size_t i = 0; i < track.cut.size(); ++i) {
    used.mutable_at(static_cast<py::ssize_t>(i)) = track.cut[i] == residuals::Cut::kNone;
    cut.append(track.cut[i] == residuals::Cut::kNone ? "" : residuals::name(track.cut[i]));
  }
  result["used"] = used;
  result["cut"] = cut;
  return result;
}

}  // namespace

py::dict read_log(const std::string& path, const std::string& columns) {
  logs::Log log;
  {
    const py::gil_scoped_release release;
    log = columns.empty() ? logs::read_log(path) : logs::read_log(path, logs::read_columns(columns));
  }
  py::dict result;
  result["path"] = log.path;
  result["format"] = log.format;
  result["signals"] = signals_of(log);
  py::list sources;
  for (const logs::SignalInfo& info : log.sources) {
    py::dict source;
    source["name"] = info.name;
    source["source"] = source_name(info.source);
    source["from"] = info.from;
    source["unit"] = info.unit;
    source["rate_hz"] = info.rate_hz;
    source["noise"] = info.noise;
    sources.append(source);
  }
  result["sources"] = sources;
  result["findings"] = logs::findings(log.health);
  result["interpretation"] = log.interpretation;
  py::list axes;
  const char* const kAxes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k)
    if (log.signals.force_axes[k]) axes.append(kAxes[k]);
  result["judged_force"] = axes;
  return result;
}

py::list residuals(const std::vector<std::string>& words, const std::string& fleet,
                   const std::string& columns, const std::string& network) {
  analysis::FlightOptions options;
  options.words = words;
  options.fleet = fleet;
  options.columns = columns;
  options.network = network;
  py::list result;
  const swarmcert::residuals::Inputs inputs = [&options] {
    const py::gil_scoped_release release;
    return analysis::read_flights(options, true, true);
  }();
  std::vector<std::string> problems;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    std::vector<swarmcert::residuals::Track> tracks;
    {
      const py::gil_scoped_release release;
      tracks = inputs.load(i, problems);
    }
    for (const swarmcert::residuals::Track& track : tracks)
      if (!track.position_only) result.append(arrays_of(inputs, track));
  }
  return result;
}

}  // namespace swarmcert::python
