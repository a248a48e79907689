// A bundle is accepted as written, in any place. With a key, nothing else is; without one, nothing that its evidence
// does not give again.
#include "analysis/gate/bundle.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "analysis/gate/documents.h"
#include "gate/release.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/base/random.h"

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;
using files::Json;

/// Runs verify_bundle() and returns the reason for rejection.
std::string rejection(const std::string& folder, const std::string& key = "") {
  const gate::BundleVerdict verdict = gate::verify_bundle(folder, key, {1, "", false, {}});
  return verdict.accepted ? "" : verdict.reason;
}

std::vector<std::string> files_of(const std::string& folder) {
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder).string());
  std::sort(files.begin(), files.end());
  return files;
}

Json document(const std::string& folder, const std::string& name) {
  return files::parse_json(read_text(folder + "/" + name), name);
}

/// Writes statement and bill of materials anew for the present files, as whoever knows the tool can. Only a key or the
/// evidence shows that they were replaced.
void forge_documents(const std::string& folder) {
  std::vector<gate::BundledFile> files;
  Json bill = document(folder, "bom.cdx.json");
  for (const Json& component : bill["components"]) {
    if (component["type"] == "machine-learning-model") continue;
    const auto path = component["name"].get<std::string>();
    files.push_back(
        {path, component["properties"][0]["value"], files::sha256(read_text(folder + "/" + path))});
  }
  const Json rows = document(folder, "gate.json")["checks"];
  files::NetworkArguments arguments;
  arguments.file = folder + "/files/network/network.toml";
  try {
    const files::Network network = files::load_network(arguments);
    bill = gate::bill_of_materials(&network, files, rows);
  } catch (const std::exception&) {  // the forger's network is damaged: only the hashes are renewed
  }
  write_text(folder + "/bom.cdx.json", files::to_text(bill));
  for (const std::string name : {"gate.json", "bom.cdx.json"})
    files.push_back({name, "", files::sha256(read_text(folder + "/" + name))});
  write_text(folder + "/statement.json", files::to_text(gate::statement_of(files, rows)));
}

/// A bundle of a release that passes, with the keys of its maker and of somebody else beside it.
class Bundled {
 public:
  explicit Bundled(const ReleaseFolder& release) : release_(release) {
    const Outcome keys = release.run(
        "for k in mine other; do openssl genpkey -algorithm ed25519 -out $k.pem && openssl pkey -in $k.pem "
        "-pubout "
        "-out $k.pub; done");
    EXPECT_EQ(keys.exit_code, 0) << keys.output;
    const Outcome written = release.run("swarmcert gate policy.toml -q --bundle bundle --key mine.pem");
    EXPECT_EQ(written.exit_code, 0) << written.output;
  }
  std::string path() const { return release_ / "bundle"; }
  std::string key() const { return release_ / "mine.pub"; }
  std::string other_key() const { return release_ / "other.pub"; }
  std::string operator/(const std::string& name) const { return path() + "/" + name; }

  /// Runs `tamper` on a copy, and returns why it is rejected without a key after the documents were written anew.
  std::string forged(const std::function<void(const std::string& folder)>& tamper,
                     bool with_key = false) const {
    const TempFolder folder;
    fs::copy(path(), folder / "b", fs::copy_options::recursive);
    tamper(folder / "b");
    forge_documents(folder / "b");
    return rejection(folder / "b", with_key ? key() : "");
  }

 private:
  const ReleaseFolder& release_;
};

void edit(const std::string& path, const std::string& from, const std::string& to) {
  std::string text = read_text(path);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << path << " has no " << from;
  write_text(path, text.replace(at, from.size(), to));
}

