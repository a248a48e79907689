/// @file Vertical residuals of several models on the same blocks of the same flights, so that differences have intervals.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/statistics.h"

namespace swarmcert::reproduction {

/// Sum of squared vertical residuals of one vehicle over 2 s of a flight, gf^2.
struct ResidualBlock {
  std::string scenario;  ///< "21_swap_ss"
  std::string
      composition;  ///< initials of the neighbours' kinds, then of the vehicle's: "SL2S"; "Ge2S" flies alone
  double squares_gf2 = 0, count = 0;
};

/// In order of flights, vehicles and time: blocks of two models with the same cut rules correspond.
std::vector<ResidualBlock> residual_blocks(const residuals::Inputs& inputs, int jobs);

double rms_gf(const std::vector<ResidualBlock>& blocks);

/// A number with its 90 % interval.
struct Estimate {
  double value_gf = 0;
  residuals::Interval interval;
};
/// rms(before) - rms(after), resampling the same blocks of both.
/// @throws std::invalid_argument if the blocks do not correspond.
Estimate change(const std::vector<ResidualBlock>& before, const std::vector<ResidualBlock>& after);
residuals::Interval interval_of(const std::vector<ResidualBlock>& blocks);

/// A sum of values over one block, and their number.
struct BlockMean {
  double sum = 0, count = 0;
};
/// Mean of all values; 90 % interval by resampling blocks, equal ends where there are fewer than two.
Estimate mean_of(const std::vector<BlockMean>& blocks);

/// RMS in gf of the blocks of each composition ("" is all), or of each scenario.
std::map<std::string, double> by_composition(const std::vector<ResidualBlock>& blocks);
std::map<std::string, double> by_scenario(const std::vector<ResidualBlock>& blocks);

}  // namespace swarmcert::reproduction
