/// @file The effect of adding effects to a model, for reports: maps, curves and worst moments before and after.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/study/picture_data.h"
#include "analysis/report/report.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {

/// Adds the vertical residuals over neighbour positions, and those along the axis of `room` over the room and over
/// the variables with which the former vary most; each pair of maps has a common colour scale. At most once per report.
void add_before_and_after(Report& report, const residuals::Comparison& before,
                          const residuals::Comparison& after, const identification::RoomMap& room,
                          const residuals::ForceUnit& unit);

/// Adds the force of each effect over its own variable, as fitted and as measured. At most once per report.
void add_effect_curves(Report& report, const std::vector<identification::EffectCurve>& effects,
                       const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
