#include "nn/weights/onnx/onnx.h"

#include "nn/weights/layer_order.h"
#include "nn/weights/onnx/graph.h"
#include "nn/weights/onnx/model.h"

namespace swarmcert::files {

bool looks_like_onnx(const std::string& bytes) {
  // Field 1 (the IR version, a small varint), then the tag of another model field: producer, graph, opset.
  if (bytes.size() < 3 || bytes[0] != '\x08' || bytes[1] < 1 || bytes[1] > 31) return false;
  const std::string tags = "\x12\x1a\x22\x28\x32\x3a\x42";
  return tags.find(bytes[2]) != std::string::npos;
}

Weights parse_onnx(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  Weights weights = OnnxGraph(read_onnx_model(bytes, path), path).run();
  weights.path = path;
  weights.order_source = stated_order(weights.layers, choice, path);
  return weights;
}

}  // namespace swarmcert::files
