/// The scan of the remainder, on remainders made from formulas with known truth.
#include "analysis/identification/scan/scan.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/identification/instrument.h"
#include "analysis/identification/scan/curve_fit.h"
#include "analysis/identification/scan/drag_law.h"
#include "analysis/identification/scan/forms.h"
#include "analysis/identification/scan/formulas.h"
#include "analysis/identification/scan/proposal.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using V = ScanVariable;

constexpr int kBlockSamples = 20;
constexpr double kNoise_N = 0.002;

/// Four flights of 40 s: every variable is a slow sum of two sines of its own and noise; forces are noise.
struct Flights {
  ScanSamples samples;
  std::mt19937_64 generator;
  std::normal_distribution<double> bell;

  explicit Flights(std::uint64_t seed, int flights = 4) : generator(seed) {
    const Eigen::Index each = 400, size = flights * each;
    samples.values.resize(size, kNumScanVariables);
    samples.commanded = Eigen::MatrixXf::Constant(size, kNumScanVariables, std::nanf(""));
    samples.residual = Eigen::MatrixXf::Zero(size, kTowardColumn + 1);
    samples.axes = Eigen::MatrixXf::Zero(size, 9);
    for (const int k : {0, 4, 8}) samples.axes.col(k).setOnes();
    samples.neighbours.lateral_m = Eigen::MatrixXf::Constant(size, NeighbourPlaces::kLags, std::nanf(""));
    samples.neighbours.height_m = samples.neighbours.lateral_m;
    samples.neighbours.velocity_m_s =
        Eigen::MatrixXf::Constant(size, 3 * NeighbourPlaces::kLags, std::nanf(""));
    for (int v = 0; v < kNumScanVariables; ++v) {
      for (int f = 0; f < flights; ++f) {
        const double a = 0.3 + uniform(), b = 0.8 + uniform(), p = 6 * uniform(), q = 6 * uniform();
        for (Eigen::Index i = 0; i < each; ++i) {
          const double t = 0.1 * static_cast<double>(i);
          samples.values(f * each + i, v) =
              static_cast<float>(std::sin(a * t + p) + 0.5 * std::sin(b * t + q));
        }
      }
    }
    for (Eigen::Index i = 0; i < size; ++i) {
      samples.values(i, static_cast<int>(V::kTime)) = static_cast<float>(0.1 * static_cast<double>(i % each));
      samples.flight.push_back(static_cast<int>(i / each));
      samples.block.push_back(static_cast<int>(i / kBlockSamples));
      for (int k = 0; k < 3; ++k) samples.residual(i, k) = static_cast<float>(kNoise_N * bell(generator));
      samples.residual.row(i).segment(3, 3) = samples.residual.row(i).head(3);
    }
    samples.flights = flights;
    samples.blocks = static_cast<int>(size) / kBlockSamples;
    samples.mean_square_N2 = 3 * kNoise_N * kNoise_N;
  }
  double uniform() { return std::generate_canonical<double, 53>(generator); }
  double at(Eigen::Index i, V v) const { return samples.values(i, static_cast<int>(v)); }
  /// Adds a force along one of the world axes; the body frame is aligned with the world frame.
  template <typename Force>
  void push(int axis, const Force& force) {
    for (Eigen::Index i = 0; i < samples.size(); ++i) {
      samples.residual(i, axis) += static_cast<float>(force(i));
      samples.residual(i, 3 + axis) = samples.residual(i, axis);
    }
  }
};

/// Stores the neighbour's velocities of the last samples, 0.1 s apart, one per lag; the first samples of a flight
/// repeat the first one.
void remember_velocities(ScanSamples& samples) {
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    for (int lag = 0; lag < NeighbourPlaces::kLags; ++lag) {
      const Eigen::Index first = i - i % 400;
      for (const V v : {V::kNeighbourVx, V::kNeighbourVy, V::kNeighbourVz}) {
        samples.neighbours.velocity_m_s(i, NeighbourPlaces::velocity_column(v, lag)) =
            samples.values(std::max(first, i - lag), static_cast<int>(v));
      }
    }
  }
}

