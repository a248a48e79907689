#include "stability/bounds/uncertain/uncertain_norms.h"

#include <map>
#include <vector>

#include "stability/bounds/uncertain/uncertain_part.h"

namespace swarmcert::stability {
namespace {

struct BoundedPart {
  PlantBox box;
  FourGains upper{};                  ///< per unit of force
  std::array<PlantPoint, 4> share{};  ///< contribution of each dimension to the bound of each gain
};

/// Gains for 1 kg at a point, and bounds on their curvature over a box.
struct UncertainFamily {
  std::function<GainNorms(const PlantPoint&)> at;
  std::function<PlantBends(const PlantBox&)> bends;
};

class Subdivision {
 public:
  Subdivision(const UncertainFamily& family, double told_mass_kg, const UncertainPlant& plant)
      : family_(family), told_mass_kg_(told_mass_kg), plant_(plant) {}

  UncertainNorms run(const UncertainEffort& effort) {
    using End = UncertainNorms::End;
    const double at_least_thrust = plant_.thrust_scale.lower * told_mass_kg_;
    const double least = at_least_thrust / plant_.mass_kg.upper;
    const double between = at_least_thrust / plant_.mass_kg.lower;
    const double most = plant_.thrust_scale.upper * told_mass_kg_ / plant_.mass_kg.lower;
    const auto box = [&](PlantEdge edge, double from, double to) {
      return PlantBox{edge,
                      {from, plant_.lag_s.lower, plant_.delay_s.lower},
                      {to, plant_.lag_s.upper, plant_.delay_s.upper}};
    };
    std::vector<PlantBox> edges;
    if (most > between || !(between > least)) edges.push_back(box(PlantEdge::kLeastMass, between, most));
    if (between > least) edges.push_back(box(PlantEdge::kLeastThrust, least, between));
    for (const PlantBox& edge : edges) {
      for (int i = 0; i < 8; ++i) evaluate(edge.edge, corner(edge, i));
    }
    for (const PlantBox& edge : edges) parts_.push_back(bounded(edge));
    while (true) {
      const Farthest farthest = find_farthest();
      const double gap = farthest.ratio - 1;
      if (gap <= effort.relative_gap) return finish(End::kGap);
      if (result_.evaluations >= effort.most_evaluations) return finish(End::kBudget);
      if (effort.go_on && !effort.go_on(result_.evaluations, gap)) return finish(End::kStopped);
      BoundedPart& part = parts_[farthest.part];
      const PlantPoint& share = part.share[farthest.gain];
      const auto i = static_cast<std::size_t>(std::max_element(share.begin(), share.end()) - share.begin());
      PlantBox low = part.box;
      PlantBox high = part.box;
      const double middle = part.box.centre()[i];
      if (!(low.from[i] < middle && middle < low.to[i]))
        return finish(End::kBudget);  // at the resolution of doubles
      low.to[i] = high.from[i] = middle;
      part = bounded(low);
      parts_.push_back(bounded(high));
    }
  }

 private:
  struct Farthest {
    std::size_t part = 0, gain = 0;
    double ratio = 1;
  };

  static PlantPoint corner(const PlantBox& box, int index) {
    PlantPoint p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = (index >> i) % 2 == 0 ? box.from[i] : box.to[i];
    return p;
  }

  /// Returns the factor that converts gains per 1 kg to gains per unit of force.
  double weight(PlantEdge edge, double ratio) const {
    return edge == PlantEdge::kLeastMass ? 1 / plant_.mass_kg.lower
                                         : ratio / (plant_.thrust_scale.lower * told_mass_kg_);
  }

