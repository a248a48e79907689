/// Flights reported as test flights influence nothing: whatever they contain, the fit is the same, bit for bit.
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"

namespace swarmcert::tests {
namespace {

const std::string& small_model() {
  static const std::string path = source_path("stability/models/crazyflie-small.toml");
  return path;
}

/// One flight of two vehicles that exert forces on each other, as run `run` in folder `into`.
void fly(const ScratchFolder& folder, int run, int seed, const std::string& into, int duration_s = 20) {
  const Outcome outcome = run_shell(
      fmt::format("swarmcert simulate random-walk -q --force --vehicles 2 --duration {} --seed {} --run {} "
                  "--model {} --gains {} -o {}",
                  duration_s, seed, run, source_path("stability/models/crazyflie-small-effects.toml"),
                  source_path("controller/gains/crazyflie-small.toml"), into),
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
}

/// Possible damage to run 4 of five, which is the test flight.
struct Damage {
  const char* name;
  std::function<void(const ScratchFolder&)> make;
};

std::vector<Damage> damages() {
  return {{"another flight", [](const ScratchFolder& folder) { fly(folder, 4, 77, "flights"); }},
          {"the logs of its vehicles swapped",
           [](const ScratchFolder& folder) {
             ASSERT_EQ(
                 run_shell("mv flights/cf1_04 x && mv flights/cf2_04 flights/cf1_04 && mv x flights/cf2_04",
                           folder.path())
                     .exit_code,
                 0);
           }},
          {"half of a log",
           [](const ScratchFolder& folder) {
             const std::string log = read_text(folder / "flights/cf1_04");
             write_text(folder / "flights/cf1_04", log.substr(0, log.size() / 2));
           }},
          {"no log at all", [](const ScratchFolder& folder) {
             write_text(folder / "flights/cf1_04", "not a log");
             write_text(folder / "flights/cf2_04", "");
           }}};
}

/// Expects the same result from `fitted` for the five flights as recorded, and with the last one damaged.
void expect_same(const std::function<std::string(const ScratchFolder&)>& fitted) {
  const ScratchFolder folder;
  for (int run = 0; run < 5; ++run) fly(folder, run, 30 + run, "flights");
  const std::string sound = fitted(folder);
  ASSERT_GT(sound.size(), 100u);
  for (const Damage& damage : damages()) {
    SCOPED_TRACE(damage.name);
    damage.make(folder);
    EXPECT_EQ(fitted(folder), sound);
  }
}

std::string hashes_of(const ScratchFolder& folder, const std::string& files) {
  const Outcome outcome = run_shell("sha256sum " + files, folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  return outcome.output;
}

TEST(TestFlights, ChangeNothingThatAddFits) {
  expect_same([](const ScratchFolder& folder) {
    const Outcome outcome = run_shell("swarmcert add downwash,drag_linear --keep-anyway --model " +
                                          small_model() + " flights -o new.toml -q --force --json add.json",
                                      folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    files::Json result = files::read_json(folder / "add.json", "swarmcert/add/1");
    std::string text = result["effects"].dump();
    for (const files::Json& row : result["ladder"]) {
      for (const char* key : {"effect", "fit_rmse", "select_rmse", "accepted", "reason"})
        text += row[key].dump() + " ";
    }
    return text;
  });
}

TEST(TestFlights, ChangeNothingThatTrainFits) {
  expect_same([](const ScratchFolder& folder) {
    const Outcome outcome =
        run_shell("swarmcert train " + small_model() +
                      " flights --phi 4 --rho 4 --features 4 --epochs 2 --teachers 1 -o trained -q --force",
                  folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return hashes_of(folder, "trained/network.toml trained/*.safetensors");
  });
}

/// The test flight alone would prefer the other mass, because it flew with 32 g. Both masses are tried on the fitted
/// flights.
TEST(TestFlights, DoNotChooseTheMassOfABudget) {
  const ScratchFolder folder;
  std::string light = read_text(source_path("stability/models/crazyflie-small.toml"));
  light.replace(light.find("mass_kg = 0.034"), 15, "mass_kg = 0.032");
  write_text(folder / "light.toml", light);
  const auto fly_model = [&](const std::string& model, int seed, const std::string& into) {
    ASSERT_EQ(
        run_shell(
            fmt::format("swarmcert simulate random-walk -q --vehicles 2 --duration 15 --seed {} --model {} "
                        "--gains {} -o {}",
                        seed, model, source_path("controller/gains/crazyflie-small.toml"), into),
            folder.path())
            .exit_code,
        0);
  };
  fly_model(small_model(), 1, "fit/1");
  fly_model("light.toml", 2, "test/2");
  fly_model(small_model(), 3, "other/3");
  const auto budget = [&](const std::string& test) {
    const Outcome outcome = run_shell("swarmcert compare " + small_model() + " " + test +
                                          " --budget fit --fitted fitted --force -q --json b.json",
                                      folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    const double mass_kg =
        files::read_json(folder / "b.json", "swarmcert/compare/1")["budget"]["nominal_mass_kg"]["small"];
    EXPECT_EQ(mass_kg, 0.034) << test;
    return hashes_of(folder, "fitted/*.toml");
  };
  EXPECT_EQ(budget("test"), budget("other"));
}

}  // namespace
}  // namespace swarmcert::tests
