/// @file Shapes of effects off their grids, by Gauss-Newton steps together with all coefficients of a set.
#pragma once

#include "analysis/identification/evidence/evidence_search.h"
#include "analysis/identification/evidence/projection.h"

namespace swarmcert::evidence {

/// Returns `best` with the shapes that raise its score, in steps of at most one step of their grids. Their columns are
/// added to `all` and `data`.
Weighed with_free_shapes(const identification::Passes& passes, const Projection& projection, Hypotheses& all,
                         Whitened& data, Weighed best);

}  // namespace swarmcert::evidence
