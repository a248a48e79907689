#include "analysis/tracking/kept_promise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/temp_folder.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string bound_file(const tests::TempFolder& folder, const Json& coverage) {
  const Json document = {{"schema", "swarmcert/bound/1"}, {"coverage", coverage}};
  write(folder / "bound.json", document.dump());
  return folder / "bound.json";
}

TEST(KeptPromise, CountsFlightsAndLeavesThoseOutThatItWasMadeFrom) {
  const tests::TempFolder folder;
  std::vector<residuals::FlightPeak> peaks;
  // 20 flights; the last two exceed 0.1 m along z, one of them for only one of its two vehicles.
  for (int k = 0; k < 20; ++k) {
    const std::string name = "flight" + std::to_string(k);
    write(folder / name, name);
    peaks.push_back({name, "cf1", folder / name, {0.01, std::nan(""), k == 18 ? 0.2 : 0.1}});
  }
  write(folder / "second", "second");
  peaks.push_back({"flight19", "cf2", folder / "second", {0.01, std::nan(""), 0.3}});
  Promise promise;
  promise.bound_m = {std::numeric_limits<double>::infinity(), 1, 0.1};
  KeptPromise kept = kept_promise(promise, peaks);
  EXPECT_EQ(kept.axes[0].held, 20);
  EXPECT_EQ(kept.axes[1].flights, 0) << "no set point";
  EXPECT_EQ(kept.axes[2].flights, 20);
  EXPECT_EQ(kept.axes[2].held, 18);
  EXPECT_EQ(kept.worst_axis(), 2);
  // Clopper and Pearson for 18 of 20, by the incomplete beta function; all of 20: 0.05^(1/20).
  EXPECT_NEAR(kept.axes[2].interval_90.lower, 0.7174, 1e-4);
  EXPECT_NEAR(kept.axes[2].interval_90.upper, 0.9819, 1e-4);
  EXPECT_NEAR(kept.axes[0].interval_90.lower, std::pow(0.05, 0.05), 1e-9);
  EXPECT_EQ(kept.axes[0].interval_90.upper, 1);
  // A single log of a flight is enough to exclude the whole flight.
  promise.made_from = {files::sha256("second"), files::sha256("flight0")};
  kept = kept_promise(promise, peaks);
  EXPECT_EQ(kept.used.size(), 2u);
  EXPECT_EQ(kept.axes[2].flights, 18);
  EXPECT_EQ(kept.axes[2].held, 17);
}

TEST(KeptPromise, ReadsTheBoundsOfTheLoopThatFlies) {
  const tests::TempFolder folder;
  const auto row = [](const char* axis, const char* channel, const char* loop, const Json& total) {
    return Json{{"axis", axis}, {"channel", channel}, {"loop", loop}, {"total", total}, {"unit", "m"}};
  };
  const Json bounds = {row("x", "force", "continuous", 0.1), row("x", "force", "sampled", 0.2),
                       row("x", "command", "sampled", 0.3), row("y", "force", "continuous", 0.4),
                       row("z", "force", "continuous", nullptr)};
  const Promise promise = read_promise(bound_file(
      folder, {{"level", 0.9}, {"made_from", Json::array({std::string(64, 'a')})}, {"bounds", bounds}}));
  EXPECT_EQ(promise.level, 0.9);
  EXPECT_EQ(promise.bound_m[0], 0.2);
  EXPECT_EQ(promise.bound_m[1], 0.4);
  EXPECT_TRUE(std::isinf(promise.bound_m[2]));
  EXPECT_EQ(promise.made_from.size(), 1u);
}

TEST(KeptPromise, RefusesWhatIsNoPromise) {
  const tests::TempFolder folder;
  for (const Json& coverage :
       {Json(), Json(1), Json{{"level", 0.9}}, Json{{"level", 0.9}, {"bounds", Json::array()}},
        Json{{"level", "0.9"}, {"bounds", Json::array()}, {"made_from", Json::array()}},
        Json{{"level", 0.9}, {"bounds", Json::array({1})}, {"made_from", Json::array()}},
        Json{{"level", 0.9}, {"bounds", Json::array()}, {"made_from", Json::array({1})}}}) {
    EXPECT_THROW(read_promise(bound_file(folder, coverage)), files::InputError) << coverage;
  }
}

}  // namespace
}  // namespace swarmcert::analysis
