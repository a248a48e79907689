/// Vehicles of any size and number of rotors; logs with a common clock; damaged logs; the page of inspect.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>

#include "analysis/residuals/inputs.h"
#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"
#include "nn/base/rotor_speed.h"
#include "stability/model.h"

namespace swarmcert::tests {
namespace {

constexpr double kHexMass_kg = 2.2, kHover = 0.5;

/// Six rotors with a quadratic thrust map, each giving a sixth of the weight at kHover.
std::string hexacopter() {
  const double coefficient_N = kHexMass_kg * 9.81 / 6 / (kHover * kHover);
  std::string rotors;
  for (int k = 0; k < 6; ++k) {
    const double angle = 3.14159265358979 / 3 * k;
    rotors += fmt::format("  {{ position_m = [{:.6f}, {:.6f}, 0.0], spin = \"{}\" }},\n",
                          0.3 * std::cos(angle), 0.3 * std::sin(angle), k % 2 == 0 ? "ccw" : "cw");
  }
  return fmt::format(
      "schema = \"swarmcert/model/1\"\n[vehicle]\nkind = \"hexacopter\"\nmass_kg = {}\n"
      "inertia_kg_m2 = [0.04, 0.04, 0.07]\ntorque_per_thrust_m = 0.016\nbattery_range_V = [12, 17]\n"
      "rotors = [\n{}]\n[vehicle.thrust_curve]\nforce_N = [0, 0, {:.9f}]\n",
      kHexMass_kg, rotors, coefficient_N);
}

/// On the ground for 2 s, up by 1.2 m within 2 s, then a hover that rises and falls slightly; 20 s at 100 Hz. The
/// commands are those that this motion needs. `front` is the command of rotor 1 over that of the others.
std::string hexacopter_csv(double front, double start_s = 0, double x_m = 0) {
  constexpr double kPi = 3.14159265358979, kSlow_1_s = 0.3;
  std::string text = "t,px,py,pz,vx,vy,vz,qx,qy,qz,qw,battery";
  for (int k = 1; k <= 6; ++k) text += fmt::format(",motor_command_{}", k);
  text += "\n";
  const double rear = std::sqrt(2 - front * front);  // rotor 4 compensates for rotor 1
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.01 * k, rising = std::min(std::max(t - 2, 0.0), 2.0), hovering = std::max(t - 4, 0.0);
    const double z =
        8.8 + 0.6 * (1 - std::cos(kPi / 2 * rising)) + 0.05 * (1 - std::cos(kSlow_1_s * hovering));
    const bool rises = rising > 0 && rising < 2;
    const double v = (rises ? 0.3 * kPi * std::sin(kPi / 2 * rising) : 0) +
                     0.05 * kSlow_1_s * std::sin(kSlow_1_s * hovering);
    const double a = (rises ? 0.15 * kPi * kPi * std::cos(kPi / 2 * rising) : 0) +
                     (hovering > 0 ? 0.05 * kSlow_1_s * kSlow_1_s * std::cos(kSlow_1_s * hovering) : 0);
    text += fmt::format("{:.3f},{:.4f},0,{:.5f},0,0,{:.5f},0,0,0,1,15.2", start_s + t, x_m, z, v);
    for (int motor = 0; motor < 6; ++motor) {
      const double u = kHover * std::sqrt(1 + a / 9.81) * (motor == 0 ? front : motor == 3 ? rear : 1);
      text += fmt::format(",{:.6f}", t > 2 ? u : 0.0);
    }
    text += "\n";
  }
  return text;
}

files::Json json_of(const ScratchFolder& folder, const std::string& command, const std::string& schema,
                    int exit_code = 0) {
  const Outcome outcome = run_shell("swarmcert " + command + " -q --force --json r.json", folder.path());
  EXPECT_EQ(outcome.exit_code, exit_code) << command << "\n" << outcome.output;
  return files::read_json(folder / "r.json", "swarmcert/" + schema + "/1");
}

TEST(AnyVehicle, AHexacoptersForceAndTorqueFollowFromItsRotorsAndTheirCommands) {
  const ScratchFolder folder;
  write_text(folder / "hexa.toml", hexacopter());
  write_text(folder / "even.csv", hexacopter_csv(1));
  write_text(folder / "nose_heavy.csv", hexacopter_csv(1.1));
  for (const char* log : {"even.csv", "nose_heavy.csv"}) {
    const files::Json json = json_of(folder, std::string("compare hexa.toml ") + log, "compare");
    EXPECT_EQ(json["unit"], "N");
    EXPECT_GT(json["overall"]["samples"].get<int>(), 1000);
    EXPECT_LT(json["overall"]["rmse"]["z"].get<double>(), 0.1) << "newton, of a weight of 21.6 N";
    EXPECT_EQ(json["flights"][0]["judged"]["torque"], files::Json({"x", "y", "z"}));
    // Rotor 1 is in front, rotor 4 behind: with u1 = 1.1 rotor 1 gives 1.21 and rotor 4 gives 0.79 of a sixth of the
    // weight. The residual is the torque that balances them.
    const double each_N = kHexMass_kg * 9.81 / 6, more = std::string(log) == "even.csv" ? 0 : 0.21;
    const files::Json& mean = json["flights"][0]["torque"]["slow_flight"]["mean"];
    EXPECT_NEAR(mean["x"].get<double>(), 0, 1e-6);
    EXPECT_NEAR(mean["y"].get<double>(), 0.3 * 2 * more * each_N, 0.01);
    // Rotor 1 turns counter-clockwise, so its reaction torque is clockwise; for rotor 4 it is the opposite.
    EXPECT_NEAR(mean["z"].get<double>(), 0.016 * 2 * more * each_N, 0.0005);
  }
}

TEST(AnyVehicle, TextIsInNewtonForHeavyVehiclesAndInMetrePerSecondSquaredWithoutAMass) {
  const ScratchFolder folder;
  write_text(folder / "hexa.toml", hexacopter());
  write_text(folder / "one.csv", hexacopter_csv(1));
  for (const char* model : {"hexa.toml", ""}) {
    const Outcome outcome = run_shell(fmt::format("swarmcert compare {} one.csv -q", model), folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_EQ(outcome.output.find("gf"), std::string::npos) << outcome.output;
    const std::string unit = *model == 0 ? "[m/s^2]" : "[N]";
    EXPECT_NE(outcome.output.find(unit), std::string::npos) << outcome.output;
  }
  const files::Json json = json_of(folder, "compare one.csv", "compare");
  EXPECT_TRUE(json["mean_square_z_gf2"].is_null()) << "no mass, no force";
  for (const files::Json& region : json["regions"])
    EXPECT_NE(region["words"].get<std::string>().find("m/s^2"), std::string::npos) << region["words"];
  EXPECT_NE(json["torque"]["refused"].get<std::string>().find("no model"), std::string::npos);
}

TEST(AnyVehicle, ALogOfFourMotorsIsNotJudgedByAModelOfSix) {
  const ScratchFolder folder;
  write_text(folder / "hexa.toml", hexacopter());
  std::string text = "t,px,py,pz,vx,vy,vz,qx,qy,qz,qw,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 800; ++k)
    text += fmt::format("{:.2f},0,0,1,0,0,0,0,0,0,1,0.6,0.6,0.6,0.6,3.8\n", 0.01 * k);
  write_text(folder / "quad.csv", text);
  const Outcome outcome = run_shell("swarmcert compare hexa.toml quad.csv -q", folder.path());
  EXPECT_EQ(outcome.exit_code, 4) << outcome.output;
  EXPECT_NE(outcome.output.find("6 rotors"), std::string::npos) << outcome.output;
}

TEST(ModelDraft, TakesRotorsFromTheParametersOfAPx4Log) {
  SWARMCERT_NEEDS_DATA();
  const ScratchFolder folder;
  const std::string log =
      std::filesystem::absolute(data_path("collections/px4/sample_px4_events.ulg")).string();
  const files::Json json = json_of(folder, "model draft " + log + " --mass 1.5 -o m.toml", "model");
  const stability::Model model = stability::read_model(folder / "m.toml");
  ASSERT_EQ(model.num_rotors(), 4u);
  // CA_ROTOR0: front right, CA_ROTOR1: back left, both counter-clockwise.
  EXPECT_GT(model.rotors[0].x_m, 0);
  EXPECT_LT(model.rotors[0].y_m, 0);
  EXPECT_TRUE(model.rotors[0].counterclockwise);
  EXPECT_LT(model.rotors[1].x_m, 0);
  EXPECT_GT(model.rotors[1].y_m, 0);
  EXPECT_TRUE(model.rotors[1].counterclockwise);
  EXPECT_FALSE(model.rotors[2].counterclockwise);
  ASSERT_TRUE(model.thrust_curve_N.has_value());
  // The weight at a mean command of 0.47 .. 0.51, with a linear map.
  EXPECT_NEAR(model.thrust.force_N(0.489, 16), 1.5 * 9.81 / 4, 0.05 * 1.5 * 9.81 / 4);
  bool from_parameters = false;
  for (const files::Json& parameter : json["parameters"]) {
    EXPECT_FALSE(parameter["source"].get<std::string>().empty());
    from_parameters =
        from_parameters || parameter["source"].get<std::string>().find("CA_ROTOR") != std::string::npos;
  }
  EXPECT_TRUE(from_parameters);
  const files::Json compared = json_of(folder, "compare m.toml " + log, "compare");
  EXPECT_EQ(compared["unit"], "N");
  // Independent scripts find a residual of 0.13 m/s^2; these seconds are a part of the flight.
  EXPECT_LT(compared["overall"]["rmse"]["total"].get<double>(), 1.5 * 0.13);
}

TEST(ModelDraft, OfAnyNumberOfMotorsIsAModel) {
  const ScratchFolder folder;
  write_text(folder / "one.csv", hexacopter_csv(1));
  for (const char* mass : {"0.02", "2.2", "20"}) {
    json_of(folder, std::string("model draft one.csv --mass ") + mass + " -o m.toml", "model");
    const stability::Model model = stability::read_model(folder / "m.toml");
    EXPECT_EQ(model.num_rotors(), 6u);
    const files::Json json = json_of(folder, "compare m.toml one.csv", "compare");
    EXPECT_LT(json["overall"]["nrmse"]["z"].get<double>(), 0.02) << mass << ": of the weight";
  }
}

constexpr double kLinearShare = 0.6, kSquareShare = 1.6;  // of the weight that a rotor carries

/// A log of 40 s at 100 Hz of a vehicle that moves up and down, with the speeds of its four rotors.
std::string bouncing_log(double phase) {
  std::string text = "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz,m1_rads,m2_rads,m3_rads,m4_rads,ax,ay,az\n";
  constexpr double kRate_1_s = 2.5, kRise_m = 0.4;
  for (int i = 0; i < 4000; ++i) {
    const double t = 0.01 * i, at = kRate_1_s * t + phase, slow = 0.3 * std::sin(0.31 * t);
    const double z = 1.5 + kRise_m * std::sin(at) + slow;
    const double v = kRise_m * kRate_1_s * std::cos(at) + 0.093 * std::cos(0.31 * t);
    const double a = -kRise_m * kRate_1_s * kRate_1_s * std::sin(at) - 0.02883 * std::sin(0.31 * t);
    const double load = 1 + a / 9.81;
    const double speed = kFullRotorSpeed_rad_s *
                         (std::sqrt(kLinearShare * kLinearShare + 4 * kSquareShare * load) - kLinearShare) /
                         (2 * kSquareShare);
    text += fmt::format("{:.2f},0,0,{:.6f},0,0,0,1,0,0,{:.6f},0,0,0", t, z, v);
    for (int k = 0; k < 4; ++k) text += fmt::format(",{:.3f}", speed);
    text += fmt::format(",0,0,{:.5f}\n", load * 9.81);
  }
  return text;
}

TEST(ModelDraft, HasTheForceAsAPolynomialOfTheRotorSpeed) {
  const ScratchFolder folder;
  write_text(folder / "one.csv", bouncing_log(0));
  write_text(folder / "two.csv", bouncing_log(1));
  const Outcome outcome =
      run_shell("swarmcert model draft one.csv two.csv --mass 0.045 -o m.toml -q", folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const stability::Model model = stability::read_model(folder / "m.toml");
  ASSERT_TRUE(model.thrust_curve_N.has_value());
  const double each_N = model.weight_N() / 4;
  EXPECT_NEAR((*model.thrust_curve_N)[1] / each_N, kLinearShare, 0.05 * kLinearShare);
  EXPECT_NEAR((*model.thrust_curve_N)[2] / each_N, kSquareShare, 0.05 * kSquareShare);
}

TEST(Clocks, OffsetsOfLogsWithAbsoluteTimesAreTheDifferencesOfTheirClocks) {
  const ScratchFolder folder;
  write_text(folder / "left.csv", hexacopter_csv(1, 1772419726));
  write_text(folder / "right.csv", hexacopter_csv(1, 1772419729.5, 2));
  residuals::InputArguments arguments;
  arguments.flights = {folder.path().string()};
  arguments.may_lack_model = true;
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  ASSERT_EQ(inputs.found.flights.size(), 1u);
  std::vector<std::string> problems;
  const std::vector<residuals::Track> tracks = inputs.load(0, problems);
  ASSERT_EQ(tracks.size(), 2u);
  EXPECT_TRUE(tracks[1].has_absolute_clock);
  // The right log began 3.5 s after the left one, so its first record is at 3.5 s on the left log's clock, which
  // starts at 0.
  EXPECT_NEAR(tracks[1].instants.front().time_s - tracks[0].instants.front().time_s, 3.5, 1e-6);
  const files::Json json = json_of(folder, "compare .", "compare");
  EXPECT_EQ(json["clocks"]["absolute"], 1);
  EXPECT_EQ(json["flights"][1]["clock"], "absolute");
}

TEST(SeveralVehicles, OneFileIsTheFlightThatFilesOfTheirOwnAre) {
  const ScratchFolder folder;
  write_text(folder / "m.toml", hexacopter());
  std::filesystem::create_directory(folder.path() / "own");
  std::string all;
  for (int v = 1; v <= 2; ++v) {
    const std::string own = hexacopter_csv(1, 0, 0.7 * v);
    write_text(folder / ("own/cf" + std::to_string(v) + "_00.csv"), own);
    std::istringstream lines(own);
    bool is_header = true;
    for (std::string line; std::getline(lines, line); is_header = false) {
      if (!is_header || v == 1) all += (is_header ? "cf," : std::to_string(v) + ",") + line + "\n";
    }
  }
  std::filesystem::create_directory(folder.path() / "one");
  write_text(folder / "one/run.csv", all);
  files::Json own = json_of(folder, "compare m.toml own", "compare"),
              one = json_of(folder, "compare m.toml one", "compare");
  EXPECT_EQ(one["overall"], own["overall"]);
  EXPECT_EQ(one["compositions"], own["compositions"]) << "each vehicle is the neighbour of the other";
  EXPECT_EQ(one["clocks"]["absolute"], 1) << "one file has one clock";
  EXPECT_EQ(one["inputs"].size() + 1, own["inputs"].size()) << "the file counts once";
  const files::Json seen = json_of(folder, "inspect one/run.csv", "inspect");
  ASSERT_EQ(seen["flights"].size(), 1u);
  EXPECT_EQ(seen["flights"][0]["logs"][1]["file"], "one/run.csv#cf2");
}

TEST(SeveralVehicles, ACopyOfALogIsNotASecondVehicle) {
  const ScratchFolder folder;
  write_text(folder / "m.toml", hexacopter());
  std::filesystem::create_directory(folder.path() / "flights");
  write_text(folder / "flights/cf1_00.csv", hexacopter_csv(1));
  const files::Json alone = json_of(folder, "compare m.toml flights", "compare");
  write_text(folder / "flights/cf01_00.csv", hexacopter_csv(1));
  const files::Json json = json_of(folder, "compare m.toml flights", "compare");
  EXPECT_EQ(json["overall"], alone["overall"]) << "counted twice, each at the place of the other";
  ASSERT_EQ(json["left_out"].size(), 1u);
  EXPECT_NE(json["left_out"][0].get<std::string>().find("has the bytes of"), std::string::npos);
  write_text(folder / "flights/cf1_00.csv", hexacopter_csv(1) + "\n");
  const files::Json again = json_of(folder, "compare m.toml flights", "compare");
  EXPECT_EQ(again["overall"], alone["overall"]) << "the same records in another file";
  ASSERT_EQ(again["problems"].size(), 1u);
  EXPECT_NE(again["problems"][0].get<std::string>().find("a copy of"), std::string::npos);
}

TEST(Keep, DamagedLogsAreLeftOutOfFitsAndNamedUnlessTheyAreKept) {
  const ScratchFolder folder;
  write_text(folder / "sound.csv", hexacopter_csv(1));
  std::string damaged = hexacopter_csv(1);
  damaged.replace(damaged.size() / 2, 40, 40, '#');
  write_text(folder / "damaged.csv", damaged);
  const auto draft = [&](const std::string& words) {
    return json_of(folder, "model draft sound.csv damaged.csv --mass 2 -o m.toml" + words, "model");
  };
  const files::Json without = draft(""), with = draft(" --keep");
  EXPECT_EQ(without["flights"], 1);
  ASSERT_EQ(without["problems"].size(), 1u);
  EXPECT_NE(without["problems"][0].get<std::string>().find("damaged"), std::string::npos);
  EXPECT_EQ(with["flights"], 2);
  EXPECT_TRUE(with["problems"].empty());
  for (const bool keep : {false, true}) {
    residuals::InputArguments arguments;
    arguments.flights = {folder / "damaged.csv"};
    arguments.may_lack_model = true;
    arguments.rules.fits = true;
    arguments.rules.keep = keep;
    std::vector<std::string> problems;
    const auto tracks = residuals::read_inputs(arguments).load(0, problems);
    ASSERT_EQ(tracks.size(), 1u);
    EXPECT_EQ(tracks[0].position_only, !keep);
    EXPECT_EQ(problems.size(), keep ? 0u : 1u);
  }
  // compare judges but does not fit, so it accepts the damaged log.
  EXPECT_GT(json_of(folder, "compare damaged.csv", "compare")["overall"]["samples"].get<int>(), 1000);
}

TEST(Keep, ImplausibleLogsAreJudgedWhereTheyAreKept) {
  const ScratchFolder folder;
  std::string text =
      "t,stateEstimate.x,stateEstimate.y,stateEstimate.z,stateEstimate.vx,stateEstimate.vy,stateEstimate.vz,"
      "qx,qy,qz,qw,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 1500; ++k)  // the position moves 30 times as far as the velocity implies
    text += fmt::format("{:.2f},{:.5f},0,1,{:.6f},0,0,0,0,0,1,0.6,0.6,0.6,0.6,3.8\n", 0.01 * k,
                        0.9 * std::sin(0.01 * k), 0.03 * std::cos(0.01 * k));
  write_text(folder / "log.csv", text);
  const std::string model = source_path("stability/models/crazyflie-small.toml");
  const Outcome refused = run_shell("swarmcert compare " + model + " log.csv -q", folder.path());
  const Outcome kept = run_shell("swarmcert compare " + model + " log.csv -q --keep", folder.path());
  EXPECT_EQ(kept.exit_code, 0) << kept.output;
  EXPECT_NE(refused.exit_code, 0) << refused.output;
}

TEST(Inspect, AFolderEndsInATableOfWhatCanBeJudged) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder.path() / "all/monday");
  std::filesystem::create_directories(folder.path() / "all/tuesday");
  write_text(folder / "all/monday/a.csv", hexacopter_csv(1));
  write_text(folder / "all/monday/b.csv", hexacopter_csv(1) + "\n");
  std::string ground = "t,px,py,pz,vx,vy,vz,m1,m2,m3,m4,vbat\n";
  for (int k = 0; k < 500; ++k) ground += fmt::format("{:.2f},0.1,0,0.05,0,0,0,0,0,0,0,4.1\n", 0.01 * k);
  write_text(folder / "all/tuesday/ground.csv", ground);
  const files::Json json = json_of(folder, "inspect all", "inspect");
  ASSERT_EQ(json["collections"].size(), 3u) << json["collections"].dump();
  EXPECT_EQ(json["collections"][0]["name"], "monday");
  EXPECT_EQ(json["collections"][0]["logs"], 2);
  EXPECT_EQ(json["collections"][0]["force"]["x"], 2);
  EXPECT_EQ(json["collections"][1]["opened"], 1);
  EXPECT_EQ(json["collections"][1]["force"]["z"], 0);
  EXPECT_EQ(json["collections"][1]["left_out"][0]["why"], "no flight: stands on the ground");
  EXPECT_EQ(json["collections"][2]["name"], "all");
  EXPECT_EQ(json["collections"][2]["logs"], 3);
  EXPECT_NEAR(json["collections"][2]["seconds"].get<double>(), 36, 1);
  const Outcome table = run_shell("swarmcert inspect all", folder.path());
  for (const char* words : {"flight [s]", "run [s]", "flight: seconds in the air; run: seconds that reading"})
    EXPECT_NE(table.output.find(words), std::string::npos) << table.output;
  const files::Json compared = json_of(folder, "compare all", "compare");
  EXPECT_EQ(compared["collections"][2]["force"]["z"], 2);
  EXPECT_EQ(compared["collections"][1]["left_out"][0]["why"], "no usable record");
}

TEST(Inspect, ReportIsAPageOnPhasesEventsSignalsAndWhatToLog) {
  const ScratchFolder folder;
  write_text(folder / "one.csv", hexacopter_csv(1));
  const Outcome outcome = run_shell("swarmcert inspect one.csv --report page -q", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::string page = read_text(folder / "page/report.html");
  for (const char* words : {"takeoff", "Can be judged: force x y z", "log next time", "specific_force",
                            "in the air", "6 motor commands", "rate [Hz]"})
    EXPECT_NE(page.find(words), std::string::npos) << words;
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "page/log_1.dat"));
  EXPECT_EQ(run_shell("swarmcert inspect one.csv --report page -q", folder.path()).exit_code, 3)
      << "the page is not replaced without --force";
}

