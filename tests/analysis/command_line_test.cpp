#include <gtest/gtest.h>
#include <unistd.h>

#include <limits>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"
#include "nn/random_network.h"
#include "nn/weights/weights.h"

namespace swarmcert {
namespace {

using files::Json;
using tests::Outcome;
using tests::read_text;
using tests::write_text;

class CommandLine : public tests::CommandLineTest {
 protected:
  /// A 2-2-1 network f(x) = relu(3 x1) + relu(-3 x1 + x2). Its Lipschitz constant is sqrt(10), its product bound is
  /// larger.
  files::Weights small_network() {
    files::Weights weights;
    weights.layers = {{"fc1", 2, 2, {3, 0, -3, 1}, {0, 0}}, {"fc2", 1, 2, {1, 1}, {0}}};
    return weights;
  }

  std::string saved(const files::Weights& weights, const std::string& name) {
    files::save_safetensors(weights, folder_ / name, true);
    return name;
  }
};

TEST_F(CommandLine, HelpShowsEveryCommandAndEachHasAnExample) {
  expect("--help", 0, {"certify", "check", "inspect", "demo", "Exit codes"});
  for (const std::string command : {"certify", "check", "inspect", "demo"}) {
    expect(command + " --help", 0, {"Example: swarmcert " + command, "--json", "--force"});
  }
  expect("--version", 0, {"swarmcert"});
}

TEST_F(CommandLine, MisspeltCommandsAndOptionsAreUsageErrorsWithASuggestion) {
  expect("certfy x", 2, {"certfy", "did you mean", "certify"});
  expect("certify x --gama 3", 2, {"--gama", "did you mean", "--gamma"});
  expect("bound --gain g.toml --model m.toml", 2, {"--gain", "did you mean \"--gains\""});
  expect("--hepl", 2, {"--hepl", "did you mean \"--help\""});
  expect("certify x --max-lipschtz=3", 2, {"--max-lipschtz", "--max-lipschitz"});
  expect("", 2, {"name a command", "swarmcert --help"});
  expect("certify x --gamma minus", 2, {"--gamma", "minus"});
  expect("certify x --gamma -1", 2, {"--gamma", "-1"});
  expect("certify --phi a", 2, {"--rho"});
}

TEST_F(CommandLine, ExplainSaysWhatEffectsFieldsAndVerdictsAre) {
  expect("explain thrust_ratio", 0, {"thrust_ratio (effect)", "equation", "mass / payload / thrust scale"});
  expect("explain wind", 0, {"constant_force (effect)"});
  expect("explain may_stay", 0, {"may_stay (field)", "spacing: shape.may_stay"});
  expect("explain refuted", 0, {"iss-check: verdict"});
  expect("explain residual", 0, {"residual (word)", "The force that the model does not explain"});
  expect("explain vibration", 0, {"vibration (word)"});
  expect("explain downwahs", 2, {"did you mean \"downwash\""});
  expect("explain platform", 2, {"no such word", "add --list"});
}

TEST_F(CommandLine, AddListsTheEffectsAndGuessesWhatAnUnknownOneMeant) {
  expect("add --list", 0, {"downwash", "thrust_ratio", "pendulum"});
  expect("add", 2, {"EFFECT is missing"});
}

TEST_F(CommandLine, TwoOutputsIntoOneFileAreRefusedBeforeAnyWork) {
  expect("certify nowhere.pth -o one.json --json ./one.json", 2,
         {"--json and -o both write", "name two files"});
  expect("gate nowhere.toml --junit a.xml --sarif a.xml", 2, {"--junit and --sarif both write a.xml"});
}

TEST_F(CommandLine, AnOutputInAFolderThatDoesNotExistIsRefusedBeforeAnyWork) {
  // The inputs do not exist either, but are not read.
  expect("certify nowhere.pth -o typo/cert.json", 3, {"typo/cert.json", "folder that does not exist"});
  expect("add drag_linear --model nowhere.toml nowhere -o typo/fitted.toml", 3,
         {"folder that does not exist"});
}

TEST_F(CommandLine, CheckSaysThatTheCertificateStandsFirst) {
  expect("check network.toml cert.json", 2, {"network.toml", "the certificate comes first"});
}

TEST_F(CommandLine, InspectGoesOnAfterABadFileAndSaysSoInItsExitCode) {
  const std::string net = saved(small_network(), "net.safetensors");
  expect("certify " + net + " -o cert.json", 0, {"proved"});
  expect("inspect nowhere.toml cert.json " + net, 3,
         {"nowhere.toml: cannot be opened", "cert.json: certificate", "fc2"});
}

TEST_F(CommandLine, SignalsEndACertificationWithWhatIsProvedAndSaySo) {
  const std::string net = saved(small_network(), "net.safetensors");
  for (const std::string signal : {"INT", "TERM"}) {
    const std::string certify =
        "swarmcert certify " + net + " --nodes 1000000000 --force -o cert.json --json out.json";
    const Outcome outcome = tests::run_shell(
        "timeout -s " + signal + " 2 sh -c 'exec " + certify + " --max-lipschitz 2.5'; echo exit $?",
        folder_.path());
    // timeout reports 124; the exit code of the command itself is in its result.
    EXPECT_NE(outcome.output.find("interrupted: the search for steep slopes"), std::string::npos)
        << outcome.output;
    const Json result = Json::parse(read_text(folder_ / "out.json"));
    EXPECT_EQ(result["status"], "interrupted");
    EXPECT_EQ(result["bounds"][0]["status"], "interrupted");
    expect("check cert.json " + net, 0, {"accepted"});
  }
}

TEST_F(CommandLine, TimeLimitsTheSemidefiniteProgramAndLeavesTheLimitInconclusive) {
  std::mt19937 generator(1);
  const std::string net = saved(tests::random_network({6, 60, 60, 60, 1}, generator), "net.safetensors");
  expect("certify " + net + " --time 0.001 --nodes 1 --max-lipschitz 4 --json out.json -o cert.json", 4,
         {"eclipse_fast", "interrupted: the semidefinite program after", "verdict: inconclusive",
          "from interrupted searches"});
  const Json bound = Json::parse(read_text(folder_ / "out.json"))["bounds"][0];
  EXPECT_EQ(bound["status"], "interrupted");
  EXPECT_EQ(bound["upper_method"], "eclipse_fast");
  EXPECT_GT(bound["upper"].get<double>(), 4);
  expect("check cert.json " + net, 0, {"accepted"});
}

TEST_F(CommandLine, NoNetworkIsAUsageErrorThatSaysWhatToGive) {
  expect("certify", 2, {"--phi", "network.toml"});
}

TEST_F(CommandLine, BadInputNamesFileFieldValueAndMend) {
  expect("certify nowhere.pth", 3, {"nowhere.pth"});
  write_text(folder_ / "empty.pth", "");
  expect("certify empty.pth", 3, {"empty.pth", "empty"});
  write_text(folder_ / "noise.pth", "this is no weight file");
  expect("inspect noise.pth", 3, {"noise.pth"});
  // The writer rejects such weights as the reader does, so the file is made from a valid one.
  saved(small_network(), "nan.safetensors");
  std::string bytes = read_text(folder_ / "nan.safetensors");
  const float one = 1;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::size_t at = bytes.rfind(std::string(reinterpret_cast<const char*>(&one), 4));
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 4, reinterpret_cast<const char*>(&nan), 4);
  write_text(folder_ / "nan.safetensors", bytes);
  expect("certify nan.safetensors", 3, {"nan.safetensors", "fc2.weight", "nan"});
}

TEST_F(CommandLine, TyposInNetworkTomlNameTheLineAndTheKeyThatWasMeant) {
  saved(small_network(), "net.safetensors");
  write_text(folder_ / "network.toml",
             "schema = \"swarmcert/network/1\"\n\n[phi.small]\nwieghts = \"net.safetensors\"\n");
  expect("certify network.toml", 3, {"network.toml", "line 4", "wieghts", "weights"});
}

TEST_F(CommandLine, CertifyThenCheckAcceptsAndEveryLimitHasItsVerdict) {
  const std::string net = saved(small_network(), "net.safetensors");
  expect("certify " + net + " -o cert.json", 0, {"verdict: proved", "network", "sdp"});
  expect("check cert.json " + net, 0, {"accepted"});
  expect("certify " + net + " --max-lipschitz 20", 0, {"proved"});
  expect("certify " + net + " --max-lipschitz 2", 1, {"refuted"});
  expect("certify " + net + " --max-lipschitz 5 --method product --nodes 0", 4, {"inconclusive"});
  expect("certify " + net + " --gamma 5", 0, {"within gamma 5"});
  expect("certify " + net + " --gamma 2", 1, {"VIOLATES gamma 2"});
}

TEST_F(CommandLine, CheckRejectsAnotherNetworkAndADamagedCertificate) {
  const std::string net = saved(small_network(), "net.safetensors");
  ASSERT_EQ(run("certify " + net + " -o cert.json").exit_code, 0);
  files::Weights other = small_network();
  other.layers[0].weights[0] = 3.0000002384185791;  // one unit in the last place larger
  saved(other, "other.safetensors");
  expect("check cert.json other.safetensors", 1, {"rejected", "other.safetensors"});
  std::string text = read_text(folder_ / "cert.json");
  text.replace(text.find("\"upper_method\": \"sdp\""), 21, "\"upper_method\": \"xdp\"");
  write_text(folder_ / "damaged.json", text);
  expect("check damaged.json " + net, 1, {"rejected", "content_sha256"});
  write_text(folder_ / "half.json", text.substr(0, text.size() / 2));
  expect("check half.json " + net, 3, {"half.json", "line"});
  expect("check " + net + " " + net, 3, {net});
}

TEST_F(CommandLine, NothingIsReplacedWithoutForce) {
  const std::string net = saved(small_network(), "net.safetensors");
  write_text(folder_ / "cert.json", "precious");
  expect("certify " + net + " -o cert.json", 3, {"cert.json", "--force"});
  EXPECT_EQ(read_text(folder_ / "cert.json"), "precious");
  expect("certify " + net + " -o cert.json --force", 0, {"proved"});
  write_text(folder_ / "result.json", "precious");
  expect("certify " + net + " --json result.json", 3, {"result.json", "--force"});
  EXPECT_EQ(read_text(folder_ / "result.json"), "precious");
}

TEST_F(CommandLine, JsonHasTheAgreedFieldsAndTheSameBytesForAnyNumberOfJobs) {
  const std::string net = saved(small_network(), "net.safetensors");
  ASSERT_EQ(run("certify " + net + " --gamma 5 --json a.json -j 1 -q").exit_code, 0);
  ASSERT_EQ(run("certify " + net + " --gamma 5 --json b.json --jobs=3").exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "a.json"), read_text(folder_ / "b.json"));
  const Json result = Json::parse(read_text(folder_ / "a.json"));
  EXPECT_EQ(result["schema"], "swarmcert/certify/1");
  EXPECT_EQ(result["verdict"], "proved");
  EXPECT_EQ(result["inputs"][0]["sha256"].get<std::string>().size(), 64U);
  EXPECT_EQ(result["layers"][0]["network"], "network");
  EXPECT_EQ(result["layers"][0]["name"], "fc1");
  EXPECT_LE(result["layers"][0]["spectral_norm"][0], result["layers"][0]["spectral_norm"][1]);
  EXPECT_EQ(result["layers"][0]["respects_gamma"], true);
  const Json& bound = result["bounds"][0];
  for (const char* key : {"function", "domain", "block", "law", "norm", "unit", "upper", "upper_method",
                          "lower", "lower_witness"}) {
    EXPECT_TRUE(bound.contains(key)) << key;
  }
  EXPECT_GE(bound["upper"].get<double>(), std::sqrt(10.0));
  EXPECT_NEAR(bound["lower"].get<double>(), std::sqrt(10.0), 1e-6);
}

