#include "nn/weights/parametrized.h"

#include <cmath>
#include <set>

#include "nn/base/input_error.h"
#include "nn/weights/enclosed.h"

namespace swarmcert::files {
namespace {

struct Style {
  const char* matrix;  ///< suffix of the name of the stored matrix
  const char* first;   ///< suffix for u or g
  const char* second;  ///< suffix for v; empty: weight_norm
};

constexpr Style kStyles[] = {
    {"weight_orig", "weight_u", "weight_v"},
    {"parametrizations.weight.original", "parametrizations.weight.0._u", "parametrizations.weight.0._v"},
    {"weight_v", "weight_g", ""},
    {"parametrizations.weight.original1", "parametrizations.weight.original0", ""},
};

class Parametrizations {
 public:
  Parametrizations(const std::vector<DeclaredTensor>& tensors, const TensorReader& read,
                   const std::string& path)
      : tensors_(tensors), read_(read), path_(path) {
    for (std::size_t i = 0; i < tensors.size(); ++i) index_.emplace(tensors[i].name, i);
  }

  EffectiveTensors run() {
    std::map<std::size_t, std::pair<const Style*, std::string>> matrices;  // with the layer's prefix
    for (std::size_t i = 0; i < tensors_.size(); ++i)
      for (const Style& style : kStyles)
        if (const auto prefix = prefix_before(tensors_[i].name, style.matrix);
            prefix && has(*prefix + style.first)) {
          if (holds_weight_itself(style, *prefix)) {
            for (const char* part : {style.matrix, style.first}) leave_unused(*prefix + part);
            continue;
          }
          matrices[i] = {&style, *prefix};
          for (const char* part : {style.first, style.second})
            if (*part != '\0' && has(*prefix + part)) used_.insert(index_.at(*prefix + part));
        }
    for (std::size_t i = 0; i < tensors_.size(); ++i) {
      const auto matrix = matrices.find(i);
      if (used_.count(i) == 1) continue;
      if (matrix == matrices.end()) {
        refuse_leftover(i);
        result_.tensors.push_back(tensors_[i]);
        result_.sources.push_back(i);
        continue;
      }
      compute(i, *matrix->second.first, matrix->second.second);
    }
    return std::move(result_);
  }

 private:
  [[noreturn]] void refuse(std::size_t i, const std::string& value, const std::string& what) const {
    throw InputError(
        {path_, "", tensors_[i].name, value, what,
         "remove the parametrization before saving: "
         "torch.nn.utils.parametrize.remove_parametrizations(layer, \"weight\"), "
         "torch.nn.utils.remove_spectral_norm(layer) or torch.nn.utils.remove_weight_norm(layer)"});
  }

  bool has(const std::string& name) const { return index_.count(name) == 1; }

  /// Returns whether the file holds the weight under spectral_norm beside what it was computed from, and lacks v.
  bool holds_weight_itself(const Style& style, const std::string& prefix) const {
    return *style.second != '\0' && !has(prefix + style.second) && has(prefix + "weight");
  }

  void leave_unused(const std::string& name) {
    used_.insert(index_.at(name));
    result_.unused.push_back(name + ": the file holds the weight itself, as spectral_norm computed it last");
  }

  /// Returns the prefix before `ending`: "fc1." for the name "fc1.weight_orig" and the ending "weight_orig".
  static std::optional<std::string> prefix_before(const std::string& name, const std::string& ending) {
    if (name.size() < ending.size()) return std::nullopt;
    const std::string prefix = name.substr(0, name.size() - ending.size());
    if (name.compare(prefix.size(), ending.size(), ending) != 0) return std::nullopt;
    if (!prefix.empty() && prefix.back() != '.') return std::nullopt;
    return prefix;
  }

  /// Rejects a tensor of an unknown parametrization.
  void refuse_leftover(std::size_t i) const {
    const std::string& name = tensors_[i].name;
    const bool is_known = name.find("parametrizations.") != std::string::npos ||
                          prefix_before(name, "weight_g") || prefix_before(name, "weight_orig") ||
                          prefix_before(name, "weight_u");
    if (is_known)
      refuse(i, "", "the weight is parametrised, and the file does not hold all that it is computed from");
  }

