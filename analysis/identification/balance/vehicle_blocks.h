/// @file Collects blocks of flight by vehicle.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/residuals/over_tracks.h"

namespace swarmcert::identification {

template <typename Block>
struct VehicleBlocks {
  int flights = 0;
  std::vector<Block> blocks;
};

/// Returns the blocks of each vehicle of this kind.
/// @param blocks_of std::optional<std::vector<Block>>(track): returns the blocks of a track; nothing: skip the track
template <typename Block, typename BlocksOf>
std::map<std::string, VehicleBlocks<Block>> blocks_by_vehicle(const residuals::Inputs& inputs,
                                                              const std::string& kind, int jobs,
                                                              const BlocksOf& blocks_of) {
  using OfTrack = std::pair<std::string, std::vector<Block>>;
  const std::vector<OfTrack> tracks = residuals::over_tracks<OfTrack>(
      inputs, jobs, [&](const residuals::Track& track, std::vector<OfTrack>& all) {
        if (track.kind != kind) return;
        std::optional<std::vector<Block>> blocks = blocks_of(track);
        if (blocks) all.emplace_back(track.vehicle, std::move(*blocks));
      });
  std::map<std::string, VehicleBlocks<Block>> vehicles;
  for (const auto& [name, blocks] : tracks) {
    VehicleBlocks<Block>& vehicle = vehicles[name];
    ++vehicle.flights;
    vehicle.blocks.insert(vehicle.blocks.end(), blocks.begin(), blocks.end());
  }
  return vehicles;
}

/// Returns one balance per vehicle of this kind with at least `fewest` blocks.
/// @param fit (blocks, balance): fills in the result for the blocks
template <typename Balance, typename Block, typename BlocksOf, typename Fit>
std::vector<Balance> balances_by_vehicle(const residuals::Inputs& inputs, const std::string& kind, int jobs,
                                         std::size_t fewest, const BlocksOf& blocks_of, const Fit& fit) {
  std::vector<Balance> all;
  for (const auto& [name, vehicle] : blocks_by_vehicle<Block>(inputs, kind, jobs, blocks_of)) {
    if (vehicle.blocks.size() < fewest) continue;
    Balance balance;
    balance.kind = kind;
    balance.vehicle = name;
    balance.flights = vehicle.flights;
    balance.blocks = vehicle.blocks.size();
    fit(vehicle.blocks, balance);
    all.push_back(std::move(balance));
  }
  return all;
}

}  // namespace swarmcert::identification
