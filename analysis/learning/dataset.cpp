#include "analysis/learning/dataset.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>

#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/torque_residual.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::learning {
namespace {

using Eigen::Index;
using residuals::Track;

constexpr int kNeighbourInputs = 6;  ///< relative position and velocity
constexpr double kBlock_s = 2, kPurge_s = 0.15;

/// Samples of one track, before the kinds in all flights are known.
struct RawTrack {
  TrackSamples about;
  std::string kind;
  std::vector<double> time_s;
  std::vector<Eigen::Vector3f> target;    ///< only z if the target is kForceZ
  std::vector<std::array<float, 4>> own;  ///< -z, -v
  std::vector<std::size_t> first = {0};
  std::vector<int> neighbour_kind;  ///< index into Kinds::names
  std::vector<std::array<float, kNeighbourInputs>> neighbour;
};

/// Residual of the model along the track, in SI units and world axes. If there is none, returns an empty vector and
/// adds a problem.
std::vector<Eigen::Vector3d> left_by_model(const Track& track, const residuals::Inputs& inputs, Target target,
                                           std::vector<std::string>& problems) {
  const stability::Model model = inputs.model_for(track);
  if (target != Target::kTorque) return residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  residuals::TorqueResidual residual = residuals::torque_residual(model, inputs.kinds, track);
  if (!residual.refused.empty())
    problems.push_back(track.flight + " " + track.vehicle + ": no torque: " + residual.refused);
  for (std::size_t i = 0; i < residual.torque_B_Nm.size(); ++i)
    residual.torque_B_Nm[i] = track.instants[i].R_WB * residual.torque_B_Nm[i];
  return std::move(residual.torque_B_Nm);
}

RawTrack raw_samples(const Track& track, const residuals::Inputs& inputs, Target target,
                     std::vector<std::string>& problems) {
  RawTrack raw;
  raw.about = {track.flight, track.scenario, track.vehicle, "", Use::kFit, 0, 0};
  raw.kind = track.kind;
  const std::vector<Eigen::Vector3d> residual = left_by_model(track, inputs, target, problems);
  for (std::size_t i = 0; i < residual.size(); ++i) {
    if (track.cut[i] != residuals::Cut::kNone || residual[i].hasNaN()) continue;
    const stability::Instant& now = track.instants[i];
    raw.time_s.push_back(now.time_s);
    raw.target.push_back((residual[i] / info(target).SI_per_unit).cast<float>());
    const Eigen::Vector3f v = now.v_W_m_s.cast<float>();
    raw.own.push_back({static_cast<float>(-now.p_W_m.z()), -v.x(), -v.y(), -v.z()});
    for (int j = 0; j < now.num_neighbours; ++j) {
      const stability::Neighbour& other = now.neighbours[j];
      const Eigen::Vector3f dp = other.dp_W_m.cast<float>();
      const Eigen::Vector3f dv = other.dv_W_m_s.cast<float>();
      raw.neighbour.push_back({dp.x(), dp.y(), dp.z(), dv.x(), dv.y(), dv.z()});
      raw.neighbour_kind.push_back(other.kind);
    }
    raw.first.push_back(raw.neighbour.size());
  }
  return raw;
}

/// Loads all flights of `inputs` in their order.
std::vector<std::vector<RawTrack>> load(const residuals::Inputs& inputs, Target target, int jobs,
                                        const std::function<void()>& flight_done,
                                        std::vector<std::string>& problems) {
  const std::size_t count = inputs.found.flights.size();
  std::vector<std::vector<RawTrack>> flights(count);
  std::vector<std::vector<std::string>> all_problems(count);
  files::parallel_for(static_cast<int>(count), jobs, [&](int f) {
    for (const Track& track : inputs.load(static_cast<std::size_t>(f), all_problems[f])) {
      if (track.position_only || track.used == 0 || inputs.model_of(track.kind) == nullptr) continue;
      RawTrack raw = raw_samples(track, inputs, target, all_problems[f]);
      if (!raw.target.empty()) flights[f].push_back(std::move(raw));
    }
    flight_done();
  });
  for (const std::vector<std::string>& some : all_problems)
    problems.insert(problems.end(), some.begin(), some.end());
  return flights;
}

/// Whether flights of the fit must provide the selecting and the test samples.
struct HeldBack {
  bool select, test;

