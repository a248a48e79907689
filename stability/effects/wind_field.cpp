/// @file Wind that varies over the room: a shear layer over the height, and a column of rising or sinking air.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

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

class WindField : public Effect {
 public:
  WindField()
      : Effect({"wind_field",
                "f_xy = F / (1 + exp(-(z - z_0) / d)), f_z = G exp(-((x - x_0)^2 + (y - y_0)^2) / (2 r^2))",
                "a shear layer between still and moving air, and a thermal or the draught of a fan; given as "
                "forces, since flights reveal only drag times wind",
                "wind_field",
                "the same heights and places at several speeds and headings",
                {{"shear_x_N", "force above the layer, world x", 0, -0.3, 0.3},
                 {"shear_y_N", "force above the layer, world y", 0, -0.3, 0.3},
                 {"thermal_N", "force in the middle of the column, upwards", 0, -0.3, 0.3}},
                {{"height_m", "z_0: middle of the shear layer", 1, -100, 100, {}},
                 {"thickness_m", "d of the shear layer", 0.1, 0.005, 100, {}},
                 {"x_m", "x_0: middle of the column", 0, -1000, 1000, {}},
                 {"y_m", "y_0", 0, -1000, 1000, {}},
                 {"radius_m", "r of the column", 0.3, 0.01, 100, {}}}}) {}
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
};

}  // namespace

EffectEntry effects::wind_field() { return effect_entry<WindField>(); }

}  // namespace swarmcert::stability
