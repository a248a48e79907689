#include "analysis/identification/thrust/thrust_identification.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "nn/base/input_error.h"
#include "run.h"

namespace swarmcert::analysis {
namespace {

// The published map of the small vehicle, as known truth.
constexpr double kTruth[5] = {11.093358483549203, -39.08104165843915, -9.525647087583181, 20.573302305476638,
                              38.42885066644033};

double thrust_gf(double p, double v) {
  return kTruth[0] + kTruth[1] * p + kTruth[2] * v + kTruth[3] * p * p + kTruth[4] * p * v;
}

/// Gaussian noise by the central limit theorem: the same on every platform.
double noise(std::mt19937& generator) {
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(generator()) / 4294967296.0;
  return sum - 6;
}

double uniform(std::mt19937& generator, double lower, double upper) {
  return lower + (upper - lower) * static_cast<double>(generator()) / 4294967296.0;
}

struct Experiment {
  int rows = 400;
  double smallest_V = 3.2, largest_V = 4.2, smallest_p = 0.25, largest_p = 1.0, noise_gf = 0.1;
};

ThrustData measured(const Experiment& e, unsigned seed) {
  std::mt19937 generator(seed);
  ThrustData data;
  for (int i = 0; i < e.rows; ++i) {
    ThrustSample s;
    s.p = uniform(generator, e.smallest_p, e.largest_p);
    s.v = uniform(generator, e.smallest_V, e.largest_V) / 4.2;
    s.thrust_gf = thrust_gf(s.p, s.v) + e.noise_gf * noise(generator);
    data.samples.push_back(s);
  }
  return data;
}

TEST(ThrustIdentification, FindsTheCoefficientsOfExactData) {
  const ThrustIdentification result = identify_thrust(measured({400, 3.2, 4.2, 0.25, 1.0, 0.0}, 1), 0.95);
  ASSERT_TRUE(result.thrust.determined) << result.thrust.why_not;
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(result.thrust.coefficients[i].value, kTruth[i], 1e-9);
  EXPECT_LE(result.thrust.residual_rms, 1e-10);
}

TEST(ThrustIdentification, FindsTheInverseMapOfExactData) {
  const double d[5] = {0.5009717811726693, 0.11823595371065385, -0.41225540923278853, -0.002065562409668875,
                       -0.04287969844506664};
  std::mt19937 generator(2);
  ThrustData data;
  for (int i = 0; i < 300; ++i) {
    ThrustSample s;
    const double g = uniform(generator, 2, 14);
    s.v = uniform(generator, 3.2, 4.2) / 4.2;
    s.thrust_gf = g;
    s.p = d[0] + d[1] * g + d[2] * s.v + d[3] * g * g + d[4] * g * s.v;
    data.samples.push_back(s);
  }
  const ThrustIdentification result = identify_thrust(data, 0.95);
  ASSERT_TRUE(result.pwm.determined) << result.pwm.why_not;
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(result.pwm.coefficients[i].value, d[i], 1e-10);
}

/// Thrust in N of one rotor, cubic in the motor's voltage, of the size of a Crazyflie's.
ThrustData cubic_in_motor_voltage(double noise_gf, int repeats) {
  std::mt19937 generator(3);
  ThrustData data;
  for (int i = 0; i < 60; ++i) {
    ThrustSample s;
    s.p = uniform(generator, 0.2, 1), s.v = uniform(generator, 3.2, 4.2) / 4.2;
    const double u = s.p * s.v * 4.2;
    for (int k = 0; k < repeats; ++k) {
      s.thrust_gf =
          (-0.02 + 0.03 * u - 0.001 * u * u + 0.0012 * u * u * u) / 0.00981 + noise_gf * noise(generator);
      data.samples.push_back(s);
    }
  }
  return data;
}

TEST(ThrustIdentification, FindsTheCubicInTheVoltageOfTheMotor) {
  const PolynomialFit fit = identify_thrust(cubic_in_motor_voltage(0, 1), 0.95).motor_voltage;
  ASSERT_TRUE(fit.determined) << fit.why_not;
  const double truth[] = {-0.02, 0.03, -0.001, 0.0012};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(fit.coefficients[i].value, truth[i], 1e-9);
}

TEST(ThrustIdentification, LackOfFitIsFoundWhereTheFormIsWrongAndNotWhereItIsRight) {
  for (const int repeats : {1, 4}) {
    const ThrustIdentification found = identify_thrust(cubic_in_motor_voltage(0.02, repeats), 0.95);
    EXPECT_EQ(found.thrust.lack.against, repeats > 1 ? "repeated rows" : "terms of the next order");
    EXPECT_TRUE(found.thrust.lack.is_found()) << found.thrust.lack.chance;
    EXPECT_FALSE(found.motor_voltage.lack.is_found()) << found.motor_voltage.lack.chance;
  }
  int found = 0;
  constexpr int kExperiments = 200;
  for (unsigned seed = 0; seed < kExperiments; ++seed)
    found += identify_thrust(measured({}, seed), 0.95).thrust.lack.is_found() ? 1 : 0;
  EXPECT_LE(found, 9) << "1 % of false alarms, and five standard deviations";
}

// A 90 % interval must contain the truth in 90 % of repeated experiments. For 400 experiments the binomial standard
// deviation is 1.5 %, so 84 % to 96 % covers four of them.
TEST(ThrustIdentification, IntervalsHoldTheTruthAsOftenAsTheySay) {
  constexpr int kExperiments = 400;
  int holds[5] = {};
  for (int n = 0; n < kExperiments; ++n) {
    const ThrustIdentification result =
        identify_thrust(measured({60, 3.2, 4.2, 0.25, 1.0, 0.2}, 100u + n), 0.90);
    ASSERT_TRUE(result.thrust.determined) << result.thrust.why_not;
    for (std::size_t i = 0; i < 5; ++i) {
      const Coefficient& c = result.thrust.coefficients[i];
      holds[i] += c.lower <= kTruth[i] && kTruth[i] <= c.upper;
    }
    EXPECT_NEAR(result.thrust.residual_rms, 0.2, 0.1);
  }
  for (const int count : holds) {
    EXPECT_GE(count, 0.84 * kExperiments);
    EXPECT_LE(count, 0.96 * kExperiments);
  }
}

TEST(ThrustIdentification, SaysWhatPoorDataLack) {
  const auto why = [](const Experiment& e) {
    const ThrustIdentification result = identify_thrust(measured(e, 3), 0.95);
    EXPECT_FALSE(result.thrust.determined);
    EXPECT_TRUE(result.thrust.coefficients.empty());
    EXPECT_FALSE(result.max_thrust.determined);
    return result.thrust.why_not;
  };
  EXPECT_NE(why({400, 4.0, 4.0}).find("battery spans 0.000 V"), std::string::npos);
  EXPECT_NE(why({400, 3.99, 4.01}).find("battery spans"), std::string::npos);
  EXPECT_NE(why({400, 3.2, 4.2, 0.5, 0.55}).find("PWM spans 0.050"), std::string::npos);
  EXPECT_NE(why({5}).find("5 rows for 5 coefficients"), std::string::npos);
  EXPECT_NE(why({12, 3.3, 4.2, 0.3, 1.0, 8.0}).find("too noisy"), std::string::npos);

  // Battery voltage and PWM vary together: each covers a wide range, but not independently.
  ThrustData together = measured({}, 4);
  for (ThrustSample& s : together.samples) s.v = 1.1 - 0.3 * s.p;
  EXPECT_NE(identify_thrust(together, 0.95).thrust.why_not.find("depend on each other"), std::string::npos);
  // Two PWM levels cannot distinguish c10 from c20.
  ThrustData levels = measured({}, 5);
  for (ThrustSample& s : levels.samples) s.p = s.p < 0.6 ? 0.3 : 0.9;
  EXPECT_NE(identify_thrust(levels, 0.95).thrust.why_not.find("depend on each other"), std::string::npos);
}

// A battery with internal resistance: v = v_open - sag p. The maximum thrust is then a function of p and v.
TEST(ThrustIdentification, RampsToFullPwmShowHowMuchTheBatteryWillSag) {
  const double sag = 0.12;
  ThrustData data;
  double open = 1.0;
  for (long ramp = 0; ramp < 12; ++ramp, open -= 0.015) {
    for (double p = 0.3; p <= 1.0001; p += 0.05) {
      ThrustSample s;
      s.p = std::fmin(p, 1.0);
      s.v = open - sag * s.p;
      s.thrust_gf = thrust_gf(s.p, s.v);
      s.run = ramp;
      data.samples.push_back(s);
    }
  }
  for (const bool has_runs : {true, false}) {
    data.has_runs = has_runs;
    const ThrustIdentification result = identify_thrust(data, 0.95);
    ASSERT_TRUE(result.max_thrust.determined) << result.max_thrust.why_not;
    const auto& e = result.max_thrust.coefficients;
    // At p, v the open-circuit voltage is v + sag p, and at full PWM the battery gives v + sag p - sag.
    const double slope = kTruth[2] + kTruth[4];
    EXPECT_NEAR(e[2].value, slope, 1e-6);
    EXPECT_NEAR(e[1].value, slope * sag, 1e-6);
    EXPECT_NEAR(e[0].value, kTruth[0] + kTruth[1] + kTruth[3] - slope * sag, 1e-6);
  }
}

TEST(ThrustIdentification, WithoutRampsTheLargestThrustIsThatOfFullPwm) {
  const ThrustIdentification result = identify_thrust(measured({400, 3.2, 4.2, 0.25, 0.8, 0.0}, 6), 0.95);
  ASSERT_TRUE(result.max_thrust.determined);
  const auto& e = result.max_thrust.coefficients;
  for (const double v : {0.8, 0.9, 1.0}) EXPECT_NEAR(e[0].value + e[2].value * v, thrust_gf(1.0, v), 1e-8);
  EXPECT_EQ(e[1].value, 0.0);
  EXPECT_NE(result.max_thrust.method.find("extrapolated from PWM 0.80"), std::string::npos);
}

TEST(ThrustData, UnitsAndNamesMayBeWrittenInManyWays) {
  const std::vector<std::string> same = {
      "pwm,vbat,thrust_gf\n32768,4.2,7.5\n16384,2.1,1\n",
      "# PWM[counts]; Battery_Voltage (mV); Force [N]\r\n32768; 4200; 0.073575\r\n16384;2100;0.00981\r\n",
      "time,thrust [g],vbat[V],pwm_ratio,note\n0,7.5,4.2,0.5,1\n1,1,2.1,0.25,2\n",
      "pwm1\tpwm2\tpwm3\tpwm4\tvbat_mV\tforce_mN\n32767\t32769\t32768\t32768\t4200\t73.575\n"
      "16384\t16384\t16384\t16384\t2100\t9.81\n",
      "\n\"pwm(%)\",\"voltage\",\"thrust\"\n# a remark\n50,4.2,+7.5\n\n25,2.1,1",
      "pwm,vbat,thrust\n0.5,4.2,7.5\n0.25,2.1,1\n"};
  for (const std::string& text : same) {
    const ThrustData data = parse_thrust_data(text, "cell.csv", 1);
    ASSERT_EQ(data.samples.size(), 2u) << text;
    EXPECT_DOUBLE_EQ(data.samples[0].p, 0.5) << text;
    EXPECT_DOUBLE_EQ(data.samples[0].v, 1.0) << text;
    EXPECT_DOUBLE_EQ(data.samples[0].thrust_gf, 7.5) << text;
    EXPECT_DOUBLE_EQ(data.samples[1].p, 0.25) << text;
  }
  EXPECT_DOUBLE_EQ(parse_thrust_data(same[0], "cell.csv", 4).samples[0].thrust_gf, 7.5 / 4);
}

TEST(ThrustData, ErrorsNameLineFieldValueAndMend) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      parse_thrust_data(text, "cell.csv", 1);
    } catch (const files::InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const std::string& text, const std::vector<std::string>& words) {
    for (const std::string& word : words) {
      EXPECT_NE(message(text).find(word), std::string::npos) << message(text) << "\nlacks: " << word;
    }
  };
  expect("", {"cell.csv", "no column"});
  expect("pwm,thrust_gf\n1,2\n", {"line 1", "vbat", "pwm, thrust_gf", "no column"});
  expect("pwm,vbat,thrust_gf\n", {"no rows"});
  expect("pwm,vbat,thrust_gf\n1,4,2\n2,x,3\n", {"line 3", "vbat", "\"x\"", "not a finite number"});
  expect("pwm,vbat,thrust_gf\n1,4,nan\n", {"line 2", "thrust_gf", "not a finite number"});
  expect("pwm,vbat,thrust_gf\n1,4\n", {"line 2", "thrust_gf", "2 cells, the header 3"});
  expect("pwm,vbat,thrust_gf\n1,4,2,9\n", {"line 2", "4 cells, the header 3"});
  expect("pwm,vbat,thrust_gf\n70000,4,2\n", {"line 2", "pwm", "70000", "between 0 and 65536"});
  expect("pwm,vbat,thrust_gf\n100,4000,2\n", {"line 2", "vbat", "4000 V", "V or mV"});
  expect("pwm,vbat[A],thrust\n1,4,2\n", {"line 1", "vbat[A]", "unit", "V, mV"});
  expect("pwm,vbat,thrust_gf,force_N\n1,4,2,0.02\n", {"line 1", "thrust_gf, force_N", "more than one"});
}

