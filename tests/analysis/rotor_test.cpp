#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>

#include "analysis/identification/rotors/lone_rotor.h"
#include "analysis/identification/rotors/rotor_balance.h"
#include "analysis/identification/rotors/rotor_fit.h"
#include "data.h"
#include "stability/model.h"

namespace swarmcert::identification {
namespace {

stability::Model small() {
  return stability::read_model(tests::source_path("stability/models/crazyflie-small.toml"));
}

RotorLoads loads(const Eigen::Vector4d& mean_N) {
  RotorLoads result;
  result.flight = "f";
  result.vehicle = "v";
  result.records = 1000;
  result.mean_N = mean_N;
  result.error_N.setConstant(1e-3);
  return result;
}

const Eigen::Vector4d kHealthy_N(0.087, 0.067, 0.092, 0.071);

/// Two flights that differ by 1 mN in some places.
std::vector<RotorLoads> healthy() {
  return {loads(kHealthy_N + Eigen::Vector4d(1e-3, 0, -1e-3, 0)),
          loads(kHealthy_N - Eigen::Vector4d(1e-3, 0, -1e-3, 0))};
}

TEST(RotorBalance, NamesTheWeakRotorWithItsFactor) {
  for (int weak = 0; weak < 4; ++weak) {
    for (const double factor : {0.85, 0.75}) {
      Eigen::Vector4d now_N = kHealthy_N;
      now_N[weak] /= factor;  // so that the rotor gives the same thrust as before
      const RotorBalance balance = rotor_balance({loads(now_N)}, healthy(), small());
      EXPECT_EQ(balance.rotor, weak + 1);
      const RotorFactor& found = balance.factors[static_cast<std::size_t>(weak)];
      EXPECT_NEAR(found.value, factor, 1e-12);
      EXPECT_LT(found.interval.lower, factor);
      EXPECT_GT(found.interval.upper, factor);
      const std::string words = in_words(balance);
      EXPECT_NE(words.find("is weak, or carries a load near it"), std::string::npos) << words;
      EXPECT_EQ(words.find("cut"), std::string::npos) << "a load looks the same";
    }
  }
}

TEST(RotorBalance, NamesNoRotorWhereTheBatterySitsElsewhere) {
  const double lever_m = small().arm_m * std::sqrt(0.5), weight_N = kHealthy_N.sum();
  for (const double place_m : {kBatteryPlay_m, -kBatteryPlay_m, 3 * kBatteryPlay_m}) {
    const double moved_N = weight_N * place_m / (4 * lever_m);
    for (const Eigen::Vector4d& to : {Eigen::Vector4d(-1, -1, 1, 1), Eigen::Vector4d(-1, 1, 1, -1)}) {
      const RotorBalance balance = rotor_balance({loads(kHealthy_N + moved_N * to)}, healthy(), small());
      EXPECT_EQ(balance.rotor, 0) << in_words(balance);
    }
  }
  EXPECT_EQ(rotor_balance({loads(1.1 * kHealthy_N)}, healthy(), small()).rotor, 0) << "a heavier vehicle";
}

TEST(RotorBalance, OneHealthyFlightAllowsForItsOwnBatteryAsWell) {
  const RotorBalance of_one = rotor_balance({loads(kHealthy_N)}, {loads(kHealthy_N)}, small());
  const RotorBalance of_two = rotor_balance({loads(kHealthy_N)}, healthy(), small());
  EXPECT_NEAR(of_one.least_rise_N / of_two.least_rise_N, std::sqrt(2 / 1.5), 1e-12);
}

TEST(RotorBalance, ComparesAVehicleWithItselfOnly) {
  std::vector<RotorLoads> other = {loads(kHealthy_N)};
  other[0].vehicle = "w";
  EXPECT_TRUE(rotor_balances(other, healthy(), small()).empty());
}

TEST(RotorFit, GivesTheFactorsThatCarryTheWeightWithoutATorque) {
  const Eigen::Vector4d factors(0.95, 1.02, 0.8, 1.0);
  const stability::Model model = small();
  const double each_N = model.weight_N() / 4;
  const RotorLoads flight = loads(each_N * factors.cwiseInverse());
  const double scale = model.weight_N() / flight.mean_N.sum();
  const RotorFactors found = rotor_factors({flight, flight}, {scale, scale}, model);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(found[k].value, factors[static_cast<Eigen::Index>(k)], 1e-12);
  EXPECT_NEAR(rotor_imbalance_N({flight}, found), 0, 1e-12);
  EXPECT_GT(rotor_imbalance_N({flight}, RotorFactors{}), 1e-3);
  const RotorFactors beside_a_scale = rotor_factors(flight);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(beside_a_scale[k].value, found[k].value / scale, 1e-12) << "each has the sum of the map";
}

TEST(RotorFit, OfOneFlightIsAsUncertainAsTheBatterysPlace) {
  const stability::Model model = small();
  const RotorFactors one = rotor_factors({loads(kHealthy_N)}, {1}, model);
  const double lever_m = model.arm_m * std::sqrt(0.5);
  for (const RotorFactor& factor : one)
    EXPECT_NEAR((factor.interval.upper - factor.interval.lower) / 2, factor.value * kBatteryPlay_m / lever_m,
                1e-12);
}

/// Loads of a vehicle whose rotors give these fractions of the mapped thrust, with an offset centre of mass.
RotorLoads loads_with(const Eigen::Vector4d& factors, double weight_N,
                      const Eigen::Vector2d& offset_m = {0, 0}) {
  const double lever_m = small().arm_m * std::sqrt(0.5);
  const Eigen::Vector4d along_x(1, -1, -1, 1), along_y(-1, -1, 1, 1);
  const Eigen::Vector4d shares =
      Eigen::Vector4d::Ones() + (offset_m.x() * along_x + offset_m.y() * along_y) / lever_m;
  return loads((weight_N / 4 * shares).cwiseQuotient(factors));
}

TEST(LoneRotor, IsTheWeakOneOfABalancedVehicle) {
  for (int weak = 0; weak < 4; ++weak) {
    for (const double factor : {0.87, 0.75}) {
      Eigen::Vector4d factors = Eigen::Vector4d::Ones();
      factors[weak] = factor;
      const LoneRotor found = lone_rotor({loads_with(factors, small().weight_N())}, small());
      EXPECT_EQ(found.rotor, weak + 1);
      EXPECT_TRUE(found.is_sure);
      EXPECT_NEAR(found.share, 1, 1e-12);
    }
  }
}

TEST(LoneRotor, IsNotSureOfWhatAnotherCauseMayBe) {
  const double weight_N = small().weight_N();
  const Eigen::Vector4d ones = Eigen::Vector4d::Ones();
  const auto rotor_of = [](const RotorLoads& flight) {
    const LoneRotor found = lone_rotor({flight}, small());
    EXPECT_FALSE(found.is_sure) << flight.mean_N.transpose();
    return found.rotor;
  };
  EXPECT_EQ(rotor_of(loads_with(0.9 * ones, weight_N)), 0) << "a scale";
  EXPECT_EQ(rotor_of(loads_with(ones, weight_N, {0.003, 0.003})), 0) << "an offset without a scale";
  EXPECT_EQ(rotor_of(loads_with({0.85, 1, 0.85, 1}, weight_N)), 0) << "two rotors";
  EXPECT_EQ(rotor_of(loads_with({0.95, 1, 1, 1}, weight_N)), 0) << "as much as a battery's position";
  const double load_N = 0.04, place_m = small().arm_m * std::sqrt(0.5) * load_N / (weight_N + load_N);
  EXPECT_EQ(rotor_of(loads_with(ones, weight_N + load_N, {place_m, place_m})), 4) << "a load under rotor 4";
  EXPECT_EQ(rotor_of(loads(kHealthy_N * weight_N / kHealthy_N.sum())), 0) << "as recorded in healthy flights";
}

TEST(LoneRotor, IsSureOfOneRandomDirectionInAHundred) {
  constexpr int kDirections = 40'000;
  const stability::Model model = small();
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  int sure = 0;
  for (int i = 0; i < kDirections; ++i) {
    Eigen::Vector4d direction;
    for (double& value : direction) value = normal(generator);
    const Eigen::Vector4d excess = 0.4 * direction.normalized();
    sure += lone_rotor({loads(model.weight_N() / 4 * (1 + excess.array()))}, model).is_sure ? 1 : 0;
  }
  const double rate = static_cast<double>(sure) / kDirections;
  EXPECT_NEAR(rate, 0.01, 4 * std::sqrt(0.01 / kDirections));
}

TEST(LoneRotor, OfTheModelIsNotFoundAgain) {
  stability::Model model = small();
  stability::EffectSpec spec;
  spec.name = rotor_effect();
  spec.parameters = {{"rotor_2", 0.8}};
  model.effects.push_back(spec);
  EXPECT_EQ(lone_rotor({loads_with({1, 0.8, 1, 1}, model.weight_N())}, model).rotor, 0);
}

/// CrazyPAD, vehicle E8: propellers with the stated length in mm cut off both blades, and flights with whole
/// propellers.
struct Condition {
  const char* folder;
  double removed_mm;
};

std::vector<RotorLoads> loads_of(const std::string& folder) {
  residuals::InputArguments arguments;
  arguments.models = {tests::source_path("stability/models/crazyflie-small.toml")};
  arguments.flights = {tests::data_path("collections/crazypad/" + folder)};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  return rotor_loads(inputs, "small", 2);
}

TEST(RotorBalance, NamesCutPropellersAndNothingElseInRecordedFlights_slow) {
  if (!std::filesystem::exists(tests::data_path("collections/crazypad"))) GTEST_SKIP() << "no recorded data";
  const std::vector<RotorLoads> whole = loads_of("normal_flight");
  int cut = 0, right = 0, others = 0;
  double last = 1;
  for (const Condition& condition : {Condition{"cut_propeller_M3_3mm", 3},
                                     {"cut_propeller_M3_2.5mm_2mm_42.5mm", 4.5},
                                     {"cut_propeller_M3_3mm_2.5mm_41.5mm", 5.5},
                                     {"cut_propeller_M3_3.5mm_3.5mm_40mm", 7}}) {
    double sum = 0;
    for (const RotorBalance& balance : rotor_balances(loads_of(condition.folder), whole, small())) {
      if (balance.flight.empty()) sum += balance.factors[2].value;
      ++cut;
      if (balance.rotor == 3) ++right;
      EXPECT_TRUE(balance.rotor == 3 || balance.rotor == 0) << balance.flight << in_words(balance);
    }
    EXPECT_LT(sum, last) << condition.removed_mm << " mm: the factor falls with what was cut off";
    last = sum;
  }
  EXPECT_EQ(cut, 16) << "four conditions, three flights each and their mean";
  EXPECT_EQ(right, cut);
  for (const char* const folder :
       {"tape_on_propeller_M3", "add_weight_W1_near_M4", "weight_on_string_W2_near_M3"}) {
    for (const RotorBalance& balance : rotor_balances(loads_of(folder), whole, small())) {
      ++others;
      EXPECT_EQ(balance.rotor, 0) << balance.flight << ": " << in_words(balance);
    }
  }
  EXPECT_EQ(others, 6 + 2 + 3 + 1 + 6 + 2);
}

/// Total length cut off both blades in millimetres: all lengths in the name of a folder except the last, if there are
/// several.
double removed_mm(const std::string& folder) {
  std::vector<double> lengths;
  for (std::size_t at = folder.find("_M3_"); at != std::string::npos; at = folder.find('_', at + 1)) {
    const std::string text = folder.substr(at + 1);
    if (text.rfind("M3", 0) != 0) lengths.push_back(std::stod(text));
  }
  constexpr double kShortestBlade_mm = 30;
  double sum = 0;
  for (const double length : lengths) sum += length < kShortestBlade_mm ? length : 0;
  return sum;
}

std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<double> ranks;
  for (const double value : values) {
    double below = 0, alike = 0;
    for (const double other : values) {
      below += other < value ? 1 : 0;
      alike += other == value ? 1 : 0;
    }
    ranks.push_back(below + (alike - 1) / 2);
  }
  return ranks;
}

double spearman(const std::vector<double>& a, const std::vector<double>& b) {
  const std::vector<double> x = ranks_of(a), y = ranks_of(b);
  const double middle = (static_cast<double>(x.size()) - 1) / 2;
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - middle) * (x[i] - middle);
    yy += (y[i] - middle) * (y[i] - middle);
    xy += (x[i] - middle) * (y[i] - middle);
  }
  return xy / std::sqrt(xx * yy);
}

