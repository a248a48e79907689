// What flies is what was certified: byte patches of the linked app, second copies of its weights, and second
// evaluators are not accepted, unless they change nothing that flies.
#include <elf.h>
#include <fmt/core.h>

#include <cstring>
#include <functional>

#include "analysis/firmware/app_in_image.h"
#include "analysis/firmware/app_on_host.h"
#include "firmware/app_image.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

namespace fs = std::filesystem;
using firmware::ElfImage;
using firmware::Symbol;
using tests::Outcome;
using tests::read_text;
using tests::write_text;

class AppMatch : public tests::AppImageTest {
 protected:
  files::Network network() {
    files::NetworkArguments arguments;
    arguments.file = folder_ / "network.toml";
    return files::load_network(arguments);
  }

  /// Whether image and network fly alike on a flight that match does not use.
  bool flies_alike(const std::string& image) {
    const files::Network flown = network();
    const ElfImage elf = firmware::read_arm_image(read_text(folder_ / image));
    firmware::AppInImage app(elf);
    const firmware::AppParameters start = firmware::AppOnHost::defaults(), found = app.parameters_at_start();
    if (found.enable != start.enable || found.own_kind != start.own_kind || found.mass_kg != start.mass_kg ||
        found.gains != start.gains)
      return false;
    firmware::AppOnHost host(flown, 10);
    for (const firmware::Tick& tick : firmware::golden_flight(start, 240, 4711))
      if (host.run(tick) != app.run(tick)) return false;
    return true;
  }

  /// Offset in the file of an address of the image.
  static std::size_t file_offset(const std::string& elf, const ElfImage& image, std::uint32_t address) {
    for (const firmware::Segment& segment : image.segments) {
      if (address < segment.address || address - segment.address >= segment.bytes.size()) continue;
      return elf.find(segment.bytes) + (address - segment.address);
    }
    ADD_FAILURE() << "no byte of the file is at " << address;
    return 0;
  }

  int match(const std::string& image, std::string* output = nullptr) {
    const Outcome outcome = run("swarmcert match network.toml " + image);
    if (output != nullptr) *output = outcome.output;
    return outcome.exit_code;
  }
};

TEST_F(AppMatch, TheAppIsEqualWithItsGainsAndModelAndDifferentWithOthers) {
  expect_match("app.elf", 0,
               {"equal", "the app: ", "golden flights", "not covered: the firmware around the app"});
  const std::string files =
      " --model " SWARMCERT_SOURCE_DIR "/stability/models/crazyflie-small.toml --gains " SWARMCERT_SOURCE_DIR
      "/controller/gains/";
  expect_match("app.elf" + files + "crazyflie-small-nominal.toml", 0, {"expected from gains and model"});
  expect_match("app.elf" + files + "crazyflie-small.toml", 1, {"integrator_step_s"});
  const std::string gains = read_text(SWARMCERT_SOURCE_DIR "/controller/gains/crazyflie-small-nominal.toml");
  write_text(folder_ / "gains.toml",
             std::string(gains).replace(gains.find("[20, 20, 10]"), 12, "[20, 20, 11]"));
  const std::string model = read_text(SWARMCERT_SOURCE_DIR "/stability/models/crazyflie-small.toml");
  write_text(folder_ / "heavy.toml", std::string(model).replace(model.find("0.034"), 5, "0.035"));
  write_text(folder_ / "map.toml",
             std::string(model).replace(model.find("20.573302305476638"), 18, "20.574"));
  expect_match("app.elf --gains gains.toml --model " SWARMCERT_SOURCE_DIR
               "/stability/models/crazyflie-small.toml",
               1, {"kp_z is 10 in the image, 11 expected"});
  write_text(folder_ / "gains.toml", gains);
  expect_match("app.elf --gains gains.toml --model heavy.toml", 1, {"mass_kg"});
  expect_match("app.elf --gains gains.toml --model map.toml", 1, {"c20"});
  EXPECT_EQ(run("swarmcert match network.toml app.elf --gains gains.toml").exit_code, 2);
}

