/// @file What the pictures of a study show: residuals over the room before and after, and each effect as measured.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// Mean vertical residual over the horizontal place of the vehicle, cell by cell.
struct RoomMap {
  static constexpr int kCells = 16;  ///< along x and along y
  double lower_m[2] = {0, 0}, step_m[2] = {0, 0};
  struct Cell {
    std::size_t records = 0;
    double before_N = 0, after_N = 0;  ///< means
  };
  std::vector<Cell> cells;  ///< [kCells * kCells], x fastest; empty where nothing flew
};

/// One effect held against flights: what is measured where the model with all other effects predicts nothing of it,
/// over what the effect itself predicts. Points of an effect that describes the flights lie on the diagonal.
struct EffectCurve {
  std::string effect;
  char axis = 'z';  ///< the world axis in which the effect varies most
  struct Point {
    double predicted_N = 0, measured_N = 0;  ///< means of the bin
    double error_N = 0;                      ///< standard error of measured_N over blocks of 2 s
    std::size_t records = 0;
  };
  std::vector<Point> points;  ///< in order of predicted_N
};

struct PictureData {
  RoomMap room;
  std::vector<EffectCurve> effects;  ///< of the fitted model's effects that exert a force, in its order
};

/// @param before, after models of the same kind of vehicle; vehicles of other kinds are left out.
PictureData picture_data(const residuals::Inputs& inputs, const stability::Model& before,
                         const stability::Model& after);

}  // namespace swarmcert::identification
