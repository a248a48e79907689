#include "analysis/identification/block_grams.h"

#include <algorithm>
#include <atomic>
#include <optional>

#include "analysis/identification/column_run.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

struct Piece {
  std::vector<Block> blocks;
  std::vector<Support> support;
  int tracks = 0;
};

/// @param rows [3 x records, columns + 1], the residual last.
Block condensed(const Eigen::Ref<const Eigen::MatrixXd>& rows) {
  const Eigen::Index columns = rows.cols() - 1;
  const auto x = rows.leftCols(columns);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(columns, columns);
  gram.selfadjointView<Eigen::Upper>().rankUpdate(x.transpose());
  Block block;
  block.gram.resize(columns * (columns + 1) / 2);
  for (Eigen::Index j = 0; j < columns; ++j)
    block.gram.segment(j * (j + 1) / 2, j + 1) = gram.col(j).head(j + 1);
  block.b = x.transpose() * rows.col(columns);
  block.y = rows.col(columns).squaredNorm();
  block.records = static_cast<int>(rows.rows() / 3);
  block.sums = Eigen::Matrix3Xd::Zero(3, rows.cols());
  for (int i = 0; i < block.records; ++i) block.sums += rows.middleRows<3>(Eigen::Index(3) * i);
  return block;
}

void add_track(const residuals::Inputs& inputs, const Track& track, const Grams& grams, int flight,
               const Noise* noise, Piece& piece) {
  const int number = piece.tracks++;
  const stability::Model model = inputs.model_for(track);
  const std::vector<Eigen::Vector3d> r = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  const TrackBlocks cut = cut_into_blocks(track);
  ColumnRun run(grams, inputs, model, track);
  std::optional<Whitening> whitening;
  if (noise != nullptr) whitening.emplace(*noise);
  Eigen::Matrix3Xd row(3, grams.columns + 1);
  Eigen::MatrixXd rows;
  std::vector<int> in_support(piece.support.size());
  int current = -1, count = 0;
  const auto close = [&] {
    if (current < 0) return;
    const TrackBlock& block = cut.blocks[static_cast<std::size_t>(current)];
    piece.blocks.push_back(condensed(rows));
    piece.blocks.back().flight = flight;
    piece.blocks.back().track = number;
    piece.blocks.back().follows = block.follows;
    for (std::size_t s = 0; s < in_support.size(); ++s) {
      piece.support[s].records += static_cast<std::size_t>(in_support[s]);
      if (20 * in_support[s] >= block.records) ++piece.support[s].blocks;
    }
  };
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const bool restart = track.restarts[i] != 0;
    row << run.advance(track.instants[i], restart), r[i];
    if (whitening)
      row = whitening->advance(row, restart ? 0 : track.instants[i].time_s - track.instants[i - 1].time_s,
                               restart);
    const int block = cut.of_record[i];
    if (block < 0) continue;
    if (block != current) {
      close();
      current = block;
      count = 0;
      rows.resize(3 * cut.blocks[static_cast<std::size_t>(block)].records, grams.columns + 1);
      std::fill(in_support.begin(), in_support.end(), 0);
    }
    rows.middleRows<3>(Eigen::Index(3) * count++) = row;
    run.count_support(track.instants[i], in_support);
  }
  close();
}

}  // namespace

double telling_blocks(const Grams& grams, std::size_t candidate, std::size_t theta) {
  const int first = grams.first_column[candidate][theta];
  double sum = 0, squares = 0;
  for (const Block& block : grams.blocks) {
    double energy = 0;
    for (int c = 0; c < grams.candidates[candidate].columns(); ++c)
      energy += block.gram[Grams::packed(first + c, first + c)];
    sum += energy;
    squares += energy * energy;
  }
  return squares > 0 ? sum * sum / squares : 0;
}

Eigen::VectorXd part_of(const Eigen::VectorXd& all, const std::vector<int>& columns) {
  Eigen::VectorXd part(static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) part[static_cast<Eigen::Index>(i)] = all[columns[i]];
  return part;
}

Eigen::MatrixXd part_of_gram(const Eigen::VectorXd& packed, const std::vector<int>& columns) {
  const auto n = static_cast<int>(columns.size());
  Eigen::MatrixXd g(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      g(i, j) = g(j, i) =
          packed[Grams::packed(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)])];
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

Grams block_grams(const residuals::Inputs& inputs, const std::string& kind, std::vector<Candidate> candidates,
                  const std::vector<int>& which, int jobs, const residuals::Progress& progress,
                  const Noise* noise) {
  Grams grams = columns_of(std::move(candidates));
  std::size_t streams = 0;
  for (const Candidate& candidate : grams.candidates) streams += candidate.thetas.size();
  std::vector<Piece> pieces(which.size());
  std::atomic<int> done{0};
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    Piece& piece = pieces[static_cast<std::size_t>(i)];
    piece.support.resize(streams);
    const int flight = which[static_cast<std::size_t>(i)];
    std::vector<std::string> problems;
    for (const Track& track : inputs.load(static_cast<std::size_t>(flight), problems)) {
      if (!track.position_only && track.kind == kind) add_track(inputs, track, grams, flight, noise, piece);
    }
    progress(++done, static_cast<int>(which.size()));
  });
  int tracks = 0;
  for (Piece& piece : pieces) {
    for (Block& block : piece.blocks) {
      block.track += tracks;
      grams.blocks.push_back(std::move(block));
    }
    tracks += piece.tracks;
    std::size_t index = 0;
    for (auto& thetas : grams.support) {
      for (Support& support : thetas) {
        const Support& part = piece.support[index++];
        support.records += part.records;
        support.blocks += part.blocks;
        if (part.blocks > 0) ++support.flights;
      }
    }
  }
  return grams;
}

}  // namespace swarmcert::identification