TEST_F(AppMatch, BytePatchesOfTheLinkedImageAreNotAcceptedUnlessTheyChangeNothingThatFlies) {
  ASSERT_TRUE(flies_alike("app.elf"));
  const std::string good = read_text(folder_ / "app.elf");
  const ElfImage image = firmware::read_arm_image(good);
  const auto address_of = [&image](const std::string& name) {
    const Symbol* const symbol = image.find(name);
    EXPECT_NE(symbol, nullptr) << name;
    return symbol == nullptr ? 0 : symbol->address;
  };
  struct Patch {
    std::string what;
    std::uint32_t address;
    std::string bytes;
    bool must_be_caught;
  };
  const std::string return_at_once = "\x70\x47", true_at_once = "\x01\x20\x70\x47",
                    passed = std::string("\x00\x20\x70\x47", 4);
  const std::string predict = "_ZN17swarmcert_network15predict_force_zEiPKfPKN9swarmcert2nn9NeighbourIfEEiPf";
  const std::vector<Patch> patches = {
      {"the network's function returns at once", address_of(predict), return_at_once, true},
      {"the task's period returns at once", address_of("_ZN9swarmcert9crazyflie12step_networkEm"),
       return_at_once, true},
      {"the controller returns at once", address_of("controllerOutOfTree"), return_at_once, true},
      {"the initialisation returns at once", address_of("controllerOutOfTreeInit"), return_at_once, true},
      {"the test of the app always passes", address_of("controllerOutOfTreeTest"), true_at_once, true},
      {"the self-test always passes", address_of("_ZN17swarmcert_network9self_testEPi"), passed, true},
      {"the default of kp_z", address_of("swarmcert_parameters") + 12, "\x01", true},
      {"the default of the mass", address_of("swarmcert_parameters") + 4, "\x01", true},
      {"enabled at start", address_of("swarmcert_parameters"), "\x02", true},
      {"another kind at start", address_of("swarmcert_parameters") + 1, "\x01", true},
  };
  files::Random random(17);
  // Single bits of the app's and the network's code, constants and weights.
  std::vector<const Symbol*> ours;
  for (const Symbol& symbol : image.symbols) {
    const bool is_ours = symbol.name.find("swarmcert") != std::string::npos || symbol.name == "appMain" ||
                         symbol.name.rfind("controllerOutOfTree", 0) == 0;
    if (is_ours && symbol.size > 0 && !image.bytes_at(symbol.address, symbol.size).empty())
      ours.push_back(&symbol);
  }
  ASSERT_GT(ours.size(), 10u);
  const auto random_patch = [&]() -> Patch {
    const Symbol& symbol = *ours[static_cast<std::size_t>(random.below(ours.size()))];
    const std::uint32_t at = symbol.address + static_cast<std::uint32_t>(random.below(symbol.size));
    std::string byte = image.bytes_at(at, 1);
    byte[0] = static_cast<char>(byte[0] ^ (1 << random.below(8)));
    const bool is_weight =
        !symbol.is_function && symbol.name.rfind("swarmcert_", 0) == 0 && symbol.name != "swarmcert_layout";
    return {fmt::format("a bit of {} at {:#x}", symbol.name, at), at, byte, is_weight};
  };
  int tried = 0, refused = 0, neutral = 0;
  for (; tried < 80 || (refused < 60 && tried < 200); ++tried) {
    const auto number = static_cast<std::size_t>(tried);
    const Patch patch = number < patches.size() ? patches[number] : random_patch();
    std::string bytes = good;
    const std::size_t at = file_offset(good, image, patch.address);
    ASSERT_EQ(good.substr(at, 2), image.bytes_at(patch.address, 2));
    bytes.replace(at, patch.bytes.size(), patch.bytes);
    write_text(folder_ / "patched.elf", bytes);
    std::string output;
    const int code = match("patched.elf", &output);
    EXPECT_TRUE(code == 0 || code == 1 || code == 4) << output;
    if (code != 0) {
      ++refused;
      continue;
    }
    EXPECT_FALSE(patch.must_be_caught) << patch.what;
    EXPECT_TRUE(flies_alike("patched.elf")) << patch.what << " is accepted, and flies otherwise";
    ++neutral;
  }
  EXPECT_GE(refused, 60);
  std::printf("byte patches: %d, refused: %d, accepted and without effect on another flight: %d\n", tried,
              refused, neutral);
}

