/// @file Doubts about a named effect: whether it is only part of what is left beside it, or has another form.
#pragma once

#include <set>
#include <string>

#include "analysis/identification/missing.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/scan/scan.h"

namespace swarmcert::identification {

/// Above this Remainder::ratio, small effects cannot be distinguished from parts of the unexplained remainder. Source:
/// 20 simulated flights with gusts and external forces had 56 .. 320, recorded flights of two vehicles 9 .. 21.
inline constexpr double kLoudRatio = 25;

/// Returns whether the registry has the effect.
bool is_of_library(const std::string& effect);

/// Returns the drags against the velocity whose exponent is fixed at 1 or 2.
std::set<std::string> fixed_drags();

/// Returns wakes that the flights do not show beside the others: a delayed wake whose delay may be zero within its
/// interval, which is a downwash; and of a delayed wake beside a downwash the one that explains less, because the wake
/// of a vehicle has one delay.
std::set<std::string> wakes_without_delay(const Selected& selected);

/// Returns the mean square that an effect removes, N^2.
double taken_N2(const Missing& missing);

/// Returns whether an effect may be only the mean, the edge or a side effect of something else: a force at a place or
/// time, which few vehicles meet; thrust that depends on the climb rate, which any force along the velocity resembles;
/// or a fraction of the thrust below two percent of the weight. Drag and a lag are not suspect: every vehicle has them.
bool may_be_part(const Missing& missing, double weight_N);

/// Returns whether an effect is too small beside the remainder or has another form than the flights show.
/// @param scan of the remainder `rest` beside all effects found
bool is_doubtful(const Missing& missing, const Remainder& rest, const Scan& scan, double weight_N);

}  // namespace swarmcert::identification
