#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/flown_network.h"
#include "analysis/firmware/export_source.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/chain.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  files::NetworkArguments network;
  std::string output, certificate, as;
  firmware::ExportOptions source;
};

/// Returns the content hash of the certificate in `path` after checking that it refers to the weights as exported.
std::string certificate_of(const files::Network& network, const std::string& path, bool as_float32) {
  const auto refuse = [&](const std::string& field, const std::string& value, const std::string& what) {
    throw files::InputError({path, "", field, value, what, "certify the network that you export"});
  };
  const files::Json certificate = files::parse_json(files::read_file(path), path);
  if (!certificate.is_object() || !certificate.contains("content_sha256") ||
      !certificate["content_sha256"].is_string() || !certificate.contains("network") ||
      !certificate["network"].contains("weights"))
    refuse("content_sha256", "", "no certificate: certify -o writes one");
  std::string hash = certificate["content_sha256"].get<std::string>();
  if (hash != files::content_sha256(certificate))
    refuse("content_sha256", hash, "is not this document's: it was changed");
  const files::Json& weights = certificate["network"]["weights"];
  for (const auto& [id, one] : files::parts(network)) {
    const std::string& part = id.name();
    if (!weights.contains(part)) refuse("network.weights", part, "is not in the certificate");
    if (weights[part].value("sha256", "") != one->sha256)
      refuse("network.weights." + part + ".sha256", weights[part].value("sha256", ""),
             "is not the hash of " + one->path);
    const files::Json chain = files::chain_json(files::chain(network, id));
    if (weights[part].value("chain", files::Json()) != chain)
      refuse("network.weights." + part + ".chain", "",
             "is not the chain that is exported: " + files::chain_words(files::chain(network, id)));
  }
  if (!network.silent.empty() && certificate["network"].value("description_sha256", "") != network.sha256)
    refuse("network.description_sha256", "",
           "is not the hash of " + network.path + ", which states the silent compositions");
  const bool certified_as_float32 = certificate["network"].value("as", files::Json()) == "float32";
  if (as_float32 && !certified_as_float32)
    refuse("network.as", "null",
           "refers to float64 weights, but float32 weights are exported: certify with --as float32");
  return hash;
}

struct ExportResult {
  bool as_float32 = false;
  std::vector<firmware::SourceFile> files;
  long weights_bytes = 0;
  int golden_vectors = 0;

  bool fits() const { return weights_bytes <= firmware::kCrazyflieFlash_bytes; }
};

void describe_file(files::Record& record, const firmware::SourceFile& file) {
  record.field("name", file.name, "Path in the folder of the export.");
  record.field("sha256", files::sha256(file.contents), "Of the content, hexadecimal.");
}

void describe(files::Record& record, const ExportResult& result) {
  record.field("as", result.as_float32 ? std::optional<std::string>("float32") : std::nullopt,
               "Arithmetic to which float64 weights are rounded: float32; null: exported as stored.");
  record.list("files", result.files, "Every exported file.", describe_file);
  record.field("weights_bytes", result.weights_bytes, "What weights and biases take of the flash.", "B",
               "exact");
  record.field("fits_crazyflie", result.fits(), "Whether that is at most the flash of a Crazyflie, 1 MiB.");
  record.field("golden_vectors", result.golden_vectors,
               "Inputs with expected outputs among the exported files.");
}

int run_export(ExportOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  bool is_rounded = false;
  const files::Network network = load_flown_net(options.network, options.as, is_rounded);
  std::vector<std::string> inputs = input_files(network);
  if (!options.certificate.empty()) {
    inputs.push_back(options.certificate);
    options.source.certificate_sha256 = certificate_of(network, options.certificate, is_rounded);
  }
  const std::vector<firmware::SourceFile> sources = firmware::export_source(network, options.source);
  for (const firmware::SourceFile& source : sources) {
    if (fs::exists(fs::path(options.output) / source.name))
      refuse_to_replace(common, (fs::path(options.output) / source.name).string());
  }
  for (const firmware::SourceFile& source : sources) {
    const fs::path path = fs::path(options.output) / source.name;
    fs::create_directories(path.parent_path());
    files::write_file(path.string(), source.contents, common.force);
  }
  const ExportResult result = {is_rounded, sources, firmware::weights_bytes(network),
                               options.source.golden_vectors * static_cast<int>(network.rho.size())};
  write_result(common, result_of("export", inputs, options.source.seed, result));
  if (common.prints_text()) {
    for (const firmware::SourceFile& source : result.files)
      fmt::print("written: {}/{}\n", options.output, source.name);
    fmt::print("compile swarmcert_network.cpp with -std=c++17 -O2 -ffp-contract=off -I{}\n", options.output);
    fmt::print("weights: {} bytes of flash", result.weights_bytes);
    if (!result.fits())
      fmt::print(", which do not fit into the {} of a Crazyflie: {}", firmware::kCrazyflieFlash_bytes,
                 firmware::kSmallerNetwork);
    fmt::print("\n");
  }
  std::vector<std::string> next = network_words(options.network);
  next.insert(next.begin(), "match");
  next.push_back(options.output);
  print_next(common, next);
  return kDone;
}

}  // namespace

Command export_command() {
  return {
      "export", "Write firmware source for a network, with golden vectors and a self-test",
      "Writes the weights as hexadecimal floats, the clamp, the scale to newton, the evaluator, and golden "
      "vectors\nthat the firmware checks at start. 'swarmcert match' proves that a source file or an ELF "
      "still holds these weights.\n\n"
      "Example: swarmcert export nn/networks/demo/network.toml -o firmware",
      [](CLI::App& app) {
        const auto options = std::make_shared<ExportOptions>();
        declare_network(app, options->network);
        add_output(app, "-o,--output", options->output, "Folder for the source")->required();
        declare_as(app, options->as);
        app.add_option("--certificate", options->certificate,
                       "Certificate whose hash is written into the source");
        app.add_option("--most-neighbours", options->source.most_neighbours,
                       "Largest number of neighbours in one evaluation")
            ->check(CLI::Range(1, 64))
            ->capture_default_str();
        app.add_option("--seed", options->source.seed, "Seed of the golden vectors")->capture_default_str();
        return [options](const CommonOptions& common) { return run_export(*options, common); };
      },
      fields_of<ExportResult>()};
}

}  // namespace swarmcert::analysis
