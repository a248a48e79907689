#include "nn/training/symmetry.h"

#include <cmath>

namespace swarmcert::training {
namespace {

struct Turn {
  float cosine, sine;
  float mirror;  ///< -1: the sign of y is changed first
};

/// Draws a point between two circles: its direction is uniform, and its cosine and sine need only a square root, so
/// that the bits are the same on every platform.
Turn random_turn(files::Random& random) {
  double x = 0, y = 0, square = 0;
  do {
    x = random.symmetric();
    y = random.symmetric();
    square = x * x + y * y;
  } while (square > 1 || square < 0x1p-20);
  const double length = std::sqrt(square);
  return {static_cast<float>(x / length), static_cast<float>(y / length),
          random.below(2) == 0 ? 1.0f : -1.0f};
}

}  // namespace

void turn_about_vertical(const Layout& layout, const Dataset& source, files::Random& random,
                         Dataset& turned) {
  for (Eigen::Index s = 0; s < source.samples(); ++s) {
    const Turn turn = random_turn(random);
    for (Eigen::Index i = source.first[s]; i < source.first[s + 1]; ++i) {
      const float* const from = source.x.data() + i * source.width;
      float* const to = turned.x.data() + i * source.width;
      for (const auto& [x, y] : layout.parts()[source.phi[i]].horizontal) {
        const float mirrored = turn.mirror * from[y];
        to[x] = turn.cosine * from[x] - turn.sine * mirrored;
        to[y] = turn.sine * from[x] + turn.cosine * mirrored;
      }
    }
    if (source.outputs != 3) continue;
    const float* const from = source.target.data() + 3 * s;
    float* const to = turned.target.data() + 3 * s;
    const float axial = source.target_is_axial ? turn.mirror : 1;
    const float x = axial * from[0];
    const float y = axial * turn.mirror * from[1];
    to[0] = turn.cosine * x - turn.sine * y;
    to[1] = turn.sine * x + turn.cosine * y;
    to[2] = axial * from[2];
  }
}

}  // namespace swarmcert::training