/// Two vehicles that are never far apart in height.
Flights of_two_vehicles(std::uint64_t seed) {
  Flights flights(seed);
  flights.samples.neighbours.lateral_m.setConstant(0.5F);
  flights.samples.neighbours.height_m.setConstant(0.2F);
  return flights;
}

TEST(Scan, FindsALiftBesideANeighbourWithItsFormula) {
  Flights flights = of_two_vehicles(41);
  flights.push(2, [&](Eigen::Index i) {
    const double dx = flights.at(i, V::kNeighbourX) - 0.3, dy = flights.at(i, V::kNeighbourY);
    return 0.02 * std::exp(-(dx * dx + dy * dy) / (2 * 0.25 * 0.25));
  });
  const Scan found = scan(flights.samples, 1);
  ASSERT_FALSE(found.entries.empty());
  EXPECT_EQ(found.entries[0].variable, "neighbour_xy");
  EXPECT_EQ(found.entries[0].axis, "z");
  const std::vector<Formula> formulas = find_formulas(flights.samples, found, 1, 1);
  ASSERT_EQ(formulas.size(), 1U);
  const stability::EffectSpec& effect = formulas[0].effect;
  EXPECT_TRUE(effect.expression.per_neighbour);
  EXPECT_EQ(formulas[0].form, "gaussian");
  EXPECT_NEAR(effect.parameters.at("a_N"), 0.02, 0.002);
  EXPECT_NEAR(effect.parameters.at("x_centre_m"), 0.3, 0.03);
  EXPECT_NEAR(effect.parameters.at("y_centre_m"), 0, 0.03);
  EXPECT_NEAR(effect.parameters.at("width_m"), 0.25, 0.03);
}

/// A force with the form of an edge would never end, so a form that vanishes far away fits the effect of such a
/// neighbour.
TEST(Scan, OffersNoFormOverNeighboursThatReachesFar) {
  Flights flights = of_two_vehicles(45);
  flights.push(2, [&](Eigen::Index i) {
    return flights.at(i, V::kNeighbourX) > 0.2 && flights.at(i, V::kNeighbourY) < 0.3 ? 0.02 : 0.0;
  });
  const Scan found = scan(flights.samples, 1);
  ASSERT_FALSE(found.entries.empty());
  EXPECT_EQ(found.entries[0].variable, "neighbour_xy");
  const std::vector<Formula> formulas = find_formulas(flights.samples, found, 1, 1);
  ASSERT_EQ(formulas.size(), 1U);
  EXPECT_TRUE(formulas[0].form == "gaussian" || formulas[0].form == "inverse_square") << formulas[0].form;
}

TEST(Scan, FindsAForceAlongTheMotionOfANeighbour) {
  Flights flights = of_two_vehicles(42);
  flights.push(1, [&](Eigen::Index i) { return 0.01 * flights.at(i, V::kNeighbourVy); });
  const Scan found = scan(flights.samples, 1);
  ASSERT_FALSE(found.entries.empty());
  EXPECT_EQ(found.entries[0].variable, "neighbour_vy");
  EXPECT_EQ(found.entries[0].axis, "y");
  EXPECT_GT(found.entries[0].share, 0.8);
}

TEST(Scan, TellsTheMotionOfANeighbourOverGroundFromThatAgainstTheVehicle) {
  Flights flights = of_two_vehicles(44);
  remember_velocities(flights.samples);
  flights.push(
      0, [&](Eigen::Index i) { return 0.01 * (flights.at(i, V::kNeighbourVx) + flights.at(i, V::kVx)); });
  const Scan found = scan(flights.samples, 1);
  ASSERT_FALSE(found.entries.empty());
  EXPECT_EQ(found.entries[0].variable, "neighbour_vx");
  EXPECT_TRUE(found.entries[0].over_ground);
  EXPECT_EQ(found.entries[0].lag_s, 0);
  EXPECT_GT(found.entries[0].share, 0.8);
}

