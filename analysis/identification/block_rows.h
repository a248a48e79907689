/// @file Computes the Gram matrices of blocks from records, and joins the blocks of all flights.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "analysis/identification/passes.h"

namespace swarmcert::identification {

/// Runs the columns of `grams` along `modelled` and calls add(block, rows) at the end of each block, where `rows` is
/// [3 x records, columns + 1] with the residual last.
/// @param noise   if not null, columns and residual are whitened
/// @param support by candidate and theta; the support in the track is added
void run_blocks(const residuals::Inputs& inputs, const ModelledTrack& modelled, const Grams& grams,
                const Noise* noise, std::vector<Support>& support,
                const std::function<void(int block, const Eigen::MatrixXd& rows)>& add);

/// Returns the columns of `grams` along `instants`, which are the track's or others at the same times, for the records
/// of blocks: [modelled.cut.rows(), columns], with the blocks stacked.
/// @param support as in run_blocks(), if not null
Eigen::MatrixXd columns_along(const residuals::Inputs& inputs, const ModelledTrack& modelled,
                              const Grams& grams, const std::vector<stability::Instant>& instants,
                              std::vector<Support>* support = nullptr);

/// Returns the residual in the same form, in newton.
Eigen::VectorXd residual_along(const ModelledTrack& modelled);

/// Returns the Gram matrix and the products of a block.
/// @param rows as passed by run_blocks()
Block condensed(const Eigen::Ref<const Eigen::MatrixXd>& rows);

/// The part of Grams of one flight.
struct FlightPart {
  explicit FlightPart(const Grams& grams);
  std::vector<Block> blocks;
  std::vector<Support> support;
};

/// Returns `grams` with the blocks and the support of all flights.
Grams joined(Grams grams, std::vector<FlightPart> parts);

}  // namespace swarmcert::identification