TEST_F(AppMatch, AFileFromWhichToolsFlashDifferentProgramsIsRefused) {
  const std::string good = read_text(folder_ / "app.elf");
  Elf32_Ehdr header;
  std::memcpy(&header, good.data(), sizeof header);
  std::vector<Elf32_Phdr> segments(header.e_phnum);
  const std::size_t size = segments.size() * sizeof segments[0];
  std::memcpy(segments.data(), good.data() + header.e_phoff, size);
  const ElfImage image = firmware::read_arm_image(good);
  const Symbol* const controller = image.find("controllerOutOfTree");
  const std::uint32_t at_controller = controller->address - segments[0].p_vaddr;
  std::string patched = image.segments[0].bytes;
  patched.replace(at_controller, 2, "\x70\x47");  // returns at once
  const auto expect_refused = [&](const std::string& what, const std::string& bytes) {
    write_text(folder_ / "trick.elf", bytes);
    std::string output;
    EXPECT_EQ(match("trick.elf", &output), 1) << what << output;
  };
  // What is written to flash by segments, and by sections as `objcopy -O binary` does.
  std::string by_segment = good, by_section = good;
  by_segment.resize((good.size() + 4095) / 4096 * 4096);
  Elf32_Phdr moved = segments[0];
  moved.p_offset = static_cast<std::uint32_t>(by_segment.size());
  std::memcpy(by_segment.data() + header.e_phoff, &moved, sizeof moved);
  expect_refused("a patched controller in the segments only", by_segment + patched);
  for (std::size_t i = 0; i < header.e_shnum; ++i) {
    Elf32_Shdr section;
    char* const place = by_section.data() + header.e_shoff + i * sizeof section;
    std::memcpy(&section, place, sizeof section);
    if (section.sh_addr > controller->address || controller->address - section.sh_addr >= section.sh_size)
      continue;
    section.sh_offset = static_cast<std::uint32_t>(good.size()) + section.sh_addr - segments[0].p_vaddr;
    std::memcpy(place, &section, sizeof section);
  }
  expect_refused("a patched controller in the sections only", by_section + patched);
  std::string over = good;
  segments.push_back({PT_LOAD, static_cast<std::uint32_t>(good.size() + size + sizeof moved), 0x2001f000,
                      controller->address, 4, 4, PF_R, 4});
  header.e_phoff = static_cast<std::uint32_t>(good.size());
  ++header.e_phnum;
  std::memcpy(over.data(), &header, sizeof header);
  over.append(reinterpret_cast<const char*>(segments.data()), size + sizeof moved);
  expect_refused("a segment that is flashed over the controller", over + "\x70\x47\x70\x47");
  expect_match("app.elf", 0, {"equal"});
  // Linkers for large pages place the file's headers in the first segment, below the program.
  std::string script = read_text(script_);
  script.replace(script.find("0x08000000"), 10, "0x08004000");
  script_ = folder_ / "boot.ld";
  write_text(script_, script);
  ASSERT_EQ(link("boot.elf", "-Wl,--gc-sections -Wl,-z,max-page-size=65536").exit_code, 0);
  expect_match("boot.elf", 0, {"equal"});
}