TEST(GateBundle, IsAcceptedAsWrittenAndRejectedWithAnyFileChangedMissingAddedOrSwapped) {
  const ReleaseFolder release;
  release.policy({{"regression", ""}});
  const Bundled written(release);
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --bundle bundle").exit_code, 3)
      << "nothing is overwritten";
  // In another place, without the release: the bundle is self-contained.
  const TempFolder elsewhere;
  const std::string bundle = elsewhere / "bundle", key = elsewhere / "key.pub";
  fs::rename(release / "bundle", bundle);
  fs::rename(written.key(), key);
  for (const fs::directory_entry& entry : fs::directory_iterator(release.path()))
    fs::remove_all(entry.path());
  ASSERT_EQ(rejection(bundle), "");
  ASSERT_EQ(rejection(bundle, key), "");
  const std::string verify = "swarmcert verify-bundle bundle -q --force --json v.json ";
  EXPECT_EQ(run_shell(verify + "--key key.pub", elsewhere.path()).exit_code, 0);
  EXPECT_EQ(document(elsewhere.path(), "v.json")["not_verified"].size(), 0u);
  EXPECT_EQ(run_shell(verify, elsewhere.path()).exit_code, 0);
  EXPECT_EQ(document(elsewhere.path(), "v.json")["not_verified"].size(), 2u) << "who made it, and its words";
  const std::string sha256 = files::sha256(read_text(bundle + "/statement.json"));
  EXPECT_EQ(run_shell(verify + "--sha256 " + sha256, elsewhere.path()).exit_code, 0);
  EXPECT_EQ(run_shell(verify + "--sha256 12", elsewhere.path()).exit_code, 1);
  EXPECT_EQ(run_shell(verify + "--key absent.pub", elsewhere.path()).exit_code, 3);
  EXPECT_EQ(run_shell(verify + "--key bundle/gate.json", elsewhere.path()).exit_code, 3) << "no key";

  const std::vector<std::string> files = files_of(bundle);
  files::Random random(9);
  int injected = 0, caught = 0;
  const auto expect_rejected = [&](const std::string& what) {
    ++injected;
    const std::string reason = rejection(bundle, key);
    EXPECT_FALSE(reason.empty()) << what;
    if (!reason.empty()) ++caught;
  };
  for (std::size_t k = 0; k < files.size(); ++k) {
    const std::string path = bundle + "/" + files[k], good = read_text(path);
    for (int i = 0; i < 8; ++i) {
      std::string damaged = good;
      damaged[static_cast<std::size_t>(random.bits() % good.size())] ^=
          static_cast<char>(1 << (random.bits() % 8));
      write_text(path, damaged);
      expect_rejected(files[k] + ", one bit");
    }
    write_text(path, good + " ");
    expect_rejected(files[k] + ", longer");
    write_text(path, good.substr(0, good.size() - 1));
    expect_rejected(files[k] + ", shorter");
    fs::remove(path);
    expect_rejected(files[k] + ", missing");
    fs::create_symlink("/dev/null", path);
    expect_rejected(files[k] + ", a link");
    fs::remove(path);
    const std::string next = bundle + "/" + files[(k + 1) % files.size()], of_next = read_text(next);
    write_text(path, of_next);
    write_text(next, good);
    expect_rejected(files[k] + ", swapped");
    write_text(path, good);
    write_text(next, of_next);
    write_text(path + ".extra", "more");
    expect_rejected(files[k] + ", a file beside it");
    fs::remove(path + ".extra");
  }
  const std::string envelope = read_text(bundle + "/statement.dsse.json");
  for (std::size_t at = 0; at < envelope.size(); at += envelope.size() / 200) {
    std::string damaged = envelope;
    damaged[at] = damaged[at] == 'A' ? 'B' : 'A';
    write_text(bundle + "/statement.dsse.json", damaged);
    expect_rejected("byte " + std::to_string(at) + " of the envelope");
  }
  write_text(bundle + "/statement.dsse.json", envelope);
  fs::create_directory(bundle + "/empty");
  expect_rejected("an empty folder");
  fs::remove(bundle + "/empty");
  ASSERT_EQ(rejection(bundle, key), "") << "the test did not restore the bundle";
  EXPECT_GE(injected, 100);
  std::printf("files of a bundle: %zu; faults injected: %d, caught with the key: %d\n", files.size(),
              injected, caught);
}

