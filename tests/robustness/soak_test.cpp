#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "robustness/inputs.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

/// A command that reads `file`, which is replaced by a mutated copy.
struct Reader {
  const char* file;
  const char* command;
};

const char* const kGate = "gate policy.toml --baseline baseline.json --bundle out --force";

const Reader kReaders[] = {
    {"phi.safetensors", "inspect phi.safetensors"},
    {"phi.safetensors", "certify phi.safetensors --nodes 1 --gamma 3"},
    {"phi.safetensors", "check cert.json phi.safetensors"},
    {"phi.safetensors", "match network.toml firmware/swarmcert_network.cpp"},
    {"phi.safetensors", "export network.toml -o out --force"},
    {"rho.safetensors", "certify network.toml --nodes 0 --method product --neighbours 2"},
    {"network.toml", "certify network.toml --nodes 0 --method product"},
    {"network.toml",
     "simulate swap --vehicles 2 --duration 0.5 --model model.toml --gains gains.toml --network "
     "network.toml -o out --force"},
    {"box.toml", "certify phi.safetensors --nodes 0 --range-nodes 20 --domain box.toml"},
    {"box.toml", "certify phi.safetensors --method branch --nodes 3 --range-nodes 20 --domain box.toml"},
    {"cert.json", "check cert.json phi.safetensors"},
    {"cert.json", "inspect cert.json"},
    {"set.json", "export network.toml --certificate set.json -o out --force"},
    {"firmware/swarmcert_network.cpp", "match network.toml firmware/swarmcert_network.cpp"},
    {"gains.toml", "bound --gains gains.toml --model model.toml --amplitude 0.1 --rate 0.2"},
    {"gains.toml", "simulate hover --duration 0.5 --model model.toml --gains gains.toml -o out --force"},
    {"gains.toml", "iss-check --gains gains.toml --model model.toml --runs 5"},
    {"gains.toml", "tune --gains gains.toml --model model.toml --nodes 5"},
    {"model.toml", "bound --gains gains.toml --model model.toml --amplitude 0.1"},
    {"model.toml", "spacing --gains gains.toml --model model.toml --max-error 0.1 --steps 2"},
    {"model.toml", "simulate hover --duration 0.5 --model model.toml --gains gains.toml -o out --force"},
    {"model.toml", "compare model.toml flights/1"},
    {"model.toml", "add drag_linear --keep-anyway --model model.toml flights/1 -o out.toml --force"},
    {"grid.toml", "sweep grid.toml -o out --force"},
    {"flights/1/cf1_00", "inspect flights/1/cf1_00"},
    {"flights/1/cf1_00", "compare model.toml flights/1"},
    {"flights/1/cf1_00", "diagnose model.toml flights/1"},
    {"flights/1/cf1_00", "add drag_linear --model model.toml flights -o out.toml --force"},
    {"log.csv", "inspect log.csv"},
    {"bundle/statement.json", "verify-bundle bundle"},
    {"bundle/gate.json", "verify-bundle bundle"},
    {"bundle/files/set.json", "verify-bundle bundle"},
    {"bundle/files/policy.toml", "verify-bundle bundle"},
    {"thrust.csv", "identify-thrust thrust.csv"},
    // The following ones take seconds each.
    {"policy.toml", kGate},
    {"baseline.json", kGate},
    {"set.json", kGate},
    {"firmware/swarmcert_network.cpp", kGate},
    {"flights/1/cf1_00", kGate},
    {"swept/shard-0-of-2.json", "merge swept --force"},
    {"flights/1/cf1_00", "train model.toml flights --phi 4 --rho 4 --features 4 --epochs 1 -o out --force"},
};

constexpr std::size_t kReadersOfSeconds = 7;

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t limit) { return limit == 0 ? 0 : random() % limit; }

/// Returns a small mutation that a reader should detect or survive.
std::string mutated(std::string bytes, Random& random) {
  static const char* const kWords[] = {
      "0",  "-1",   "1e308", "-1e308", "nan",      "inf",      "99999999999999999999", "1e-308", "\"\"", "[]",
      "{}", "true", "'",     "\n",     "\xff\xfe", "0x1p-1074"};
  const int changes = 1 + static_cast<int>(below(random, 3));
  for (int i = 0; i < changes; ++i) {
    const std::size_t at = below(random, bytes.size() + 1);
    switch (below(random, 7)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(random());
        break;
      case 1:
        if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(random, 8)));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.erase(at, 1 + below(random, 40));
        break;
      case 4:
        bytes.insert(at, bytes.substr(below(random, bytes.size() + 1), 1 + below(random, 60)));
        break;
      default: {  // replaces a number
        const std::size_t begin = bytes.find_first_of("0123456789", at);
        if (begin == std::string::npos) break;
        const std::size_t end = std::min(bytes.find_first_not_of("0123456789.eE+-", begin), bytes.size());
        bytes.replace(begin, end - begin, kWords[below(random, std::size(kWords))]);
      }
    }
  }
  return bytes;
}