class IdentifyThrustCommand : public testing::Test {
 protected:
  /// The example in the help text: a table in counts and volts.
  static std::string table(const Experiment& e) {
    std::string text = "pwm,vbat,thrust_gf\n";
    for (const ThrustSample& s : measured(e, 7).samples) {
      text += fmt::format("{:.0f},{:.4f},{:.5f}\n", s.p * 65536, s.v * 4.2, s.thrust_gf);
    }
    return text;
  }
  tests::ScratchFolder folder_;
};

TEST_F(IdentifyThrustCommand, WritesCoefficientsWithIntervals) {
  tests::write_text(folder_ / "cell.csv", table({}));
  const tests::Outcome outcome =
      tests::run_shell("swarmcert identify-thrust cell.csv --json out.json", folder_.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("c11 = "), std::string::npos);
  EXPECT_NE(outcome.output.find("Next: swarmcert compare model.toml"), std::string::npos) << outcome.output;
  const std::string json = tests::read_text(folder_ / "out.json");
  for (const char* part :
       {"\"schema\": \"swarmcert/identify-thrust/1\"", "\"verdict\": \"determined\"", "\"c20\"", "\"d11\"",
        "\"e01\"", "\"interval\"", "\"residual_rms\"", "\"sha256\""}) {
    EXPECT_NE(json.find(part), std::string::npos) << part;
  }
}

TEST_F(IdentifyThrustCommand, IsInconclusiveWhereTheDataSayTooLittle) {
  tests::write_text(folder_ / "cell.csv", table({400, 4.0, 4.0}));
  const tests::Outcome outcome = tests::run_shell("swarmcert identify-thrust cell.csv", folder_.path());
  EXPECT_EQ(outcome.exit_code, 4) << outcome.output;
  EXPECT_NE(outcome.output.find("not determined: the battery spans"), std::string::npos) << outcome.output;
}

TEST_F(IdentifyThrustCommand, RefusesBadTablesWithTheLine) {
  tests::write_text(folder_ / "cell.csv", "pwm,vbat,thrust_gf\n1,4,oops\n");
  const tests::Outcome outcome = tests::run_shell("swarmcert identify-thrust cell.csv", folder_.path());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("cell.csv: line 2: thrust_gf"), std::string::npos) << outcome.output;
  EXPECT_EQ(tests::run_shell("swarmcert identify-thrust missing.csv", folder_.path()).exit_code, 3);
  EXPECT_EQ(tests::run_shell("swarmcert identify-thrust cell.csv --rotors 0", folder_.path()).exit_code, 2);
}

}  // namespace
}  // namespace swarmcert::analysis
