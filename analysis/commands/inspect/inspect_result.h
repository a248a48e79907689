/// @file The result of `inspect`: what each file holds. Nothing is checked or proved.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/flight_story.h"
#include "analysis/logs/log.h"
#include "analysis/logs/plausibility.h"
#include "analysis/logs/read_log.h"
#include "analysis/residuals/flight_set.h"
#include "nn/base/record.h"
#include "nn/weights/network.h"
#include "stability/model.h"

namespace swarmcert::analysis {

struct UnreadableFile {
  std::string file, reason;
};

struct NetworkFile {
  std::string file;
  files::Network network;
};

struct ModelFile {
  std::string file;
  stability::Model model;
};

/// A bound of a certificate. What the certificate does not state, or with another type, is empty.
struct StatedBound {
  std::optional<std::string> function, rho, domain, block, law, norm, unit, upper_method, status;
  std::optional<std::vector<std::string>> scale;
  std::optional<std::map<std::string, std::int64_t>> neighbours;
  std::optional<double> upper, lower;
};

struct CertificateFile {
  std::string file;
  std::vector<StatedBound> bounds;
};

/// The gains of one loop with respect to one input; NaN: not stated.
struct StatedGains {
  std::optional<std::string> axis, input;
  std::string loop;
  double rate = 0, amplitude = 0, edge = 0, impulse = 0;
};

struct LeftOutLoop {
  std::string axis, input, loop, why;
};

struct TrackingCertificateFile {
  std::string file;
  std::vector<StatedGains> loops;
  std::vector<LeftOutLoop> left_out;
};

struct LogFile {
  std::string file;
  logs::Log log;  ///< without its samples
  double t0_s = 0, t1_s = 0, lost_share = 0;
  logs::FlightStory story;
  std::vector<logs::Doubt> doubts;
};

using InspectedFile =
    std::variant<UnreadableFile, NetworkFile, ModelFile, CertificateFile, TrackingCertificateFile, LogFile>;

struct InspectResult {
  std::vector<InspectedFile> files;
  residuals::FoundFlights found;           ///< of the folders, and of files of several vehicles
  std::vector<CollectionRow> collections;  ///< of the folders
};

/// Drops the samples of the log.
LogFile log_file(const std::string& path, logs::Log log);

/// Returns the logs among the files.
std::vector<const LogFile*> logs_of(const InspectResult& result);

/// Returns the axes along which a force and a torque can be judged: "x", "y", "z".
std::vector<std::string> force_axes(const logs::Signals& signals);
std::vector<std::string> torque_axes(const logs::Signals& signals);
const char* name(logs::TorqueUse use);

void describe(files::Record& record, const UnreadableFile& unreadable);
void describe(files::Record& record, const NetworkFile& file);
void describe(files::Record& record, const ModelFile& file);
void describe(files::Record& record, const CertificateFile& certificate);
void describe(files::Record& record, const TrackingCertificateFile& certificate);
void describe(files::Record& record, const LogFile& file);
void describe(files::Record& record, const InspectResult& result);

}  // namespace swarmcert::analysis

namespace swarmcert::logs {

void describe(files::Record& record, SignalInfo::Source source);
void describe(files::Record& record, Completeness completeness);

}  // namespace swarmcert::logs