TEST(Scan, FindsWhenANeighbourMovedThatDisturbsLater) {
  Flights flights = of_two_vehicles(43);
  const auto vy = static_cast<int>(V::kNeighbourVy);
  double moved = 0;  // decays within a third of a second, unlike anything else here
  for (Eigen::Index i = 0; i < flights.samples.size(); ++i) {
    moved = 0.7 * moved + flights.bell(flights.generator);
    flights.samples.values(i, vy) = static_cast<float>(moved);
  }
  remember_velocities(flights.samples);
  flights.push(1, [&](Eigen::Index i) {
    return 0.01 * flights.samples.values(std::max<Eigen::Index>(i - i % 400, i - 3), vy);
  });
  const Scan found = scan(flights.samples, 1);
  ASSERT_FALSE(found.entries.empty());
  EXPECT_EQ(found.entries[0].variable, "neighbour_vy");
  EXPECT_EQ(found.entries[0].axis, "y");
  EXPECT_NEAR(found.entries[0].lag_s, 0.3, 1e-9);
  EXPECT_GT(found.entries[0].share, 0.8);
  for (std::size_t e = 1; e < found.entries.size(); ++e)
    EXPECT_NE(found.entries[e].variable + found.entries[e].axis, "neighbour_vyy") << "of another lag";
}

TEST(Scan, LeavesItToOtherFlightsWhetherAForceOfFewPassesIsAnAccident) {
  Flights flights(44, 2);
  for (Eigen::Index i = 0; i < flights.samples.size(); ++i) {
    const double from_pass_s = flights.at(i, V::kTime) - 20;  // one pass in each flight
    flights.samples.values(i, static_cast<int>(V::kX)) =
        static_cast<float>(std::exp(-from_pass_s * from_pass_s / 4));
  }
  flights.push(0, [&](Eigen::Index i) { return -0.1 * flights.at(i, V::kX); });
  const Scan sure = scan(flights.samples, 1), proposed = scan(flights.samples, 1, Judges::kOtherFlights);
  const auto knows_x = [](const Scan& found) {
    return std::any_of(found.entries.begin(), found.entries.end(),
                       [](const ScanEntry& entry) { return entry.variable == "x" && entry.axis == "x"; });
  };
  EXPECT_TRUE(knows_x(proposed));
  EXPECT_GT(sure.least_share, 0.5) << "signs drawn at random look like it, as few passes make it";
  EXPECT_LT(proposed.least_share, sure.least_share);
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    EXPECT_TRUE(scan(Flights(seed, 2).samples, 1, Judges::kOtherFlights).entries.empty())
        << "noise, " << seed;
}

TEST(Scan, FindsAPullTowardsANeighbourThatPassesAllAround) {
  Flights flights(40);
  ScanSamples& samples = flights.samples;
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    const double lateral_m = 0.35 + 0.3 * std::sin(0.11 * static_cast<double>(i)),
                 bearing = 0.37 * static_cast<double>(i);
    samples.neighbours.lateral_m.row(i).setConstant(static_cast<float>(lateral_m));
    samples.neighbours.height_m.row(i).setConstant(0.2F);
    const double pull_N = 0.02 * std::exp(-lateral_m / 0.2);
    const Eigen::RowVector2f toward(static_cast<float>(std::cos(bearing)),
                                    static_cast<float>(std::sin(bearing)));
    samples.residual.row(i).head<2>() += static_cast<float>(pull_N) * toward;
    samples.residual.row(i).segment<2>(3) = samples.residual.row(i).head<2>();
    samples.residual(i, kTowardColumn) = samples.residual.row(i).head<2>().dot(toward);
  }
  const Scan found = scan(samples, 1);
  ASSERT_FALSE(found.entries.empty());
  EXPECT_EQ(found.entries[0].variable, "neighbour");
  EXPECT_EQ(found.entries[0].frame, "neighbour");
  EXPECT_EQ(found.entries[0].axis, "toward");
  EXPECT_GT(found.entries[0].share, 0.5);
}