  std::vector<double> numbers(std::size_t i, const std::vector<std::uint64_t>& shape) const {
    const DeclaredTensor& tensor = tensors_[i];
    if (tensor.shape != shape)
      refuse(i, shape_text(tensor.shape), "the parametrization needs the shape " + shape_text(shape));
    if (!tensor.precision) refuse(i, tensor.type, "does not hold floating-point numbers");
    std::vector<double> result = read_(i);
    for (const double number : result)
      if (!std::isfinite(number)) refuse(i, "", "holds a number that is not finite");
    return result;
  }

  void compute(std::size_t i, const Style& style, const std::string& prefix) {
    const std::vector<std::uint64_t>& shape = tensors_[i].shape;
    const bool fits = shape.size() == 2 && shape[0] > 0 && shape[1] > 0 && element_count(shape);
    if (!fits) refuse(i, shape_text(shape), "only the weights of linear layers may be parametrised");
    const std::vector<double> stored = numbers(i, shape);
    const bool is_spectral = *style.second != '\0';
    if (is_spectral && !has(prefix + style.second))
      refuse(i, "", "the weight is under spectral_norm, but the file holds no " + prefix + style.second);
    const std::vector<Enclosed> sigma =
        is_spectral ? std::vector<Enclosed>{sigma_of(i, stored, index_.at(prefix + style.first),
                                                     index_.at(prefix + style.second))}
                    : std::vector<Enclosed>();
    const std::vector<double> g =
        is_spectral ? std::vector<double>() : numbers(index_.at(prefix + style.first), {shape[0], 1});
    EffectiveTensors::Computed computed;
    std::vector<double> radii;
    for (std::uint64_t row = 0; row < shape[0]; ++row) {
      const double* const first = stored.data() + row * shape[1];
      const Enclosed divisor = is_spectral ? sigma[0] : length(i, first, shape[1]);
      for (std::uint64_t k = 0; k < shape[1]; ++k) {
        const Enclosed number{first[k], 0};
        const Enclosed entry = divided(is_spectral ? number : times({g[row], 0}, number), divisor);
        computed.numbers.push_back(entry.value);
        if (entry.radius > 0) radii.push_back(entry.radius);
      }
    }
    computed.rounding = norm_up(radii);
    DeclaredTensor tensor = tensors_[i];
    tensor.name = prefix + "weight";
    result_.computed[result_.tensors.size()] = std::move(computed);
    result_.tensors.push_back(std::move(tensor));
    result_.sources.push_back(i);
    result_.notes.push_back(
        prefix + "weight is computed from its " +
        (is_spectral ? "spectral_norm, W / (u' W v) with the stored u and v" : "weight_norm, g v / |v|") +
        ", as PyTorch evaluates it after eval()");
  }

  /// Returns the divisor of the weight, u' W v.
  Enclosed sigma_of(std::size_t i, const std::vector<double>& stored, std::size_t u_index,
                    std::size_t v_index) const {
    const std::vector<std::uint64_t>& shape = tensors_[i].shape;
    const std::vector<double> u = numbers(u_index, {shape[0]}), v = numbers(v_index, {shape[1]});
    ExactSum sigma;
    for (std::uint64_t row = 0; row < shape[0]; ++row) {
      ExactSum product;
      for (std::uint64_t k = 0; k < shape[1]; ++k)
        product.add_product({stored[row * shape[1] + k], 0}, {v[k], 0});
      sigma.add_product({u[row], 0}, product.value());
    }
    return usable(i, sigma.value());
  }

  Enclosed length(std::size_t i, const double* row, std::uint64_t size) const {
    ExactSum squares;
    for (std::uint64_t k = 0; k < size; ++k) squares.add_product({row[k], 0}, {row[k], 0});
    return usable(i, square_root(squares.value()));
  }

  Enclosed usable(std::size_t i, const Enclosed& divisor) const {
    if (!std::isfinite(divisor.value) || !(std::fabs(divisor.value) > 2 * divisor.radius))
      refuse(i, "", "the norm that the weight is divided by is 0 or beyond the range of double");
    return divisor;
  }

  const std::vector<DeclaredTensor>& tensors_;
  const TensorReader& read_;
  const std::string& path_;
  std::map<std::string, std::size_t> index_;
  std::set<std::size_t> used_;
  EffectiveTensors result_;
};

}  // namespace

EffectiveTensors effective_tensors(const std::vector<DeclaredTensor>& tensors, const TensorReader& read,
                                   const std::string& path) {
  return Parametrizations(tensors, read, path).run();
}

}  // namespace swarmcert::files
