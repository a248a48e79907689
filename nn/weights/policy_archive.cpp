#include "nn/weights/policy_archive.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/weights/activation.h"
#include "nn/weights/pth.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kLargestEntry_bytes = std::uint64_t{1} << 29;

enum class PolicyKind {
  kActorCritic,  ///< A2C, PPO, TRPO: separate networks of policy and value, tanh by default
  kSac,          ///< SAC, TQC: latent_pi, then mu, then tanh
  kTd3,          ///< TD3, DDPG: mu, which ends in tanh
  kDqn,          ///< DQN: q_net
  kOther
};

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

std::string text_of(const Json& json, const char* key) {
  return json.is_object() && json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
}

PolicyKind kind_of(const Json& policy_class) {
  const std::string module = text_of(policy_class, "__module__");
  if (contains(module, ".sac.") || contains(module, ".tqc.")) return PolicyKind::kSac;
  if (contains(module, ".td3.")) return PolicyKind::kTd3;
  if (contains(module, ".dqn.")) return PolicyKind::kDqn;
  if (module == "stable_baselines3.common.policies") return PolicyKind::kActorCritic;
  return PolicyKind::kOther;
}

std::vector<std::string> prefixes_of(PolicyKind kind, const std::string& word) {
  if (word == "policy" || word == "actor") switch (kind) {
      case PolicyKind::kActorCritic:
        return {"mlp_extractor.policy_net", "action_net"};
      case PolicyKind::kSac:
        return {"actor.latent_pi", "actor.mu"};
      case PolicyKind::kTd3:
        return {"actor.mu"};
      case PolicyKind::kDqn:
        return {"q_net"};
      case PolicyKind::kOther:
        break;
    }
  if (word == "value" && kind == PolicyKind::kActorCritic) return {"mlp_extractor.value_net", "value_net"};
  return {word};
}

/// Returns "relu" for "<class 'torch.nn.modules.activation.ReLU'>"; empty if the settings name none.
std::string stated_activation(const Json& settings) {
  const std::string text = text_of(settings, "activation_fn");
  const std::size_t dot = text.rfind('.');
  const std::size_t end = text.rfind('\'');
  if (dot == std::string::npos || end == std::string::npos || end < dot) return text;
  return text.substr(dot + 1, end - dot - 1);
}

/// Returns whether an unused tensor's name has this part.
bool is_unused(const Weights& weights, const char* part) {
  return std::any_of(weights.unused.begin(), weights.unused.end(),
                     [part](const std::string& name) { return contains(name, part); });
}

}  // namespace

bool is_policy_archive(const ZipArchive& archive) { return archive.has("policy.pth") && archive.has("data"); }

Weights parse_policy_archive(const ZipArchive& archive, const std::string& path, const std::string& key,
                             const LayerChoice& choice) {
  const Json data = parse_json(archive.read("data", kLargestEntry_bytes), path + ": data");
  const PolicyKind kind = kind_of(data.value("policy_class", Json::object()));
  if (!choice.is_stated())
    throw InputError({path, "", "policy.pth", "",
                      "holds the networks of a policy and of its values, and nothing says which to take",
                      kind == PolicyKind::kActorCritic
                          ? "name one: --select policy or --select value"
                          : "name one: --select policy, or a prefix of its layers"});
  LayerChoice own = choice;
  if (own.select.size() == 1) own.select = prefixes_of(kind, own.select.front());
  const std::string nested = archive.read("policy.pth", kLargestEntry_bytes);
  Weights weights = parse_pth_zip(nested, path, key, own);
  if (own.select != choice.select && is_unused(weights, "mlp_extractor.shared_net.")) {
    own.select.insert(own.select.begin(), "mlp_extractor.shared_net");
    weights = parse_pth_zip(nested, path, key, own);
  }
  if (choice.order.empty() && is_unused(weights, "features_extractor."))
    throw InputError({path, "", "features_extractor", "",
                      "has layers in front of the network that is selected",
                      "name the whole chain: --order LAYER,LAYER,..."});
  for (const std::string& name : archive.names())
    if (name != "policy.pth" && name != "data") weights.unused.push_back(name + ": not part of the policy");
  if (weights.layers.size() < 2) return weights;
  std::string between = stated_activation(data.value("policy_kwargs", Json::object()));
  if (between.empty() && kind == PolicyKind::kOther) {
    weights.assumed.push_back(kBetweenGuess + std::string("ReLU; the class of the policy is not known"));
    return weights;
  }
  if (between.empty()) between = kind == PolicyKind::kActorCritic ? "tanh" : "relu";
  std::vector<std::string> words(weights.layers.size() - 1, between);
  const std::string& last = weights.layers.back().name;
  const bool is_squashed =
      (kind == PolicyKind::kSac || kind == PolicyKind::kTd3) && last.compare(0, 5, "actor") == 0;
  if (is_squashed) words.emplace_back("tanh");
  weights.notes.push_back("activations as the policy's class and settings state them");
  return with_activation_of_file(std::move(weights), words, "policy_kwargs");
}

}  // namespace swarmcert::files