TEST(Scan, CommandedRatesAreThoseThatTheSetPointsAskFor) {
  constexpr double kReach_m = 0.4, kOmega_rad_s = 2, kStep_s = 0.01, kSomeMass_kg = 0.03;
  for (const double heading : {0.0, M_PI / 2}) {
    residuals::Track track;
    for (int i = 0; i < 400; ++i) {
      stability::Instant now;
      now.time_s = kStep_s * i;
      now.R_WB = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      now.omega_B_rad_s = {5, 5, 0.5};  // as in flight: the response of the controller
      track.instants.push_back(now);
      const double phase = kOmega_rad_s * now.time_s;
      track.targets.push_back({{kReach_m * std::sin(phase), 0, 1},
                               {kReach_m * kOmega_rad_s * std::cos(phase), 0, 0},
                               Eigen::Vector3d::Zero()});
    }
    const std::vector<stability::Instant> wanted = as_commanded(track, kSomeMass_kg);
    double fastest = 0;
    for (int i = 10; i < 390; ++i) {
      // The thrust axis tilts by atan(x'' / g) towards +x of the world.
      const double phase = kOmega_rad_s * kStep_s * i;
      const double lean = -kReach_m * std::pow(kOmega_rad_s, 2) * std::sin(phase) / stability::kGravity_m_s2;
      const double slope = -kReach_m * std::pow(kOmega_rad_s, 3) * std::cos(phase) / stability::kGravity_m_s2;
      const double rate = slope / (1 + lean * lean);
      const Eigen::Vector3d expected =
          heading == 0 ? Eigen::Vector3d(0, rate, 0.5) : Eigen::Vector3d(rate, 0, 0.5);
      EXPECT_LT((wanted[static_cast<std::size_t>(i)].omega_B_rad_s - expected).norm(), 2e-3) << i;
      fastest = std::max(fastest, std::abs(rate));
    }
    EXPECT_GT(fastest, 0.3);
  }
}

/// Adds the force -0.01 |v|^exponent against the velocity.
void add_drag(double exponent, Flights& flights) {
  for (Eigen::Index i = 0; i < flights.samples.size(); ++i) {
    const Eigen::Vector3f v_m_s =
        flights.samples.values.row(i).segment<3>(static_cast<int>(V::kVx)).transpose();
    const double factor = -0.01 * std::pow(v_m_s.norm(), exponent - 1);
    flights.samples.residual.row(i).head(3) += static_cast<float>(factor) * v_m_s.transpose();
  }
}

TEST(DragLaw, FindsTheExponentBesideOrWithoutAFixedDrag) {
  for (const double exponent : {1.0, 1.5, 2.0, 3.0}) {
    Flights flights(7);
    add_drag(exponent, flights);
    const std::optional<DragLaw> law = drag_law(flights.samples, {});
    ASSERT_TRUE(law.has_value()) << exponent;
    EXPECT_NEAR(law->exponent, exponent, 0.1);
    EXPECT_NEAR(law->formula.effect.parameters.at("drag_N"), 0.01, 0.0005) << exponent;
    // The noise has three components.
    EXPECT_NEAR(law->mean_square_N2, 3 * kNoise_N * kNoise_N, 0.2 * kNoise_N * kNoise_N) << exponent;
  }
  // A drag that the model already has counts as part of the law.
  Flights flights(8);
  add_drag(1, flights);
  const std::optional<DragLaw> doubled = drag_law(flights.samples, {0.01, 0});
  ASSERT_TRUE(doubled.has_value());
  EXPECT_NEAR(doubled->exponent, 1, 0.1);
  EXPECT_NEAR(doubled->formula.effect.parameters.at("drag_N"), 0.02, 0.001);
}

TEST(DragLaw, IsNotFoundForAForceAlongTheVelocity) {
  Flights flights(9);
  add_drag(2, flights);
  flights.samples.residual *= -1;
  EXPECT_FALSE(drag_law(flights.samples, {}).has_value());
}

