#include "stability/simulation/radio.h"

#include <cmath>

namespace swarmcert::stability {

Radio::Radio(int vehicles, double period_s, const RadioOptions& options)
    : options_(options),
      late_(static_cast<std::size_t>(std::ceil(options.latency_s / period_s - 1e-9))),
      on_their_way_(late_ + 1),
      tracks_(static_cast<std::size_t>(vehicles)) {}

void Radio::broadcast(const std::vector<Eigen::Vector3d>& positions_W_m, std::uint32_t now_ms,
                      files::Random& random) {
  on_their_way_[next_ % on_their_way_.size()] = {now_ms, positions_W_m};
  ++next_;
  if (next_ <= late_) return;
  const Sent& arriving = on_their_way_[(next_ - 1 - late_) % on_their_way_.size()];
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (options_.loss > 0 && random.uniform() < options_.loss) continue;
    const Eigen::Vector3d& p = arriving.positions_W_m[i];
    controller::update(tracks_[i], filter_, {p.x(), p.y(), p.z()}, arriving.stamp_ms);
  }
}

void Radio::look(int own, std::uint32_t now_ms, Instant* now, std::vector<Neighbour>& neighbours,
                 std::vector<double>& weights) const {
  const controller::Vector3<double> position = {now->p_W_m.x(), now->p_W_m.y(), now->p_W_m.z()};
  neighbours.assign(now->neighbours, now->neighbours + now->num_neighbours);
  weights.resize(neighbours.size());
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    const std::size_t other = k < static_cast<std::size_t>(own) ? k : k + 1;
    const controller::NeighbourTrack<double>& track = tracks_[other];
    const controller::Vector3<double>& p = track.position_W_m;
    const controller::Vector3<double>& v = track.velocity_W_m_s;
    neighbours[k].dp_W_m = Eigen::Vector3d(p.x, p.y, p.z) - now->p_W_m;
    neighbours[k].v_W_m_s = Eigen::Vector3d(v.x, v.y, v.z);
    neighbours[k].dv_W_m_s = neighbours[k].v_W_m_s - now->v_W_m_s;
    weights[k] = controller::weight(track, cut_offs_, position, now_ms);
  }
  now->neighbours = neighbours.data();
}

}  // namespace swarmcert::stability
