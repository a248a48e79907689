#include "analysis/gate/bundle.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <system_error>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/documents.h"
#include "analysis/gate/envelope.h"
#include "analysis/gate/outputs.h"
#include "analysis/gate/text.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::gate {
namespace {

namespace fs = std::filesystem;
using files::InputError;
using files::Json;

constexpr char kStatement[] = "statement.json", kEnvelope[] = "statement.dsse.json", kBill[] = "bom.cdx.json",
               kResult[] = "gate.json";
/// Values of rows that are derived again agree to this relative error: other processors sum in other orders.
constexpr double kSameValue = 1e-9;

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

/// Returns the text of one of the bundle's documents, which must be as it was written.
Json read_document(const fs::path& folder, const char* name) {
  const std::string path = (folder / name).string(), text = files::read_file(path);
  Json document = files::parse_json(text, path);
  if (files::to_text(document) != text) reject(std::string(name) + " is not as it was written");
  return document;
}

/// Returns the files that a statement names. Roles are known of the configuration only.
std::vector<BundledFile> files_of(const Json& statement) {
  std::vector<BundledFile> files;
  const auto add = [&files](const Json& described, const std::string& role) {
    BundledFile file{described.at("name").get<std::string>(), role,
                     described.at("digest").at("sha256").get<std::string>()};
    const fs::path relative(file.path);
    if (relative.is_absolute() || relative.lexically_normal() != relative || file.path.empty() ||
        *relative.begin() == "..")
      reject(std::string(kStatement) + " names " + files::in_quotes(file.path) +
             ", which is not a path inside the bundle");
    files.push_back(std::move(file));
  };
  for (const Json& subject : statement.at("subject")) add(subject, "");
  for (const Json& one : statement.at("predicate").at("configuration"))
    add(one, one.at("annotations").at("role").get<std::string>());
  return files;
}

std::string path_of_role(const std::vector<BundledFile>& files, const std::string& role) {
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&role](const BundledFile& file) { return file.role == role; });
  return found == files.end() ? "" : found->path;
}

/// Verifies that the folder contains exactly these files and their folders, as regular files with these hashes.
void verify_files(const fs::path& folder, const std::vector<BundledFile>& entries) {
  std::set<std::string> files = {kStatement, kEnvelope}, folders;
  for (const BundledFile& entry : entries) {
    if (!files.insert(entry.path).second)
      reject(std::string(kStatement) + " names " + files::in_quotes(entry.path) + " twice");
    for (fs::path up = fs::path(entry.path).parent_path(); !up.empty(); up = up.parent_path())
      folders.insert(up.string());
  }
  for (const fs::directory_entry& found : fs::recursive_directory_iterator(folder)) {
    const std::string relative = found.path().lexically_relative(folder).string();
    const fs::file_type type = found.symlink_status().type();
    const bool is_known = type == fs::file_type::regular     ? files.count(relative) == 1
                          : type == fs::file_type::directory ? folders.count(relative) == 1
                                                             : false;
    if (!is_known) reject(files::in_quotes(relative) + " is not in the statement");
  }
  for (const BundledFile& entry : entries) {
    const fs::path path = folder / entry.path;
    if (!fs::is_regular_file(fs::symlink_status(path))) reject(files::in_quotes(entry.path) + " is missing");
    if (files::sha256_of_file(path.string()) != entry.sha256)
      reject(files::in_quotes(entry.path) + " is not the file of the statement");
  }
}

/// Returns the files of a bundle as they are derived from its policy: every file that this names, in the order of
/// `list`, with its role and hash.
/// @param path_of returns the path in the bundle of a file of the release.
template <class PathInBundle>
std::vector<BundledFile> derived_files(const std::vector<EvidenceFile>& list, const PathInBundle& path_of) {
  std::vector<BundledFile> files;
  for (const EvidenceFile& file : list)
    files.push_back({path_of(file), file.role, files::sha256_of_file(file.path)});
  return files;
}

/// The documents of a bundle, derived from its files and the result of the gate.
struct Documents {
  std::string bill, statement;
};
Documents documents_of(const Policy& policy, std::vector<BundledFile> files, const Json& gate_json,
                       const std::string& gate_text) {
  std::optional<files::Network> network;
  if (policy.release.has_network()) network = files::load_network(policy.release.network);
  Documents documents;
  const Json& rows = gate_json.at("checks");
  documents.bill = files::to_text(bill_of_materials(network ? &*network : nullptr, files, rows));
  files.push_back({kResult, "result", files::sha256(gate_text)});
  files.push_back({kBill, "bill of materials", files::sha256(documents.bill)});
  documents.statement = files::to_text(statement_of(files, rows));
  return documents;
}

