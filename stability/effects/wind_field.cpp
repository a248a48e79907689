/// @file Wind that varies over the room: a shear layer over the height, and a column of rising or sinking air.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/hint.h"

namespace swarmcert::stability {
namespace {

enum WindShape { kShearHeight, kShearThickness, kColumnX, kColumnY, kColumnRadius };

/// 0 below the layer, 1 above.
double shear_share(const Instant& now, const double* shape) {
  return 1 / (1 + std::exp(std::min(-(now.p_W_m.z() - shape[kShearHeight]) / shape[kShearThickness], 50.0)));
}

double column_share(const Instant& now, const double* shape) {
  const double x = now.p_W_m.x() - shape[kColumnX], y = now.p_W_m.y() - shape[kColumnY];
  return std::exp(-(x * x + y * y) / (2 * shape[kColumnRadius] * shape[kColumnRadius]));
}

bool start_at_layer(const Hint& hint, Start& start) {
  const auto height_m = hint.first_of({"middle", "at", "centre"});
  if (!hint.is_horizontal() || !height_m) return false;
  const double width_m = hint.number_of("width").value_or(0.1);
  std::vector<double> theta = start.thetas[0];
  start.thetas.clear();
  theta[kShearHeight] = *height_m;
  for (const double factor : {1.0, 0.4, 2.0}) {
    theta[kShearThickness] = std::max(factor * width_m, 0.02);
    start.thetas.push_back(theta);
  }
  start.hold_others({"shear_x_N", "shear_y_N"});
  start.free_shape({"height_m", "thickness_m"});
  return true;
}

bool start_at_column(const Hint& hint, Start& start) {
  const auto x_m = hint.number_of("x_centre"), y_m = hint.number_of("y_centre");
  const auto radius_m = hint.first_of({"width", "core"});
  const bool is_column = hint.form == "gaussian" || hint.form == "inverse_square";
  if (!hint.is_vertical() || !is_column || !x_m || !y_m || !radius_m) return false;
  std::vector<double>& theta = start.thetas[0];
  theta[kColumnX] = *x_m;
  theta[kColumnY] = *y_m;
  theta[kColumnRadius] = *radius_m;
  start.thetas.resize(1);
  start.hold_others({"thermal_N"});
  start.free_shape({"x_m", "y_m", "radius_m"});
  return true;
}

class WindField : public Effect {
 public:
  WindField()
      : Effect({"wind_field",
                "f_xy = F / (1 + exp(-(z - z_0) / d)), f_z = G exp(-((x - x_0)^2 + (y - y_0)^2) / (2 r^2))",
                "a shear layer between still and moving air, and a thermal or the draught of a fan; given as "
                "forces, since flights reveal only drag times wind",
                "wind_field",
                "the same heights and places at several speeds and headings",
                {{"shear_x_N", "force above the layer, world x", 0, -1, 1, {}, Unit::kWeight},
                 {"shear_y_N", "force above the layer, world y", 0, -1, 1, {}, Unit::kWeight},
                 {"thermal_N", "force in the middle of the column, upwards", 0, -1, 1, {}, Unit::kWeight}},
                {{"height_m", "z_0: middle of the shear layer", 1, -100, 100, {}},
                 {"thickness_m", "d of the shear layer", 0.1, 0.005, 100, {}},
                 {"x_m", "x_0: middle of the column", 0, -1000, 1000, {}},
                 {"y_m", "y_0", 0, -1000, 1000, {}},
                 {"radius_m", "r of the column", 0.3, 0.01, 100, {}}}},
               {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kNotNeeded, {"z", "xy"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double layer = shear_share(now, shape);
    columns[0] = {layer * Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero()};
    columns[1] = {layer * Eigen::Vector3d::UnitY(), Eigen::Vector3d::Zero()};
    columns[2] = {column_share(now, shape) * Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    constexpr double kClear = 0.1;
    return shear_share(now, shape) > kClear || column_share(now, shape) > kClear;
  }
  bool start_at(const Hint& hint, Start& start) const override {
    return hint.variable == "z" ? start_at_layer(hint, start) : start_at_column(hint, start);
  }
};

}  // namespace

EffectEntry effects::wind_field() { return effect_entry<WindField>(); }

}  // namespace swarmcert::stability
