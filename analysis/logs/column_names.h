/// @file Names of columns: the forms in which they are compared, and what their words suggest, a prior in bits and
/// never a decision.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/logs/signals.h"

namespace swarmcert::logs {

/// What a group of columns may be.
enum Quantity : int {
  kIsPosition,
  kIsVelocity,
  kIsSpecificForce,
  kIsRates,
  kIsQuaternion,
  kIsAngles,
  kIsMotors,
  kIsBattery,
  kIsTargetPosition,
  kIsTargetVelocity,
  kNumQuantities
};

/// The signal that a group of this quantity carries, in the order of the quantities of a motion.
inline constexpr int kSignalOfQuantity[] = {kPosition, kVelocity, kForceBody, kRates, kAttitude, kEuler};

/// log2 of the odds for each quantity against a column without a name.
using NameBits = std::array<double, kNumQuantities>;

/// How the columns of a group are told apart.
enum class IndexKind { kNone, kAxis, kCompass, kNumber, kAngle, kRate };

/// The name of one column, taken apart.
struct NameReading {
  std::string family;  ///< the words without the index; columns of one vector have it in common
  IndexKind kind = IndexKind::kNone;
  int index = 0;  ///< x y z w, roll pitch yaw, p q r: 0 .. 3; north 0, east 1, down 2, up 3; or the number
  NameBits bits{};
  std::string unit;                         ///< as stated_unit()
  bool says_down = false, says_up = false;  ///< "ned", "frd"; "enu", "flu"
  bool is_wish = false;                     ///< a set point
  bool is_foreign = false;  ///< a word says that something else than the vehicle's motion is meant
};

/// Splits the name into words at signs, capitals and the last letter ("posX", "vel_n", "m1") and adds the bits of each
/// word: of the quantity that it names, of a set point, of things that are not the vehicle (wind, payload), of words
/// that say nothing (est, drone) and of unknown words.
NameReading read_name(const std::string& column);

/// Returns the name in lower case, without a unit in brackets, with each run of other characters than letters and
/// digits replaced by a dot.
std::string plain_name(const std::string& column);

/// The unit that the name of a column states.
struct StatedUnit {
  std::string unit;   ///< spelled as in columns.toml; empty if there is no known unit
  std::string plain;  ///< plain_name() without the unit after the last word
};

/// Returns the unit in brackets, "vx (mm/s)", or after the last word, "vx_mm_s", "pos_x_m", "roll_deg", "acc_z_mps2".
/// @param is_clock look for units of time: "t_ms"
StatedUnit stated_unit(const std::string& column, bool is_clock = false);

}  // namespace swarmcert::logs