/// Verifies claims for which the policy may not ask: the independent checker on the certificate, and the match.
void verify_claims(const Policy& policy, const GateSettings& settings, BundleVerdict& verdict) {
  Evidence evidence(policy, settings);
  const Release& release = policy.release;
  const auto is_asked = [&policy](const char* name) {
    return std::any_of(policy.checks.begin(), policy.checks.end(),
                       [name](const PlannedCheck& check) { return check.name == name; });
  };
  if (!release.certificate.empty() && !is_asked("certificate")) {
    const std::string why = evidence.why_not_certified();
    if (!why.empty()) reject("the certificate is rejected: " + why);
    verdict.verified.emplace_back("the independent checker accepts the certificate for the bundled weights");
  }
  const auto match = [&](const std::string& path, bool is_elf) {
    if (path.empty() || is_asked("match")) return;
    const Check check = match_row(evidence, "match", 0, path, is_elf, false);
    if (check.verdict != Verdict::kPass) reject(check.reason + ": " + check.witness);
    verdict.verified.push_back(std::string(is_elf ? "the ELF: " : "the source: ") + check.witness);
  };
  match(release.source, false);
  match(release.elf, true);
}

/// What gate.json says in words: they name paths, and numbers whose last digits depend on the processor.
const std::set<std::string> kWords = {"witness", "tool", "command_line", "policy", "file"};

/// Rejects a result that differs from the one derived again in anything but words.
void require_same(const Json& stated, const Json& derived, const std::string& where) {
  bool is_same = stated.size() == derived.size();
  if (derived.is_object() && stated.is_object() && is_same) {
    for (const auto& [member, value] : derived.items())
      if (kWords.count(member) == 0 || !stated.contains(member))
        require_same(stated.at(member), value, where + "." + member);
  } else if (derived.is_array() && stated.is_array() && is_same) {
    for (std::size_t i = 0; i < derived.size(); ++i)
      require_same(stated[i], derived[i], fmt::format("{}[{}]", where, i));
  } else if (derived.is_number() && stated.is_number()) {
    const double x = stated.get<double>(), y = derived.get<double>();
    is_same = std::abs(x - y) <= kSameValue * std::max(std::abs(x), std::abs(y));
  } else {
    is_same = stated == derived;
  }
  if (!is_same)
    reject(fmt::format("{} is {}, the evidence gives {}", where, printable(stated.dump()).substr(0, 200),
                       derived.dump().substr(0, 200)));
}

void verify_result(const Json& stated, const GateResult& again, const GateSettings& settings) {
  Json derived = files::to_json(files::record_of(again));
  for (const char* const head : {"schema", "tool", "command_line"}) derived[head] = stated.at(head);
  derived["seed"] = nullptr;
  derived["updates_baseline"] = settings.updates_baseline;
  for (const EvidenceFile& file : again.files)
    derived["inputs"].push_back({{"file", file.path}, {"sha256", files::sha256_of_file(file.path)}});
  require_same(stated, derived, kResult);
}

void verify_signature(const fs::path& folder, const std::string& public_key, BundleVerdict& verdict) {
  const bool is_signed = fs::exists(folder / kEnvelope);
  if (public_key.empty()) {
    verdict.not_verified.push_back(fmt::format(
        "who made it: without --key, whoever can write the bundle can replace policy, evidence and result by "
        "others that agree. {} Compare the statement's SHA-256 with one that came another way",
        is_signed ? "Its signature was not verified." : "It is not signed."));
    verdict.not_verified.emplace_back(
        "what gate.json says in words: witnesses, paths, its command line and the version of the tool");
    return;
  }
  if (!is_signed) reject("it is not signed");
  const std::string why = why_not_signed(read_document(folder, kEnvelope),
                                         files::read_file((folder / kStatement).string()), public_key);
  if (!why.empty()) reject(why);
  verdict.verified.emplace_back("the statement is signed by the key");
}

void verify(const fs::path& folder, const std::string& public_key, GateSettings settings,
            BundleVerdict& verdict) {
  const std::string statement_text = files::read_file((folder / kStatement).string());
  verdict.statement_sha256 = files::sha256(statement_text);
  verify_signature(folder, public_key, verdict);
  const std::vector<BundledFile> entries = files_of(read_document(folder, kStatement));
  verify_files(folder, entries);
  verdict.files = entries.size();
  verdict.verified.push_back(
      fmt::format("{} files with the hashes of the statement, none missing or additional", entries.size()));

  const std::string gate_text = files::read_file((folder / kResult).string());
  const Json gate_json = files::parse_json(gate_text, (folder / kResult).string(), "swarmcert/gate/1");
  const Policy policy = read_policy((folder / path_of_role(entries, "policy")).string());
  const std::string baseline = path_of_role(entries, "baseline");
  if (!baseline.empty()) settings.baseline = (folder / baseline).string();
  settings.updates_baseline = gate_json.value("updates_baseline", false);
  settings.may_lack_baseline = settings.updates_baseline && baseline.empty();
  if (settings.may_lack_baseline) settings.baseline = (folder / "no baseline").string();
  const std::vector<BundledFile> derived =
      derived_files(evidence_files(policy, settings.baseline), [&](const EvidenceFile& file) {
        return normal(file.path).lexically_relative(normal(folder.string())).string();
      });
  const Documents documents = documents_of(policy, derived, gate_json, gate_text);
  if (documents.statement != statement_text)
    reject("the statement is not that of the files that the policy names and of the rows of gate.json");
  if (documents.bill != files::read_file((folder / kBill).string()))
    reject(std::string(kBill) + " is not that of these files");
  verify_claims(policy, settings, verdict);
  const GateResult again = run_gate(policy, settings);
  for (const Check& check : again.checks) {
    if (check.verdict != Verdict::kPass) reject(check.name + ", derived again: " + check.reason);
  }
  verify_result(gate_json, again, settings);
  for (const Change& change : again.changes)
    if (change.asks_for_less())
      verdict.not_verified.push_back(
          "whether less may be asked for than in the last release, as --update-baseline "
          "accepted: " +
          words(change));
  verdict.verified.push_back(
      fmt::format("all {} rows of the result, derived again from the evidence", again.checks.size()));
}

}  // namespace