/// Factors found by `add rotor_thrust` and by `diagnose --against` on the same flights.
TEST(RotorFit, WeaknessGrowsWithWhatWasCutOffInRecordedFlights_slow) {
  const std::string collection = tests::data_path("collections/crazypad");
  if (!std::filesystem::exists(collection)) GTEST_SKIP() << "no recorded data";
  const std::vector<RotorLoads> whole = loads_of("normal_flight");
  std::vector<double> removed, weakness, weakness_against;
  for (const auto& entry : std::filesystem::directory_iterator(collection)) {
    const std::string folder = entry.path().filename().string();
    if (folder.rfind("cut_propeller_M3_", 0) != 0) continue;
    std::vector<RotorLoads> own = loads_of(folder);
    own.erase(std::remove_if(own.begin(), own.end(),
                             [](const RotorLoads& flight) { return flight.vehicle != "E8"; }),
              own.end());
    if (own.empty()) continue;
    removed.push_back(removed_mm(folder));
    weakness.push_back(1 - rotor_factors(own, std::vector<double>(own.size(), 1), small())[2].value);
    for (const RotorBalance& balance : rotor_balances(own, whole, small())) {
      if (balance.flight.empty()) weakness_against.push_back(1 - balance.factors[2].value);
    }
  }
  ASSERT_GE(removed.size(), 15u);
  ASSERT_EQ(weakness_against.size(), removed.size());
  const double fitted = spearman(removed, weakness), against = spearman(removed, weakness_against);
  std::printf("Spearman over %zu conditions: %.3f as fitted, %.3f against healthy flights\n", removed.size(),
              fitted, against);
  EXPECT_GT(fitted, 0.9);
  EXPECT_GT(against, 0.9);
}

}  // namespace
}  // namespace swarmcert::identification