TEST(Inspect, SuggestsAModelDraftOnlyForALogInWhichTheVehicleFlew) {
  const ScratchFolder folder;
  const std::string flight = hexacopter_csv(1);
  write_text(folder / "flight.csv", flight);
  write_text(folder / "ground.csv", flight.substr(0, flight.find("\n2.000,") + 1));
  const Outcome flew = run_shell("swarmcert inspect flight.csv", folder.path());
  EXPECT_NE(flew.output.find("model draft flight.csv"), std::string::npos) << flew.output;
  const Outcome stood = run_shell("swarmcert inspect ground.csv", folder.path());
  EXPECT_NE(stood.output.find("no flight: stands on the ground"), std::string::npos) << stood.output;
  EXPECT_EQ(stood.output.find("model draft"), std::string::npos) << stood.output;
}

TEST(Inspect, ReportOnAFolderNamesItOnceAndLogsWithinIt) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder.path() / "some/flights");
  for (const char* name : {"some/flights/one.csv", "some/flights/two.csv"})
    write_text(folder / name, hexacopter_csv(1));
  const Outcome outcome = run_shell("swarmcert inspect some/flights --report page -q", folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::string page = read_text(folder / "page/report.html");
  EXPECT_NE(page.find("Logs in some/flights/"), std::string::npos);
  EXPECT_NE(page.find("<h2>one.csv</h2>"), std::string::npos);
  EXPECT_NE(page.find(">two.csv</td>"), std::string::npos);
  EXPECT_NE(page.find(">flights</td>"), std::string::npos);
}

}  // namespace
}  // namespace swarmcert::tests
