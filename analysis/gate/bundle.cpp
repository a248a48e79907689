#include "analysis/gate/bundle.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "analysis/gate/checks/checks.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::gate {
namespace {

namespace fs = std::filesystem;
using files::InputError;
using files::Json;

constexpr char kManifestSchema[] = "swarmcert/manifest/1";

fs::path normal(const std::string& path) { return fs::absolute(path).lexically_normal(); }

/// Returns the deepest folder that contains all files.
fs::path common_folder(const std::vector<EvidenceFile>& files) {
  fs::path common = normal(files.front().path).parent_path();
  for (const EvidenceFile& file : files) {
    const fs::path folder = normal(file.path).parent_path();
    const auto [mine, other] = std::mismatch(common.begin(), common.end(), folder.begin(), folder.end());
    fs::path shared;
    for (auto part = common.begin(); part != mine; ++part) shared /= *part;
    common = shared;
  }
  return common;
}

struct Entry {
  std::string path, role, sha256;  ///< path relative to the bundle
  std::size_t bytes = 0;
};

Json manifest_of(const std::vector<Entry>& entries, const std::string& policy) {
  Json list = Json::array();
  for (const Entry& entry : entries) {
    list.push_back(
        {{"path", entry.path}, {"role", entry.role}, {"bytes", entry.bytes}, {"sha256", entry.sha256}});
  }
  Json manifest = {
      {"schema", kManifestSchema},
      {"tool", "swarmcert " SWARMCERT_VERSION},
      {"statement",
       "These files, with these SHA-256, are one release that passed its gate: the policy, the weights, "
       "the certificate of these weights, the source and ELF that hold them, gains, models and logs."},
      {"policy", policy},
      {"files", std::move(list)}};
  manifest["content_sha256"] = files::content_sha256(manifest);
  return manifest;
}

/// Removes an unfinished folder on destruction.
class Unfinished {
 public:
  explicit Unfinished(fs::path path) : path_(std::move(path)) { fs::create_directories(path_); }
  ~Unfinished() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  const fs::path& path() const { return path_; }
  /// Moves the folder to `target` and removes what was there. A concurrent reader sees either the old or the new
  /// folder completely.
  void move_to(const fs::path& target) {
    const unsigned flags = fs::exists(target) ? RENAME_EXCHANGE : RENAME_NOREPLACE;
    if (::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target.c_str(), flags) == 0) {
      if (flags == RENAME_NOREPLACE) path_.clear();
      return;
    }
    if (errno != EINVAL && errno != ENOSYS)
      throw InputError({target.string(), "", "", "",
                        fmt::format("cannot be written ({})", std::generic_category().message(errno)), ""});
    fs::remove_all(target);  // for file systems that cannot exchange
    fs::rename(path_, target);
    path_.clear();
  }

 private:
  fs::path path_;
};

[[noreturn]] void reject(const std::string& reason) { throw Unfounded(reason); }

std::vector<Entry> read_manifest(const fs::path& folder, std::string& sha256, std::string& policy) {
  const std::string path = (folder / "manifest.json").string();
  const std::string text = files::read_file(path);
  sha256 = files::sha256(text);
  const Json manifest = files::parse_json(text, path, kManifestSchema);
  if (files::to_text(manifest) != text) reject("manifest.json is not as it was written");
  files::require_keys(manifest, {"schema", "tool", "statement", "policy", "files", "content_sha256"},
                      "manifest.json");
  if (manifest["content_sha256"] != files::content_sha256(manifest))
    reject("manifest.json does not have the hash that it states");
  policy = manifest["policy"].get<std::string>();
  std::vector<Entry> entries;
  for (const Json& one : manifest["files"]) {
    files::require_keys(one, {"path", "role", "bytes", "sha256"}, "manifest.json, files");
    Entry entry{one["path"].get<std::string>(), one["role"].get<std::string>(),
                one["sha256"].get<std::string>(), one["bytes"].get<std::size_t>()};
    const fs::path relative(entry.path);
    if (relative.is_absolute() || relative.lexically_normal() != relative || entry.path.empty() ||
        *relative.begin() == "..")
      reject("manifest.json names " + files::in_quotes(entry.path) +
             ", which is not a path inside the bundle");
    entries.push_back(std::move(entry));
  }
  return entries;
}