TEST_F(CommandLine, BlocksScaleBoxRangeAndExplanationOfAPlainNetwork) {
  const std::string net = saved(small_network(), "net.safetensors");
  write_text(folder_ / "box.toml", "schema = \"swarmcert/box/1\"\nlower = [-1, -1]\nupper = [1, 2]\n");
  expect("certify " + net + " --blocks --scale 1,2 --domain box.toml --explain -o cert.json --json out.json",
         0, {"network x0", "network scaled", "has the largest slack", "Range over the box", "Float32"});
  expect("check cert.json " + net, 0, {"accepted", "4 upper bounds"});
  const Json result = Json::parse(read_text(folder_ / "out.json"));
  ASSERT_EQ(result["bounds"].size(), 4U);
  EXPECT_EQ(result["bounds"][1]["block"], "x0");
  EXPECT_EQ(result["bounds"][1]["domain"], "box");
  EXPECT_NEAR(result["bounds"][2]["upper"].get<double>(), 1,
              1e-6);  // df/dx1 of relu(3 x0) + relu(-3 x0 + x1)
  EXPECT_EQ(result["bounds"][3]["norm"], "weighted_l2");
  EXPECT_EQ(result["inputs"].size(), 2U);
  ASSERT_EQ(result["range"].size(), 1U);
  EXPECT_NEAR(result["range"][0]["upper"].get<double>(), 5, 0.01);  // at (-1, 2)
  EXPECT_EQ(result["range"][0]["upper_witness"]["value"], 5);
  EXPECT_LE(result["range"][0]["lower"].get<double>(), 0);
  EXPECT_LT(result["float32_error"][0]["bound"].get<double>(), 1e-5);
  EXPECT_TRUE(result["bounds"][0]["comparison"].contains("combettes_pesquet_upper"));
}

