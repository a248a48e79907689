/// @file Sparse affine maps with exact entries, used to fold layers.
#pragma once

#include <cstdint>
#include <vector>

#include "nn/weights/enclosed.h"

namespace swarmcert::files {

/// Thrown if a map would have more entries, or need more work, than a reader allows; the reader names the node.
struct FoldingLimit {
  const char* what;
};

/// One entry of a row.
struct AffineEntry {
  int column = 0;
  Enclosed factor;
};

/// x -> M x + c. Each row holds its entries in ascending order of columns; entries that are exactly 0 are omitted.
struct AffineMap {
  using Row = std::vector<AffineEntry>;

  int inputs = 0;
  std::vector<Row> rows;
  std::vector<Enclosed> shift;  ///< c, one per row

  int outputs() const { return static_cast<int>(rows.size()); }
  std::uint64_t entries() const;
  bool is_identity() const;
  /// Returns whether every entry and shift is finite.
  bool is_finite() const;
};

/// Returns x -> x.
AffineMap identity_map(int size);

/// Returns x -> second(first(x)), for second.inputs == first.outputs().
/// @throws FoldingLimit.
AffineMap composed(const AffineMap& second, const AffineMap& first);

/// Returns x -> a(x) + sign b(x) for maps of the same size; `sign` is 1 or -1.
AffineMap sum_of(const AffineMap& a, const AffineMap& b, double sign);

/// Multiplies row i by factors[i]; a single factor applies to all rows.
void scale_rows(AffineMap& map, const std::vector<Enclosed>& factors);

/// Shifts row i by sign * amounts[i]; a single amount applies to all rows.
void shift_rows(AffineMap& map, const std::vector<Enclosed>& amounts, double sign);

/// Stacks the rows of maps that have the same number of inputs.
AffineMap stacked(const std::vector<const AffineMap*>& maps);

/// Returns the rows `which` of `map`, in the given order.
AffineMap selected(const AffineMap& map, const std::vector<int>& which);

}  // namespace swarmcert::files
