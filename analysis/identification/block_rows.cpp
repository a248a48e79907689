#include "analysis/identification/block_rows.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace swarmcert::identification {

void run_blocks(const residuals::Inputs& inputs, const ModelledTrack& modelled, const Grams& grams,
                const Noise* noise, std::vector<Support>& support,
                const std::function<void(int block, const Eigen::MatrixXd& rows)>& add) {
  const residuals::Track& track = modelled.track;
  const TrackBlocks& cut = modelled.cut;
  ColumnRun run(grams, inputs, modelled.model, track);
  std::optional<Whitening> whitening;
  if (noise != nullptr) whitening.emplace(*noise);
  Eigen::Matrix3Xd row(3, grams.columns + 1);
  Eigen::MatrixXd rows;
  std::vector<int> in_support(support.size());
  int current = -1, count = 0;
  const auto close = [&] {
    if (current < 0) return;
    add(current, rows);
    for (std::size_t s = 0; s < in_support.size(); ++s) {
      support[s].records += static_cast<std::size_t>(in_support[s]);
      if (20 * in_support[s] >= cut.blocks[static_cast<std::size_t>(current)].records) ++support[s].blocks;
    }
  };
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const bool restart = track.restarts[i] != 0;
    row << run.advance(track.instants[i], restart), modelled.residual_N[i];
    if (whitening)
      row = whitening->advance(row, restart ? 0 : track.instants[i].time_s - track.instants[i - 1].time_s,
                               restart);
    const int block = cut.of_record[i];
    if (block < 0) continue;
    if (block != current) {
      close();
      current = block;
      count = 0;
      rows.resize(Eigen::Index(3) * cut.blocks[static_cast<std::size_t>(block)].records, grams.columns + 1);
      std::fill(in_support.begin(), in_support.end(), 0);
    }
    rows.middleRows<3>(Eigen::Index(3) * count++) = row;
    run.count_support(track.instants[i], in_support);
  }
  close();
}

std::vector<Eigen::MatrixXd> block_columns(const residuals::Inputs& inputs, const ModelledTrack& modelled,
                                           const Grams& grams,
                                           const std::vector<stability::Instant>& instants) {
  const TrackBlocks& cut = modelled.cut;
  std::vector<Eigen::MatrixXd> blocks;
  for (const TrackBlock& block : cut.blocks)
    blocks.emplace_back(Eigen::Index(3) * block.records, grams.columns);
  std::vector<Eigen::Index> next(blocks.size(), 0);
  ColumnRun run(grams, inputs, modelled.model, modelled.track);
  for (std::size_t i = 0; i < instants.size(); ++i) {
    const Eigen::Matrix3Xd& columns = run.advance(instants[i], modelled.track.restarts[i] != 0);
    if (cut.of_record[i] < 0) continue;
    const auto b = static_cast<std::size_t>(cut.of_record[i]);
    blocks[b].middleRows<3>(next[b]) = columns;
    next[b] += 3;
  }
  return blocks;
}

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

FlightPart::FlightPart(const Grams& grams) {
  for (const Candidate& candidate : grams.candidates)
    support.resize(support.size() + candidate.thetas.size());
}

Grams joined(Grams grams, std::vector<FlightPart> parts) {
  int tracks = 0;
  for (FlightPart& part : parts) {
    for (Block& block : part.blocks) {
      block.track += tracks;
      grams.blocks.push_back(std::move(block));
    }
    tracks += part.tracks;
    std::size_t index = 0;
    for (auto& thetas : grams.support) {
      for (Support& support : thetas) {
        const Support& more = part.support[index++];
        support.records += more.records;
        support.blocks += more.blocks;
        if (more.blocks > 0) ++support.flights;
      }
    }
  }
  return grams;
}

}  // namespace swarmcert::identification
