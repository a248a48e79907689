/// @file Logs with the setpoints, path, sensors or name of another vehicle, and vehicles of another kind.
///
/// Not detectable: exchanged names of two vehicles of the same kind, and kinds that hover at about the same duty.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

struct Mislabelled {
  enum class What {
    kSetPoints,  ///< `vehicle` follows those in the log of `belongs_to`
    kPath,       ///< position and velocity in the log of `vehicle` are those of `belongs_to`
    kSensors,    ///< accelerometer, attitude and duties in the log of `vehicle` are those of `belongs_to`
    kName,  ///< the log named `vehicle` is that of `belongs_to`, of another kind, and the other way round
    kKind   ///< `vehicle` flies as one of the kind `belongs_to`
  };
  What what = What::kKind;
  std::string flight, vehicle, kind, path;  ///< for kKind, no flight and path: all flights of the vehicle
  std::string belongs_to;
  /// False if a thrust scale (another mass, a payload, other motors) explains the flights equally well.
  bool is_sure = true;
  /// Root mean square of the misfit as labelled and as corrected: m for setpoints, m/s^2 otherwise; along the thrust
  /// axis for names and kinds.
  double before = 0, after = 0;
  double mass_kg = 0;  ///< of the model of `vehicle`; 0 if it has none
  int blocks = 0, flights = 1;
};

/// Checks each flight separately, except that the kind of a vehicle is judged over all of its flights. Uses tests over
/// blocks of 1 s (kinds: 2 s) at 1 % for everything that is tried together. The result does not depend on `jobs`.
std::vector<Mislabelled> mislabelled(const residuals::Inputs& inputs, int jobs);

/// Makes `inputs` use the corrected names and kinds that are sure; a log of which only the kind is known is left out.
void correct_labels(const std::vector<Mislabelled>& found, residuals::Inputs& inputs);

/// Finds mislabelled logs and corrects those that can be corrected.
std::vector<Mislabelled> find_and_correct_labels(residuals::Inputs& inputs, int jobs);

/// Describes the finding: "cf51 of swap/00 flew the set points in the log of cf50: 0.050 m from them (RMS), 0.620 m
/// from those in its own log".
std::string in_words(const Mislabelled& label);

}  // namespace swarmcert::identification
