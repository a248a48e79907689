/// @file The columns of all candidates along one vehicle's track, and how the track is cut into blocks.
#pragma once

#include <functional>
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
  /// @param track  candidates of other vehicles than its own have zero columns; must outlive this.
  ColumnRun(const Grams& grams, const residuals::Inputs& inputs, const stability::Model& model,
            const residuals::Track& track);
  ~ColumnRun();

  /// Columns at record i as the log would show them, in W [3 x grams.columns].
  using Use = std::function<void(std::size_t i, const Eigen::Matrix3Xd& columns)>;
  /// Goes along `instants`, the track's or others of the same times.
  void along(const std::vector<stability::Instant>& instants, const Use& use);

  /// Adds 1 for each candidate and theta, in their order, that acts at `now`.
  void count_support(const stability::Instant& now, std::vector<int>& counts) const;

 private:
  struct Stream;
  /// Filters and memories forget the past.
  void restart();
  /// Fills the first `count` of values_.
  void advance(const stability::Instant* instants, int count);

  const bool filtered_;
  const std::vector<char>& restarts_;
  residuals::MeasuredForce measured_;
  std::vector<Eigen::Matrix3Xd> values_;  ///< of records in a row
  std::vector<std::unique_ptr<stability::Effect>> effects_;
  std::vector<Stream> streams_;
};

/// One block of a track.
struct TrackBlock {
  int records = 0;       ///< without those purged at both ends
  int first_row = 0;     ///< of its three axes per record, where the track's blocks lie one below the other
  bool follows = false;  ///< directly after the block before it
};

/// Cuts a track into blocks of 2 s without cut records; 0.15 s at both ends belong to none, so that what filters
/// remember does not leak into another fold. Blocks of fewer than 40 records are dropped.
struct TrackBlocks {
  std::vector<int> of_record;  ///< index into `blocks`; -1: none
  std::vector<TrackBlock> blocks;

  /// Three axes per record of all blocks.
  int rows() const { return blocks.empty() ? 0 : blocks.back().first_row + 3 * blocks.back().records; }
};
TrackBlocks cut_into_blocks(const residuals::Track& track);

}  // namespace swarmcert::identification
