#include <algorithm>
#include <stdexcept>

#include "lipschitz/checker/certificate_checker.h"
#include "lipschitz/checker/witness.h"

namespace swarmcert::check {

void CertificateChecker::check_lower(const Json& bound, double lower, const std::vector<double>& scale,
                                     const std::string& where) const {
  const Json& witness = bound["lower_witness"];
  files::require_keys(witness, {"x", "y", "others"}, where);
  const files::FunctionId function = bound["function"].get<std::string>();
  const auto point = [&](const Json& array, const files::FunctionId& part) {
    const std::vector<double> values = files::parse_hex_floats(array);
    const std::vector<float> result(values.begin(), values.end());
    require(std::equal(values.begin(), values.end(), result.begin()),
            where + ": a coordinate is not a float32");
    if (bound["domain"] == "box") {
      const std::vector<double> lower_end =
          files::parse_hex_floats(certificate_["box"].at(part.name()).at("lower"));
      const std::vector<double> upper_end =
          files::parse_hex_floats(certificate_["box"].at(part.name()).at("upper"));
      for (std::size_t k = 0; k < values.size(); ++k)
        require(lower_end.at(k) <= values[k] && values[k] <= upper_end.at(k),
                where + ": a point is outside of the box");
    }
    return result;
  };
  const files::FunctionId moved = function.input_part();
  lipschitz::SlopePoints points{point(witness["x"], moved), point(witness["y"], moved), {}};
  std::vector<files::FunctionId> others;
  require(witness["others"].is_array(), where + ": others is not an array");
  Neighbours there = {{moved.kind(), 1}};
  for (const Json& other : witness["others"]) {
    files::require_keys(other, {"network", "x"}, where + ".others");
    others.emplace_back(other["network"].get<std::string>());
    points.others.push_back(point(other["x"], others.back()));
    ++there[others.back().kind()];
  }
  const Neighbours neighbours = neighbours_of(bound, where);
  for (const auto& [kind, count] : there)
    require(neighbours.empty() || kind == files::kGroundKind ||
                (neighbours.count(kind) == 1 && count <= neighbours.at(kind)),
            where + ": has more neighbours than listed");
  const mpq_class square = lipschitz::slope_squared(
      lipschitz::slope_function(network_, function, others), points,
      files::block_coordinates(network_, function, bound["block"].get<std::string>()), scale);
  require(mpq_class(lower) * mpq_class(lower) <= square,
          where + ": claims more than the slope between x and y");
}

}  // namespace swarmcert::check
