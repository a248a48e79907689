#include "analysis/reproduction/experiments.h"

namespace swarmcert::reproduction {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {
      {"curriculum", "section III-C: distances and labels from stage to stage", curriculum},
      {"data", "section V-B: test error over minutes of data", minutes_of_data},
      {"table", "tab:nnperf: largest z-error of networks and swarms; x- and y-errors", performance},
      {"claims", "section V-C: under which wakes, batteries and heights its results appear", claims},
      {"intro", "fig:intro: two vehicles swap, without and with a network", figure_intro},
      {"swaps", "fig:swaps: height errors of three vehicles under four controllers", figure_swaps},
      {"heatmap", "fig:heatmap: predicted force over places", figure_heatmap},
      {"validation", "fig:validation: force and prediction in a swap of four", figure_validation},
      {"superposition", "f(a,b) - f(a) - f(b): truth, network, recorded flights", superposition},
      {"lipschitz", "test error, certified bound and tracking error over gamma", lipschitz_tradeoff},
      {"symmetry", "exact symmetry, turned samples or none: test error over data and over the bound",
       symmetry},
      {"layers",
       "spectral normalisation, projection and bounded layers: test error at equal certified bounds",
       bounded_layers},
      {"real-flights", "the published flights: beside the published networks; physics first", real_flights},
      {"gains-in-flight", "errors of gains that flew, predicted from the gains: --calibrate, --flights",
       gains_in_flight},
  };
  return all;
}

}  // namespace swarmcert::reproduction