TEST_F(CommandLine, OptionsThatAskForWhatTheNetworkHasNotAreUsageErrors) {
  const std::string net = saved(small_network(), "net.safetensors");
  expect("certify " + net + " --blocks=position", 2, {"position"});
  expect("certify " + net + " --scale 1,2,3", 2, {"3 inputs"});
  expect("certify " + net + " --neighbours many", 2, {"--neighbours many", "small=1"});
  expect("certify " + net + " --neighbours 2", 2, {"plain network"});
  expect("certify " + net + " --cuts 5", 2, {"--method branch"});
  const std::string set = tests::source_path("nn/networks/demo/network.toml");
  expect("certify " + set + " --neighbours a=1", 2, {"\"a\""});
  expect("certify " + net + " --range", 2, {"--domain"});
  expect("certify " + net + " --as float16", 2, {"--as"});
  write_text(folder_ / "box.toml", "schema = \"swarmcert/box/1\"\nlower = [-1]\nupper = [1, 2]\n");
  expect("certify " + net + " --domain box.toml", 3, {"box.toml", "line 2", "2 inputs"});
}

TEST_F(CommandLine, BranchAndBoundWithoutABoxHoldsForAllInputs) {
  const std::string net = saved(small_network(), "net.safetensors");
  ASSERT_EQ(run("certify " + net + " --method branch --nodes 300 -o cert.json --json out.json").exit_code, 0);
  const Json bound = Json::parse(read_text(folder_ / "out.json"))["bounds"][0];
  EXPECT_EQ(bound["domain"], "global");
  EXPECT_GE(bound["upper"].get<double>(), bound["lower"].get<double>());
  expect("check cert.json " + net, 0, {"accepted"});
}

