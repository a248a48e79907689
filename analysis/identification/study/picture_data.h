/// @file Data for the figures of a study: residuals over the room before and after, and the force of
/// each effect over its own variable.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// Mean residual along one axis over the horizontal position of the vehicle, on a grid.
struct RoomMap {
  int axis = 2;                      ///< along which the residual of the given model is largest; 2: z
  static constexpr int kCells = 16;  ///< along x and along y
  double lower_m[2] = {0, 0}, step_m[2] = {0, 0};
  struct Cell {
    std::size_t records = 0;
    double before_N = 0, after_N = 0;  ///< means
  };
  std::vector<Cell> cells;  ///< [kCells * kCells], x fastest; empty without flight
};

/// An effect over its own variable: the force that it exerts, and what is measured of it, the residual of the model
/// with all other effects.
struct EffectCurve {
  std::string effect;
  char axis = 'z';  ///< of the world
  std::string variable,
      unit;          ///< "z", "m": of those that the effect is known to vary with, the one that explains most
  double share = 0;  ///< of the effect's variance along the axis that the variable explains: estimate
  struct Point {
    double at = 0;                           ///< mean of the variable
    double predicted_N = 0, measured_N = 0;  ///< means of the bin
    double error_N = 0;                      ///< standard error of measured_N over blocks of 2 s
    std::size_t records = 0;
  };
  std::vector<Point> points;  ///< by the variable; denser where the force is steep
};

struct PictureData {
  RoomMap room;
  std::vector<EffectCurve> effects;  ///< for effects of the fitted model whose force varies, in their order
};

/// @param before, after models of the same kind of vehicle; vehicles of other kinds are ignored
PictureData picture_data(const residuals::Inputs& inputs, const stability::Model& before,
                         const stability::Model& after);

}  // namespace swarmcert::identification