TEST(GateBundle, EveryRowIsDerivedAgainFromTheEvidenceSoThatRehashedDocumentsHideNothing) {
  const ReleaseFolder release;
  release.policy({{"regression", ""}});
  const Bundled bundle(release);
  ASSERT_EQ(bundle.forged([](const std::string&) {}), "") << "the forger's documents are those of the tool";
  ASSERT_EQ(bundle.forged([](const std::string&) {}, true), "");
  const ReleaseFolder other(release);
  change_tensor(other / "network/rho.safetensors", "fc2", 0.9);
  other.certify_again();
  const auto with_rows = [](const std::function<void(Json&)>& change) {
    return [change](const std::string& folder) {
      Json result = document(folder, "gate.json");
      change(result);
      write_text(folder + "/gate.json", files::to_text(result));
    };
  };
  const auto with_file = [&other](const std::string& file) {
    return [&other, file](const std::string& folder) {
      write_text(folder + "/files/" + file, read_text(other / file));
    };
  };
  const auto with_text = [](const std::string& file, const std::string& from, const std::string& to) {
    return [=](const std::string& folder) { edit(folder + "/files/" + file, from, to); };
  };
  std::map<std::string, std::function<void(const std::string&)>> tamperings = {
      {"gains that are not those of gate.json", with_text("gains.toml", "[position]", "# tuned\n[position]")},
      {"a weakened limit", with_text("policy.toml", "max_jump_gf = 400", "max_jump_gf = 900")},
      {"a dropped check", with_text("policy.toml", "[small_gain]\nmin_margin = 0.05", "")},
      {"a weakened condition", with_text("policy.toml", "amplitude_N = 0.02", "amplitude_N = 0.01")},
      {"another certificate", with_file("cert.json")},
      {"other weights", with_file("network/rho.safetensors")},
      {"other source", with_file("firmware/swarmcert_network.cpp")},
      {"other flights",
       [](const std::string& folder) {
         std::vector<std::string> logs;
         for (const std::string& file : files_of(folder + "/files/flights")) logs.push_back(file);
         write_text(folder + "/files/flights/" + logs[0], read_text(folder + "/files/flights/" + logs[1]));
       }},
      {"all rows removed", with_rows([](Json& r) { r["checks"] = Json::array(); })},
      {"a row removed", with_rows([](Json& r) { r["checks"].erase(r["checks"].begin()); })},
      {"a row twice", with_rows([](Json& r) { r["checks"].push_back(r["checks"][0]); })},
      {"a failed verdict", with_rows([](Json& r) { r["verdict"] = "fail"; })},
      {"another input's hash", with_rows([](Json& r) { r["inputs"][1]["sha256"] = files::sha256("x"); })},
      {"an input left out", with_rows([](Json& r) { r["inputs"].erase(r["inputs"].begin()); })},
      {"a remark added", with_rows([](Json& r) { r["remark"] = "approved for 10 m/s"; })},
      {"a reason", with_rows([](Json& r) { r["checks"][0]["reason"] = "approved"; })},
      {"a change invented", with_rows([](Json& r) {
         r["changes"].push_back({{"condition", "x"}, {"before", 1}, {"now", 2}, {"claim", "stronger"}});
       })},
      {"a check said not to be asked for", with_rows([](Json& r) { r["not_run"].push_back("lipschitz"); })},
  };
  if (release.has_elf()) tamperings["another ELF"] = with_file("firmware/network.elf");
  const Json rows = document(bundle.path(), "gate.json")["checks"];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = rows[i]["name"];
    if (rows[i]["value"].is_number())
      tamperings["value of " + name] = with_rows(
          [i](Json& r) { r["checks"][i]["value"] = 0.99 * r["checks"][i]["value"].get<double>() + 1e-3; });
    if (rows[i]["limit"].is_number())
      tamperings["limit of " + name] = with_rows(
          [i](Json& r) { r["checks"][i]["limit"] = 0.5 * r["checks"][i]["limit"].get<double>() + 1e-3; });
    tamperings["name of " + name] = with_rows([i](Json& r) { r["checks"][i]["name"] = "x"; });
    tamperings["unit of " + name] = with_rows([i](Json& r) { r["checks"][i]["unit"] = "km"; });
    tamperings["verdict of " + name] =
        with_rows([i](Json& r) { r["checks"][i]["verdict"] = "inconclusive"; });
  }
  int caught = 0, caught_with_key = 0;
  for (const auto& [what, tamper] : tamperings) {
    // The evidence is the same for all changes of gate.json, so that a sample of them suffices without a key.
    const std::string reason = bundle.forged(tamper);
    EXPECT_NE(reason, "") << what;
    EXPECT_EQ(reason.find("is not the file of the statement"), std::string::npos)
        << what << " was not forged well: " << reason;
    if (!reason.empty()) ++caught;
    if (!bundle.forged(tamper, true).empty()) ++caught_with_key;
  }
  EXPECT_EQ(caught_with_key, static_cast<int>(tamperings.size()));
  std::printf("rehashed tamperings: %zu, rejected without a key: %d, with: %d\n", tamperings.size(), caught,
              caught_with_key);
}