  /// Returns the gains at a point, per unit of force; raises `lower`.
  FourGains evaluate(PlantEdge edge, const PlantPoint& p) {
    const auto [known, is_new] = norms_.try_emplace(p);
    if (is_new) {
      known->second = family_.at(p);
      ++result_.evaluations;
    }
    const double by = weight(edge, p[0]);
    FourGains values;
    for (std::size_t k = 0; k < 4; ++k) {
      values[k] = known->second.*kUncertainGains[k] * by;
      UncertainGain& gain = *gains_[k];
      if (!(values[k] > gain.lower)) continue;
      const double thrust = p[0] * plant_.mass_kg.lower / told_mass_kg_;
      gain.lower = values[k];
      gain.mass_kg = edge == PlantEdge::kLeastMass
                         ? plant_.mass_kg.lower
                         : std::min(plant_.mass_kg.upper, plant_.thrust_scale.lower * told_mass_kg_ / p[0]);
      gain.thrust_scale = edge == PlantEdge::kLeastMass ? std::min(plant_.thrust_scale.upper, thrust)
                                                        : plant_.thrust_scale.lower;
      gain.lag_s = p[1];
      gain.delay_s = p[2];
    }
    return values;
  }

  BoundedPart bounded(const PlantBox& box) {
    BoundedPart part{box, {}, {}};
    FourGains most{};
    for (int i = 0; i < 8; ++i) {
      const FourGains here = evaluate(box.edge, corner(box, i));
      for (std::size_t k = 0; k < 4; ++k) most[k] = std::max(most[k], here[k]);
    }
    ++result_.evaluations;
    const PlantBends bends = family_.bends(box);
    // On the edge of least thrust, bends refer to the gain times the ratio.
    const double unit = weight(box.edge, 1);
    for (std::size_t k = 0; k < 4; ++k) {
      double absolute = bends.between_samples[k] * weight(box.edge, box.to[0]);
      double relative = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        absolute += bends.absolute[k][i] * unit;
        relative += bends.relative[k][i];
        part.share[k][i] = bends.absolute[k][i] * unit + times(bends.relative[k][i], most[k]);
      }
      // Bends are valid only where the small-gain bound exists; a NaN proves nothing.
      const double first_order = bends.first_order[k] * weight(box.edge, box.to[0]);
      const bool is_bent = std::isfinite(first_order) && relative < 1 && !std::isnan(absolute);
      part.upper[k] = is_bent ? std::min(first_order, (most[k] + absolute) / (1 - relative)) : kInfinity;
      if (!is_bent || std::isinf(absolute)) part.share[k] = bends.share;
    }
    return part;
  }

  /// Finds the part and gain with the largest gap to the value attained; sets `upper`.
  Farthest find_farthest() {
    Farthest farthest;
    for (std::size_t k = 0; k < 4; ++k) gains_[k]->upper = gains_[k]->lower;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        gains_[k]->upper = std::max(gains_[k]->upper, parts_[i].upper[k]);
        if (std::isinf(gains_[k]->lower)) continue;  // nothing to prove: the gain is infinite
        const double ratio = parts_[i].upper[k] / gains_[k]->lower;
        if (ratio > farthest.ratio) farthest = {i, k, ratio};
      }
    }
    return farthest;
  }

  UncertainNorms finish(UncertainNorms::End end) {
    result_.end = end;
    return result_;
  }

  const UncertainFamily& family_;
  double told_mass_kg_;
  const UncertainPlant& plant_;
  UncertainNorms result_;
  std::array<UncertainGain*, 4> gains_ = {&result_.rate, &result_.amplitude, &result_.edge, &result_.impulse};
  std::map<PlantPoint, GainNorms> norms_;  ///< parts share their corners
  std::vector<BoundedPart> parts_;
};

}  // namespace

UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               const UncertainEffort& effort) {
  const UncertainFamily family = {
      [&](const PlantPoint& p) { return continuous_norms(plant_at(loop, p), channel); },
      [&](const PlantBox& box) { return bends_over(loop, channel, box); }};
  return Subdivision(family, loop.mass_kg, plant).run(effort);
}

UncertainNorms uncertain_norms(const SampledLoop& loop, const UncertainPlant& plant, Channel channel,
                               const UncertainEffort& effort) {
  const UncertainFamily family = {[&](const PlantPoint& p) {
                                    SampledLoop here = loop;
                                    here.plant = plant_at(loop.plant, p);
                                    return sampled_norms(here, channel, Instants::kSampling);
                                  },
                                  [&](const PlantBox& box) { return bends_over(loop, channel, box); }};
  return Subdivision(family, loop.plant.mass_kg, plant).run(effort);
}

}  // namespace swarmcert::stability
