#include "stability/simulation/flight_log.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>

#include "data.h"
#include "nn/base/file_io.h"
#include "stability/simulation/simulate.h"

namespace swarmcert::stability {
namespace {

/// Expands a compressed quaternion according to the firmware's description.
Eigen::Quaterniond expanded(std::uint32_t compressed) {
  Eigen::Quaterniond q;
  const int largest = static_cast<int>(compressed >> 30);
  double sum = 0;
  for (int i = 3; i >= 0; --i) {
    if (i == largest) continue;
    const double magnitude = (compressed & 0x1ffu) / 511.0 * std::sqrt(0.5);
    q.coeffs()[i] = (compressed >> 9 & 1u) != 0 ? -magnitude : magnitude;
    sum += magnitude * magnitude;
    compressed >>= 10;
  }
  q.coeffs()[largest] = std::sqrt(1 - sum);
  return q;
}

/// Reads the output of to_usd_log(); implemented from the format's description alone.
struct UsdReader {
  std::vector<std::string> names;
  std::vector<char> types;
  std::vector<std::vector<double>> records;
  bool checks_hold = true;

  explicit UsdReader(const std::string& bytes) {
    std::size_t at = 1;
    for (int i = 0; i < static_cast<unsigned char>(bytes[0]); ++i) {
      const std::size_t open = bytes.find('(', at);
      names.push_back(bytes.substr(at, open - at));
      types.push_back(bytes[open + 1]);
      at = open + 4;
    }
    check(bytes, 0, at);
    at += 4;
    while (at < bytes.size()) {
      const std::size_t begin = at;
      const int count = static_cast<unsigned char>(bytes[at++]);
      for (int k = 0; k < count; ++k) {
        std::vector<double>& record = records.emplace_back();
        for (const char type : types) record.push_back(number(bytes, type, &at));
      }
      check(bytes, begin, at);
      at += 4;
    }
  }

  void check(const std::string& bytes, std::size_t begin, std::size_t end) {
    std::uint32_t stored;
    std::memcpy(&stored, bytes.data() + end, 4);
    const auto* data = reinterpret_cast<const Bytef*>(bytes.data() + begin);
    checks_hold =
        checks_hold && stored == ~static_cast<std::uint32_t>(crc32(0, data, static_cast<uInt>(end - begin)));
  }