/// Cycles through the quick readers and, with `all`, through the slow ones too, one per round.
const Reader& reader_of(int input, bool all) {
  const std::size_t quick = std::size(kReaders) - kReadersOfSeconds;
  const std::size_t round_length = quick + (all ? 1 : 0);
  const std::size_t round = static_cast<std::size_t>(input) / round_length;
  const std::size_t place = static_cast<std::size_t>(input) % round_length;
  return kReaders[place < quick ? place : quick + round % kReadersOfSeconds];
}

/// Tries `inputs` mutated files on the quick readers or on `all` of kReaders. Each run must end within a minute of
/// processor time, with the exit code of a verdict or of an invalid file, and without a sanitizer report.
void soak(int inputs, bool all, std::uint64_t seed) {
  const ScratchFolder folder;
  make_inputs(folder.path(), true);
  std::string thrust = "pwm,vbat,thrust_gf\n";
  for (int i = 0; i < 40; ++i)
    thrust += fmt::format("{},{},{}\n", 10000 + 1200 * i, 4.2 - 0.01 * i, 2.0 + 1.3 * i);
  write_text(folder / "thrust.csv", thrust);
  const std::size_t readers = std::size(kReaders) - (all ? 0 : kReadersOfSeconds);
  for (std::size_t i = 0; i < readers; ++i) {
    const Outcome sound = run_shell(fmt::format("swarmcert {} -q", kReaders[i].command), folder.path());
    EXPECT_TRUE(sound.exit_code == 0 || sound.exit_code == 1 || sound.exit_code == 4)
        << kReaders[i].command << ": exit " << sound.exit_code << "\n"
        << sound.output;
  }
  const fs::path keep = fs::temp_directory_path() / "swarmcert-soak-findings";
  Random random(seed);
  std::map<int, int> codes;
  int findings = 0;
  for (int i = 0; i < inputs; ++i) {
    const Reader& reader = reader_of(i, all);
    const std::string sound = read_text(folder / reader.file);
    ASSERT_FALSE(sound.empty()) << reader.file;
    const std::string changed = mutated(sound, random);
    write_text(folder / reader.file, changed);
    const Outcome outcome =
        run_shell(fmt::format("ulimit -t 60; swarmcert {} -q --jobs 1", reader.command), folder.path());
    write_text(folder / reader.file, sound);
    ++codes[outcome.exit_code];
    // The command line is correct in all runs: exit code 2 would blame the user for the file.
    const bool is_sound = outcome.exit_code >= 0 && outcome.exit_code <= 4 && outcome.exit_code != 2 &&
                          outcome.output.find("Sanitizer") == std::string::npos &&
                          outcome.output.find("runtime error:") == std::string::npos;
    if (is_sound) continue;
    fs::create_directories(keep);
    const fs::path kept = keep / fmt::format("{}-{}-{}", seed, i, fs::path(reader.file).filename().string());
    write_text(kept.string(), changed);
    ++findings;
    ADD_FAILURE() << reader.command << "\nwith " << reader.file << " as in " << kept << ": exit "
                  << outcome.exit_code << "\n"
                  << outcome.output.substr(0, 3000);
  }
  std::string table;
  for (const auto& [code, count] : codes) table += fmt::format("  exit {}: {}", code, count);
  fmt::print("{} mutated inputs, {} ways to read them:{}; {} findings\n", inputs, readers, table, findings);
  EXPECT_GT(codes[3], inputs / 5) << "hardly anything was noticed";
  EXPECT_GT(codes[0], 0) << "nothing was harmless: the sound inputs are not";
}

TEST(Soak, MutatedInputsEndWithADocumentedExitCode) {
  const std::size_t quick = std::size(kReaders) - kReadersOfSeconds;
  soak(3 * static_cast<int>(quick), false, 1);
}

/// SWARMCERT_SOAK_INPUTS and SWARMCERT_SOAK_SEED set the number and the selection of the mutations.
TEST(Soak, MutatedInputsOfEveryCommand_slow) {
  const char* inputs = std::getenv("SWARMCERT_SOAK_INPUTS");
  const char* seed = std::getenv("SWARMCERT_SOAK_SEED");
  soak(inputs != nullptr ? std::atoi(inputs) : 3000, true,
       seed != nullptr ? std::strtoull(seed, nullptr, 10) : 2);
}

}  // namespace
}  // namespace swarmcert::tests