std::string write_bundle(const std::string& folder, const Policy& policy, const GateResult& result,
                         const Json& gate_json, const std::string& private_key, bool overwrite) {
  const fs::path target = normal(folder).has_filename() ? normal(folder) : normal(folder).parent_path();
  if (fs::exists(target) && !overwrite && !(fs::is_directory(target) && fs::is_empty(target)))
    throw InputError({folder, "", "", "", "the folder is not empty", "--force replaces it"});
  std::map<std::string, std::string> judged;  // what the gate's result states about its inputs
  for (const Json& input : gate_json["inputs"])
    judged[normal(input["file"].get<std::string>()).string()] = input["sha256"].get<std::string>();

  Unfinished unfinished(target.string() + ".part-" + std::to_string(::getpid()));
  const fs::path common = common_folder(result.files);
  const auto path_of = [&common](const EvidenceFile& file) {
    return (fs::path("files") / normal(file.path).lexically_relative(common)).string();
  };
  const auto put = [&](const std::string& relative, const std::string& bytes) {
    const fs::path path = unfinished.path() / relative;
    fs::create_directories(path.parent_path());
    files::write_file(path.string(), bytes, false);
  };
  for (const EvidenceFile& file : result.files) {
    const std::string bytes = files::read_file(file.path);
    const auto hash = judged.find(normal(file.path).string());
    if (hash == judged.end() || hash->second != files::sha256(bytes))
      throw InputError({file.path, "", "", "", "changed while the release was judged", "run the gate again"});
    put(path_of(file), bytes);
  }
  const std::string gate_text = files::to_text(gate_json);
  const Documents documents =
      documents_of(policy, derived_files(result.files, path_of), gate_json, gate_text);
  put(kResult, gate_text);
  put(kBill, documents.bill);
  put(kStatement, documents.statement);
  if (!private_key.empty()) put(kEnvelope, files::to_text(sign(documents.statement, private_key)));

  const Policy bundled = read_policy((unfinished.path() / path_of(result.files.front())).string());
  for (const EvidenceFile& file : evidence_files(bundled, "")) {
    const std::string relative = normal(file.path).lexically_relative(unfinished.path()).string();
    if (!fs::exists(unfinished.path() / relative) || relative.rfind("..", 0) == 0)
      throw InputError({policy.path, "", "", "",
                        "cannot be bundled: it names " + files::in_quotes(file.path) + " outside the bundle",
                        "name files by paths relative to the file that names them"});
  }
  unfinished.move_to(target);
  return files::sha256(documents.statement);
}

void describe(files::Record& record, const BundleVerdict& verdict) {
  record.field("accepted", verdict.accepted, "Whether everything was verified.");
  record.field("reason", printable(verdict.reason), "Why not; empty where accepted.");
  record.field("statement_sha256", verdict.statement_sha256, "SHA-256 of statement.json.");
  record.field("files", verdict.files, "Number of files of the bundle.");
  record.field("verified", verdict.verified, "What was verified, in words.");
  record.field("not_verified", verdict.not_verified, "What the verdict does not cover, in words.");
}

BundleVerdict verify_bundle(const std::string& folder, const std::string& public_key,
                            const GateSettings& settings) {
  if (!fs::is_directory(folder))
    throw InputError({folder, "", "", "", "is not a folder", "name the folder that gate --bundle wrote"});
  if (!public_key.empty()) require_public_key(public_key);  // a wrong file is no fault of the bundle
  BundleVerdict verdict;
  try {
    verify(fs::path(folder).lexically_normal(), public_key, settings, verdict);
    verdict.accepted = true;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {  // damaged files, malformed statements, unfounded claims
    verdict.reason = error.what();
  }
  return verdict;
}

}  // namespace swarmcert::gate
