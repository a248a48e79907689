/// @file Checks whether exported files are byte for byte what `swarmcert export` writes for a network.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/firmware/export_source.h"

namespace swarmcert::firmware {

/// The first place where a file differs from the regenerated one.
struct FileDifference {
  std::string file;      ///< path
  std::size_t line = 0;  ///< starts at 1; 0: the file is missing, or is not part of an export
  std::string expected,
      found;         ///< the line, without bytes outside printable ASCII; both empty if `line` is 0
  std::string what;  ///< description
};

struct ExportMatch {
  std::vector<std::string> compared;  ///< paths of the files read and compared
  std::vector<std::string> absent;    ///< generated files missing next to a named file
  ExportOptions parameters;           ///< as stated by the files of the export
  std::optional<FileDifference> first_difference;
};

struct ExportMatchOptions {
  /// Content hash of the certificate that the files may name; empty: any.
  std::optional<std::string> certificate_sha256;
  bool needs_all = false;  ///< even if a single file is named, no file may be missing or additional
  std::vector<std::string> other_contents;  ///< paths of other files allowed in the folder of the export
};

/// True if the file `path` with contents `bytes` claims to be part of an export, by its name or by its first line.
bool is_exported_file(const std::string& path, const std::string& bytes);

/// True if `folder` contains a file of an export.
bool holds_export(const std::string& folder);

/// Returns the paths of all files of the export to which `path`, its folder or one of its files, belongs; empty if
/// `path` does not have the name of an exported file.
std::vector<std::string> files_of_export(const std::string& path);

/// Regenerates the export of `network` and compares every file byte for byte. Line ends are normalised first: CR LF
/// counts as LF. The parameters of the export (most neighbours, seed, certificate) are those stated by the files.
/// @param path the folder of the export, in which no file may be missing and no other file except `other_contents`
///     may be present; or one of its files, in which case the other files of the export next to it are compared too.
///     Precondition: every weight is a float32 (files::as_float32()); the network is a deep set.
/// @throws files::InputError if a file cannot be read, or the network cannot be exported.
ExportMatch match_export(const files::Network& network, const std::string& path,
                         const ExportMatchOptions& options);

}  // namespace swarmcert::firmware
