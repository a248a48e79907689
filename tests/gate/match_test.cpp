// The gate compares the whole export and the code in the ELF file, not only the weights.
#include "gate/release.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;

void replace_in(const std::string& path, const std::string& from, const std::string& to) {
  std::string text = read_text(path);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << path << " has no " << from;
  write_text(path, text.replace(at, from.size(), to));
}

/// The rows of [match] by name.
std::map<std::string, gate::Check> match_rows(const ReleaseFolder& release) {
  std::map<std::string, gate::Check> rows;
  for (const gate::Check& check : release.judge(release.policy_of({"match"})).checks)
    rows[check.name] = check;
  return rows;
}

struct Attack {
  std::string file, from, to;
};

const std::vector<Attack> kAttacks = {
    {"firmware/swarmcert_network.h", "kNewtonPerUnit = 0x1.41743ep-7f", "kNewtonPerUnit = 0x1.41743ep-6f"},
    {"firmware/swarmcert_network.cpp", "*force_N = rounded", "*force_N = -rounded"},
    {"firmware/nn/dense_layer.h", "const Scalar zero = unknown;", "const Scalar zero = unknown - 1;"},
};

TEST(GateMatch, FailsForAnyChangedFileOfTheExportWithFileAndLine) {
  const ReleaseFolder good;
  EXPECT_EQ(match_rows(good)["match"].verdict, gate::Verdict::kPass) << match_rows(good)["match"].reason;
  for (const Attack& attack : kAttacks) {
    const ReleaseFolder release(good);
    replace_in(release / attack.file, attack.from, attack.to);
    const gate::Check row = match_rows(release)["match"];
    EXPECT_EQ(row.verdict, gate::Verdict::kFail) << attack.file;
    EXPECT_NE(row.witness.find(attack.file + ", line "), std::string::npos) << row.witness;
  }
  const ReleaseFolder release(good);
  const std::string path = release / "firmware/swarmcert_network.cpp", text = read_text(path);
  std::string changed = text;
  const std::size_t digit = changed.find("p-", changed.find("swarmcert_rho_small_2 = {")) - 1;
  changed[digit] = changed[digit] == '2' ? '4' : '2';
  write_text(path, "#if 0\n" + text + "#endif\n" + changed);
  EXPECT_EQ(match_rows(release)["match"].verdict, gate::Verdict::kFail) << "the true text is inactive";
  write_text(path, text);
  fs::remove(release / "firmware/nn/mlp.h");
  EXPECT_EQ(match_rows(release)["match"].verdict, gate::Verdict::kFail) << "a header is missing";
  const ReleaseFolder more(good);
  write_text(more / "firmware/nn/cstdint", "");
  const gate::Check row = match_rows(more)["match"];
  EXPECT_EQ(row.verdict, gate::Verdict::kFail) << "a header is added";
  EXPECT_NE(row.witness.find("firmware/nn/cstdint"), std::string::npos) << row.witness;
}

TEST(GateMatch, FailsForAnElfBuiltFromAChangedExportAndIsOpenForOneThatCannotRun) {
  const ReleaseFolder good;
  if (!good.has_elf()) GTEST_SKIP() << "needs arm-none-eabi-g++ and qemu-system-arm";
  const gate::Check run = match_rows(good)["match.elf"];
  EXPECT_EQ(run.verdict, gate::Verdict::kPass) << run.reason;
  EXPECT_NE(run.witness.find("golden vectors"), std::string::npos) << run.witness;
  for (const Attack& attack : kAttacks) {
    const ReleaseFolder release(good);
    const std::string text = read_text(release / attack.file);
    replace_in(release / attack.file, attack.from, attack.to);
    release.build_elf();
    write_text(release / attack.file, text);
    std::map<std::string, gate::Check> rows = match_rows(release);
    EXPECT_EQ(rows["match"].verdict, gate::Verdict::kPass) << "the test did not restore the export";
    EXPECT_EQ(rows["match.elf"].verdict, gate::Verdict::kFail) << attack.file;
    EXPECT_NE(rows["match.elf"].witness.find("predict_force_z gives"), std::string::npos);
  }
  const ReleaseFolder release(good);
  ASSERT_EQ(release.run("arm-none-eabi-strip firmware/network.elf").exit_code, 0);
  const gate::GateResult result = release.judge(release.policy_of({"match"}));
  EXPECT_EQ(result.verdict(), gate::Verdict::kInconclusive) << told(result);
  EXPECT_EQ(exit_code(result, false), 1);
  EXPECT_NE(match_rows(release)["match.elf"].reason.find("not checked: "), std::string::npos);
}

}  // namespace
}  // namespace swarmcert::tests
