#include "analysis/reproduction/nearest_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "nn/weights/function_id.h"

namespace swarmcert::reproduction {
namespace {

using Eigen::Index;

constexpr std::size_t kNearest = 20;
constexpr Index kTestStride = 20, kOtherStride = 5;
constexpr double kLength_m = 0.05, kSpeed_m_s = 0.25;
constexpr double kNear = 1.5;           ///< RMS distance of the nearest records, in units of the two scales
constexpr double kLeastHeight_m = 0.5;  ///< above this height there is no ground effect
constexpr double kNearShare = 0.9;

using State = std::array<double, 5>;

/// Quantities of position and velocity that are invariant under rotation about the vertical: height, lateral
/// distance, and the velocity components outward, tangential and upward.
State invariants(double x, double y, double z, double vx, double vy, double vz) {
  const double r = std::hypot(x, y), outwards = (x * vx + y * vy) / std::max(r, 0.03);
  const double across = std::sqrt(std::max(0.0, vx * vx + vy * vy - outwards * outwards));
  return {z / kLength_m, r / kLength_m, outwards / kSpeed_m_s, across / kSpeed_m_s, vz / kSpeed_m_s};
}

/// Invariants of the neighbour if there is one, otherwise own height and velocity.
State state_of(const learning::LearningData& data, Index sample) {
  const training::Dataset& samples = data.samples;
  const int ground = data.layout.find(files::FunctionId::ground_phi());
  const float* own = nullptr;
  for (Index i = samples.first[sample]; i < samples.first[sample + 1]; ++i) {
    const float* const input = samples.x.data() + i * samples.width;
    const auto at = [input](int k) { return static_cast<double>(input[k]); };
    if (samples.phi[i] != ground) return invariants(at(0), at(1), at(2), at(3), at(4), at(5));
    own = input;
  }
  const auto at = [own](int k) { return own == nullptr ? 0.0 : static_cast<double>(own[k]); };
  return invariants(0, 0, std::max(at(0), -kLeastHeight_m), at(1), at(2), at(3));
}

double squared_distance(const State& a, const State& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

bool has_two_neighbours(const learning::TrackSamples& track) {
  return track.composition.find('+') != std::string::npos;
}

}  // namespace

std::map<std::pair<std::string, std::string>, NearestLabels> nearest_labels(
    const learning::LearningData& data) {
  std::map<std::string, std::vector<std::pair<State, double>>> others;
  for (const learning::TrackSamples& track : data.tracks) {
    if (track.use == learning::Use::kTest || has_two_neighbours(track)) continue;
    for (Index s = track.begin; s < track.end; s += kOtherStride)
      others[track.composition].emplace_back(state_of(data, s), static_cast<double>(data.samples.target[s]));
  }
  std::map<std::pair<std::string, std::string>, NearestLabels> result;
  for (const learning::TrackSamples& track : data.tracks) {
    if (track.use != learning::Use::kTest || has_two_neighbours(track)) continue;
    const auto& known = others[track.composition];
    if (known.size() < kNearest) continue;
    std::vector<std::pair<double, double>> by_distance(known.size());
    double sum = 0, squares = 0, count = 0, near = 0;
    for (Index s = track.begin; s < track.end; s += kTestStride) {
      const State state = state_of(data, s);
      for (std::size_t k = 0; k < known.size(); ++k)
        by_distance[k] = {squared_distance(state, known[k].first), known[k].second};
      std::nth_element(by_distance.begin(), by_distance.begin() + kNearest - 1, by_distance.end());
      double distance = 0, label_gf = 0;
      for (std::size_t k = 0; k < kNearest; ++k) {
        distance += by_distance[k].first / kNearest;
        label_gf += by_distance[k].second / kNearest;
      }
      const double difference_gf = static_cast<double>(data.samples.target[s]) - label_gf;
      sum += difference_gf;
      squares += difference_gf * difference_gf;
      near += distance < kNear * kNear ? 1 : 0;
      count += 1;
    }
    if (near >= kNearShare * count)
      result[{track.flight, track.vehicle}] = {sum / count, std::sqrt(squares / count)};
  }
  return result;
}

}  // namespace swarmcert::reproduction
