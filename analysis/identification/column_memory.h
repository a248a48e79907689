/// @file Caches the columns of effects along the flights of one search between passes.
///
/// A search requests the same columns many times: each round of a selection requests the columns of all candidates,
/// each step of a refinement those of the effects whose shapes do not move. For each block of 2 s, the columns after
/// the accelerometer's filter and their Gram matrix are kept, and new columns are appended. The most recent other
/// columns and the results of fits are cached as well.
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

/// Returns a text of all properties of candidates that a fit depends on: equal texts give equal results.
std::string text_of(const std::vector<Candidate>& candidates);

/// A block of a track with the kept columns X and the residual r.
struct KeptBlock {
  double y = 0;              ///< r'r
  std::vector<double> gram;  ///< X'X, packed as Block::gram
  std::vector<double> b;     ///< X'r
};

/// The columns of one effect with one theta.
struct TrackColumns {
  Eigen::MatrixXd rows;  ///< result of columns_along()
  Support support;
};

struct KeptTrack {
  ModelledTrack known;
  std::vector<stability::Instant> wanted;  ///< as_commanded(), once requested
  Eigen::VectorXd residual_N;              ///< residual_along()
  std::vector<KeptBlock> blocks;
  std::vector<Eigen::MatrixXd> pieces;     ///< columns_along(): the kept columns, in pieces as appended
  std::map<std::string, Support> support;  ///< by key of a column, see ColumnMemory
};

/// Serves all passes over one set of flights under one model.
class ColumnMemory {
 public:
  /// About half the size of five hours of flights. Further columns are computed again in each pass.
  static constexpr std::size_t kMost_bytes = std::size_t{512} << 20;
  /// Limit for the most recent columns that are not kept.
  static constexpr std::size_t kMostRecent_bytes = std::size_t{128} << 20;

  /// @param flights number of flights of the passes
  /// @param records approximate number of records of these flights in blocks
  ColumnMemory(std::size_t flights, std::size_t records, std::size_t most_bytes = kMost_bytes)
      : flights_(flights), records_(records), most_bytes_(most_bytes) {}

  /// Returns the Gram matrices of `candidates`. They do not depend on earlier requests except for round-off.
  /// @param passes must have the same flights and models in each call
  /// @param kept   whether new columns will be requested again
  Grams grams(const Passes& passes, std::vector<Candidate> candidates, Kept kept);

  /// Called with a track and its columns_along() as flown and as_commanded().
  using UseColumns = std::function<void(std::size_t flight, const ModelledTrack& track,
                                        const Eigen::MatrixXd& flown, const Eigen::MatrixXd& wanted)>;
  /// Calls use() for each track, several flights at a time. Precondition: all tracks have setpoints.
  void over_columns(const Passes& passes, const Grams& asked, const UseColumns& use);

  /// Frees the kept columns, when few or no further requests are expected.
  void forget_kept();

  /// Returns the tracks of passes.flights[flight]. Thread-safe if each thread uses a different flight.
  std::vector<KeptTrack>& tracks(const Passes& passes, std::size_t flight);

  /// Results of refine() and instrument(), keyed by a text of everything they depend on.
  std::map<std::string, std::vector<Refined>> refinements;
  std::map<std::string, std::vector<InstrumentedValue>> instrumented;

 private:
  struct Flight {
    bool is_loaded = false;
    std::vector<KeptTrack> tracks;
  };
  struct Request;
  using OfFlights = std::vector<std::vector<TrackColumns>>;  ///< by flight and track
  /// Columns that are computed in a pass.
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
  /// Allocates, for the recent columns that are new in this pass, an entry for each track of the flight.
  void make_places(const Request& request, std::size_t flight) const;
  /// Returns the kept columns of the track and those of request.more, in the order of Request::first.
  /// @param made    receives new columns
  /// @param support receives the support of request.more, by key
  std::vector<const double*> columns_of_track(const Passes& passes, const Request& request, Along along,
                                              const Place& at, const KeptTrack& track, Eigen::MatrixXd& made,
                                              std::map<std::string, Support>& support) const;
  void add_track(const Passes& passes, const Grams& asked, const Request& request, const Place& at,
                 KeptTrack& track, FlightPart& part) const;
  /// Drops the oldest recent columns beyond the memory limit.
  void forget_old();

  std::vector<Flight> flights_;
  const std::size_t records_, most_bytes_;
  std::map<std::string, int> first_column_;  ///< of kept columns, by a text of effect and theta
  int columns_ = 0;                          ///< number of kept columns
  std::map<std::string, Recent> recent_;     ///< by the same text
  /// Buffers freed by the last pass, by number of columns, for reuse by the same number of new columns.
  std::multimap<int, OfFlights> spare_;
  std::size_t requests_ = 0;
};

}  // namespace swarmcert::identification
