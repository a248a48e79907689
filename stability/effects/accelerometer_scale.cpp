/// @file An accelerometer that reads too much or too little.
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

/// The log's specific force is `scale` times the true one. As a force, to first order in what is no thrust: (scale - 1)
/// T b3. In simulation it acts on the log alone.
class AccelerometerScale : public MemoryEffect {
 public:
  AccelerometerScale()
      : MemoryEffect({"accelerometer_scale",
                      "r = (scale - 1) T b3, the measured specific force being scale times the true one",
                      "scale errors of inexpensive accelerometers are 1 to 3 %, and a wrong range or unit "
                      "gives far more",
                      "accelerometer scale",
                      "climbs and descents with more than 1 m/s^2, in a log with positions or velocities",
                      {{"scale", "measured over true specific force; 1 is nominal", 1, 0.3, 3},
                       {"nominal", "the true reading, which the factor replaces", -1, -1, -1}},
                      {},
                      true}) {}
  std::unique_ptr<ColumnStream> stream(const double*) const override {
    return std::make_unique<AccelerometerScaleStream>();
  }
  void add_to(SignalPath&, const double*, const double*) const override {
    // Nothing between command and force: FlightRecorder scales what it logs.
  }
};

}  // namespace

EffectEntry effects::accelerometer_scale() { return effect_entry<AccelerometerScale>(); }

}  // namespace swarmcert::stability