/// Verifies that the folder contains exactly these files and their folders, as regular files with these hashes.
void verify_files(const fs::path& folder, const std::vector<Entry>& entries) {
  std::set<std::string> files = {"manifest.json"}, folders;
  for (const Entry& entry : entries) {
    if (!files.insert(entry.path).second)
      reject("manifest.json names " + files::in_quotes(entry.path) + " twice");
    for (fs::path up = fs::path(entry.path).parent_path(); !up.empty(); up = up.parent_path())
      folders.insert(up.string());
  }
  for (const fs::directory_entry& found : fs::recursive_directory_iterator(folder)) {
    const std::string relative = found.path().lexically_relative(folder).string();
    const fs::file_type type = found.symlink_status().type();
    const bool is_known = type == fs::file_type::regular     ? files.count(relative) == 1
                          : type == fs::file_type::directory ? folders.count(relative) == 1
                                                             : false;
    if (!is_known) reject(files::in_quotes(relative) + " is not in the manifest");
  }
  for (const Entry& entry : entries) {
    const fs::path path = folder / entry.path;
    if (!fs::is_regular_file(fs::symlink_status(path))) reject(files::in_quotes(entry.path) + " is missing");
    const std::string bytes = files::read_file(path.string());
    if (bytes.size() != entry.bytes || files::sha256(bytes) != entry.sha256)
      reject(files::in_quotes(entry.path) + " is not the file of the manifest");
  }
}

/// Verifies that the policy refers to the files of the manifest: inside the bundle, and with the same roles.
void verify_roles(const fs::path& folder, const std::vector<Entry>& entries, const Policy& policy) {
  std::map<std::string, std::string> roles;
  for (const Entry& entry : entries) roles[entry.path] = entry.role;
  std::size_t named = 0;
  for (const EvidenceFile& file : evidence_files(policy, "")) {
    const std::string relative = normal(file.path).lexically_relative(normal(folder.string())).string();
    const auto found = roles.find(relative);
    if (found == roles.end())
      reject("the policy names " + files::in_quotes(relative) + ", which is not in the bundle");
    if (found->second != file.role)
      reject(files::in_quotes(relative) + " is " + file.role + " to the policy, but " + found->second +
             " in the manifest");
    ++named;
  }
  const auto unnamed = std::count_if(entries.begin(), entries.end(), [](const Entry& entry) {
    return entry.role == "result" || entry.role == "baseline";
  });
  if (named + static_cast<std::size_t>(unnamed) != entries.size())
    reject("the manifest has files that the policy does not name");
}

/// Runs the independent checker and the match on the files of the bundle.
void verify_claims(const Policy& policy, const GateSettings& settings, BundleVerdict& verdict) {
  Evidence evidence(policy, settings);
  const Release& release = policy.release;
  if (!release.certificate.empty()) {
    const std::string why = evidence.why_not_certified();
    if (!why.empty()) reject("the certificate is rejected: " + why);
    verdict.verified.emplace_back("the independent checker accepts the certificate for the bundled weights");
  }
  const auto match = [&](const std::string& path, bool is_elf) {
    if (path.empty()) return;
    const Check check = match_row(evidence, "match", 0, path, is_elf);
    if (check.verdict != Verdict::kPass) reject(check.reason + ": " + check.witness);
    verdict.verified.push_back(std::string(is_elf ? "the ELF: " : "the source: ") + check.witness);
  };
  match(release.source, false);
  match(release.elf, true);
}

void verify_again(const Policy& policy, const GateSettings& settings, BundleVerdict& verdict) {
  const GateResult again = run_gate(policy, settings);
  for (const Check& check : again.checks) {
    if (check.verdict != Verdict::kPass) reject(check.name + ", run again: " + check.reason);
  }
  verdict.verified.push_back(fmt::format("all {} checks of the policy pass again", again.checks.size()));
}