  Use of_five(std::size_t index) const {
    if (select && index % 5 == 2) return Use::kSelect;
    if (test && index % 5 == 4) return Use::kTest;
    return Use::kFit;
  }
  Use of_flight(std::size_t flight, std::size_t flights) const {
    if (flights >= 5) return of_five(flight);
    if (test && flight + 1 == flights && flights > 1) return Use::kTest;
    if (select && flight + (test ? 2 : 1) == flights && flights > 1) return Use::kSelect;
    return Use::kFit;
  }
};

/// Returns the layout: a phi per kind that occurs as a neighbour, a rho per kind whose force is known.
training::Layout layout_of(const std::vector<RawTrack>& tracks, const std::vector<std::string>& kinds,
                           const NetworkSizes& sizes, Target target) {
  std::set<std::string> neighbours, own;
  for (const RawTrack& track : tracks) {
    own.insert(track.kind);
    for (const int kind : track.neighbour_kind) neighbours.insert(kinds[kind]);
  }
  using Plane = std::array<int, 2>;
  std::vector<training::Part> parts;
  const auto add = [&parts](const files::FunctionId& part, int inputs, const std::vector<int>& hidden,
                            int outputs, std::vector<Plane> horizontal) {
    std::vector<int> all = {inputs};
    all.insert(all.end(), hidden.begin(), hidden.end());
    all.push_back(outputs);
    parts.push_back({part, std::move(all), 0, std::move(horizontal)});
  };
  if (sizes.ground)
    add(files::FunctionId::ground_phi(), files::kGroundInputs, sizes.phi, sizes.features, {Plane{1, 2}});
  for (const std::string& kind : neighbours) {
    add(files::FunctionId::phi(kind), kNeighbourInputs, sizes.phi, sizes.features,
        {Plane{0, 1}, Plane{3, 4}});
  }
  for (const std::string& kind : own)
    add(files::FunctionId::rho(kind), sizes.features, sizes.rho, info(target).components, {});
  return training::Layout(std::move(parts));
}

/// Returns the end, at most `to`, of the records from `from` on with the same number of neighbours of each kind.
std::size_t same_neighbours(const RawTrack& raw, std::size_t from, std::size_t to) {
  const auto begin = [&raw](std::size_t i) {
    return raw.neighbour_kind.begin() + static_cast<long>(raw.first[i]);
  };
  std::size_t end = from + 1;
  while (end < to && std::is_permutation(begin(from), begin(from + 1), begin(end), begin(end + 1))) ++end;
  return end;
}

/// Appends records of one composition.
void append_alike(LearningData& data, const RawTrack& raw, const std::vector<std::string>& kinds,
                  std::size_t from, std::size_t to, Use use) {
  TrackSamples about = raw.about;
  about.use = use;
  std::vector<std::string> neighbours;
  for (std::size_t j = raw.first[from]; j < raw.first[from + 1]; ++j)
    neighbours.push_back(kinds[raw.neighbour_kind[j]]);
  about.composition = files::composition_name(std::move(neighbours), raw.kind);
  about.begin = data.samples.samples();
  const int ground = data.layout.find(files::FunctionId::ground_phi());
  const int rho = data.layout.find(files::FunctionId::rho(raw.kind));
  std::vector<int> phi;
  for (const std::string& kind : kinds) phi.push_back(data.layout.find(files::FunctionId::phi(kind)));
  for (std::size_t i = from; i < to; ++i) {
    if (ground >= 0) data.samples.add_input(ground, {raw.own[i].begin(), raw.own[i].end()});
    for (std::size_t j = raw.first[i]; j < raw.first[i + 1]; ++j)
      data.samples.add_input(phi[raw.neighbour_kind[j]], {raw.neighbour[j].begin(), raw.neighbour[j].end()});
    const Eigen::Vector3f& y = raw.target[i];
    if (data.samples.outputs == 1)
      data.samples.add_sample(rho, {y.z()});
    else
      data.samples.add_sample(rho, {y.x(), y.y(), y.z()});
  }
  about.end = data.samples.samples();
  data.tracks.push_back(std::move(about));
}

void append(LearningData& data, const RawTrack& raw, const std::vector<std::string>& kinds, std::size_t from,
            std::size_t to, Use use) {
  while (from < to) {
    const std::size_t end = same_neighbours(raw, from, to);
    append_alike(data, raw, kinds, from, end, use);
    from = end;
  }
}

/// Appends a whole track, with its blocks of 2 s used in turn for fitting, selecting and testing.
void append_blocks(LearningData& data, const RawTrack& raw, const std::vector<std::string>& kinds,
                   HeldBack held_back) {
  const std::size_t count = raw.time_s.size();
  for (std::size_t from = 0; from < count;) {
    const double block = std::floor(raw.time_s[from] / kBlock_s);
    std::size_t to = from;
    while (to < count && std::floor(raw.time_s[to] / kBlock_s) == block) ++to;
    std::size_t first = from, last = to;
    while (first < last && raw.time_s[first] < block * kBlock_s + kPurge_s) ++first;
    while (last > first && raw.time_s[last - 1] > (block + 1) * kBlock_s - kPurge_s) --last;
    append(data, raw, kinds, first, last, held_back.of_five(static_cast<std::size_t>(std::max(block, 0.0))));
    from = to;
  }
}

}  // namespace

const TargetInfo& info(Target target) {
  static const TargetInfo kInfo[] = {
      {"force_z", "gf", "vertical force", 1, stability::kGramForce_N},
      {"force", "gf", "force", 3, stability::kGramForce_N},
      {"torque", "mN_m", "torque", 3, 1e-3},
  };
  return kInfo[static_cast<int>(target)];
}

const char* name(Use use) { return use == Use::kFit ? "fit" : use == Use::kSelect ? "select" : "test"; }

