/// @file Whether what is built or shipped is the certified network: an export's folder, one of its files, other C
/// source, or an ELF.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/firmware/match.h"
#include "analysis/firmware/match_export.h"

namespace swarmcert::firmware {

enum class ArtefactVerdict { kEqual, kDifferent, kInconclusive };
/// "equal", "different" or "inconclusive".
const char* name(ArtefactVerdict verdict);

struct ArtefactMatch {
  /// Equal: everything that the artefact holds of the network was compared and is the same. Inconclusive: what was
  /// compared is the same, and `not_checked` is not empty.
  ArtefactVerdict verdict = ArtefactVerdict::kInconclusive;
  std::vector<std::string> compared;              ///< what was compared, and how, in words
  std::vector<std::string> files;                 ///< paths of the files that were compared
  std::vector<std::string> not_checked;           ///< what should have been, and why it was not
  std::vector<std::string> not_covered;           ///< what no verdict says anything about
  std::optional<std::string> first_difference;    ///< in words
  std::optional<Difference> number_difference;    ///< where it is a weight or bias
  std::optional<FileDifference> file_difference;  ///< where it is in an exported file
  std::optional<ExportOptions> parameters;        ///< of an export, as its files state them
  int arrays = 0;  ///< weight matrices and bias vectors that were compared; 0: none are in these files
  std::size_t numbers = 0;  ///< in them
};

struct ArtefactOptions {
  ExportMatchOptions source;
  int most_neighbours = 10;  ///< that the source in an ELF was exported with
};

/// Compares by what `path` is:
///   the folder or a file of an export   match_export();
///   other C or C++ source               the weights, bit for bit; equal only if the file holds nothing but them;
///   an ELF                              the weights, bit for bit, and match_code().
/// Precondition: every weight is a float32 (files::as_float32()).
/// @throws files::InputError if a file cannot be read or is damaged.
ArtefactMatch match_artefact(const files::Network& network, const std::string& path,
                             const ArtefactOptions& options);

}  // namespace swarmcert::firmware
