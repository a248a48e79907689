#include "analysis/commands/commands.h"

namespace swarmcert::analysis {

const std::vector<Command>& commands() {
  static const std::vector<Command> all = {
      inspect_command(),          //
      certify_command(),          //
      check_command(),            //
      study_command(),            //
      compare_command(),          //
      diagnose_command(),         //
      add_command(),              //
      model_command(),            //
      train_command(),            //
      simulate_command(),         //
      reproduce_command(),        //
      bound_command(),            //
      spacing_command(),          //
      sweep_command(),            //
      merge_command(),            //
      tune_command(),             //
      iss_check_command(),        //
      identify_thrust_command(),  //
      export_command(),           //
      match_command(),            //
      gate_command(),             //
      verify_bundle_command(),    //
      schema_command(),           //
      demo_command(),
  };
  return all;
}

}  // namespace swarmcert::analysis
