/// @file Columns of effects along the flights of one search, kept between the passes over them.
///
/// A search asks for the same columns many times: each round of a selection for those of all candidates, each step of
/// a refinement for those of the effects whose shapes it does not move. Kept are, for each block of 2 s, the columns
/// behind the accelerometer's filter and their Gram matrix, to which new columns are appended. Of other columns those
/// that were made last are there as well, and so are the results of fits: the same are asked for again and again.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/identification/instrument.h"
#include "analysis/identification/passes.h"
#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

struct FlightPart;

/// Everything about candidates that a fit depends on: equal texts, equal results.
std::string text_of(const std::vector<Candidate>& candidates);

/// One block of a track with the kept columns X and the residual r.
struct KeptBlock {
  double y = 0;  ///< r'r
  Eigen::Vector3d residual_sum_N = Eigen::Vector3d::Zero();
  std::vector<double> gram;           ///< X'X, packed as Block::gram
  std::vector<double> b;              ///< X'r
  std::vector<Eigen::Vector3d> sums;  ///< of each column over the records
};

/// Columns of one effect with one theta.
struct TrackColumns {
  Eigen::MatrixXd rows;  ///< columns_along() the track
  Support support;
};

struct KeptTrack {
  ModelledTrack known;
  std::vector<stability::Instant> wanted;  ///< as_commanded(), once it was asked for
  Eigen::VectorXd residual_N;              ///< residual_along()
  std::vector<KeptBlock> blocks;
  std::vector<Eigen::MatrixXd> pieces;  ///< columns_along(): the kept ones, in the pieces in which they grew
  std::map<std::string, Support> support;  ///< by the key of a column, see ColumnMemory
};

/// Serves the passes over one choice of flights under one model.
class ColumnMemory {
 public:
  /// Half of what five hours of flights may take. Columns beyond it are made anew in each pass.
  static constexpr std::size_t kMost_bytes = std::size_t{512} << 20;
  /// Of columns that are not kept, those that were asked for last.
  static constexpr std::size_t kMostRecent_bytes = std::size_t{128} << 20;

  /// @param flights how many the passes have
  /// @param records of these flights in blocks, about
  ColumnMemory(std::size_t flights, std::size_t records, std::size_t most_bytes = kMost_bytes)
      : flights_(flights), records_(records), most_bytes_(most_bytes) {}

  /// The Gram matrices of `candidates`, which do not depend on what was asked for before but by their rounding.
  /// @param passes always of the same flights and models
  /// @param kept   whether columns that are not kept yet will be asked for again
  Grams grams(const Passes& passes, std::vector<Candidate> candidates, Kept kept);

  /// A track, with columns_along() it as flown and as_commanded().
  using UseColumns = std::function<void(std::size_t flight, const ModelledTrack& track,
                                        const Eigen::MatrixXd& flown, const Eigen::MatrixXd& wanted)>;
  /// Calls use() for each track, several flights at a time. Precondition: all tracks have set points.
  void over_columns(const Passes& passes, const Grams& asked, const UseColumns& use);

  /// Gives back what the kept columns take: nothing is asked for again, or little.
  void forget_kept();

  /// Of passes.flights[flight]. Safe to call from several threads, each with a flight of its own.
  std::vector<KeptTrack>& tracks(const Passes& passes, std::size_t flight);

  /// Results of refine() and instrument(), by a text of everything that they depend on.
  std::map<std::string, std::vector<Refined>> refinements;
  std::map<std::string, std::vector<InstrumentedValue>> instrumented;

 private:
  struct Flight {
    bool is_loaded = false;
    std::vector<KeptTrack> tracks;
  };
  struct Request;
  using OfFlights = std::vector<std::vector<TrackColumns>>;  ///< by flight and track
  /// Columns that a pass fills.
  struct Recent {
    std::size_t last_use = 0;
    int columns = 0;
    OfFlights flights;
  };

  enum class Along { kFlown, kWanted };  ///< the track, or as_commanded()
  struct Place {
    std::size_t flight, track;
  };

  std::size_t bytes_of(int columns) const;
  Request planned(const Grams& asked, Kept kept, Along along);
  /// Gives recent columns that are new in this pass a place for each track of the flight.
  void make_places(const Request& request, std::size_t flight) const;
  /// The kept columns of the track and those of request.more, in the order of Request::first.
  /// @param made    gets those that are new
  /// @param support gets that of request.more, by key.
  std::vector<const double*> columns_of_track(const Passes& passes, const Request& request, Along along,
                                              const Place& at, const KeptTrack& track, Eigen::MatrixXd& made,
                                              std::map<std::string, Support>& support) const;
  void add_track(const Passes& passes, const Grams& asked, const Request& request, const Place& at,
                 KeptTrack& track, FlightPart& part) const;
  /// Recent columns beyond what the memory may hold.
  void forget_old();

  std::vector<Flight> flights_;
  const std::size_t records_, most_bytes_;
  std::map<std::string, int> first_column_;  ///< of kept columns, by a text of effect and theta
  int columns_ = 0;                          ///< kept
  std::map<std::string, Recent> recent_;     ///< by the same text
  /// What the last pass forgot, by the number of columns: room for as many new ones, which need not be asked for.
  std::multimap<int, OfFlights> spare_;
  std::size_t requests_ = 0;
};

}  // namespace swarmcert::identification
