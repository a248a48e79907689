#include "stability/swarm_pairs.h"

#include <algorithm>

#include "stability/vehicle_state.h"

namespace swarmcert::stability {

void SwarmPairs::close() {
  const std::size_t lines = lines_for(pairs_.size());
  count_ = static_cast<int>(lines) * kRowLength;
  own_.make_room(lines);
  other_.make_room(lines);
  constants_.make_room(lines);
  const auto total = static_cast<std::size_t>(count_);
  for (std::size_t k = 0; k < total; ++k) {
    const Pair& pair = pairs_[std::min(k, pairs_.size() - 1)];
    const int neighbour = k < pairs_.size() ? pair.neighbour : pair.vehicle;
    own_.data()[k] = static_cast<std::int64_t>(row_index(pair.vehicle, kVehicleStateSize));
    other_.data()[k] = static_cast<std::int64_t>(row_index(neighbour, kVehicleStateSize));
    constants_.data()[k] = pair.constant;
  }

  std::vector<int>& first = first_slot_;
  first.assign(lines_ + 1, 0);
  const auto each = [this](const auto& visit) {
    int slot = 0;
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      slot = k > 0 && pairs_[k - 1].vehicle == pairs_[k].vehicle ? slot + 1 : 0;
      visit(k, pairs_[k].vehicle, slot);
    }
  };
  each([&](std::size_t, int vehicle, int slot) {
    int& slots = first[static_cast<std::size_t>(vehicle / kRowLength) + 1];
    slots = std::max(slots, slot + 1);
  });
  for (std::size_t line = 0; line < lines_; ++line) first[line + 1] += first[line];
  const auto slots = static_cast<std::size_t>(first.back());
  slots_.make_room(slots);
  masks_.make_room(slots);
  std::fill_n(slots_.data(), slots * kRowLength, 0);
  std::fill_n(masks_.data(), slots * kRowLength, 0);
  each([&](std::size_t k, int vehicle, int slot) {
    const int at = (first_slot(vehicle / kRowLength) + slot) * kRowLength + vehicle % kRowLength;
    slots_.data()[at] = static_cast<std::int64_t>(k);
    masks_.data()[at] = -1;
  });
}

}  // namespace swarmcert::stability