void verify(const fs::path& folder, bool rerun, GateSettings settings, BundleVerdict& verdict) {
  std::string policy_path;
  const std::vector<Entry> entries = read_manifest(folder, verdict.manifest_sha256, policy_path);
  verify_files(folder, entries);
  verdict.files = entries.size();
  verdict.verified.push_back(
      fmt::format("{} files with the hashes of the manifest, none missing or additional", entries.size()));
  const std::string result = (folder / "gate.json").string();
  const Json gate_json = files::read_json(result, "swarmcert/gate/1");
  if (gate_json.value("verdict", "") != "pass") reject("gate.json states that the release did not pass");
  const Policy policy = read_policy((folder / policy_path).string());
  verify_roles(folder, entries, policy);
  verify_claims(policy, settings, verdict);
  if (!rerun) return;
  for (const Entry& entry : entries)
    if (entry.role == "baseline") settings.baseline = (folder / entry.path).string();
  settings.may_lack_baseline = settings.baseline.empty();
  settings.updates_baseline = gate_json.value("updates_baseline", false);
  verify_again(policy, settings, verdict);
}

}  // namespace

std::string write_bundle(const std::string& folder, const Policy& policy, const GateResult& result,
                         const Json& gate_json, bool overwrite) {
  const fs::path target = normal(folder).has_filename() ? normal(folder) : normal(folder).parent_path();
  if (fs::exists(target) && !overwrite && !(fs::is_directory(target) && fs::is_empty(target)))
    throw InputError({folder, "", "", "", "the folder is not empty", "--force replaces it"});
  std::map<std::string, std::string> judged;  // what the gate's result states about its inputs
  for (const Json& input : gate_json["inputs"])
    judged[normal(input["file"].get<std::string>()).string()] = input["sha256"].get<std::string>();

  Unfinished unfinished(target.string() + ".part-" + std::to_string(::getpid()));
  const fs::path common = common_folder(result.files);
  std::vector<Entry> entries;
  const auto put = [&](const std::string& relative, const std::string& role, const std::string& bytes) {
    const fs::path path = unfinished.path() / relative;
    fs::create_directories(path.parent_path());
    files::write_file(path.string(), bytes, false);
    entries.push_back({relative, role, files::sha256(bytes), bytes.size()});
  };
  std::string policy_path;
  for (const EvidenceFile& file : result.files) {
    const fs::path from = normal(file.path);
    const std::string bytes = files::read_file(from.string());
    const auto hash = judged.find(from.string());
    if (hash == judged.end() || hash->second != files::sha256(bytes))
      throw InputError({file.path, "", "", "", "changed while the release was judged", "run the gate again"});
    const std::string relative = (fs::path("files") / from.lexically_relative(common)).string();
    if (file.role == "policy") policy_path = relative;
    put(relative, file.role, bytes);
  }
  put("gate.json", "result", files::to_text(gate_json));
  const std::string manifest = files::to_text(manifest_of(entries, policy_path));
  files::write_file((unfinished.path() / "manifest.json").string(), manifest, false);

  try {
    verify_roles(unfinished.path(), entries, read_policy((unfinished.path() / policy_path).string()));
  } catch (const Unfounded& error) {
    throw InputError({policy.path, "", "", "", std::string("cannot be bundled: ") + error.what(),
                      "name files by paths relative to the file that names them"});
  }
  unfinished.move_to(target);
  return files::sha256(manifest);
}

BundleVerdict verify_bundle(const std::string& folder, bool rerun, const GateSettings& settings) {
  if (!fs::is_directory(folder))
    throw InputError({folder, "", "", "", "is not a folder", "name the folder that gate --bundle wrote"});
  BundleVerdict verdict;
  try {
    verify(fs::path(folder).lexically_normal(), rerun, settings, verdict);
    verdict.accepted = true;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {  // damaged files, malformed manifests, unfounded claims
    verdict.reason = error.what();
  }
  return verdict;
}

}  // namespace swarmcert::gate
