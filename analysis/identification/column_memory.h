/// @file Columns of effects along the flights of one search, kept between the passes over them.
///
/// A search asks for the same columns many times: each round of a selection for those of all candidates, each step of
/// a refinement for those of the effects whose shapes it does not move. Kept are, for each block of 2 s, the columns
/// behind the accelerometer's filter and their Gram matrix, to which new columns are appended.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/identification/passes.h"

namespace swarmcert::identification {

struct FlightPart;

/// One block of a track with the kept columns X and the residual r, in newton.
struct KeptBlock {
  /// X [3 x records, columns], in the pieces in which it grew.
  std::vector<Eigen::MatrixXd> pieces;
  Eigen::VectorXd r;  ///< [3 x records]
  double y = 0;       ///< r'r
  Eigen::Vector3d residual_sum_N = Eigen::Vector3d::Zero();
  std::vector<double> gram;           ///< X'X, packed as Block::gram
  std::vector<double> b;              ///< X'r
  std::vector<Eigen::Vector3d> sums;  ///< of each column over the records

  int columns() const { return static_cast<int>(b.size()); }
};

struct KeptTrack {
  ModelledTrack known;
  std::vector<KeptBlock> blocks;
  std::map<std::string, Support> support;  ///< by the key of a column, see ColumnMemory
};

/// Serves the passes over one choice of flights under one model.
class ColumnMemory {
 public:
  /// Half of what five hours of flights may take. Columns beyond it are made anew in each pass.
  static constexpr std::size_t kMost_bytes = std::size_t{512} << 20;

  /// @param flights how many the passes have
  /// @param records of these flights in blocks, about
  ColumnMemory(std::size_t flights, std::size_t records, std::size_t most_bytes = kMost_bytes)
      : flights_(flights), records_(records), most_bytes_(most_bytes) {}

  /// The Gram matrices of `candidates`, which do not depend on what was asked for before but by their rounding.
  /// @param passes always of the same flights and models
  /// @param kept   whether columns that are not kept yet will be asked for again
  Grams grams(const Passes& passes, std::vector<Candidate> candidates, Kept kept);

  /// Of passes.flights[flight]. Safe to call from several threads, each with a flight of its own.
  std::vector<KeptTrack>& tracks(const Passes& passes, std::size_t flight);

 private:
  struct Flight {
    bool is_loaded = false;
    std::vector<KeptTrack> tracks;
  };
  struct Request;

  Request planned(const Grams& asked, Kept kept) const;
  void add_track(const Passes& passes, const Grams& asked, const Request& request, int flight,
                 KeptTrack& track, FlightPart& part) const;

  std::vector<Flight> flights_;
  const std::size_t records_, most_bytes_;
  std::map<std::string, int> first_column_;  ///< of kept columns, by a text of effect and theta
  int columns_ = 0;                          ///< kept
};

}  // namespace swarmcert::identification