TEST_F(CommandLine, LawsOfTheShippedNetwork) {
  const std::string net = tests::source_path("nn/networks/demo/network.toml");
  ASSERT_EQ(run("certify " + net + " --neighbours small=3 --nodes 0 -o cert.json --json out.json").exit_code,
            0);
  const Json result = Json::parse(read_text(folder_ / "out.json"));
  double one = 0;
  int laws = 0;
  for (const Json& bound : result["bounds"]) {
    if (bound["law"] == "one_neighbour") one = bound["upper"];
    if (bound["upper_method"] != "law") continue;
    const double factor = bound["law"] == "all_stacked" ? std::sqrt(3.0) : 3;
    EXPECT_NEAR(bound["upper"].get<double>(), factor * one, 1e-9 * one) << bound["law"];
    ++laws;
  }
  EXPECT_EQ(laws, 3);
  expect("check cert.json " + net, 0, {"accepted"});
}

TEST_F(CommandLine, JsonOnStandardOutputSilencesTheText) {
  const std::string net = saved(small_network(), "net.safetensors");
  const Outcome outcome = run("certify " + net + " --json -");
  EXPECT_TRUE(Json::accept(outcome.output)) << outcome.output;
}

TEST_F(CommandLine, ReportIsOneFileThatNeedsNothingElse) {
  const std::string net = saved(small_network(), "net.safetensors");
  expect("certify " + net + " --report report", 0, {"report/report.html"});
  const std::string html = read_text(folder_ / "report/report.html");
  EXPECT_NE(html.find("<img src=\"data:image/svg+xml;base64,"), std::string::npos) << "gnuplot drew nothing";
  for (std::size_t at = html.find("src="); at != std::string::npos; at = html.find("src=", at + 1))
    EXPECT_EQ(html.compare(at, 10, "src=\"data:"), 0) << "refers to another file";
  EXPECT_TRUE(std::filesystem::exists(folder_ / "report/bounds.dat"));
  expect("certify " + net + " --report report", 3, {"report", "--force"});
}

TEST_F(CommandLine, InspectDescribesNetworksAndCertificates) {
  const std::string net = saved(small_network(), "net.safetensors");
  expect("inspect " + net, 0, {"float32", "fc1", "2 -> 2", "sha256"});
  ASSERT_EQ(run("certify " + net + " -o cert.json").exit_code, 0);
  expect("inspect cert.json " + net, 0, {"certificate", "upper"});
}

TEST_F(CommandLine, PublishedFloat32NetworksExceedGammaThreeInTwoLayers) {
  SWARMCERT_NEEDS_DATA();
  const std::string weights = tests::data_path("weights/zip_f32/");
  int exceeded = 0;
  for (const std::string kind : {"L", "S"}) {
    const Outcome outcome =
        run("certify --phi " + weights + "phi_" + kind + ".pth --rho " + weights + "rho_" + kind +
            ".pth --gamma 3 --nodes 0 --method product --json out.json --force");
    EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
    const Json result = Json::parse(read_text(folder_ / "out.json"));
    for (const Json& layer : result["layers"]) exceeded += layer["respects_gamma"] == false ? 1 : 0;
  }
  EXPECT_EQ(exceeded, 2);
}

}  // namespace
}  // namespace swarmcert
