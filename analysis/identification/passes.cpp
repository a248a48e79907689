#include "analysis/identification/passes.h"

#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {

std::vector<ModelledTrack> modelled_tracks(const residuals::Inputs& inputs, const std::string& kind,
                                           int flight) {
  std::vector<ModelledTrack> result;
  std::vector<std::string> problems;
  for (residuals::Track& track : inputs.load(static_cast<std::size_t>(flight), problems)) {
    if (track.position_only || track.kind != kind) continue;
    ModelledTrack next;
    next.model = inputs.model_for(track);
    next.residual_N = residuals::force_residual(next.model, inputs.kinds, inputs.rules, track);
    next.cut = cut_into_blocks(track);
    next.track = std::move(track);
    result.push_back(std::move(next));
  }
  return result;
}

void over_modelled_tracks(const Passes& passes,
                          const std::function<void(std::size_t k, const ModelledTrack& track)>& use,
                          const std::function<void()>& ended) {
  files::parallel_for(static_cast<int>(passes.flights.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::optional<std::vector<ModelledTrack>> own;
    std::optional<std::vector<ModelledTrack>>& tracks = passes.known == nullptr ? own : (*passes.known)[k];
    if (!tracks) tracks = modelled_tracks(passes.inputs, passes.kind, passes.flights[k]);
    for (const ModelledTrack& track : *tracks) use(k, track);
    if (ended) ended();
  });
}

}  // namespace swarmcert::identification
