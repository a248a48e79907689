#include "analysis/certify_report.h"

#include <fmt/core.h>

#include "analysis/report.h"
#include "nn/files/functions.h"

namespace swarmcert::analysis {

using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;
using lipschitz::Verdict;

std::string write_certify_report(const files::Network& network, const Certification& found, Verdict verdict,
                                 const std::string& folder, bool overwrite) {
  Report report("Lipschitz certificate");
  report.paragraph(
      fmt::format("Verdict: {}. Every upper bound is proved in exact arithmetic for the weights as stored, "
                  "over all inputs, in Euclidean norms; every witnessed value is the slope between two "
                  "float32 points.",
                  name(verdict)));
  report.heading("Lipschitz constants");
  std::vector<std::vector<std::string>> rows;
  std::string data;
  for (const CertifiedBound& bound : found.bounds) {
    const double lower = bound.lower.witness ? bound.lower.witness->slope.value() : 0;
    rows.push_back({bound.function, fmt::format("{:.10g}", bound.upper.value()), name(bound.method),
                    fmt::format("{:.8g}", bound.product.value()), fmt::format("{:.8g}", lower),
                    files::unit(network, bound.function)});
    data += fmt::format("\"{}\" {:.17g} {:.17g} {:.17g}\n", bound.function, bound.product.value(),
                        bound.upper.value(), lower);
  }
  report.table({"function", "proved upper", "method", "product of norms", "witnessed lower", "unit"}, rows);
  report.figure("bounds", data,
                "set style data histograms\nset style fill solid 0.9 noborder\nset logscale y\nset grid y\n"
                "set ylabel 'Lipschitz constant (units in the table)'\nset key outside top center horizontal "
                "noenhanced\n"
                "set xtics noenhanced\nset boxwidth 0.9\n"
                "plot 'bounds.dat' using 2:xtic(1) title 'product of norms' linecolor rgb '#bbbbbb', "
                "'' using 3 title 'proved upper' linecolor rgb '#0072b2', "
                "'' using 4 title 'witnessed lower' linecolor rgb '#e69f00'\n",
                "The true constant lies between the witnessed and the proved value. Logarithmic scale.");
  report.heading("Spectral norms of the layers");
  rows.clear();
  for (const CertifiedLayer& layer : found.layers) {
    rows.push_back({layer.network, layer.name, fmt::format("{:.15g}", layer.norm.norm.lower.value()),
                    fmt::format("{:.15g}", layer.norm.norm.upper.value()),
                    layer.respects_gamma ? name(*layer.respects_gamma) : "not stated"});
  }
  report.table({"network", "layer", "at least", "at most", "within gamma"}, rows);
  report.heading("Inputs");
  rows.clear();
  for (const auto& [part, weights] : files::parts(network))
    rows.push_back({part, weights->path, weights->sha256});
  report.table({"network", "file", "sha256"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
