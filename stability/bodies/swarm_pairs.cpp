#include "stability/bodies/swarm_pairs.h"

#include <algorithm>

#include "stability/bodies/vehicle_state.h"

namespace swarmcert::stability {

void LaneSums::clear(int count) {
  count_ = count;
  parts_.resize(std::max(parts_.size(), lines_for(static_cast<std::size_t>(count))));
  for (std::vector<Part>& parts : parts_) parts.clear();
}

void LaneSums::add(int to, int from) {
  std::vector<Part>& parts = parts_[static_cast<std::size_t>(to / kRowLength)];
  const int line = from / kRowLength, lane = to % kRowLength;
  // If the last part already has a term for this lane, a new part is needed.
  if (parts.empty() || parts.back().line != line || parts.back().mask[lane] != 0) {
    parts.emplace_back();
    parts.back().line = line;
  }
  parts.back().from[lane] = from % kRowLength;
  parts.back().mask[lane] = -1;
}

void SwarmPairs::clear() {
  pairs_.clear();
  with_pairs_.clear();
  for (Layout& layout : layouts_) layout.states_ = 0;
}

void SwarmPairs::add(int vehicle, int neighbour, double constant) {
  if (with_pairs_.empty() || with_pairs_.back().number != vehicle) {
    with_pairs_.push_back({vehicle, static_cast<int>(pairs_.size()), 0});
  }
  ++with_pairs_.back().count;
  pairs_.push_back({neighbour, constant});
}

const SwarmPairs::Layout& SwarmPairs::layout(int states) const {
  const int together = lines() == 1 ? states : 1;
  Layout& layout = layouts_[together - 1];
  if (layout.states_ == 0) lay_out(together, &layout);
  return layout;
}

std::size_t SwarmPairs::scratch_lines() const {
  const std::size_t states = lines() == 1 ? 2 : 1;
  return lines_for(states * pairs_.size()) + lines_for(states * with_pairs_.size());
}

void SwarmPairs::lay_out(int states, Layout* layout) const {
  layout->states_ = states;
  layout->count_ = states * static_cast<int>(pairs_.size());
  const auto lines = static_cast<std::size_t>(layout->lines());
  layout->own_.make_room(lines);
  layout->other_.make_room(lines);
  layout->constants_.make_room(lines);
  layout->sums_.clear(states * static_cast<int>(with_pairs_.size()));

  std::vector<Vehicle> by_count = with_pairs_;
  std::sort(by_count.begin(), by_count.end(), [](const Vehicle& a, const Vehicle& b) {
    return a.count != b.count ? a.count > b.count : a.number < b.number;
  });
  int pair = 0;
  const auto put = [&](int vehicle, int neighbour, int state, double constant) {
    const auto place = [state](int number) {
      return static_cast<std::int64_t>(row_index(number, kVehicleStateSize)) + state * kRowLength;
    };
    layout->own_.data()[pair] = place(vehicle);
    layout->other_.data()[pair] = place(neighbour);
    layout->constants_.data()[pair] = constant;
    ++pair;
  };
  for (int which = 0; which < by_count.front().count; ++which) {
    int sum = 0;
    for (const Vehicle& vehicle : by_count) {
      if (vehicle.count <= which) break;
      const Pair& own = pairs_[static_cast<std::size_t>(vehicle.first + which)];
      for (int state = 0; state < states; ++state) {
        layout->sums_.add(sum++, pair);
        put(vehicle.number, own.neighbour, state, own.constant);
      }
    }
  }
  while (pair % kRowLength != 0) put(by_count.front().number, by_count.front().number, 0, 0);
  for (int state = 0; state < states; ++state) {
    layout->of_vehicles_[state].clear(vehicles_);
    int sum = state;
    for (const Vehicle& vehicle : by_count) {
      layout->of_vehicles_[state].add(vehicle.number, sum);
      sum += states;
    }
  }
}

}  // namespace swarmcert::stability
