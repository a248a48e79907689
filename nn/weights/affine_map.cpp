#include "nn/weights/affine_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kMostProducts = std::uint64_t{1} << 30;  ///< limit for one composition: half a minute

bool is_one(const Enclosed& factor) { return factor.value == 1 && factor.radius == 0; }
bool is_zero(const Enclosed& factor) { return factor.value == 0 && factor.radius == 0; }

/// Computes `second` times `first` row by row, with one exact sum per column.
class Composition {
 public:
  Composition(const AffineMap& second, const AffineMap& first)
      : second_(second), first_(first), sums_(static_cast<std::size_t>(first.inputs)) {}

  AffineMap run() {
    check_work();
    AffineMap result;
    result.inputs = first_.inputs;
    std::uint64_t entries = 0;
    for (std::size_t i = 0; i < second_.rows.size(); ++i) {
      result.rows.push_back(row(second_.rows[i]));
      result.shift.push_back(shift(second_.rows[i], second_.shift[i]));
      entries += result.rows.back().size();
      if (entries > kMostElements) throw FoldingLimit{"the folded layer has more than 2^25 numbers"};
    }
    return result;
  }

 private:
  void check_work() const {
    std::uint64_t products = 0;
    for (const AffineMap::Row& row : second_.rows) {
      for (const AffineEntry& entry : row)
        products += first_.rows[static_cast<std::size_t>(entry.column)].size();
      if (products > kMostProducts) throw FoldingLimit{"folding these layers takes too long"};
    }
  }

  AffineMap::Row row(const AffineMap::Row& factors) {
    if (factors.size() == 1) {
      AffineMap::Row result = first_.rows[static_cast<std::size_t>(factors[0].column)];
      if (!is_one(factors[0].factor))
        for (AffineEntry& entry : result) entry.factor = times(factors[0].factor, entry.factor);
      return result;
    }
    touched_.clear();
    for (const AffineEntry& outer : factors) {
      for (const AffineEntry& inner : first_.rows[static_cast<std::size_t>(outer.column)]) {
        touched_.push_back(inner.column);
        sums_[static_cast<std::size_t>(inner.column)].add_product(outer.factor, inner.factor);
      }
    }
    std::sort(touched_.begin(), touched_.end());
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    AffineMap::Row result;
    for (const int column : touched_) {
      ExactSum& sum = sums_[static_cast<std::size_t>(column)];
      const Enclosed factor = sum.value();
      if (!is_zero(factor)) result.push_back({column, factor});
      sum.clear();
    }
    return result;
  }

  Enclosed shift(const AffineMap::Row& factors, const Enclosed& own) const {
    ExactSum sum;
    sum.add(own);
    for (const AffineEntry& entry : factors)
      sum.add_product(entry.factor, first_.shift[static_cast<std::size_t>(entry.column)]);
    return sum.value();
  }

  const AffineMap& second_;
  const AffineMap& first_;
  std::vector<ExactSum> sums_;
  std::vector<int> touched_;
};

Enclosed sum_of(const Enclosed& a, const Enclosed& b, double sign) {
  ExactSum sum;
  sum.add(a);
  sum.add({sign * b.value, b.radius});
  return sum.value();
}

bool is_finite(const Enclosed& number) { return std::isfinite(number.value) && std::isfinite(number.radius); }

}  // namespace

std::uint64_t AffineMap::entries() const {
  std::uint64_t count = 0;
  for (const Row& row : rows) count += row.size();
  return count;
}

bool AffineMap::is_identity() const {
  if (outputs() != inputs) return false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != 1 || rows[i][0].column != static_cast<int>(i) || !is_one(rows[i][0].factor) ||
        !is_zero(shift[i]))
      return false;
  }
  return true;
}

bool AffineMap::is_finite() const {
  for (const Row& row : rows)
    for (const AffineEntry& entry : row)
      if (!files::is_finite(entry.factor)) return false;
  return std::all_of(shift.begin(), shift.end(), [](const Enclosed& c) { return files::is_finite(c); });
}

AffineMap identity_map(int size) {
  AffineMap map;
  map.inputs = size;
  for (int i = 0; i < size; ++i) map.rows.push_back({{i, {1, 0}}});
  map.shift.assign(static_cast<std::size_t>(size), {});
  return map;
}

AffineMap composed(const AffineMap& second, const AffineMap& first) {
  if (first.is_identity()) return second;
  return Composition(second, first).run();
}

AffineMap sum_of(const AffineMap& a, const AffineMap& b, double sign) {
  AffineMap result;
  result.inputs = a.inputs;
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    AffineMap::Row row;
    auto left = a.rows[i].begin();
    auto right = b.rows[i].begin();
    while (left != a.rows[i].end() || right != b.rows[i].end()) {
      const bool takes_left =
          right == b.rows[i].end() || (left != a.rows[i].end() && left->column <= right->column);
      const bool takes_right =
          left == a.rows[i].end() || (right != b.rows[i].end() && right->column <= left->column);
      const int column = takes_left ? left->column : right->column;
      const Enclosed factor =
          sum_of(takes_left ? left->factor : Enclosed{}, takes_right ? right->factor : Enclosed{}, sign);
      if (!is_zero(factor)) row.push_back({column, factor});
      if (takes_left) ++left;
      if (takes_right) ++right;
    }
    result.rows.push_back(std::move(row));
    result.shift.push_back(sum_of(a.shift[i], b.shift[i], sign));
  }
  return result;
}

void scale_rows(AffineMap& map, const std::vector<Enclosed>& factors) {
  for (std::size_t i = 0; i < map.rows.size(); ++i) {
    const Enclosed& factor = factors[factors.size() == 1 ? 0 : i];
    if (is_one(factor)) continue;
    if (is_zero(factor)) map.rows[i].clear();
    for (AffineEntry& entry : map.rows[i]) entry.factor = times(factor, entry.factor);
    map.shift[i] = times(factor, map.shift[i]);
  }
}

void shift_rows(AffineMap& map, const std::vector<Enclosed>& amounts, double sign) {
  for (std::size_t i = 0; i < map.rows.size(); ++i)
    map.shift[i] = sum_of(map.shift[i], amounts[amounts.size() == 1 ? 0 : i], sign);
}

AffineMap stacked(const std::vector<const AffineMap*>& maps) {
  AffineMap result;
  result.inputs = maps.front()->inputs;
  for (const AffineMap* map : maps) {
    result.rows.insert(result.rows.end(), map->rows.begin(), map->rows.end());
    result.shift.insert(result.shift.end(), map->shift.begin(), map->shift.end());
  }
  return result;
}

AffineMap selected(const AffineMap& map, const std::vector<int>& which) {
  AffineMap result;
  result.inputs = map.inputs;
  for (const int row : which) {
    result.rows.push_back(map.rows[static_cast<std::size_t>(row)]);
    result.shift.push_back(map.shift[static_cast<std::size_t>(row)]);
  }
  return result;
}

}  // namespace swarmcert::files
