/// @file Where a model fails, in one line: nowhere, everywhere alike, in one regime, or here and there.
#pragma once

#include <string>

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/record.h"

namespace swarmcert::residuals {

struct FailingPlace {
  enum class Where { kNowhere, kEverywhere, kRegion, kScattered };
  Where where = Where::kNowhere;
  int variable = -1;  ///< of the region
  double share = 0;   ///< of the mean square of the residual vector: estimate
  std::string words;  ///< "everywhere alike: 20.1 mN towards -y, 87 % of the mean square"
};
void describe(files::Record& record, FailingPlace::Where where);
void describe(files::Record& record, const FailingPlace& place);

/// Judges the residual of all records. Nowhere: its mean square is at most half as much again as that of the noise
/// floor, which is the white part of its spectrum, and its low frequencies are at most three times that. Everywhere:
/// the squared mean is at least half of the rest of the mean square. A region: its mean beside that of all explains a
/// tenth; one of a variable that the controller sets only if no other does. Else scattered.
FailingPlace failing_place(const Comparison& comparison, const ForceUnit& unit);

/// "It fails everywhere alike: 20.1 mN towards -y, 87 % of the mean square."
std::string sentence(const FailingPlace& place);

/// Returns a region with the mean of its residual: "height below 0.08 m: 35 mN towards +z".
std::string region_words(const RegionErrors& region, const ForceUnit& unit);

/// Returns the axis with the largest share of the squared residual: 0 for x, 1 for y, 2 for z.
int failing_axis(const ErrorStatistics& statistics);

}  // namespace swarmcert::residuals