TEST(Instrument, LagsReachDownToWhatWeakSetPointsLeavePossible) {
  constexpr double kLag_s = 0.12;
  const Interval kNarrow = {0.1, 0.14};
  Refined lag;
  lag.candidate.info = stability::effect_info("motor_lag");
  lag.coefficients = {1};
  lag.theta = {kLag_s};
  const auto interval_with = [&](const InstrumentedValue& check) {
    std::vector<Refined> all = {lag};
    all[0].shape_intervals = {kNarrow};
    widen_by_bias({{check}}, {}, all);
    return all[0].shape_intervals[0];
  };
  const InstrumentedValue less = {1, 0.4, {-0.2, 1}, -1.5}, much_less = {1, 0.5, {0.25, 0.75 + 0.6}, -2},
                          alike = {1, 0.8, {-0.2, 1.8}, -0.4};
  ASSERT_FALSE(less.is_strong());
  ASSERT_FALSE(much_less.is_strong());
  EXPECT_DOUBLE_EQ(interval_with(less).lower, lag.candidate.info.shape[0].lower);
  EXPECT_DOUBLE_EQ(interval_with(much_less).lower, 0.25 * kLag_s);
  EXPECT_EQ(interval_with(much_less).upper, kNarrow.upper);
  EXPECT_EQ(interval_with(alike), kNarrow);
}

TEST(Scan, FindsTheVariableOfEachForm) {
  struct Case {
    std::string variable;
    int axis;
    std::function<double(const Flights&, Eigen::Index)> force;
  };
  const std::vector<Case> cases = {
      {"z", 0, [](const Flights& f, Eigen::Index i) { return 0.01 * std::exp(-f.at(i, V::kZ) / 0.4); }},
      {"climb", 2, [](const Flights& f, Eigen::Index i) { return f.at(i, V::kClimb) > 0.5 ? 0.01 : 0; }},
      {"heading", 1,
       [](const Flights& f, Eigen::Index i) { return 0.01 * std::cos(2 * f.at(i, V::kHeading)); }},
      {"speed", 2, [](const Flights& f, Eigen::Index i) { return 0.01 * std::pow(f.at(i, V::kSpeed), 2); }},
      {"xy", 2,
       [](const Flights& f, Eigen::Index i) {
         return 0.02 * std::exp(-(std::pow(f.at(i, V::kX), 2) + std::pow(f.at(i, V::kY) - 0.3, 2)) / 0.3);
       }},
      {"xz", 2,
       [](const Flights& f, Eigen::Index i) {
         return f.at(i, V::kX) > 0.2 ? 0.02 * std::exp(-f.at(i, V::kZ) / 0.5) : 0;
       }},
      {"yz", 0,
       [](const Flights& f, Eigen::Index i) {
         return f.at(i, V::kY) < 0 ? 0.02 * std::exp(-std::pow(f.at(i, V::kZ) / 0.5, 2)) : 0;
       }},
      {"rate_z", 2, [](const Flights& f, Eigen::Index i) { return 0.01 * std::abs(f.at(i, V::kRateZ)); }},
      {"time", 2, [](const Flights& f, Eigen::Index i) { return f.at(i, V::kTime) > 17 ? 0.01 : 0; }},
      {"time", 0, [](const Flights& f, Eigen::Index i) { return 0.01 * std::sin(4 * f.at(i, V::kTime)); }},
  };
  for (std::size_t c = 0; c < cases.size(); ++c) {
    Flights flights(10 + c);
    flights.push(cases[c].axis, [&](Eigen::Index i) { return cases[c].force(flights, i); });
    const Scan found = scan(flights.samples, 1);
    ASSERT_FALSE(found.entries.empty()) << cases[c].variable;
    const ScanEntry& first = found.entries[0];
    EXPECT_EQ(first.variable, cases[c].variable);
    EXPECT_EQ(first.axis, std::string(1, "xyz"[cases[c].axis]));
    EXPECT_GT(first.share, 0.5);
    EXPECT_LE(first.share_interval.lower, first.share);
    EXPECT_GE(first.share_interval.upper, first.share);
  }
}