std::vector<Index> LearningData::indices(Use use) const {
  std::vector<Index> result;
  for (const TrackSamples& track : tracks) {
    if (track.use != use) continue;
    for (Index s = track.begin; s < track.end; ++s) result.push_back(s);
  }
  return result;
}

void balance(LearningData& data) {
  std::map<std::string, double> counts;
  for (const TrackSamples& track : data.tracks) {
    if (track.use == Use::kFit) counts[track.group()] += static_cast<double>(track.end - track.begin);
  }
  double total = 0;
  for (const auto& [group, count] : counts) total += count;
  for (const TrackSamples& track : data.tracks) {
    const auto found = counts.find(track.group());
    if (track.use != Use::kFit || found == counts.end()) continue;
    const double weight = total / (static_cast<double>(counts.size()) * found->second);
    for (Index s = track.begin; s < track.end; ++s) data.samples.weight[s] = static_cast<float>(weight);
  }
}

namespace {

/// Returns the tracks of the fitted flights, whole or in blocks.
/// @throws InputError if nothing can be learned from them.
std::vector<RawTrack> fitted_tracks(const std::vector<std::vector<RawTrack>>& flights,
                                    const HeldBack& held_back, const residuals::Inputs& inputs,
                                    const LearningData& data) {
  std::vector<RawTrack> fitted;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    if (data.split_by_blocks || held_back.of_flight(f, flights.size()) == Use::kFit)
      fitted.insert(fitted.end(), flights[f].begin(), flights[f].end());
  }
  const auto refuse = [&](const std::string& what, const std::string& hint) {
    throw files::InputError(
        {inputs.found.flights.empty() ? "" : inputs.found.flights.front().logs.front().second, "", "flights",
         "", what, hint});
  };
  if (fitted.empty()) {
    refuse("no usable record of a vehicle with a model among the flights to fit",
           data.problems.empty() ? "see 'swarmcert compare' for what was cut" : data.problems.front());
  }
  if (std::all_of(fitted.begin(), fitted.end(), [](const RawTrack& t) { return t.neighbour.empty(); }))
    refuse("no vehicle ever has a neighbour", "name flights of two or more vehicles");
  return fitted;
}

/// Appends a track if the network has its kinds; otherwise records why it is left out.
void append_if_known(LearningData& data, const RawTrack& track, const std::vector<std::string>& kinds,
                     Use use) {
  const auto has_phi = [&](int kind) { return data.layout.find(files::FunctionId::phi(kinds[kind])) >= 0; };
  if (data.layout.find(files::FunctionId::rho(track.kind)) >= 0 &&
      std::all_of(track.neighbour_kind.begin(), track.neighbour_kind.end(), has_phi)) {
    append(data, track, kinds, 0, track.target.size(), use);
  } else {
    data.problems.push_back(track.about.flight + " " + track.about.vehicle +
                            ": a kind of vehicle that is not in the flights to learn from");
  }
}

}  // namespace

LearningData load_learning_data(const LearningFlights& named, const NetworkSizes& sizes, SplitBy split,
                                int jobs, const Progress& progress, Target target) {
  LearningData data;
  data.target = target;
  data.samples.outputs = info(target).components;
  data.samples.target_is_axial = target == Target::kTorque;
  const residuals::Inputs& inputs = *named.fit;
  std::mutex mutex;
  int done = 0, total = 0;
  for (const residuals::Inputs* some : {named.fit, named.select, named.test}) {
    if (some != nullptr) total += static_cast<int>(some->found.flights.size());
  }
  const auto flight_done = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    progress(++done, total);
  };
  const std::vector<std::vector<RawTrack>> flights = load(inputs, target, jobs, flight_done, data.problems);
  // The use of a flight depends on its position in the list of named flights, never on its contents: otherwise a
  // damaged test flight would change which flights are fitted.
  const HeldBack held_back = {named.select == nullptr, named.test == nullptr};
  const std::size_t needed = 1 + (held_back.select ? 1 : 0) + (held_back.test ? 1 : 0);
  data.split_by_blocks =
      split == SplitBy::kBlocks || (split == SplitBy::kAuto && flights.size() < needed && needed > 1);
  data.layout = layout_of(fitted_tracks(flights, held_back, inputs, data), inputs.kinds.names, sizes, target);

  for (std::size_t f = 0; f < flights.size(); ++f) {
    for (const RawTrack& track : flights[f]) {
      if (data.split_by_blocks)
        append_blocks(data, track, inputs.kinds.names, held_back);
      else
        append_if_known(data, track, inputs.kinds.names, held_back.of_flight(f, flights.size()));
    }
  }
  const auto append_all = [&](const residuals::Inputs* others, Use use) {
    if (others == nullptr) return;
    for (const auto& tracks : load(*others, target, jobs, flight_done, data.problems)) {
      for (const RawTrack& track : tracks) append_if_known(data, track, others->kinds.names, use);
    }
  };
  append_all(named.select, Use::kSelect);
  append_all(named.test, Use::kTest);
  balance(data);
  return data;
}

}  // namespace swarmcert::learning
