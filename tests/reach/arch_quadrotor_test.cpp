#include "stability/reach/arch_quadrotor.h"

#include <cmath>

#include "tests/data.h"
#include "tests/reach/random_forms.h"

namespace swarmcert::stability {
namespace {

using State = std::array<double, 12>;
using Inputs = std::array<double, 3>;  ///< thrust (N), roll and pitch torque (N m)

const Interval kPeriod_s = decimal(0.1);
constexpr int kPeriods = 50;

/// The equations of the benchmark in double, from its description.
State slopes(const State& x, const Inputs& u) {
  const double s7 = std::sin(x[6]), c7 = std::cos(x[6]), s8 = std::sin(x[7]), c8 = std::cos(x[7]);
  const double s9 = std::sin(x[8]), c9 = std::cos(x[8]), g = 9.81, m = 1.4, Jx = 0.054, Jy = 0.054,
               Jz = 0.104;
  return {c8 * c9 * x[3] + (s7 * s8 * c9 - c7 * s9) * x[4] + (c7 * s8 * c9 + s7 * s9) * x[5],
          c8 * s9 * x[3] + (s7 * s8 * s9 + c7 * c9) * x[4] + (c7 * s8 * s9 - s7 * c9) * x[5],
          s8 * x[3] - s7 * c8 * x[4] - c7 * c8 * x[5],
          x[11] * x[4] - x[10] * x[5] - g * s8,
          x[9] * x[5] - x[11] * x[3] + g * c8 * s7,
          x[10] * x[3] - x[9] * x[4] + g * c8 * c7 - u[0] / m,
          x[9] + s7 * s8 / c8 * x[10] + c7 * s8 / c8 * x[11],
          c7 * x[10] - s7 * x[11],
          (s7 * x[10] + c7 * x[11]) / c8,
          (Jy - Jz) / Jx * x[10] * x[11] + u[1] / Jx,
          (Jz - Jx) / Jy * x[9] * x[11] + u[2] / Jy,
          (Jx - Jy) / Jz * x[9] * x[10]};
}

State moved(State x, const State& slope, double h) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += h * slope[i];
  return x;
}

/// A period by 40 steps of Runge-Kutta, whose error is below 1e-9.
State after_period(State x, const std::function<Inputs(const State&)>& law, bool is_held) {
  const Inputs held = law(x);
  const auto slope = [&](const State& y) { return slopes(y, is_held ? held : law(y)); };
  for (int k = 0; k < 40; ++k) {
    const double h = 0.1 / 40;
    const State k1 = slope(x), k2 = slope(moved(x, k1, h / 2)), k3 = slope(moved(x, k2, h / 2)),
                k4 = slope(moved(x, k3, h));
    x = moved(moved(moved(moved(x, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
  }
  return x;
}

Inputs altitude_law(const State& x) {
  return {1.4 * 9.81 - 10 * (x[2] - 1) + 3 * x[5], -x[6] - x[9], -x[7] - x[10]};
}

/// Flies from random initial states of `start`, often its corners, and expects every state at the end of each period
/// in the forms for the initial state.
void expect_flights_inside(const std::vector<FlowStep>& steps, const AffineVector& start,
                           const std::function<Inputs(const State&)>& law, bool is_held, int flights) {
  files::Random random(6);
  for (int flight = 0; flight < flights; ++flight) {
    std::vector<double> e(6);
    for (double& one : e) one = flight % 2 == 0 ? random.symmetric() : random.uniform() < 0.5 ? -1 : 1;
    State x{};
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(tests::middle(start[i], e));
    for (std::size_t k = 0; k < steps.size(); ++k) {
      x = after_period(x, law, is_held);
      const AffineVector reached = steps[k].at(kPeriod_s);
      for (std::size_t i = 0; i < x.size(); ++i)
        ASSERT_TRUE(tests::contains(reached[i], e, x[i], 1e-9)) << "x" << i + 1 << " after period " << k + 1;
    }
  }
}

std::vector<FlowStep> altitude_steps(const AffineVector& start) {
  return reach([](const AffineVector&) { return VectorField(arch_altitude_step); }, start, kPeriod_s,
               kPeriods, 12);
}

AffineVector cube(double radius) { return arch_start({radius, radius, radius, radius, radius, radius}); }

/// The known answers of the linear equation that the altitude obeys, with the digits that they are stated with.
struct Answer {
  double radius, largest, smallest_from_1_s, least_at_5_s, most_at_5_s;
};
constexpr Answer kAnswers[] = {{0.1, 1.278358, .929602, .995746, .996631},
                               {0.4, 1.356206, .909914, .994418, .997958},
                               {0.8, 1.462088, .883136, .992648, .999728}};

TEST(ArchQuadrotor, TheAltitudeStepHasTheKnownAnswersWithoutAssumingALevelAttitude) {
  for (const Answer& answer : kAnswers) {
    const std::vector<FlowStep> steps = altitude_steps(cube(answer.radius));
    const AffineVector last = steps.back().at(kPeriod_s);
    for (std::size_t i = 6; i < 12; ++i) EXPECT_TRUE(last[i].is_zero()) << "attitude and rates stay 0";
    const auto expect = [](Interval found, double known) {
      EXPECT_GE(found.upper, known * (1 - 1e-6));
      EXPECT_LE(found.upper, known * (1 + 1e-6));
      EXPECT_LT(found.upper - found.lower, 1e-7);
    };
    expect(extreme(steps, 0, 2, Side::kLargest, 400, 6).value, answer.largest);
    expect(extreme(steps, 10, 2, Side::kSmallest, 400, 6).value, answer.smallest_from_1_s);
    expect(-(-last[2]).largest(6), answer.least_at_5_s);
    expect(last[2].largest(6), answer.most_at_5_s);
  }
}

TEST(ArchQuadrotor, ACornerOfTheLargestBoxBreaksTheLimitForSure) {
  const std::vector<FlowStep> steps = altitude_steps(cube(0.8));
  const Extreme peak = extreme(steps, 0, 2, Side::kLargest, 400, 6);
  const AffineForm form = steps[peak.step].x[2].at(peak.time_s);
  AffineVector corner = arch_start({});
  for (std::size_t i = 0; i < 6; ++i)
    corner[i] = decimal(i < form.slopes.size() && form.slopes[i] < 0 ? -0.8 : 0.8);
  const Interval altitude = altitude_steps(corner)[peak.step].at(peak.time_s)[2].range();
  EXPECT_GT(altitude.lower, 1.462);
  EXPECT_LT(altitude.upper, peak.value.upper);
}

TEST(ArchQuadrotor, FlightsUnderTheLawStayInTheSets) {
  const AffineVector start = cube(0.8);
  expect_flights_inside(altitude_steps(start), start, altitude_law, false, 40);
}

/// From a tilted and turning start, where every term of the equations acts.
TEST(ArchQuadrotor, TiltedFlightsStayInTheSets) {
  AffineVector start(12);
  for (std::size_t i = 0; i < 12; ++i)
    start[i] = AffineForm(i % 2 == 0 ? 0.3 : -0.2) + AffineForm(0.005) * symbol(i % 6);
  expect_flights_inside(altitude_steps(start), start, altitude_law, false, 20);
}

class ArchNetwork : public testing::Test {
 protected:
  void SetUp() override {
    SWARMCERT_NEEDS_DATA();
    network_ = files::load_weights(tests::data_path("weights/arch/QUAD_quad_controller_3_64_torch.onnx"));
  }
  std::vector<FlowStep> steps(const AffineVector& start) const {
    return reach(arch_network_loop(network_), start, kPeriod_s, kPeriods, 4);
  }
  void expect_flights_inside(const AffineVector& start, int flights) const {
    const files::Evaluator<double> f(network_);
    const auto law = [&f](const State& x) {
      const std::vector<double> u = f({x.begin(), x.end()});
      return Inputs{1.4 * 9.81 + u[0], u[1], u[2]};
    };
    stability::expect_flights_inside(steps(start), start, law, true, flights);
  }

  files::Weights network_;
};

TEST_F(ArchNetwork, ReachesItsAltitudeFromTheSmallBox) {
  const Interval altitude = steps(cube(0.004)).back().at(kPeriod_s)[2].range();
  EXPECT_GT(altitude.lower, 0.9905);
  EXPECT_LT(altitude.upper, 0.9907);
}

TEST_F(ArchNetwork, ReachesItsAltitudeFromTheWholeBoxInTenParts) {
  for (int part = 0; part < 10; ++part) {
    const Interval middle = Interval(part) * decimal(0.08) - decimal(0.36);
    const Interval altitude =
        steps(arch_start({0.4, 0.4, 0.04, 0.4, 0.4, 0.4}, middle)).back().at(kPeriod_s)[2].range();
    EXPECT_GT(altitude.lower, 0.94) << part;
    EXPECT_LT(altitude.upper, 1.06) << part;
  }
}

TEST_F(ArchNetwork, FlightsStayInTheSets) {
  expect_flights_inside(cube(0.004), 20);
  expect_flights_inside(arch_start({0.4, 0.4, 0.04, 0.4, 0.4, 0.4}, 0.36), 40);
}

}  // namespace
}  // namespace swarmcert::stability