TEST(Scan, FindsNothingWhereNothingIs) {
  int claims = 0;
  for (std::uint64_t seed = 100; seed < 112; ++seed)
    claims += scan(Flights(seed, seed % 2 == 0 ? 1 : 6).samples, 1).entries.empty() ? 0 : 1;
  EXPECT_EQ(claims, 0);
}

/// A gust pushes upward and the controller reduces the thrust: the force is negatively correlated with the thrust,
/// but not caused by it.
TEST(Scan, CountsNoAnswerOfTheController) {
  Flights flights(5);
  flights.push(2, [&](Eigen::Index) { return 0.01 * flights.bell(flights.generator); });
  const auto thrust = static_cast<Eigen::Index>(V::kThrust);
  for (Eigen::Index i = 0; i < flights.samples.size(); ++i) {
    const double wanted = 0.33 + 0.02 * flights.at(i, V::kDuty1);
    flights.samples.commanded(i, thrust) = static_cast<float>(wanted);
    flights.samples.values(i, thrust) = static_cast<float>(wanted - flights.samples.residual(i, 2));
  }
  const auto names_thrust = [](const Scan& found) {
    return std::any_of(found.entries.begin(), found.entries.end(),
                       [](const ScanEntry& entry) { return entry.variable == "thrust"; });
  };
  EXPECT_FALSE(names_thrust(scan(flights.samples, 1)));
  // A force that the thrust does cause is counted.
  flights.push(2, [&](Eigen::Index i) { return 0.5 * (flights.samples.commanded(i, thrust) - 0.33); });
  for (Eigen::Index i = 0; i < flights.samples.size(); ++i)
    flights.samples.values(i, thrust) = flights.samples.commanded(i, thrust);
  EXPECT_TRUE(names_thrust(scan(flights.samples, 1)));
}

TEST(CurveFit, ErrorsUnderOtherSignsAreThoseOfFitsToThoseTargets) {
  const ScanSamples samples = Flights(3).samples;
  const Chunks chunks = chunks_of(samples);
  const auto z = samples.values.col(static_cast<int>(V::kZ));
  const std::vector<SparseRow> rows = hat_rows(z, knots_over(z, 8));
  CurveFit fit(rows, 8, chunks);
  Eigen::MatrixXd signs(2, chunks.count());
  for (Eigen::Index c = 0; c < signs.cols(); ++c) {
    signs(0, c) = 1;
    signs(1, c) = c % 3 == 0 ? -1 : 1;
  }
  const Columns targets = samples.residual;
  const Eigen::MatrixXd errors = fit.errors_of_flipped(targets, signs);
  for (Eigen::Index d = 0; d < signs.rows(); ++d) {
    Columns flipped = targets;
    for (Eigen::Index i = 0; i < flipped.rows(); ++i)
      flipped.row(i) *= static_cast<float>(signs(d, chunks.of_sample[static_cast<std::size_t>(i)]));
    fit.fit(flipped);
    const Eigen::RowVectorXd expected = chunk_errors(flipped, fit.predictions(), chunks).colwise().sum();
    for (Eigen::Index k = 0; k < expected.size(); ++k)
      EXPECT_NEAR(errors(d, k), expected[k], 1e-6 * targets.squaredNorm());
  }
}

TEST(Scan, DoesNotDependOnTheNumberOfThreads) {
  Flights flights(7);
  flights.push(2, [&](Eigen::Index i) { return 0.01 * flights.at(i, V::kZ); });
  const Scan one = scan(flights.samples, 1), two = scan(flights.samples, 2);
  ASSERT_EQ(one.entries.size(), two.entries.size());
  for (std::size_t i = 0; i < one.entries.size(); ++i) EXPECT_EQ(one.entries[i].share, two.entries[i].share);
}

/// The same flights with torques of 1e-6 N m noise and rotors of 1e-3 N noise in place of the force.
ScanSamples balance_of(Flights& flights) {
  constexpr double kNoise_Nm = 1e-6, kNoiseOfRotor_N = 1e-3;
  ScanSamples samples = flights.samples;
  samples.quantity = ScanQuantity::kBalance;
  samples.residual.resize(samples.size(), 7);
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    for (int k = 0; k < 7; ++k)
      samples.residual(i, k) =
          static_cast<float>((k < 3 ? kNoise_Nm : kNoiseOfRotor_N) * flights.bell(flights.generator));
  }
  return samples;
}

