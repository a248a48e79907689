/// @file Checks whether an artefact is the certified network: the folder of an export, one of its files, other C
/// source, or an ELF file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/firmware/match.h"
#include "analysis/firmware/match_code.h"
#include "analysis/firmware/match_export.h"

namespace swarmcert::firmware {

enum class ArtefactVerdict { kEqual, kDifferent, kInconclusive };
/// Returns "equal", "different" or "inconclusive".
const char* name(ArtefactVerdict verdict);

struct ArtefactMatch {
  /// kEqual: everything that the artefact contains of the network was compared and is the same. kInconclusive: what
  /// was compared is the same, but `not_checked` is not empty.
  ArtefactVerdict verdict = ArtefactVerdict::kInconclusive;
  std::vector<std::string> compared;     ///< what was compared, and how
  std::vector<std::string> files;        ///< paths of the files that were compared
  std::vector<std::string> not_checked;  ///< what should have been compared, with the reason why it was not
  std::vector<std::string> not_covered;  ///< what the verdict does not cover
  std::optional<std::string> first_difference;    ///< as text
  std::optional<Difference> number_difference;    ///< set if it is a weight or bias
  std::optional<FileDifference> file_difference;  ///< set if it is in an exported file
  std::optional<ExportOptions> parameters;        ///< parameters of an export as stated by its files
  int arrays = 0;           ///< weight matrices and bias vectors compared; 0: the files contain none
  std::size_t numbers = 0;  ///< number of weights and biases in them
};

struct ArtefactOptions {
  ExportMatchOptions source;
  int most_neighbours = 10;                         ///< of the export that is contained in an ELF file
  ExpectApp app = [] { return AppExpectation(); };  ///< what the app in an ELF file should hold
  bool needs_app = false;                           ///< an ELF file without the app is another program
};

/// Compares depending on what `path` is:
///   the folder or a file of an export   match_export();
///   other C or C++ source               the weights, bit for bit; equal only if the file contains nothing else;
///   an ELF file                         the weights, bit for bit, in the objects named as exported if there are these;
///                                       that there is no second copy and no symbol twice; and match_code().
/// Precondition: every weight is a float32 (files::as_float32()).
/// @throws files::InputError if a file cannot be read or is damaged.
ArtefactMatch match_artefact(const files::Network& network, const std::string& path,
                             const ArtefactOptions& options);

}  // namespace swarmcert::firmware
