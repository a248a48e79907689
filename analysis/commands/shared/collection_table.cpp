#include "analysis/commands/shared/collection_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <set>

namespace swarmcert::analysis {
namespace {

namespace fs = std::filesystem;

void add(CollectionRow& row, const LogOutcome& log) {
  ++row.logs;
  row.opened += log.opened ? 1 : 0;
  for (std::size_t k = 0; k < 3; ++k) row.force[k] += log.force[k] ? 1 : 0;
  row.torque += log.torque ? 1 : 0;
  row.seconds += log.seconds;
  row.run_s += log.run_s;
  if (!log.left_out_why.empty()) ++row.left_out[log.left_out_why];
}

/// The first folder below `folder` on the way to `path`; empty if the log is in `folder` itself or outside it.
std::string folder_below(const std::string& folder, const std::string& path) {
  const fs::path way = fs::path(path).lexically_relative(folder);
  const auto parts = std::distance(way.begin(), way.end());
  return parts > 1 ? way.begin()->string() : "";
}

bool is_below(const std::string& folder, const std::string& path) {
  const fs::path way = fs::path(path).lexically_relative(folder);
  return !way.empty() && *way.begin() != "..";
}

std::string reasons(const CollectionRow& row) {
  std::string text;
  for (const auto& [why, count] : row.left_out)
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", count, why);
  return text;
}

bool is_timed(const std::vector<CollectionRow>& rows) {
  return std::any_of(rows.begin(), rows.end(), [](const CollectionRow& row) { return row.run_s > 0; });
}

}  // namespace

std::vector<CollectionRow> collection_rows(const std::vector<std::string>& words,
                                           const std::vector<LogOutcome>& logs) {
  std::vector<CollectionRow> rows;
  CollectionRow all;
  all.name = "all";
  for (const std::string& word : words) {
    if (!fs::is_directory(word)) continue;
    std::set<std::string> below;
    for (const LogOutcome& log : logs) {
      if (is_below(word, log.path)) below.insert(folder_below(word, log.path));
    }
    std::map<std::string, CollectionRow> parts;
    for (const LogOutcome& log : logs) {
      if (!is_below(word, log.path)) continue;
      const std::string part = below.size() > 1 ? folder_below(word, log.path) : "";
      CollectionRow& row = parts[part];
      row.name = part.empty() ? word : part;
      add(row, log);
      add(all, log);
    }
    for (auto& [part, row] : parts) rows.push_back(std::move(row));
  }
  if (rows.size() > 1) rows.push_back(std::move(all));
  return rows;
}

void describe(files::Record& record, const CollectionRow& row) {
  struct LeftOut {
    std::string why;
    std::size_t logs = 0;
  };
  std::vector<LeftOut> left_out;
  for (const auto& [why, count] : row.left_out) left_out.push_back({why, count});
  record.field("name", row.name, "");
  record.field("logs", row.logs, "");
  record.field("opened", row.opened, "");
  record.object("force", "Logs that can be judged along each axis.", [&row](files::Record& r) {
    r.field("x", row.force[0], "");
    r.field("y", row.force[1], "");
    r.field("z", row.force[2], "");
  });
  record.field("torque", row.torque, "Logs with at least its mean in slow flight.");
  record.field("seconds", row.seconds, "Of flight.", "s");
  record.list("left_out", left_out, "", [](files::Record& r, const LeftOut& one) {
    r.field("why", one.why, "");
    r.field("logs", one.logs, "");
  });
}

Table collection_table(const std::vector<CollectionRow>& rows) {
  Table all = table(files::record_of(rows), {{"name", "folder"},
                                             {"logs"},
                                             {"opened"},
                                             {"force.x", "force x"},
                                             {"force.y", "y"},
                                             {"force.z", "z"},
                                             {"torque"},
                                             {"seconds", "flight", "{:.1f}"}});
  if (is_timed(rows)) all.header.emplace_back("run [s]");
  all.header.emplace_back("left out");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (is_timed(rows)) all.rows[i].push_back(fmt::format("{:.2f}", rows[i].run_s));
    all.rows[i].push_back(rows[i].left_out.empty() ? "-" : reasons(rows[i]));
  }
  return all;
}

void print_collections(const std::vector<CollectionRow>& rows, const std::string& seconds) {
  if (rows.empty()) return;
  fmt::print("\n{}", to_text(collection_table(rows)));
  fmt::print("(flight: seconds {}{}; torque: at least its mean in slow flight)\n", seconds,
             is_timed(rows) ? "; run: seconds that reading and judging took" : "");
}

}  // namespace swarmcert::analysis
