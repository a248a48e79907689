#include "analysis/reproduction/experiments.h"

namespace swarmcert::reproduction {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {
      curriculum(),          //
      minutes_of_data(),     //
      performance(),         //
      claims(),              //
      figure_intro(),        //
      figure_swaps(),        //
      figure_heatmap(),      //
      figure_validation(),   //
      superposition(),       //
      lipschitz_tradeoff(),  //
      symmetry(),            //
      bounded_layers(),      //
      real_flights(),        //
      gains_in_flight(),     //
  };
  return all;
}

}  // namespace swarmcert::reproduction
