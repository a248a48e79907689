#include "analysis/identification/block_rows.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace swarmcert::identification {

namespace {

/// Counts per block where the effects of a run act.
class SupportCount {
 public:
  /// @param support receives the results of close(); must outlive this object
  SupportCount(const TrackBlocks& cut, std::vector<Support>& support)
      : cut_(cut), support_(support), records_(support.size()) {}

  void add(const ColumnRun& run, const stability::Instant& now, int block) {
    if (block != current_) close();
    current_ = block;
    run.count_support(now, records_);
  }

  /// Finishes the block.
  void close() {
    if (current_ < 0) return;
    for (std::size_t s = 0; s < records_.size(); ++s) {
      support_[s].records += static_cast<std::size_t>(records_[s]);
      if (20 * records_[s] >= cut_.blocks[static_cast<std::size_t>(current_)].records) ++support_[s].blocks;
    }
    std::fill(records_.begin(), records_.end(), 0);
  }

 private:
  const TrackBlocks& cut_;
  std::vector<Support>& support_;
  std::vector<int> records_;
  int current_ = -1;
};

}  // namespace

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
  SupportCount shown(cut, support);
  int current = -1;
  Eigen::Index next = 0;
  run.along(track.instants, [&](std::size_t i, const Eigen::Matrix3Xd& columns) {
    const bool restart = track.restarts[i] != 0;
    const int block = cut.of_record[i];
    if (block < 0 && !whitening) return;
    row << columns, modelled.residual_N[i];
    if (whitening)
      row = whitening->advance(row, restart ? 0 : track.instants[i].time_s - track.instants[i - 1].time_s,
                               restart);
    if (block < 0) return;
    if (block != current) {
      if (current >= 0) add(current, rows);
      current = block;
      next = 0;
      rows.resize(Eigen::Index(3) * cut.blocks[static_cast<std::size_t>(block)].records, grams.columns + 1);
    }
    rows.middleRows<3>(next) = row;
    next += 3;
    shown.add(run, track.instants[i], block);
  });
  if (current >= 0) add(current, rows);
  shown.close();
}

Eigen::MatrixXd columns_along(const residuals::Inputs& inputs, const ModelledTrack& modelled,
                              const Grams& grams, const std::vector<stability::Instant>& instants,
                              std::vector<Support>* support) {
  Eigen::MatrixXd rows(modelled.cut.rows(), grams.columns);
  Eigen::Index next = 0;
  ColumnRun run(grams, inputs, modelled.model, modelled.track);
  std::optional<SupportCount> shown;
  if (support != nullptr) shown.emplace(modelled.cut, *support);
  run.along(instants, [&](std::size_t i, const Eigen::Matrix3Xd& columns) {
    const int block = modelled.cut.of_record[i];
    if (block < 0) return;
    rows.middleRows<3>(next) = columns;
    next += 3;
    if (shown) shown->add(run, instants[i], block);
  });
  if (shown) shown->close();
  return rows;
}

Eigen::VectorXd residual_along(const ModelledTrack& modelled) {
  Eigen::VectorXd rows(modelled.cut.rows());
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < modelled.residual_N.size(); ++i) {
    if (modelled.cut.of_record[i] < 0) continue;
    rows.segment<3>(next) = modelled.residual_N[i];
    next += 3;
  }
  return rows;
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
  return block;
}

FlightPart::FlightPart(const Grams& grams) {
  for (const Candidate& candidate : grams.candidates)
    support.resize(support.size() + candidate.thetas.size());
}

Grams joined(Grams grams, std::vector<FlightPart> parts) {
  for (FlightPart& part : parts) {
    for (Block& block : part.blocks) grams.blocks.push_back(std::move(block));
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