TEST(GateBundle, OnlyTheKeysOwnSignatureOfThisStatementCountsAndOpensslVerifiesIt) {
  const ReleaseFolder release;
  release.policy_of({"certificate", "firmware_facts\nmax_flash_bytes = 65536"});
  const Bundled bundle(release);
  EXPECT_NE(rejection(bundle.path(), bundle.other_key()).find("signed by another key"), std::string::npos);
  const std::string good = read_text(bundle / "statement.dsse.json");
  release.policy_of({"certificate"});
  for (const std::string algorithm :
       {"ed25519", "rsa -pkeyopt rsa_keygen_bits:2048", "ec -pkeyopt ec_paramgen_curve:P-256"}) {
    ASSERT_EQ(
        release
            .run(
                "openssl genpkey -algorithm " + algorithm +
                " -out k.pem 2>&1 && openssl pkey -in k.pem -pubout -out k.pub && swarmcert gate policy.toml "
                "-q --force --bundle bundle --key k.pem")
            .exit_code,
        0)
        << algorithm;
    EXPECT_EQ(release.run("swarmcert verify-bundle bundle -q --key k.pub").exit_code, 0) << algorithm;
    const Json envelope = document(bundle.path(), "statement.dsse.json");
    const std::string statement = read_text(bundle / "statement.json"), type = envelope["payloadType"];
    write_text(release / "message",
               fmt::format("DSSEv1 {} {} {} {}", type.size(), type, statement.size(), statement));
    write_text(release / "payload.b64", envelope["payload"].get<std::string>());
    write_text(release / "sig.b64", envelope["signatures"][0]["sig"].get<std::string>());
    const std::string check =
        algorithm == "ed25519" ? "openssl pkeyutl -verify -pubin -inkey k.pub -rawin -in message -sigfile sig"
                               : "openssl dgst -sha256 -verify k.pub -signature sig message";
    const Outcome verified = release.run(
        "openssl base64 -d -A -in payload.b64 | cmp - bundle/statement.json && "
        "openssl base64 -d -A -in sig.b64 -out sig && " +
        check);
    EXPECT_EQ(verified.exit_code, 0) << algorithm << verified.output;
    write_text(release / "message", read_text(release / "message") + " ");
    EXPECT_NE(release.run(check).exit_code, 0) << "the check of openssl can fail";
  }
  write_text(bundle / "statement.dsse.json", good);
  EXPECT_NE(rejection(bundle.path(), bundle.key()), "") << "the signature of an earlier statement";
  fs::remove(bundle / "statement.dsse.json");
  EXPECT_EQ(rejection(bundle.path(), bundle.key()), "it is not signed");
  EXPECT_EQ(rejection(bundle.path()), "");
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --key mine.pem").exit_code, 2);
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --bundle b --key mine.pub").exit_code, 3);
  for (const std::string path : {"../../x", "/etc/passwd", "files/../files/gains.toml", ""}) {
    Json statement = document(bundle.path(), "statement.json");
    statement["subject"][0]["name"] = path;
    write_text(bundle / "statement.json", files::to_text(statement));
    EXPECT_NE(rejection(bundle.path()).find("not a path inside"), std::string::npos)
        << path << rejection(bundle.path());
  }
}

TEST(GateBundle, OfAReleaseThatFailsOrPointsOutsideIsNotWritten) {
  const ReleaseFolder release;
  release.policy_of({"firmware_facts\nmax_flash_bytes = 1"});
  EXPECT_EQ(release.run("swarmcert gate policy.toml -q --bundle b").exit_code, 1);
  EXPECT_FALSE(fs::exists(release / "b"));
  std::string policy = read_text(release.policy_of({"certificate"}));
  policy.replace(policy.find("\"cert.json\""), 11, "\"" + (release / "cert.json") + "\"");
  write_text(release / "policy.toml", policy);
  const Outcome outcome = release.run("swarmcert gate policy.toml -q --bundle b");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("relative"), std::string::npos) << outcome.output;
  for (const fs::directory_entry& entry : fs::directory_iterator(release.path()))
    EXPECT_EQ(entry.path().filename().string().find("b."), std::string::npos)
        << entry.path() << " was left behind";
}

}  // namespace
}  // namespace swarmcert::tests
