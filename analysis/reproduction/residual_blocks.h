/// @file Vertical residuals of several models on the same blocks of the same flights, so that differences have
/// intervals.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/statistics.h"

namespace swarmcert::reproduction {

/// Sum of squared vertical residuals of one vehicle over 2 s of a flight, gf^2.
struct ResidualBlock {
  std::string flight, vehicle;  ///< "21_swap_ss/02", "cf50"
  std::string scenario;         ///< "21_swap_ss"
  std::string
      composition;  ///< initials of the neighbours' kinds, then of the vehicle's: "SL2S"; "Ge2S" flies alone
  double sum_gf = 0, squares_gf2 = 0, count = 0;
};

/// In order of flights, vehicles and time: blocks of two models with the same cut rules correspond.
std::vector<ResidualBlock> residual_blocks(const residuals::Inputs& inputs, int jobs);

double rms_gf(const std::vector<ResidualBlock>& blocks);

/// A number with its 90 % interval.
struct Estimate {
  double value_gf = 0;
  Interval interval;
};
/// rms(before) - rms(after), resampling the same blocks of both.
/// @throws std::invalid_argument if the blocks do not correspond.
Estimate change(const std::vector<ResidualBlock>& before, const std::vector<ResidualBlock>& after);
Interval interval_of(const std::vector<ResidualBlock>& blocks);

/// A sum of values over one block, and their number.
struct BlockMean {
  double sum = 0, count = 0;
};
/// Mean of all values; 90 % interval by resampling blocks, equal ends where there are fewer than two.
Estimate mean_of(const std::vector<BlockMean>& blocks);

/// What is left of one vehicle in one flight.
struct TrackError {
  std::string scenario, flight, vehicle;
  double mean_gf = 0, spread_gf = 0;  ///< RMS^2 = mean^2 + spread^2
  double count = 0;
  double squares_gf2() const { return count * (mean_gf * mean_gf + spread_gf * spread_gf); }
};
/// In order of flights and vehicles.
std::vector<TrackError> by_track(const std::vector<ResidualBlock>& blocks);
/// RMS in gf of each scenario, once the mean of every vehicle in every flight is taken off.
std::map<std::string, double> spread_by_scenario(const std::vector<TrackError>& tracks);

/// RMS in gf of the blocks of each composition ("" is all), or of each scenario.
std::map<std::string, double> by_composition(const std::vector<ResidualBlock>& blocks);
std::map<std::string, double> by_scenario(const std::vector<ResidualBlock>& blocks);

}  // namespace swarmcert::reproduction
