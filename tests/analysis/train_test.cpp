#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "analysis/run.h"
#include "nn/base/json.h"

namespace swarmcert {
namespace {

using files::Json;
using tests::Outcome;
using tests::read_text;
using tests::write_text;

/// Three simulated swaps of two vehicles with downwash, and a model without it.
class Train : public testing::Test {
 protected:
  void SetUp() override {
    const std::string nominal =
        read_text(std::string(SWARMCERT_SOURCE_DIR) + "/stability/models/crazyflie-small.toml");
    write_text(folder_ / "nominal.toml", nominal);
    write_text(folder_ / "truth.toml", nominal + "\n[[effect]]\nname = \"downwash\"\n");
    for (const std::string run : {"1", "2", "3"}) {
      const Outcome outcome =
          execute("swarmcert simulate swap --vehicles 2 --model truth.toml --gains '" +
                  std::string(SWARMCERT_SOURCE_DIR) + "/controller/gains/crazyflie-small.toml' --seed " +
                  run + " -o flights/" + run);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    }
  }

  Outcome execute(const std::string& command) { return tests::run_shell(command, folder_.path()); }

  std::string train(const std::string& options) {
    return "swarmcert train nominal.toml flights --phi 12,12 --rho 12 --features 8 " + options;
  }

  tests::ScratchFolder folder_;
};

TEST_F(Train, LearnsTheDownwashOfFlightsThatItDidNotSeeAndCertifiesTheResult) {
  const Outcome outcome = execute(train("--epochs 25 --batch 256 --rate 5e-3 -o out --json result.json"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const Json result = files::read_json(folder_ / "result.json", "swarmcert/train/1");
  EXPECT_EQ(result["split"], "flights");
  EXPECT_LT(result["test_rmse"].get<double>(), 0.6 * result["test_rmse_of_nothing"].get<double>());
  EXPECT_EQ(result["gamma_verdict"], "proved");
  EXPECT_GT(result["lipschitz"].get<double>(), 0);
  EXPECT_EQ(execute("swarmcert check out/certificate.json out/network.toml").exit_code, 0);

  // The model with the network explains the flights better than the model without it.
  const auto rmse = [&](const std::string& model) {
    const Outcome compared = execute("swarmcert compare " + model + " flights --force --json compared.json");
    EXPECT_EQ(compared.exit_code, 0) << compared.output;
    return files::read_json(folder_ / "compared.json", "swarmcert/compare/1")["overall"]["rmse"]["z"]
        .get<double>();
  };
  EXPECT_LT(rmse("out/model-small.toml"), 0.7 * rmse("nominal.toml"));
}

TEST_F(Train, KeepsNoNetworkThatIsWorseThanNoneOnTheSelectingFlights) {
  // The fitted flights have downwash and the selecting flights do not: the learned force must not be used in flight.
  ASSERT_EQ(
      execute("swarmcert simulate swap --vehicles 2 --model nominal.toml --gains '" +
              std::string(SWARMCERT_SOURCE_DIR) + "/controller/gains/crazyflie-small.toml' --seed 9 -o calm")
          .exit_code,
      0);
  const Outcome outcome = execute(
      "swarmcert train nominal.toml flights/1 flights/2 --select calm --test flights/3 --phi 12,12 --rho 12 "
      "--features 8 --epochs 10 --batch 256 --rate 5e-3 -o out --json result.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const Json result = files::read_json(folder_ / "result.json", "swarmcert/train/1");
  EXPECT_FALSE(result["kept"].get<bool>());
  EXPECT_NEAR(result["select_rmse"].get<double>(), result["select_rmse_of_nothing"].get<double>(), 1e-9);
  ASSERT_EQ(result["select"].size(), 1u);
  EXPECT_EQ(result["output_scales"]["small"], 0);
  ASSERT_EQ(result["silent"].size(), 1u);
  EXPECT_EQ(result["silent"][0]["vehicles"], "small>small");
  EXPECT_GT(result["silent"][0]["rmse"].get<double>(), result["silent"][0]["rmse_of_nothing"].get<double>());
  EXPECT_NE(read_text(folder_ / "out/network.toml").find("silent = [\"small>small\"]"), std::string::npos);
  EXPECT_FALSE(result["select"][0]["worse_than_none"].get<bool>());
  EXPECT_NE(outcome.output.find("no network is kept"), std::string::npos) << outcome.output;
  EXPECT_EQ(read_text(folder_ / "out/model-small.toml").find("deep_set"), std::string::npos);

  // With selecting flights like the fitted ones, it is kept without a warning.
  const Outcome like = execute(
      "swarmcert train nominal.toml flights/1 flights/2 --select flights/3 --phi 12,12 --rho 12 --features 8 "
      "--epochs 10 --batch 256 --rate 5e-3 -o kept --json kept.json");
  ASSERT_EQ(like.exit_code, 0) << like.output;
  EXPECT_TRUE(files::read_json(folder_ / "kept.json", "swarmcert/train/1")["kept"].get<bool>());
  EXPECT_EQ(like.output.find("worse than none"), std::string::npos) << like.output;
  EXPECT_NE(read_text(folder_ / "kept/model-small.toml").find("deep_set"), std::string::npos);
}

TEST_F(Train, TakesVehiclesOfOneKindWithModelsOfTheirOwn) {
  // As written by compare --fitted.
  std::string heavy = read_text(folder_ / "nominal.toml");
  const std::string mass = "mass_kg = 0.034";
  heavy.replace(heavy.find(mass), mass.size(), "mass_kg = 0.035");
  write_text(folder_ / "heavy.toml", heavy);
  write_text(folder_ / "flights.toml",
             "schema = \"swarmcert/flights/1\"\n[vehicle.cf1]\nmodel = \"nominal.toml\"\n"
             "[vehicle.cf2]\nmodel = \"heavy.toml\"\n");
  const Outcome outcome = execute(
      "swarmcert train flights --flights flights.toml --phi 12,12 --rho 12 --features 8 --epochs 25 --batch "
      "256 --rate 5e-3 -o out");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(read_text(folder_ / "out/flights.toml").find("model-cf"), std::string::npos);
  const auto rmse = [&](const std::string& fleet) {
    const Outcome compared =
        execute("swarmcert compare flights --flights " + fleet + " --force --json compared.json");
    EXPECT_EQ(compared.exit_code, 0) << compared.output;
    return files::read_json(folder_ / "compared.json", "swarmcert/compare/1")["overall"]["rmse"]["z"]
        .get<double>();
  };
  EXPECT_LT(rmse("out/flights.toml"), 0.8 * rmse("flights.toml"));
}

TEST_F(Train, ModelsForPublishedSignalsHaveTheLagOfTheirLabels) {
  const Outcome outcome = execute(train("--epochs 3 --batch 256 --published-signals -o out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::string model = read_text(folder_ / "out/model-small.toml");
  const std::size_t lag = model.find("\"motor_lag\"");
  ASSERT_NE(lag, std::string::npos) << model;
  EXPECT_EQ(model.find("\"motor_lag\"", lag + 1), std::string::npos) << "one lag";
  // The filter moves 16 % of the way per record of 10 ms: 0.01 / -log(0.84).
  EXPECT_NE(model.find("0.0573548"), std::string::npos) << model;
}

/// Wakes push sideways and tilt the vehicle; logs at 500 Hz show both.
class TrainVectors : public Train {
 protected:
  void SetUp() override {
    std::string nominal =
        read_text(std::string(SWARMCERT_SOURCE_DIR) + "/stability/models/crazyflie-small.toml");
    const std::string rate = "log_rate_hz = 100.0";
    nominal.replace(nominal.find(rate), rate.size(), "log_rate_hz = 500.0");
    // The judged model has the motor lag, which the loop has anyway: torques follow it.
    write_text(folder_ / "nominal.toml", nominal + "\n[[effect]]\nname = \"motor_lag\"\n");
    write_text(folder_ / "truth.toml", nominal + R"toml(
[[effect]]
name = "push_and_tilt"
parameters = { push = 0.4, tilt_N = 4e-3 }
[effect.expression]
per_neighbour = true
force_x_N = "-push * dx * exp(-12 * (dx^2 + dy^2 + dz^2))"
force_y_N = "-push * dy * exp(-12 * (dx^2 + dy^2 + dz^2))"
torque_x_Nm = "tilt_N * dy * exp(-12 * (dx^2 + dy^2 + dz^2))"
torque_y_Nm = "-tilt_N * dx * exp(-12 * (dx^2 + dy^2 + dz^2))"
linear = ["push", "tilt_N"]
)toml");
    for (const std::string run : {"1", "2", "3"}) {
      const Outcome outcome =
          execute("swarmcert simulate random-walk --duration 12 --vehicles 2 --model truth.toml --gains '" +
                  std::string(SWARMCERT_SOURCE_DIR) + "/controller/gains/crazyflie-small.toml' --seed " +
                  run + " -o flights/" + run);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    }
  }
};

TEST_F(TrainVectors, AlsoLearnsTheWholeForceAndTheTorqueWhichModelsThenHave) {
  for (const std::string quantity : {"force", "torque"}) {
    SCOPED_TRACE(quantity);
    const std::string out = quantity + "-net";
    const Outcome outcome =
        execute(train("--quantity " + quantity + " --epochs 12 --batch 256 --rate 5e-3 -o " + out +
                      " --force --json result.json --report report-" + quantity));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    const Json result = files::read_json(folder_ / "result.json", "swarmcert/train/1");
    EXPECT_EQ(result["quantity"], quantity);
    for (const std::string axis : {"x", "y"}) {
      EXPECT_LT(result["test_rmse_axes"][axis].get<double>(),
                0.6 * result["test_rmse_of_nothing_axes"][axis].get<double>())
          << axis;
    }
    EXPECT_EQ(result["gamma_verdict"], "proved");
    EXPECT_EQ(execute("swarmcert check " + out + "/certificate.json " + out + "/network.toml").exit_code, 0);

    const auto rmse_x = [&](const std::string& model) {
      const Outcome compared =
          execute("swarmcert compare " + model + " flights --force --json compared.json");
      EXPECT_EQ(compared.exit_code, 0) << compared.output;
      const Json all = files::read_json(folder_ / "compared.json", "swarmcert/compare/1");
      return (quantity == "force" ? all["overall"] : all["flights"][0]["torque"])["rmse"]["x"].get<double>();
    };
    EXPECT_LT(rmse_x(out + "/model-small.toml"), 0.6 * rmse_x("nominal.toml"));

    std::string tilting = read_text(folder_ / "truth.toml");
    tilting.replace(tilting.find("push = 0.4"), 10, "push = 0.0");
    write_text(folder_ / "tilting.toml", tilting);
    const auto flown_rms_m = [&](const std::string& options) {
      const Outcome flown =
          execute("swarmcert simulate random-walk --duration 12 --vehicles 2 --model tilting.toml --gains '" +
                  std::string(SWARMCERT_SOURCE_DIR) +
                  "/controller/gains/crazyflie-small.toml' --no-noise --seed 9 -o fed --force --json "
                  "flown.json " +
                  options);
      EXPECT_EQ(flown.exit_code, quantity == "torque" || options.empty() ? 0 : 3) << flown.output;
      const Json all = files::read_json(folder_ / "flown.json", "swarmcert/simulate/1");
      return all["vehicles"][0]["rms"]["total"].get<double>() +
             all["vehicles"][1]["rms"]["total"].get<double>();
    };
    const double alone = flown_rms_m(""),
                 fed_forward = flown_rms_m("--torque-network " + out + "/network.toml");
    if (quantity == "torque") {
      EXPECT_LT(fed_forward, 0.95 * alone);
    }

    for (const std::string& use :
         {"simulate swap --vehicles 2 --model nominal.toml --network " + out + "/network.toml -o flown",
          "bound --model nominal.toml --speed 1 --accel 1 --network " + out + "/network.toml"}) {
      const Outcome flown = execute("swarmcert " + use + " --gains '" + std::string(SWARMCERT_SOURCE_DIR) +
                                    "/controller/gains/crazyflie-small.toml'");
      EXPECT_EQ(flown.exit_code, 3) << use;
      EXPECT_NE(flown.output.find("is not the vertical force, which flight code requires"), std::string::npos)
          << flown.output;
    }
  }
}

TEST_F(Train, RefusesTorquesOfLogsThatAreTooSlow) {
  const Outcome outcome = execute(train("--quantity torque --epochs 1 -o out"));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("logs at 100 Hz alias the attitude loop: torques need 400 Hz"),
            std::string::npos)
      << outcome.output;
}

TEST_F(Train, KeepsTheLipschitzLimitThatItWasGiven) {
  const auto learn = [&](const std::string& options) {
    const Outcome outcome =
        execute(train("--epochs 20 --batch 256 --rate 5e-3 --force --json result.json " + options));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder_ / "result.json", "swarmcert/train/1");
  };
  const double loose = learn("-o loose")["lipschitz"].get<double>();
  const Json tight = learn(fmt::format("-o tight --max-lipschitz {}", loose / 2));
  EXPECT_LE(tight["lipschitz"].get<double>(), loose / 2);
  EXPECT_EQ(tight["gamma_verdict"], "proved");
  EXPECT_LT(tight["test_rmse"].get<double>(), tight["test_rmse_of_nothing"].get<double>());
  // As seen by certify, from the files alone.
  EXPECT_EQ(execute(fmt::format("swarmcert certify tight/network.toml --max-lipschitz {} -o certificate.json",
                                loose / 2))
                .exit_code,
            0);
  EXPECT_NE(execute(fmt::format(
                        "swarmcert certify loose/network.toml --max-lipschitz {} -o certificate.json --force",
                        loose / 2))
                .exit_code,
            0);
  EXPECT_EQ(execute(train("--epochs 1 --max-lipschitz 100 --gamma-mode equal -o out")).exit_code, 2);
}

TEST_F(Train, BoundedLayersAreCertifiedAndCheckedAsAnyOtherNetwork) {
  for (const std::string layers : {"aol", "orthogonal", "sandwich"}) {
    const Outcome outcome = execute(train("--epochs 25 --batch 256 --rate 6e-3 --max-lipschitz 40 --layers " +
                                          layers + " --force -o out --json out.json"));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    const Json result = files::read_json(folder_ / "out.json", "swarmcert/train/1");
    EXPECT_EQ(result["layers"], layers);
    EXPECT_LE(result["lipschitz"].get<double>(), 40) << layers;
    EXPECT_GE(result["lipschitz"].get<double>(), 20) << layers;
    EXPECT_EQ(result["gamma_verdict"], "proved") << layers;
    EXPECT_LT(result["test_rmse"].get<double>(), 0.8 * result["test_rmse_of_nothing"].get<double>())
        << layers;
    EXPECT_EQ(execute("swarmcert check out/certificate.json out/network.toml").exit_code, 0) << layers;
  }
  EXPECT_EQ(execute(train("--epochs 1 --layers aol --gamma-mode equal -o equal")).exit_code, 2);
}

TEST_F(Train, ATrainedNetworkIsCertifiedComparedSimulatedExportedBoundedAndGated) {
  const Outcome trained =
      execute(train("--epochs 25 --batch 256 --rate 3e-3 --max-lipschitz 60 -o out "
                    "--json out.json"));
  ASSERT_EQ(trained.exit_code, 0) << trained.output;
  const Json result = files::read_json(folder_ / "out.json", "swarmcert/train/1");
  EXPECT_LT(result["test_rmse"].get<double>(), 0.8 * result["test_rmse_of_nothing"].get<double>());
  EXPECT_LE(result["lipschitz"].get<double>(), 60);
  EXPECT_EQ(execute("swarmcert check out/certificate.json out/network.toml").exit_code, 0);
  // The effect of the model and the controller evaluate the same network.
  const auto rmse = [&](const std::string& model) {
    const Outcome compared = execute("swarmcert compare " + model + " flights --force --json compared.json");
    EXPECT_EQ(compared.exit_code, 0) << compared.output;
    return files::read_json(folder_ / "compared.json", "swarmcert/compare/1")["overall"]["rmse"]["z"]
        .get<double>();
  };
  EXPECT_LT(rmse("out/model-small.toml"), 0.8 * rmse("nominal.toml"));
  const Outcome flown = execute(
      "swarmcert simulate swap --vehicles 2 --model truth.toml --network out/network.toml "
      "--gains '" +
      std::string(SWARMCERT_SOURCE_DIR) + "/controller/gains/crazyflie-small.toml' -o flown");
  EXPECT_EQ(flown.exit_code, 0) << flown.output;
  EXPECT_EQ(
      execute("swarmcert export out/network.toml --certificate out/certificate.json -o firmware").exit_code,
      0);
  EXPECT_EQ(execute("swarmcert match out/network.toml firmware").exit_code, 0);
  EXPECT_EQ(execute("swarmcert inspect out/network.toml").exit_code, 0);
  const Outcome bounded =
      execute("swarmcert bound --model nominal.toml --gains '" + std::string(SWARMCERT_SOURCE_DIR) +
              "/controller/gains/crazyflie-small.toml' --speed 1 --accel 1 --network out/network.toml "
              "--certificate out/certificate.json");
  EXPECT_EQ(bounded.exit_code, 4) << bounded.output;  // the network gives a rate, and nothing an amplitude
  for (const char* const word : {"rate of f_hat (proved)", "the size of the force error is not known"})
    EXPECT_NE(bounded.output.find(word), std::string::npos) << word << "\n" << bounded.output;
  write_text(folder_ / "policy.toml",
             "schema = \"swarmcert/policy/1\"\n[release]\nnetwork = \"out/network.toml\"\ncertificate = "
             "\"out/certificate.json\"\nsource = \"firmware/swarmcert_network.cpp\"\n[certificate]\n[match]\n"
             "[spectral_norms]\n[lipschitz]\nmax_joint_gf = 60\n");
  const Outcome gated = execute("swarmcert gate policy.toml");
  EXPECT_EQ(gated.exit_code, 0) << gated.output;
  write_text(folder_ / "states.toml",
             "schema = \"swarmcert/box/1\"\nlower = [-0.2,-0.2,-0.5,-1,-1,-1]\nupper = [0.2,0.2,0.5,1,1,1]\n"
             "ground = { lower = [-1,-1,-1,-1], upper = [0,1,1,1] }\n");
  std::string policy = read_text(folder_ / "policy.toml");
  policy.insert(policy.find("[certificate]"), "box = \"states.toml\"\n");
  write_text(folder_ / "range.toml", policy + "[range]\nmax_abs_force_gf = 200\nmax_jump_gf = 500\n");
  const Outcome ranged = execute("swarmcert gate range.toml");
  EXPECT_EQ(ranged.exit_code, 0) << ranged.output;
}

TEST_F(Train, SameSeedGivesTheSameFilesWhateverTheJobs) {
  ASSERT_EQ(execute(train("--epochs 3 --max-lipschitz 100 -o one -j 1")).exit_code, 0);
  ASSERT_EQ(execute(train("--epochs 3 --max-lipschitz 100 -o two -j 2")).exit_code, 0);
  ASSERT_EQ(execute(train("--epochs 3 -o other --seed 2")).exit_code, 0);
  for (const std::string file :
       {"phi_small.safetensors", "rho_small.safetensors", "phi_ground.safetensors"}) {
    EXPECT_EQ(read_text(folder_ / ("one/" + file)), read_text(folder_ / ("two/" + file))) << file;
    EXPECT_NE(read_text(folder_ / ("one/" + file)), read_text(folder_ / ("other/" + file))) << file;
  }
}

TEST_F(Train, FoldsGiveOneCertifiedNetworkAndErrorsOfFlightsThatEachMemberDidNotSee) {
  const Outcome folded = execute(
      "swarmcert train nominal.toml flights/1 flights/2 --test flights/3 --phi 12,12 --rho 12 --features 8 "
      "--folds 2 --epochs 12 --batch 256 --rate 5e-3 --report page -o out --json result.json");
  ASSERT_EQ(folded.exit_code, 0) << folded.output;
  const Json result = files::read_json(folder_ / "result.json", "swarmcert/train/1");
  ASSERT_EQ(result["folds"].size(), 2u);
  EXPECT_EQ(result["folds"][1]["seed"], 2);
  EXPECT_EQ(result["samples"]["select"], 0) << "every flight that does not test is fitted";
  EXPECT_LT(result["select_rmse"].get<double>(), result["select_rmse_of_nothing"].get<double>());
  EXPECT_LT(result["test_rmse"].get<double>(), 0.7 * result["test_rmse_of_nothing"].get<double>());
  for (const Json& row : result["select"]) EXPECT_FALSE(row["worse_than_none"].get<bool>()) << row.dump();
  EXPECT_EQ(result["gamma_verdict"], "proved");
  EXPECT_EQ(execute("swarmcert check out/certificate.json out/network.toml").exit_code, 0);
  for (const char* const file : {"out/checkpoint.json", "out/checkpoint-2.json"})
    EXPECT_FALSE(std::filesystem::exists(folder_ / file)) << file;
  for (const std::string refused : {"--folds 1", "--folds 2 --teachers 2", "--folds 2 --gamma-mode equal",
                                    "--folds 2 --select flights/3"})
    EXPECT_EQ(execute(train(refused + " -o refused")).exit_code, 2) << refused;
}

TEST_F(Train, TeachersAreTheNetworksOfTheirSeedsAndTheSelectingFlightsDecide) {
  const auto learn = [&](const std::string& options) {
    const Outcome outcome =
        execute(train("--epochs 6 --batch 256 --rate 5e-3 --force --json result.json " + options));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return files::read_json(folder_ / "result.json", "swarmcert/train/1");
  };
  const Json taught = learn("--seed 4 --teachers 2 -o taught");
  ASSERT_EQ(taught["teachers"].size(), 2u);
  double least = taught["taught"]["select_rmse_gf"];
  int best_seed = taught["taught"]["seed"];
  EXPECT_EQ(best_seed, 4);
  for (const Json& teacher : taught["teachers"]) {
    const Json alone = learn(fmt::format("--seed {} -o alone", teacher["seed"].get<int>()));
    const auto epoch = alone["best_epoch"].get<std::size_t>() - 1;
    EXPECT_EQ(teacher["select_rmse_gf"], alone["epochs"][epoch]["select_rmse_gf"]);
    if (teacher["select_rmse_gf"] < least) {
      least = teacher["select_rmse_gf"];
      best_seed = teacher["seed"];
    }
  }
  EXPECT_EQ(taught["kept_seed"], best_seed);
  EXPECT_EQ(taught["epochs"][taught["best_epoch"].get<std::size_t>() - 1]["select_rmse_gf"], least);
  EXPECT_EQ(taught["gamma_verdict"], "proved");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "taught/checkpoint.json"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "taught/checkpoint-5.json"));
  const Json untaught = learn("--seed 4 -o untaught");
  EXPECT_NE(taught["taught"]["select_rmse_gf"],
            untaught["epochs"][untaught["best_epoch"].get<std::size_t>() - 1]["select_rmse_gf"])
      << "it was fitted to the record, not to its teachers";
}

TEST_F(Train, HoldsBackNamedFlightsOrBlocksAndRefusesAFlightForTwoUses) {
  const auto learn = [&](const std::string& words) {
    return execute("swarmcert train nominal.toml " + words +
                   " --phi 6 --rho 6 --features 4 --epochs 1 -o out --force --json result.json");
  };
  const auto samples = [&](const std::string& split) {
    const Json result = files::read_json(folder_ / "result.json", "swarmcert/train/1");
    EXPECT_EQ(result["split"], split);
    return std::array<int, 3>{result["samples"]["fit"].get<int>(), result["samples"]["select"].get<int>(),
                              result["samples"]["test"].get<int>()};
  };
  ASSERT_EQ(learn("flights/1 --select flights/2 --test flights/3").exit_code, 0);
  for (const int count : samples("flights")) EXPECT_GT(count, 4000);
  ASSERT_EQ(learn("flights/1 --split blocks").exit_code, 0);
  const auto [fit, select, test] = samples("blocks");
  EXPECT_GT(select, 500);
  EXPECT_GT(test, 500);
  EXPECT_GT(fit, 2 * select);
  EXPECT_LT(fit + select + test, 5200) << "the ends of blocks are cut";
  EXPECT_EQ(learn("flights/1 --select flights/2 --test flights/2").exit_code, 2);
}

/// Interrupted runs continue to the same files and JSON as an uninterrupted run; one Ctrl-C may be delivered twice.
TEST_F(Train, GoesOnWhereCtrlCStoppedIt) {
  const std::string options = "--epochs 150 --patience 150 --batch 64 --rate 2e-3 -q ";
  ASSERT_EQ(execute(train(options + "-o whole --json whole.json")).exit_code, 0);
  const Outcome cut = execute(train(options + "-o cut --json cut.json") +
                              " & run=$!; for i in $(seq 3000); do [ -e cut/checkpoint.json ] && break; "
                              "sleep 0.01; done; kill -INT $run; kill -INT $run; wait $run");
  ASSERT_EQ(cut.exit_code, 4) << cut.output;
  EXPECT_NE(cut.output.find("--resume goes on"), std::string::npos) << cut.output;
  Outcome outcome = execute(train("--epochs 150 --batch 64 --rate 2.0000001e-3 -q --resume -o cut"));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("other flights, options or seed"), std::string::npos) << outcome.output;
  outcome = execute(train(options + "--resume -o cut --json cut.json"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(execute("diff -r whole cut && cmp whole.json cut.json").exit_code, 0);

  outcome = execute(train(options + "--resume -o cut"));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("no interrupted run"), std::string::npos) << outcome.output;
  EXPECT_EQ(execute(train("--epochs 1 --resume -o begun")).exit_code, 0) << "killed before its first epoch";
}

TEST_F(Train, RefusesSizesAndRatesThatCannotBe) {
  for (const std::string word : {"--phi 0", "--rho 8,-1", "--phi 100000000"})
    EXPECT_EQ(execute("swarmcert train nominal.toml flights -o out " + word).exit_code, 2) << word;
  const Outcome outcome = execute(train("--epochs 2 --rate 1e10 -o out"));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("smaller rate"), std::string::npos) << outcome.output;
}

TEST_F(Train, RefusesAFolderThatIsNotEmptyAndFlightsWithoutNeighbours) {
  write_text(folder_ / "kept.txt", "");
  Outcome outcome = execute(train("--epochs 1 -o ."));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("--force"), std::string::npos) << outcome.output;
  ASSERT_EQ(execute("swarmcert simulate hover --vehicles 1 --model truth.toml --gains '" +
                    std::string(SWARMCERT_SOURCE_DIR) + "/controller/gains/crazyflie-small.toml' -o alone")
                .exit_code,
            0);
  outcome = execute("swarmcert train nominal.toml alone --epochs 1 -o out");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.output.find("neighbour"), std::string::npos) << outcome.output;
}

}  // namespace
}  // namespace swarmcert
