/// @file The columns of all candidates along one vehicle's track, and how the track is cut into blocks.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/residuals/force_residual.h"

namespace swarmcert::identification {

/// Runs every candidate with every theta along a time series.
class ColumnRun {
 public:
  /// @param grams names the candidates and their columns; must outlive this.
  /// @param track  candidates of other vehicles than its own have zero columns.
  ColumnRun(const Grams& grams, const residuals::Inputs& inputs, const stability::Model& model,
            const residuals::Track& track);
  ~ColumnRun();

  /// Columns at `now` as the log would show them, in W [3 x grams.columns].
  /// @param restart filters and memories forget the past.
  const Eigen::Matrix3Xd& advance(const stability::Instant& now, bool restart);

  /// Adds 1 for each candidate and theta, in their order, that acts at `now`.
  void count_support(const stability::Instant& now, std::vector<int>& counts) const;

 private:
  struct Stream;
  const bool filtered_;
  residuals::MeasuredForce measured_;
  Eigen::Matrix3Xd values_;
  std::vector<std::unique_ptr<stability::Effect>> effects_;
  std::vector<Stream> streams_;
};

/// One block of a track.
struct TrackBlock {
  int records = 0;       ///< without those purged at both ends
  bool follows = false;  ///< directly after the block before it
};

/// Cuts a track into blocks of 2 s without cut records; 0.15 s at both ends belong to none, so that what filters
/// remember does not leak into another fold. Blocks of fewer than 40 records are dropped.
struct TrackBlocks {
  std::vector<int> of_record;  ///< index into `blocks`; -1: none
  std::vector<TrackBlock> blocks;
};
TrackBlocks cut_into_blocks(const residuals::Track& track);

}  // namespace swarmcert::identification
