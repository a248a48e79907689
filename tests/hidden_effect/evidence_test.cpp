/// Names by evidence: transforms, noise, and sets of effects in flights in gusts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/evidence/noise_model.h"
#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/truths.h"

namespace swarmcert::tests {
namespace {

constexpr int kManyRecords = 4000;
constexpr double kRecordStep_s = 0.01;

std::vector<float> transformed(const evidence::Spectral& spectral, const std::vector<float>& series) {
  std::vector<float> to(static_cast<std::size_t>(spectral.rows()));
  spectral.transform(0, series.data(), to.data());
  return to;
}

/// A first-order process with time constant tau_s, observed with white noise, both of standard deviation 1 and `white`.
std::vector<float> gust(double tau_s, double white, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<float> series;
  const double keeps = std::exp(-kRecordStep_s / tau_s);
  double state = normal(random);
  for (int i = 0; i < kManyRecords; ++i) {
    series.push_back(static_cast<float>(state + white * normal(random)));
    state = keeps * state + std::sqrt(1 - keeps * keeps) * normal(random);
  }
  return series;
}

/// Flies `truth` three times and diagnoses the flights.
identification::Diagnosis diagnosis_of(const Truth& truth) {
  const ScratchFolder folder;
  for (int run = 0; run < 3; ++run)
    fly(truth, {Program::kRich, 1, 30, 4100 + static_cast<std::uint64_t>(run)}, folder.path(), run);
  residuals::InputArguments arguments;
  arguments.models = {source_path("stability/models/crazyflie-small.toml")};
  arguments.flights = {folder.path()};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  return identification::diagnose(inputs, inputs.models[0].kind, identification::every_flight(inputs), 2,
                                  [](int, int) {});
}

std::vector<identification::Missing> named_in(const Truth& truth) { return diagnosis_of(truth).ranking; }

TEST(Evidence, ProductsOfTransformsAreThoseOfTheSeriesFadedAtBothEnds) {
  const evidence::Spectral spectral({{0, kManyRecords, kRecordStep_s}});
  std::vector<float> wave, other;
  for (int i = 0; i < kManyRecords; ++i) {
    wave.push_back(static_cast<float>(std::sin(2 * M_PI * 0.7 * kRecordStep_s * i)));
    other.push_back(static_cast<float>(std::sin(2 * M_PI * 0.7 * kRecordStep_s * i + 1)));
  }
  double in_time = 0;
  for (int i = 0; i < kManyRecords; ++i) {
    const double from_end_s = kRecordStep_s * (std::min(i, kManyRecords - 1 - i) + 0.5);
    const double share = from_end_s < 1 ? 0.5 - 0.5 * std::cos(M_PI * from_end_s) : 1;
    in_time += share * share * wave[static_cast<std::size_t>(i)] * other[static_cast<std::size_t>(i)];
  }
  const std::vector<float> a = transformed(spectral, wave), b = transformed(spectral, other);
  EXPECT_NEAR(std::inner_product(a.begin(), a.end(), b.begin(), 0.0), in_time, 1e-3 * in_time);
}

TEST(Evidence, AGustHasTheVarianceOfTheNoiseModelAlongADirectionOfSlowSetPoints) {
  const evidence::Spectral spectral({{0, kManyRecords, kRecordStep_s}});
  const evidence::NoiseModel noise(spectral.bands(), Eigen::Vector3d::Constant(1e-4));
  // A ramp jumps from the last record to the first; so does most of the gust.
  std::vector<float> ramp(kManyRecords);
  std::iota(ramp.begin(), ramp.end(), 0.0F);
  const std::vector<float> direction = transformed(spectral, ramp);
  double sum = 0;
  constexpr int kRuns = 200;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const std::vector<float> y = transformed(spectral, gust(0.7, 0.03, seed));
    const auto bands = static_cast<Eigen::Index>(spectral.bands().size());
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(3 * bands);
    for (Eigen::Index b = 0; b < bands; ++b) {
      const evidence::Band& band = spectral.bands()[static_cast<std::size_t>(b)];
      for (int row = band.first; row < band.first + band.count; ++row)
        squares[b] += std::pow(y[static_cast<std::size_t>(row)], 2);
      squares[bands + b] = squares[2 * bands + b] = squares[b];
    }
    const Eigen::VectorXd S = noise.power(squares, noise.counts());
    double along = 0, length = 0;
    for (Eigen::Index b = 0; b < bands; ++b) {
      const evidence::Band& band = spectral.bands()[static_cast<std::size_t>(b)];
      for (int row = band.first; row < band.first + band.count; ++row) {
        const auto i = static_cast<std::size_t>(row);
        along += direction[i] * y[i] / S[b];
        length += std::pow(direction[i], 2) / S[b];
      }
    }
    sum += along * along / length / kRuns;
  }
  // The mean of kRuns squares of standard normal numbers is 1 +- 0.1.
  EXPECT_NEAR(sum, 1, 0.35);
}

TEST(Evidence, NamesNothingInAGustAlone) {
  Truth truth;
  truth.gust_N = 0.02;
  truth.gust_time_s = 0.7;
  for (const identification::Missing& missing : named_in(truth))
    ADD_FAILURE() << missing.effect << " is not there";
}

TEST(Evidence, NamesWhatIsHalfAsLargeAgainAsItsDetectableSizeAndNotWhatIsHalfOfIt) {
  double size_N_s_m = 0;
  for (const evidence::Detectable& entry : diagnosis_of({}).detectable) {
    if (entry.effect == "drag_linear") size_N_s_m = entry.size;
  }
  ASSERT_GT(size_N_s_m, 0);
  ASSERT_LT(size_N_s_m, 0.01);
  for (const double factor : {0.5, 1.5}) {
    SCOPED_TRACE(factor);
    Truth truth;
    truth.force_N = [&](const Moment& now) { return Eigen::Vector3d(-factor * size_N_s_m * now.v_m_s); };
    const std::vector<identification::Missing> named = named_in(truth);
    ASSERT_EQ(named.size(), factor > 1 ? 1u : 0u);
    for (const identification::Missing& missing : named) EXPECT_EQ(missing.effect, "drag_linear");
  }
}

TEST(Evidence, NamesADragInAGustWithItsValueAndAThrustScaleBesideItAmongWhatFlightsCannotTellApart) {
  Truth truth;
  truth.gust_N = 0.02;
  truth.gust_time_s = 0.7;
  truth.thrust_factor = 1.08;
  truth.force_N = [](const Moment& now) { return Eigen::Vector3d(-0.02 * now.v_m_s); };
  const std::vector<identification::Missing> named = named_in(truth);
  std::string all;
  for (const identification::Missing& missing : named) all += missing.effect + " ";
  ASSERT_EQ(named.size(), 2u) << all;
  for (const identification::Missing& missing : named) {
    if (missing.effect == "drag_linear") {
      const Interval& interval = missing.intervals.at("drag_N_s_m");
      EXPECT_LT(interval.lower, 0.02);
      EXPECT_GT(interval.upper, 0.02);
    } else {
      const std::vector<std::string> others = missing.finding.confounded_with();
      EXPECT_TRUE(missing.effect == "thrust_ratio" ||
                  std::find(others.begin(), others.end(), "thrust_ratio") != others.end())
          << all;
    }
  }
}

}  // namespace
}  // namespace swarmcert::tests
