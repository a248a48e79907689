/// @file Settings of a pass over the flights, and the tracks that it visits.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/identification/column_run.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::identification {

/// A track with its model.
struct ModelledTrack {
  residuals::Track track;
  stability::Model model;
  std::vector<Eigen::Vector3d> residual_N;  ///< one per record, see residuals::force_residual()
  TrackBlocks cut;
};

/// The tracks of flights, once a pass has read them.
using KnownTracks = std::vector<std::optional<std::vector<ModelledTrack>>>;

struct Passes {
  const residuals::Inputs& inputs;
  std::string kind;
  std::vector<int> flights;  ///< indices into inputs.found.flights
  std::size_t records = 0;
  int jobs = 0;
  residuals::Progress progress;
  /// Of `flights`; null: each pass reads them again.
  std::shared_ptr<KnownTracks> known = nullptr;
};

/// Returns the tracks of vehicles of `kind` in a flight, without position-only ones.
/// @param flight index into inputs.found.flights
std::vector<ModelledTrack> modelled_tracks(const residuals::Inputs& inputs, const std::string& kind,
                                           int flight);

/// Calls use(k, track) for each track of passes.flights[k], several flights at a time, then ended(), if set.
void over_modelled_tracks(const Passes& passes,
                          const std::function<void(std::size_t k, const ModelledTrack& track)>& use,
                          const std::function<void()>& ended = nullptr);

}  // namespace swarmcert::identification
