#include "analysis/reproduction/residual_blocks.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"
#include "nn/base/random.h"

namespace swarmcert::reproduction {
namespace {

constexpr double kBlock_s = 2;
constexpr int kResamples = 400;

std::string composition_of(const std::vector<residuals::Track>& tracks, std::size_t own) {
  const auto initial = [](const std::string& kind) { return static_cast<char>(std::toupper(kind.at(0))); };
  std::string others;
  for (std::size_t j = 0; j < tracks.size(); ++j) {
    if (j != own) others += initial(tracks[j].kind);
  }
  std::sort(others.rbegin(), others.rend());
  return (others.empty() ? "Ge" : others) + "2" + initial(tracks[own].kind);
}

/// 90 % interval of f over resampled blocks, which are passed as indices.
Interval bootstrap(std::size_t blocks, const std::function<double(const std::vector<std::size_t>&)>& f) {
  if (blocks < 2) return {};
  files::Random random(1);
  std::vector<std::size_t> drawn(blocks);
  std::vector<double> values;
  for (int i = 0; i < kResamples; ++i) {
    for (std::size_t& index : drawn) index = random.below(blocks);
    values.push_back(f(drawn));
  }
  return {residuals::quantile(values, 0.05), residuals::quantile(values, 0.95)};
}

double rms_of(const std::vector<ResidualBlock>& blocks, const std::vector<std::size_t>& drawn) {
  double squares = 0, count = 0;
  for (const std::size_t index : drawn) {
    squares += blocks[index].squares_gf2;
    count += blocks[index].count;
  }
  return std::sqrt(squares / count);
}

std::map<std::string, double> rms_by(const std::vector<ResidualBlock>& blocks,
                                     std::string ResidualBlock::*group) {
  std::map<std::string, std::vector<ResidualBlock>> groups;
  for (const ResidualBlock& block : blocks) groups[block.*group].push_back(block);
  std::map<std::string, double> result;
  for (const auto& [name, members] : groups) result[name] = rms_gf(members);
  return result;
}

}  // namespace

std::vector<ResidualBlock> residual_blocks(const residuals::Inputs& inputs, int jobs) {
  std::vector<std::vector<ResidualBlock>> of_flight(inputs.found.flights.size());
  files::parallel_for(static_cast<int>(of_flight.size()), jobs, [&](int f) {
    std::vector<std::string> ignored;
    const std::vector<residuals::Track> tracks = inputs.load(static_cast<std::size_t>(f), ignored);
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const residuals::Track& track = tracks[i];
      if (track.position_only || track.used == 0) continue;
      const std::vector<Eigen::Vector3d> residual =
          residuals::force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
      double block_at = -1;
      for (std::size_t k = 0; k < residual.size(); ++k) {
        if (track.cut[k] != residuals::Cut::kNone) continue;
        const double at = std::floor(track.instants[k].time_s / kBlock_s);
        if (at != block_at)
          of_flight[f].push_back({track.flight, track.vehicle, track.scenario, composition_of(tracks, i)});
        block_at = at;
        const double r_gf = residual[k].z() / stability::kGramForce_N;
        of_flight[f].back().sum_gf += r_gf;
        of_flight[f].back().squares_gf2 += r_gf * r_gf;
        of_flight[f].back().count += 1;
      }
    }
  });
  std::vector<ResidualBlock> all;
  for (const auto& some : of_flight) all.insert(all.end(), some.begin(), some.end());
  return all;
}

double rms_gf(const std::vector<ResidualBlock>& blocks) {
  double squares = 0, count = 0;
  for (const ResidualBlock& block : blocks) {
    squares += block.squares_gf2;
    count += block.count;
  }
  return std::sqrt(squares / count);
}

Estimate change(const std::vector<ResidualBlock>& before, const std::vector<ResidualBlock>& after) {
  bool same = before.size() == after.size();
  for (std::size_t k = 0; same && k < before.size(); ++k) same = before[k].count == after[k].count;
  if (!same) throw std::invalid_argument("the blocks have different records");
  return {rms_gf(before) - rms_gf(after),
          bootstrap(before.size(), [&](const std::vector<std::size_t>& drawn) {
            return rms_of(before, drawn) - rms_of(after, drawn);
          })};
}

Interval interval_of(const std::vector<ResidualBlock>& blocks) {
  return bootstrap(blocks.size(),
                   [&](const std::vector<std::size_t>& drawn) { return rms_of(blocks, drawn); });
}

Estimate mean_of(const std::vector<BlockMean>& blocks) {
  std::vector<std::size_t> all(blocks.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  const auto mean = [&](const std::vector<std::size_t>& drawn) {
    BlockMean total;
    for (const std::size_t index : drawn) {
      total.sum += blocks[index].sum;
      total.count += blocks[index].count;
    }
    return total.sum / total.count;
  };
  return {mean(all), bootstrap(blocks.size(), mean)};
}

std::vector<TrackError> by_track(const std::vector<ResidualBlock>& blocks) {
  std::vector<TrackError> tracks;
  for (std::size_t k = 0; k < blocks.size();) {
    TrackError track = {blocks[k].scenario, blocks[k].flight, blocks[k].vehicle};
    double sum = 0, squares = 0;
    for (; k < blocks.size() && blocks[k].flight == track.flight && blocks[k].vehicle == track.vehicle; ++k) {
      sum += blocks[k].sum_gf;
      squares += blocks[k].squares_gf2;
      track.count += blocks[k].count;
    }
    track.mean_gf = sum / track.count;
    track.spread_gf = std::sqrt(std::max(0.0, squares / track.count - track.mean_gf * track.mean_gf));
    tracks.push_back(std::move(track));
  }
  return tracks;
}

std::map<std::string, double> spread_by_scenario(const std::vector<TrackError>& tracks) {
  std::map<std::string, std::pair<double, double>> sums;
  for (const TrackError& track : tracks) {
    sums[track.scenario].first += track.count * track.spread_gf * track.spread_gf;
    sums[track.scenario].second += track.count;
  }
  std::map<std::string, double> result;
  for (const auto& [scenario, sum] : sums) result[scenario] = std::sqrt(sum.first / sum.second);
  return result;
}

std::map<std::string, double> by_composition(const std::vector<ResidualBlock>& blocks) {
  return rms_by(blocks, &ResidualBlock::composition);
}

std::map<std::string, double> by_scenario(const std::vector<ResidualBlock>& blocks) {
  return rms_by(blocks, &ResidualBlock::scenario);
}

}  // namespace swarmcert::reproduction
