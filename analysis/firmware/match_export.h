/// @file Whether exported files are, byte for byte, what swarmcert export writes for a network.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/firmware/export_source.h"

namespace swarmcert::firmware {

/// The first place where a file is not the regenerated one.
struct FileDifference {
  std::string file;      ///< path
  std::size_t line = 0;  ///< counted from 1; 0: the file is missing, or no part of an export
  std::string expected,
      found;         ///< the line, without bytes outside printable ASCII; both empty if `line` is 0
  std::string what;  ///< in words
};

struct ExportMatch {
  std::vector<std::string> compared;  ///< paths of the files that were read and compared
  std::vector<std::string> absent;    ///< generated files that do not lie beside a file that was named
  ExportOptions parameters;           ///< of the export, as its files state them
  std::optional<FileDifference> first_difference;
};

struct ExportMatchOptions {
  /// Content hash of the certificate that the files may name; nothing: they may name any.
  std::optional<std::string> certificate_sha256;
  bool needs_all = false;  ///< also where one file is named: none may be missing or additional
  std::vector<std::string> other_contents;  ///< paths of files that may lie in the export's folder
};

/// True if `bytes` of the file `path` claim to be of an export: by the file's name, or by its first line.
bool is_exported_file(const std::string& path, const std::string& bytes);

/// True if one of the files of an export lies in `folder`.
bool holds_export(const std::string& folder);

/// Paths that the export's files have which `path`, a file of it or its folder, belongs to; none if `path` does not
/// have the name of an exported file.
std::vector<std::string> files_of_export(const std::string& path);

/// Regenerates the export of `network` and compares every file byte for byte. Line ends are normalised first: CR LF
/// counts as LF. The parameters of the export (most neighbours, seed, certificate) are those that the files state.
/// @param path  the folder of the export: none of its files may be missing and no other file may be in it, those of
///   `other_contents` excepted; or one of its files, with which those that lie beside it are compared too.
/// Precondition: every weight is a float32 (files::as_float32()); the network is a deep set.
/// @throws files::InputError if a file cannot be read, or the network cannot be exported.
ExportMatch match_export(const files::Network& network, const std::string& path,
                         const ExportMatchOptions& options);

}  // namespace swarmcert::firmware