TEST(BalanceScan, FindsTheAxisAndTheVariableOfATorque) {
  const std::vector<std::pair<std::string, V>> cases = {
      {"roll", V::kSpeed}, {"pitch", V::kZ}, {"yaw", V::kClimb}};
  for (std::size_t axis = 0; axis < cases.size(); ++axis) {
    Flights flights(30 + axis);
    ScanSamples samples = balance_of(flights);
    for (Eigen::Index i = 0; i < samples.size(); ++i)
      samples.residual(i, static_cast<int>(axis)) +=
          static_cast<float>(2e-6 * flights.at(i, cases[axis].second));
    const Scan found = scan(samples, 1);
    ASSERT_FALSE(found.entries.empty()) << cases[axis].first;
    const ScanEntry& first = found.entries[0];
    EXPECT_EQ(first.axis, cases[axis].first);
    EXPECT_EQ(first.variable, scan_variable(cases[axis].second).name);
    EXPECT_EQ(first.quantity, "torque");
    EXPECT_EQ(first.frame, "body");
    EXPECT_EQ(first.unit, "Nm");
    // The correct curve leaves a noise of 1e-6 N m on the axis.
    EXPECT_NEAR(first.rmse_after, 1e-6, 1e-7);
    EXPECT_NEAR(first.share, 1 - std::pow(first.rmse_after / first.rmse_before, 2), 0.02);
    const std::vector<Formula> formulas = find_formulas(samples, found, 1, 1);
    ASSERT_EQ(formulas.size(), 1U);
    ASSERT_EQ(formulas[0].effect.expression.formulas.size(), 1U);
    const std::string target = std::string("torque_") + "xyz"[axis] + "_Nm";
    EXPECT_EQ(formulas[0].effect.expression.formulas.begin()->first, target);
    const stability::AppliedEffect effect(formulas[0].effect, {});
    const auto torque = [&](double value) {
      stability::Instant now;
      now.p_W_m = {0, 0, value};
      now.v_W_m_s = {0, 0, value};
      return effect.wrench(now).torque_B_Nm[static_cast<Eigen::Index>(axis)];
    };
    EXPECT_NEAR(torque(0.8) - torque(0.3), 1e-6, 2e-7);
  }
}

TEST(BalanceScan, NamesARotorOnlyWhereNoOtherDoesTheSame) {
  const auto rotors_of = [](const Scan& found) {
    std::vector<std::string> names;
    for (const ScanEntry& entry : found.entries) {
      if (entry.quantity == "rotor_force") names.push_back(entry.axis + " over " + entry.variable);
    }
    return names;
  };
  Flights flights(40);
  ScanSamples samples = balance_of(flights);
  const auto duty = static_cast<Eigen::Index>(V::kDuty2);
  samples.commanded.col(duty) = samples.values.col(duty);  // setpoints confirm it
  constexpr Eigen::Index kSecond = 4, kThird = 5;
  const Eigen::VectorXf loss = 2e-3F * samples.values.col(duty).cwiseMax(0);
  samples.residual.col(kSecond) -= loss;
  const std::vector<std::string> one = rotors_of(scan(samples, 1));
  ASSERT_FALSE(one.empty());
  EXPECT_EQ(one[0], "rotor_2 over duty_2");
  samples.residual.col(kThird) -= loss;
  EXPECT_EQ(rotors_of(scan(samples, 1)), std::vector<std::string>{});
}

TEST(BalanceScan, FindsNothingWhereNothingIs) {
  int claims = 0;
  for (std::uint64_t seed = 200; seed < 205; ++seed) {
    Flights flights(seed, seed % 2 == 0 ? 1 : 6);
    claims += scan(balance_of(flights), 1).entries.empty() ? 0 : 1;
  }
  EXPECT_EQ(claims, 0);
}

