/// @file Affine maps with exact entries, sparse, as the folding of layers needs them.
#pragma once

#include <cstdint>
#include <vector>

#include "nn/weights/enclosed.h"

namespace swarmcert::files {

/// Thrown where a map would have more entries, or need more work, than a reader allows; the reader names the node.
struct FoldingLimit {
  const char* what;
};

/// One entry of a row.
struct AffineEntry {
  int column = 0;
  Enclosed factor;
};

/// x -> M x + c. Rows hold their entries in ascending order of columns; entries that are exactly 0 are left out.
struct AffineMap {
  using Row = std::vector<AffineEntry>;

  int inputs = 0;
  std::vector<Row> rows;
  std::vector<Enclosed> shift;  ///< c, one per row

  int outputs() const { return static_cast<int>(rows.size()); }
  std::uint64_t entries() const;
  bool is_identity() const;
  /// Whether every entry and shift is finite.
  bool is_finite() const;
};

/// x -> x.
AffineMap identity_map(int size);

/// x -> second(first(x)), for second.inputs == first.outputs().
/// @throws FoldingLimit.
AffineMap composed(const AffineMap& second, const AffineMap& first);

/// x -> a(x) + sign b(x), row by row; of the same sizes. `sign` is 1 or -1.
AffineMap sum_of(const AffineMap& a, const AffineMap& b, double sign);

/// Row i multiplied by factors[i]; one factor serves all rows.
void scale_rows(AffineMap& map, const std::vector<Enclosed>& factors);

/// Row i shifted by sign * amounts[i]; one amount serves all rows.
void shift_rows(AffineMap& map, const std::vector<Enclosed>& amounts, double sign);

/// The rows of all maps, one below the other; of the same number of inputs.
AffineMap stacked(const std::vector<const AffineMap*>& maps);

/// Rows `which` of `map`, in this order.
AffineMap selected(const AffineMap& map, const std::vector<int>& which);

}  // namespace swarmcert::files