  static double number(const std::string& bytes, char type, std::size_t* at) {
    const char* const from = bytes.data() + *at;
    const auto take = [&](auto value) {
      std::memcpy(&value, from, sizeof value);
      *at += sizeof value;
      return static_cast<double>(value);
    };
    switch (type) {
      case 'I':
        return take(std::uint32_t{});
      case 'h':
        return take(std::int16_t{});
      case 'H':
        return take(std::uint16_t{});
      default:
        return take(float{});
    }
  }
};

TEST(FlightLog, HasThePublishedHeaderByteForByte) {
  SWARMCERT_NEEDS_DATA();
  const std::string published = files::read_file(tests::data_path("flights/development/21_swap_ss/cf50_00"));
  const std::string ours = to_usd_log({});
  ASSERT_LE(ours.size(), published.size());
  EXPECT_EQ(ours, published.substr(0, ours.size())) << "header and its CRC";
}

TEST(FlightLog, RoundTripKeepsEveryFieldAndTheChecks) {
  const Model model = read_model(tests::source_path("stability/models/crazyflie-small.toml"));
  const Gains gains = load_gains(tests::source_path("controller/gains/crazyflie-small-nominal.toml"));
  Swarm swarm(model, 2);
  const auto task = make_task("swap", {2, 6, 0});
  SimulationOptions options;
  options.loop.noise = true;
  const Simulation flown = simulate(swarm, gains, *task, options);
  const std::string bytes = to_usd_log(flown.logs[1]);
  const UsdReader log(bytes);
  EXPECT_TRUE(log.checks_hold);
  ASSERT_EQ(log.names.size(), 35u);
  ASSERT_EQ(log.records.size(), flown.logs[1].size());
  ASSERT_GT(log.records.size(), 590u);
  for (std::size_t k = 0; k < log.records.size(); ++k) {
    const LogRecord& wrote = flown.logs[1][k];
    const std::vector<double>& read = log.records[k];
    ASSERT_EQ(read[0], wrote.tick_us);
    for (std::size_t i = 0; i < 9; ++i) {
      ASSERT_EQ(read[1 + i], wrote.position_mm_velocity_mm_s_acceleration_mm_s2[i]);
    }
    ASSERT_EQ(read[10], wrote.quaternion);
    ASSERT_EQ(read[20], static_cast<double>(wrote.thrust_N));
    ASSERT_EQ(read[28], wrote.pwm[0]);
    ASSERT_EQ(read[33], wrote.battery_mV);
    if (k > 0) {
      ASSERT_GT(read[0], log.records[k - 1][0]) << "ticks ascend";
    }
  }
  // Sampled every 10 ms. At hover the specific force, which includes gravity, is g along +z.
  const double span_s = 1e-6 * (log.records.back()[0] - log.records[0][0]);
  EXPECT_NEAR(span_s / static_cast<double>(log.records.size() - 1), 0.01, 1e-5);
  EXPECT_NEAR(1e-3 * log.records[50][9], 9.81, 0.6);
}

TEST(FlightLog, ResidualForceOfALogIsTheEffectThatActed) {
  // f_a = m a - R e_z T from the log alone, compared with the constant force of the truth (identification.md, section
  // 2).
  Model model = read_model(tests::source_path("stability/models/crazyflie-small.toml"));
  EffectSpec force;
  force.name = "constant_force";
  force.parameters = {{"force_x_N", 0.01}, {"force_z_N", -0.03}};
  model.effects.push_back(force);
  const Gains gains = load_gains(tests::source_path("controller/gains/crazyflie-small-nominal.toml"));
  Swarm swarm(model, 1);
  const auto task = make_task("circle", {1, 20, 0});
  SimulationOptions options;
  options.loop.noise = true;
  const Simulation flown = simulate(swarm, gains, *task, options);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const LogRecord& record : flown.logs[0]) {
    const Eigen::Matrix3d R = expanded(record.quaternion).toRotationMatrix();
    double thrust_N = 0;
    for (const std::uint32_t pwm : record.pwm)
      thrust_N += model.thrust.force_N(pwm / 65536.0, 1e-3 * record.battery_mV);
    const auto& k = record.position_mm_velocity_mm_s_acceleration_mm_s2;
    sum += model.mass_kg * 1e-3 * Eigen::Vector3d(k[6], k[7], k[8]) - thrust_N * R.col(2);
  }
  const Eigen::Vector3d mean = sum / static_cast<double>(flown.logs[0].size());
  EXPECT_NEAR(mean.x(), 0.01, 5e-4);
  EXPECT_NEAR(mean.y(), 0, 5e-4);
  EXPECT_NEAR(mean.z(), -0.03, 5e-4);
}

TEST(Sensors, QuaternionsSurviveTheirCompressionUpToTheQuantum) {
  files::Random random(4);
  for (int trial = 0; trial < 2000; ++trial) {
    Eigen::Vector4d wxyz;
    for (double& component : wxyz) component = random.bell();
    const Eigen::Quaterniond q = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
    const Eigen::Quaterniond r = expanded(compress_quaternion(q));
    const double sign = q.dot(r) < 0 ? -1 : 1;
    for (int i = 0; i < 4; ++i) ASSERT_NEAR(sign * r.coeffs()[i], q.coeffs()[i], 3e-3) << trial;
  }
}

TEST(Sensors, TheRealPartIsTheLastComponentOfACompressedQuaternion) {
  EXPECT_EQ(compress_quaternion(Eigen::Quaterniond(1, 0, 0, 0)) >> 30, 3U);
  EXPECT_EQ(compress_quaternion(Eigen::Quaterniond(0, 1, 0, 0)) >> 30, 0U);
}

TEST(Sensors, AccelerometerFilterHas3dBAtItsCutoffAndTheStatedDelay) {
  const double rate_hz = 500;
  for (const double f_hz : {1.0, 30.0}) {
    LowPass filter(30, rate_hz);
    double in_phase = 0, quadrature = 0;
    const int periods = static_cast<int>(20 * f_hz);
    const int samples = static_cast<int>(periods * rate_hz / f_hz);
    for (int k = 0; k < 2 * samples; ++k) {
      const double phase = 2 * M_PI * f_hz * k / rate_hz;
      const double y = filter.filter({std::sin(phase), 0, 0}).x();
      if (k < samples) continue;
      in_phase += 2 * y * std::sin(phase) / samples;
      quadrature += 2 * y * std::cos(phase) / samples;
    }
    const double gain = std::hypot(in_phase, quadrature);
    const double delay_s = -std::atan2(quadrature, in_phase) / (2 * M_PI * f_hz);
    if (f_hz == 30) {
      EXPECT_NEAR(gain, std::sqrt(0.5), 1e-3);
    } else {
      EXPECT_NEAR(delay_s, 0.0075, 2e-4) << "group delay, identification.md section 2";
    }
  }
}

TEST(Sensors, DelayedSignalIsLateByTheDelayAndByTheGainsShare) {
  for (const double delay_s : {0.0, 0.0005, 0.002, 0.0075, 0.03}) {
    for (const double gain : {0.0, 0.6, 1.0}) {
      DelayedSignal signal(delay_s, gain, 0.002);
      for (int k = 0; k < 100; ++k) {
        const double t = 0.002 * k;
        const Eigen::Vector3d late = signal.filter({3 * t, 1, -t});
        if (t < delay_s) continue;
        ASSERT_NEAR(late.x(), 3 * (t - gain * delay_s), 1e-12) << delay_s << " " << gain;
        ASSERT_NEAR(late.y(), 1, 1e-15);
      }
    }
  }
}

TEST(Sensors, MilliTruncatesAndWrapsLikeInt16) {
  EXPECT_EQ(milli(0.0129), 12);
  EXPECT_EQ(milli(-0.0129), -12);
  EXPECT_EQ(milli(32.768), -32768);
  EXPECT_EQ(milli(std::nan("")), 0);
}

}  // namespace
}  // namespace swarmcert::stability
