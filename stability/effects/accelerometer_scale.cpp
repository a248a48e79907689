/// @file Scale error of the accelerometer.
#include "stability/effects/effect_entry.h"
#include "stability/effects/memory_effect.h"

namespace swarmcert::stability {
namespace {

class AccelerometerScaleStream : public ColumnStream {
 public:
  void advance(const Instant& now, Wrench* columns) override {
    columns[0] = columns[1] = {now.thrust_N * now.b3_W(), Eigen::Vector3d::Zero()};
  }
};

/// The log's specific force is `scale` times the true one. Expressed as a force, to first order in the non-thrust
/// forces: (scale - 1) T b3. In simulation it affects only the log.
class AccelerometerScale : public MemoryEffect {
 public:
  AccelerometerScale()
      : MemoryEffect(
            {"accelerometer_scale",
             "r = (scale - 1) T b3, the measured specific force being scale times the true one",
             "scale errors of inexpensive accelerometers are 1 to 3 %, and a wrong range or unit "
             "gives far more",
             "accelerometer scale",
             "climbs and descents with more than 1 m/s^2, in a log with positions or velocities",
             {{"scale", "measured over true specific force; 1 is nominal", 1, 0.3, 3},
              {"nominal", "the true reading, which the factor replaces", -1, -1, -1}},
             {},
             true},
            {Family::kNone, Family::kNone, ShownBy::kAccelerometer, SetPoints::kNotNeeded, {}, Place::kLog}) {
  }
  std::unique_ptr<ColumnStream> stream(const double*) const override {
    return std::make_unique<AccelerometerScaleStream>();
  }
  void add_to(SignalPath&, const double*, const double*) const override {
    // Does not affect the path from command to force: FlightRecorder scales what it logs.
  }
};

}  // namespace

EffectEntry effects::accelerometer_scale() { return effect_entry<AccelerometerScale>(); }

}  // namespace swarmcert::stability
