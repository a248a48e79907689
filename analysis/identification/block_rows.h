/// @file From the records of a block to its Gram matrix, and from the blocks of single flights to those of all.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "analysis/identification/passes.h"

namespace swarmcert::identification {

/// Runs the columns of `grams` along `modelled`, and calls add(block, rows) at the end of each block, where `rows` is
/// [3 x records, columns + 1] with the residual last.
/// @param noise   whitens columns and residual where it is not null
/// @param support by candidate and theta; what the track shows is added
void run_blocks(const residuals::Inputs& inputs, const ModelledTrack& modelled, const Grams& grams,
                const Noise* noise, std::vector<Support>& support,
                const std::function<void(int block, const Eigen::MatrixXd& rows)>& add);

/// The columns of `grams` along `instants`, the track's or others of the same times, at the records of blocks:
/// [modelled.cut.rows(), columns], one block below the other.
/// @param support as of run_blocks(), where somebody asks
Eigen::MatrixXd columns_along(const residuals::Inputs& inputs, const ModelledTrack& modelled,
                              const Grams& grams, const std::vector<stability::Instant>& instants,
                              std::vector<Support>* support = nullptr);

/// The residual likewise, in newton.
Eigen::VectorXd residual_along(const ModelledTrack& modelled);

/// Gram matrix, products and sums of a block.
/// @param rows as run_blocks() gives them
Block condensed(const Eigen::Ref<const Eigen::MatrixXd>& rows);

/// One flight's part of Grams.
struct FlightPart {
  explicit FlightPart(const Grams& grams);
  std::vector<Block> blocks;  ///< Block::track counts the tracks of this flight
  std::vector<Support> support;
  int tracks = 0;
};

/// `grams` with the blocks and the support of all flights.
Grams joined(Grams grams, std::vector<FlightPart> parts);

}  // namespace swarmcert::identification
