/// @file Vertical residuals of several models on the same blocks of the same flights, so that differences have
/// confidence intervals.
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

/// Returns the blocks in order of flights, vehicles and time: blocks of two models with the same cut rules correspond.
std::vector<ResidualBlock> residual_blocks(const residuals::Inputs& inputs, int jobs);

double rms_gf(const std::vector<ResidualBlock>& blocks);

/// An estimate with its 90 % confidence interval.
struct Estimate {
  double value_gf = 0;
  Interval interval;
};
/// Returns rms(before) - rms(after), resampling the same blocks of both.
/// @throws std::invalid_argument if the blocks do not correspond.
Estimate change(const std::vector<ResidualBlock>& before, const std::vector<ResidualBlock>& after);
Interval interval_of(const std::vector<ResidualBlock>& blocks);

/// A sum of values over one block, and their number.
struct BlockMean {
  double sum = 0, count = 0;
};
/// Returns the mean of all values with a 90 % interval from resampling blocks; the ends coincide for fewer than two
/// blocks.
Estimate mean_of(const std::vector<BlockMean>& blocks);

/// The residual of one vehicle in one flight.
struct TrackError {
  std::string scenario, flight, vehicle;
  double mean_gf = 0, spread_gf = 0;  ///< RMS^2 = mean^2 + spread^2
  double count = 0;
  double squares_gf2() const { return count * (mean_gf * mean_gf + spread_gf * spread_gf); }
};
/// Returns the errors in order of flights and vehicles.
std::vector<TrackError> by_track(const std::vector<ResidualBlock>& blocks);
/// Returns the RMS in gf of each scenario after subtracting the mean of every vehicle in every flight.
std::map<std::string, double> spread_by_scenario(const std::vector<TrackError>& tracks);

/// Returns the RMS in gf of the blocks of each composition ("" is all), or of each scenario.
std::map<std::string, double> by_composition(const std::vector<ResidualBlock>& blocks);
std::map<std::string, double> by_scenario(const std::vector<ResidualBlock>& blocks);

}  // namespace swarmcert::reproduction
