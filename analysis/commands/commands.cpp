#include "analysis/commands/commands.h"

namespace swarmcert::analysis {

const std::vector<Command>& commands() {
  static const std::vector<Command> all = {
      // The commands that people need first
      demo_command(),      //
      inspect_command(),   //
      study_command(),     //
      compare_command(),   //
      add_command(),       //
      certify_command(),   //
      check_command(),     //
      bound_command(),     //
      simulate_command(),  //
      gate_command(),      //
      // Further commands
      diagnose_command(),         //
      model_command(),            //
      train_command(),            //
      reproduce_command(),        //
      spacing_command(),          //
      sweep_command(),            //
      merge_command(),            //
      tune_command(),             //
      iss_check_command(),        //
      identify_thrust_command(),  //
      export_command(),           //
      match_command(),            //
      verify_bundle_command(),    //
      explain_command(),          //
      schema_command(),           //
  };
  return all;
}

}  // namespace swarmcert::analysis
