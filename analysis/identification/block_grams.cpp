#include "analysis/identification/block_grams.h"

#include <atomic>

#include "analysis/identification/block_rows.h"

namespace swarmcert::identification {
namespace {

/// Adds all candidates along a track, block by block.
void add_track(const Passes& passes, const ModelledTrack& track, const Grams& grams, const Noise* noise,
               int flight, FlightPart& part) {
  run_blocks(passes.inputs, track, grams, noise, part.support, [&](int at, const Eigen::MatrixXd& rows) {
    part.blocks.push_back(condensed(rows));
    Block& block = part.blocks.back();
    block.flight = flight;
    block.follows = track.cut.blocks[static_cast<std::size_t>(at)].follows;
  });
}

Grams made_anew(const Passes& passes, std::vector<Candidate> candidates, const Noise* noise) {
  const Grams grams = columns_of(std::move(candidates));
  std::vector<FlightPart> parts(passes.flights.size(), FlightPart(grams));
  std::atomic<int> done{0};
  over_modelled_tracks(
      passes,
      [&](std::size_t k, const ModelledTrack& track) {
        add_track(passes, track, grams, noise, passes.flights[k], parts[k]);
      },
      [&] { passes.progress(++done, static_cast<int>(parts.size())); });
  return joined(grams, std::move(parts));
}

}  // namespace

Eigen::VectorXd part_of(const Eigen::VectorXd& all, const std::vector<int>& columns) {
  Eigen::VectorXd part(static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) part[static_cast<Eigen::Index>(i)] = all[columns[i]];
  return part;
}

Eigen::MatrixXd part_of_gram(const Eigen::VectorXd& packed, const std::vector<int>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd g(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int row = columns[static_cast<std::size_t>(i)];
    const double* const upper = packed.data() + Grams::packed(0, row);
    for (Eigen::Index j = 0; j <= i; ++j) {
      const int column = columns[static_cast<std::size_t>(j)];
      g(i, j) = g(j, i) = column <= row ? upper[column] : packed[Grams::packed(row, column)];
    }
  }
  return g;
}

Grams columns_of(std::vector<Candidate> candidates) {
  Grams grams;
  grams.candidates = std::move(candidates);
  for (const Candidate& candidate : grams.candidates) {
    grams.first_column.emplace_back();
    for (std::size_t t = 0; t < candidate.thetas.size(); ++t) {
      grams.first_column.back().push_back(grams.columns);
      grams.columns += candidate.columns();
    }
    grams.support.emplace_back(candidate.thetas.size());
  }
  return grams;
}

Grams block_grams(const Passes& passes, std::vector<Candidate> candidates) {
  return made_anew(passes, std::move(candidates), nullptr);
}

Grams whitened_grams(const Passes& passes, std::vector<Candidate> candidates, const Noise& noise) {
  return made_anew(passes, std::move(candidates), &noise);
}

}  // namespace swarmcert::identification