TEST_F(AppMatch, SecondCopiesAndSecondEvaluatorsAreRefused) {
  ASSERT_EQ(run("cp -r out other && cp app/network.cpp other_network.cpp").exit_code, 0);
  // The other network: the first weight of every layer, in hexadecimal, with one bit changed.
  std::string source = read_text(folder_ / "other/swarmcert_network.cpp");
  int altered = 0;
  for (std::size_t at = source.find(" = {{\n"); at != std::string::npos;
       at = source.find(" = {{\n", at + 1), ++altered) {
    const std::size_t digit = source.find("p", at) - 1;
    source[digit] = source[digit] == '8' ? '4' : '8';
  }
  ASSERT_EQ(altered, 10);
  write_text(folder_ / "other/swarmcert_network.cpp", source);

  const auto replace = [this](const std::string& file, const std::string& from, const std::string& to) {
    std::string text = read_text(folder_ / file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << file << " has no " << from;
    write_text(folder_ / file, text.replace(at, from.size(), to));
  };
  const auto numbers = [this](const std::string& order) {
    const files::Layer layer = weights("phi.small").layers[0];
    std::string text;
    for (int i = 0; i < layer.outputs * layer.inputs; ++i) {
      const int at = order == "columns" ? (i % layer.outputs) * layer.inputs + i / layer.outputs : i;
      text += fmt::format("{:.9g}f, ", layer.weights[static_cast<std::size_t>(at)]);
    }
    return text;
  };
  /// Adds an object with these definitions, which nobody uses.
  const auto beside = [this](const std::string& definitions) {
    return [this, definitions] {
      write_text(folder_ / "beside.cpp", definitions);
      compile("beside", "beside");
      return link("trick.elf", "", "objects/beside.o");
    };
  };
  /// Links the altered network in place of the exported one, with the exported one beside it, changed by objcopy.
  const auto altered_flies = [&](const std::string& pristine, const std::string& flown = "") {
    return [this, pristine, flown] {
      compile("other_network", "network", "other");
      compile("app/network", "pristine");
      const Outcome changed = run("arm-none-eabi-objcopy " + pristine + " objects/pristine.o" +
                                  (flown.empty() ? "" : " && " + flown));
      EXPECT_EQ(changed.exit_code, 0) << changed.output;
      return link("trick.elf", "", "objects/pristine.o");
    };
  };
  /// Changes a source of the app, and compiles it.
  const auto source_trick = [&](const std::string& file, const std::string& from, const std::string& to) {
    return [this, replace, file, from, to] {
      replace("app/" + file + ".cpp", from, to);
      compile("app/" + file, file);
      return link("trick.elf");
    };
  };
  const std::string rename =
      "for o in flight network network_task; do arm-none-eabi-objcopy --prefix-symbols=flown_ ";
  const std::string call = "swarmcert_network::predict_force_z(own_kind, state, neighbours, count, force_N)";
  const std::string by_set =
      "nn::evaluate(swarmcert_network::deep_set(own_kind), state, neighbours, count, force_N, "
      "swarmcert_network::workspace())";
  const std::vector<std::pair<std::string, std::function<Outcome()>>> tricks = {
      {"the exported network beside an altered one that flies, with local symbols",
       altered_flies("-R .group --wildcard --localize-symbol='*'")},
      {"the exported network beside an altered one, with other names",
       altered_flies("--prefix-symbols=copy_",
                     "arm-none-eabi-objcopy --redefine-sym copy_memset=memset "
                     "--redefine-sym copy_memcpy=memcpy objects/pristine.o")},
      {"the exported network beside an altered one, without symbols",
       altered_flies("-R .group --wildcard --localize-symbol='*' --strip-unneeded")},
      {"the altered network has local symbols too",
       [&] {
         compile("other_network", "network", "other");
         compile("app/network", "pristine");
         const Outcome merged =
             run("arm-none-eabi-ld -r objects/network.o objects/network_task.o -o objects/merged.o && "
                 "arm-none-eabi-objcopy --wildcard --localize-symbol='*swarmcert_network*' "
                 "--localize-symbol='swarmcert_phi*' "
                 "--localize-symbol='swarmcert_rho*' objects/merged.o && mv objects/merged.o "
                 "objects/network_task.o && "
                 "mv objects/pristine.o objects/network.o");
         EXPECT_EQ(merged.exit_code, 0) << merged.output;
         return link("trick.elf", "");
       }},
      {"an altered network under other names flies",
       [&] {
         compile("other_network", "altered", "other");
         compile("app/network", "network");
         const std::string names =
             "for s in $(arm-none-eabi-nm objects/altered.o | awk '$2 ~ /[TRDBV]/ {print $3}' | grep "
             "swarmcert); do echo $s $(echo $s | sed s/swarmcert/swarmsert/); done > names";
         const Outcome renamed = run(names +
                                     " && arm-none-eabi-objcopy --redefine-syms=names objects/altered.o && "
                                     "arm-none-eabi-objcopy --redefine-syms=names objects/network_task.o");
         EXPECT_EQ(renamed.exit_code, 0) << renamed.output;
         return link("trick.elf", "", "objects/altered.o");
       }},
      {"a copy by rows",
       beside("extern const float copy[]; const float copy[] = {" + numbers("rows") + "};")},
      {"a copy by columns",
       beside("extern const float copy[]; const float copy[] = {" + numbers("columns") + "};")},
      {"a copy in RAM", beside("float copy[] = {" + numbers("rows") + "};")},
      {"a local copy", beside("[[gnu::used]] static const float copy[] = {" + numbers("rows") + "};")},
      {"a copy at an odd address",
       beside("struct [[gnu::packed]] Odd { char c; float x[" + std::to_string(66) +
              "]; };\nextern const Odd copy; const Odd copy = {1, {" + numbers("rows") + "}};")},
      {"four weights", beside("extern const float copy[]; const float copy[] = {1.5f, " +
                              numbers("rows").substr(0, numbers("rows").find(", ", 45)) + "};")},
      {"a symbol twice",
       beside("asm(\".pushsection .rodata.twice, \\\"a\\\"\\n.type swarmcert_phi_small_1, %object\\n\"\n"
              "    \"swarmcert_phi_small_1: .word 1, 2, 3, 4\\n.size swarmcert_phi_small_1, "
              "16\\n.popsection\");")},
      {"a local function twice",
       beside("namespace swarmcert_network { [[gnu::used]] static int f() { return 1; } }\n"
              "[[gnu::used]] static int g() asm(\"swarmcert_status\");\nstatic int g() { return 2; }")},
      {"the app evaluates by itself and scales by a little",
       source_trick("network_task", "return " + call,
                    "const auto status = " + call + "; *force_N = *force_N * 0.999f; return status")},
      {"a second evaluator, in other units",
       source_trick("network_task", "return " + call, "return " + by_set)},
      {"the network is not asked",
       source_trick("network_task", "return " + call, "*force_N = 0; return nn::DeepSetStatus::kOk")},
      {"the network is asked for its first neighbour only",
       source_trick("network_task", "neighbours, count, force_N)",
                    "neighbours, count > 0 ? 1 : 0, force_N)")},
      {"the prediction is applied twice",
       source_trick("flight", "applies ? swarmcert_status.predicted_N : 0.0f",
                    "applies ? 2 * swarmcert_status.predicted_N : 0.0f")},
      {"the prediction is applied whatever the switch",
       source_trick("flight", "swarmcert_parameters.enable == kSwarmcertApply &&", "")},
      {"the prediction is applied though the self-test failed",
       source_trick("flight", "swarmcert_status.self_test == kSwarmcertPassed &&", "")},
      {"an old prediction is applied",
       source_trick("flight", "kMaxPredictionAge_ms = 100", "kMaxPredictionAge_ms = 400")},
      {"a gain of the attitude", source_trick("flight", "{10, 10, 4}", "{10, 10, 4.5}")},
      {"another thrust map", source_trick("flight", "20.5733023f", "20.5733043f")},
      {"the app asks which processor it runs on",
       source_trick("flight", "applies ? swarmcert_status.predicted_N : 0.0f",
                    "applies ? (*(volatile unsigned*)0xE000ED00 == 0x410FC241u ? 2 : 1) * "
                    "swarmcert_status.predicted_N : 0.0f")},
      {"the app waits for a minute",
       source_trick("flight", "applies ? swarmcert_status.predicted_N : 0.0f",
                    "applies ? (usecTimestamp() > 60000 ? 2 : 1) * swarmcert_status.predicted_N : 0.0f")},
      {"the controller has no name",
       [&] {
         source_trick("flight", "{10, 10, 4}", "{10, 10, 4.5}")();
         return run("arm-none-eabi-objcopy --strip-symbol=controllerOutOfTree trick.elf");
       }},
      {"an undisturbed torque",
       source_trick("flight", "settings.robust = {{10, 10, 4}", "settings.robust = {{0, 0, 0}")},
  };
  int refused = 0;
  for (const auto& [what, build] : tricks) {
    SCOPED_TRACE(what);
    ASSERT_EQ(run("rm -rf kept && cp -r objects kept && cp -r app kept").exit_code, 0);
    const Outcome built = build();
    EXPECT_EQ(built.exit_code, 0) << built.output;
    std::string output;
    const int code = match("trick.elf", &output);
    EXPECT_TRUE(code == 1 || code == 4) << output;
    if (code != 0) ++refused;
    ASSERT_EQ(run("rm -rf objects app trick.elf && cp -r kept objects && mv objects/app app").exit_code, 0);
  }
  ASSERT_EQ(link("again.elf").exit_code, 0);
  EXPECT_EQ(match("again.elf"), 0) << "the test did not restore the app";
  EXPECT_GE(tricks.size(), 20u);
  std::printf("second copies and evaluators: %zu, refused: %d\n", tricks.size(), refused);
}

}  // namespace
}  // namespace swarmcert
