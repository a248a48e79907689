/// @file Radio: positions of the other vehicles, delayed and sometimes lost.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/neighbours.h"
#include "nn/base/random.h"
#include "stability/effects/effect.h"

namespace swarmcert::stability {

struct RadioOptions {
  double latency_s = 0;  ///< from measurement of a position to its arrival
  double loss = 0;       ///< fraction of positions that are lost, independently
};

/// Broadcast positions as processed by the flight code (controller/neighbours.h), in double precision: velocities are
/// filtered differences, and neighbours that are stale or leave the valid box of positions fade out.
class Radio {
 public:
  /// @param period_s time between broadcasts.
  Radio(int vehicles, double period_s, const RadioOptions& options);

  /// Sends one broadcast from every vehicle, and delivers the one sent `latency_s` ago.
  void broadcast(const std::vector<Eigen::Vector3d>& positions_W_m, std::uint32_t now_ms,
                 files::Random& random);

  /// Replaces the neighbours in `now` by what vehicle `own` knows about them.
  /// @param now must contain all other vehicles in their order.
  /// @param neighbours, weights overwritten; weights in [0, 1], from controller::weight().
  void look(int own, std::uint32_t now_ms, Instant* now, std::vector<Neighbour>& neighbours,
            std::vector<double>& weights) const;

 private:
  struct Sent {
    std::uint32_t stamp_ms;
    std::vector<Eigen::Vector3d> positions_W_m;
  };

  const RadioOptions options_;
  std::size_t late_;  ///< number of broadcasts in transit
  std::vector<Sent> on_their_way_;
  std::size_t next_ = 0;
  std::vector<controller::NeighbourTrack<double>> tracks_;
  controller::VelocityFilter<double> filter_;
  controller::CutOffs<double> cut_offs_;
};

}  // namespace swarmcert::stability
