#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/identification/rotors/rotor_balance.h"
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

/// Two flights that differ by 1 mN here and there.
std::vector<RotorLoads> healthy() {
  return {loads(kHealthy_N + Eigen::Vector4d(1e-3, 0, -1e-3, 0)),
          loads(kHealthy_N - Eigen::Vector4d(1e-3, 0, -1e-3, 0))};
}

TEST(RotorBalance, NamesTheWeakRotorWithItsFactor) {
  for (int weak = 0; weak < 4; ++weak) {
    for (const double factor : {0.85, 0.75}) {
      Eigen::Vector4d now_N = kHealthy_N;
      now_N[weak] /= factor;  // so that it gives what it gave
      const RotorBalance balance = rotor_balance({loads(now_N)}, healthy(), small());
      EXPECT_EQ(balance.rotor, weak + 1);
      const RotorFactor& found = balance.factors[static_cast<std::size_t>(weak)];
      EXPECT_NEAR(found.value, factor, 1e-12);
      EXPECT_LT(found.interval.first, factor);
      EXPECT_GT(found.interval.second, factor);
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

/// CrazyPAD, vehicle E8: propellers cut by so many millimetres, both blades together, and flights of whole propellers.
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

}  // namespace
}  // namespace swarmcert::identification
