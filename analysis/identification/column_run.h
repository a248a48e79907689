/// @file Evaluates the columns of all candidates along a track, and cuts tracks into blocks.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/residuals/force_residual.h"

namespace swarmcert::identification {

/// Evaluates each candidate with each theta along a time series.
class ColumnRun {
 public:
  /// @param grams defines the candidates and their columns; must outlive this object
  /// @param track  candidates of other vehicles have zero columns; must outlive this object
  ColumnRun(const Grams& grams, const residuals::Inputs& inputs, const stability::Model& model,
            const residuals::Track& track);
  ~ColumnRun();

  /// Called with the columns at record i as the log would show them, in W [3 x grams.columns].
  using Use = std::function<void(std::size_t i, const Eigen::Matrix3Xd& columns)>;
  /// Evaluates along `instants`, which are the track's or others at the same times.
  void along(const std::vector<stability::Instant>& instants, const Use& use);

  /// Adds 1 for each candidate and theta, in order, that acts at `now`.
  void count_support(const stability::Instant& now, std::vector<int>& counts) const;

 private:
  struct Stream;
  /// Resets filters and memories.
  void restart();
  /// Fills the first `count` entries of values_.
  void advance(const stability::Instant* instants, int count);

  const bool filtered_;
  const std::vector<char>& restarts_;
  residuals::MeasuredForce measured_;
  std::vector<Eigen::Matrix3Xd> values_;  ///< of consecutive records
  std::vector<std::unique_ptr<stability::Effect>> effects_;
  std::vector<Stream> streams_;
};

/// A block of a track.
struct TrackBlock {
  int records = 0;       ///< number of records without those dropped at both ends
  int first_row = 0;     ///< of its three axes per record, if the blocks of the track are stacked
  bool follows = false;  ///< directly follows the previous block
};

/// A track divided into blocks of 2 s without cut records. The records within 0.15 s of both ends belong to no block,
/// so that the memory of filters does not leak into another fold. Blocks whose records cover less than 0.4 s are
/// dropped.
struct TrackBlocks {
  std::vector<int> of_record;  ///< index into `blocks`; -1: none
  std::vector<TrackBlock> blocks;

  /// Returns the number of rows of all blocks, with three axes per record.
  int rows() const { return blocks.empty() ? 0 : blocks.back().first_row + 3 * blocks.back().records; }
};
TrackBlocks cut_into_blocks(const residuals::Track& track);

}  // namespace swarmcert::identification
