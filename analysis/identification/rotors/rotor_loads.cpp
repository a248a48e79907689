#include "analysis/identification/rotors/rotor_loads.h"

#include <algorithm>
#include <cmath>

#include "analysis/residuals/over_tracks.h"
#include "analysis/residuals/torque_residual.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

/// Computes means over blocks and their scatter.
void summarize(const std::vector<Eigen::Vector4d>& blocks, RotorLoads& loads) {
  const auto count = static_cast<double>(blocks.size());
  for (const Eigen::Vector4d& block : blocks) loads.mean_N += block / count;
  Eigen::Vector4d squares = Eigen::Vector4d::Zero();
  for (const Eigen::Vector4d& block : blocks) squares += (block - loads.mean_N).cwiseAbs2();
  loads.error_N = (squares / (count * std::max(count - 1, 1.0))).cwiseSqrt();
}

/// Returns which rotor of the model stands front right, back right, back left and front left; empty unless there are
/// four, one in each quadrant, and those on the diagonal through front right turn counterclockwise: `rotor_thrust`
/// assumes such a vehicle.
std::vector<std::size_t> rotors_in_order(const stability::Model& model) {
  constexpr double kSides[4][2] = {{1, -1}, {-1, -1}, {-1, 1}, {1, 1}};
  const std::vector<stability::RotorPlace> places = stability::rotor_places(model);
  std::vector<std::size_t> order;
  if (places.size() != 4) return order;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto is_there = [&](const stability::RotorPlace& place) {
      return place.x_m * kSides[k][0] > 0 && place.y_m * kSides[k][1] > 0 &&
             place.counterclockwise == (k % 2 == 0);
    };
    const auto found = std::find_if(places.begin(), places.end(), is_there);
    if (found == places.end()) return {};
    order.push_back(static_cast<std::size_t>(found - places.begin()));
  }
  return order;
}

RotorLoads loads_of(const Track& track, const stability::Model& model,
                    const std::vector<std::size_t>& order) {
  constexpr double kBlock_s = 1;
  RotorLoads loads;
  loads.flight = track.flight;
  loads.vehicle = track.vehicle;
  double lowest_m = INFINITY, time_s = 0;
  for (const stability::Instant& now : track.instants) lowest_m = std::min(lowest_m, now.p_W_m.z());
  std::vector<Eigen::Vector4d> blocks;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  double in_block = 0, in_block_s = 0;
  for (std::size_t i = 1; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    const bool is_slow = std::abs(now.v_W_m_s.z()) < kMostClimb_m_s &&
                         now.p_W_m.z() - lowest_m > kLeastRise_m && track.cut[i] == residuals::Cut::kNone;
    if (!is_slow || track.restarts[i] != 0) continue;
    const residuals::RotorForces force_N = residuals::rotor_forces_N(model, track, i);
    for (std::size_t k = 0; k < 4; ++k) sum[static_cast<Eigen::Index>(k)] += force_N[order[k]];
    in_block += 1;
    in_block_s += now.time_s - track.instants[i - 1].time_s;
    ++loads.records;
    if (in_block_s < kBlock_s) continue;
    time_s += in_block_s;
    blocks.emplace_back(sum / in_block);
    sum.setZero();
    in_block = in_block_s = 0;
  }
  if (time_s < kLeastSlowFlight_s) loads.records = 0;
  if (loads.records > 0) summarize(blocks, loads);
  return loads;
}

}  // namespace

std::vector<RotorLoads> rotor_loads(const residuals::Inputs& inputs, const std::string& kind, int jobs) {
  return residuals::over_tracks<RotorLoads>(inputs, jobs,
                                            [&](const Track& track, std::vector<RotorLoads>& all) {
                                              if (track.kind != kind || !track.has_height) return;
                                              const stability::Model model = inputs.model_for(track);
                                              const std::vector<std::size_t> order = rotors_in_order(model);
                                              if (order.empty() || !residuals::has_rotor_forces(model, track))
                                                return;
                                              RotorLoads loads = loads_of(track, model, order);
                                              if (loads.records > 0) all.push_back(std::move(loads));
                                            });
}

}  // namespace swarmcert::identification