TEST(Formulas, RecoverTheFormAndItsNumbers) {
  Flights flights(21);
  flights.push(2, [&](Eigen::Index i) {
    return 0.03 * std::exp(-std::pow((flights.at(i, V::kZ) - 0.2) / 0.3, 2) / 2);
  });
  const Scan found = scan(flights.samples, 1);
  const std::vector<Formula> formulas = find_formulas(flights.samples, found, 4, 1);
  ASSERT_FALSE(formulas.empty());
  EXPECT_EQ(formulas[0].variable, "z");
  EXPECT_EQ(formulas[0].form, "gaussian");
  EXPECT_NEAR(formulas[0].effect.parameters.at("centre_m"), 0.2, 0.02);
  EXPECT_NEAR(std::abs(formulas[0].effect.parameters.at("width_m")), 0.3, 0.03);
  EXPECT_NEAR(formulas[0].effect.parameters.at("a_N"), 0.03, 0.003);
}

/// A written formula can be read back and gives the force that was found.
TEST(Formulas, DoNotGrowBeyondThePlacesThatWereFlown) {
  Flights flights(41);
  flights.push(2, [&](Eigen::Index i) { return 0.02 * flights.at(i, V::kZ); });
  const std::vector<Formula> formulas = find_formulas(flights.samples, scan(flights.samples, 1), 1, 1);
  ASSERT_EQ(formulas.size(), 1u);
  ASSERT_EQ(formulas[0].variable, "z") << to_toml(formulas[0]);
  const stability::AppliedEffect effect(formulas[0].effect, {"small", {"small"}, ""});
  const auto force_N = [&](double z_m) {
    stability::Instant now;
    now.p_W_m.z() = z_m;
    return effect.wrench(now).force_W_N.z();
  };
  EXPECT_NEAR(force_N(0.5) - force_N(-0.5), 0.02, 0.002);
  EXPECT_EQ(force_N(50), force_N(5)) << to_toml(formulas[0]);
  EXPECT_LT(std::abs(force_N(50)), 0.02 * 1.6);
}

TEST(Formulas, AreEffectsOfTheModelFile) {
  Flights flights(22);
  flights.push(0, [&](Eigen::Index i) { return 0.02 * std::max(0.0, flights.at(i, V::kSpeed) - 0.3); });
  const std::vector<Formula> formulas = find_formulas(flights.samples, scan(flights.samples, 1), 4, 1);
  ASSERT_FALSE(formulas.empty());
  const stability::AppliedEffect effect(formulas[0].effect, {});
  stability::Instant now;
  now.v_W_m_s = {1.1, 0, 0};
  now.p_W_m = {0, 0, 1};
  const double fast = effect.wrench(now).force_W_N.x();
  now.v_W_m_s = {0.5, 0, 0};
  EXPECT_NEAR(fast - effect.wrench(now).force_W_N.x(), 0.02 * 0.6, 0.001);
  EXPECT_NE(to_toml(formulas[0]).find("[effect.expression]"), std::string::npos);
}

TEST(Shape, IsMonotoneWhereTheForceIs) {
  Flights flights(23);
  flights.push(2, [&](Eigen::Index i) { return 0.02 * std::tanh(3 * flights.at(i, V::kZ)); });
  const Scan found = scan(flights.samples, 1);
  ASSERT_FALSE(found.entries.empty());
  const std::optional<stability::EffectSpec> shape = shape_of(flights.samples, found.entries[0]);
  ASSERT_TRUE(shape.has_value());
  const stability::AppliedEffect effect(*shape, {});
  double last = -1;
  for (double z = -1.5; z < 1.5; z += 0.05) {
    stability::Instant now;
    now.p_W_m = {0, 0, z};
    const double force_N = effect.wrench(now).force_W_N.z();
    EXPECT_GE(force_N, last - 1e-12);
    EXPECT_NEAR(force_N, 0.02 * std::tanh(3 * z), 0.006) << z;
    last = force_N;
  }
}

}  // namespace
}  // namespace swarmcert::identification
