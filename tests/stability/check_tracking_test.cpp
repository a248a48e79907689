#include "stability/checker/check_tracking.h"

#include <gtest/gtest.h>

#include "nn/base/content_hash.h"

namespace swarmcert::check {
namespace {

using files::Json;

constexpr char kNoHash[] = "";

/// A certificate without loops, with a valid content hash.
Json empty_certificate() {
  return {{"schema", kTrackingSchema},
          {"tool", "test"},
          {"statement", kTrackingStatement},
          {"gains_sha256", std::string(64, 'a')},
          {"model_sha256", std::string(64, 'b')},
          {"loops", Json::array()},
          {"sampled_loops", Json::array()},
          {"left_out", Json::array()}};
}

TrackingVerdict verdict_of(Json certificate, const std::string& gains = kNoHash,
                           const std::string& model = kNoHash) {
  certificate["content_sha256"] = files::content_sha256(certificate);
  return check_tracking(certificate, gains, model);
}

TEST(CheckTracking, AnswersWhatIsNoCertificateWithAReasonAndNoException) {
  for (const char* const text : {"null", "1", "\"text\"", "[]", "{}", "{\"schema\": 3}", "[[[]]]"}) {
    const TrackingVerdict verdict = check_tracking(Json::parse(text), kNoHash, kNoHash);
    EXPECT_FALSE(verdict.accepted) << text;
    EXPECT_FALSE(verdict.reason.empty()) << text;
    EXPECT_EQ(verdict.gains, 0) << text;
  }
}

TEST(CheckTracking, RefusesAnotherStatementEvenWithAForgedContentHash) {
  Json other = empty_certificate();
  other["statement"] = "For every loop, whatever it is: the tracking error is 0.";
  const TrackingVerdict verdict = verdict_of(other);
  EXPECT_FALSE(verdict.accepted);
  EXPECT_NE(verdict.reason.find("statement"), std::string::npos) << verdict.reason;
}

TEST(CheckTracking, NamesTheFieldThatIsMissingOrOfAnotherType) {
  for (const char* const field : {"loops", "sampled_loops", "left_out"}) {
    Json without = empty_certificate(), other = empty_certificate();
    without.erase(field);
    other[field] = "text";
    EXPECT_NE(verdict_of(without).reason.find(field), std::string::npos) << verdict_of(without).reason;
    EXPECT_NE(verdict_of(other).reason.find(field), std::string::npos) << verdict_of(other).reason;
    EXPECT_FALSE(verdict_of(without).accepted || verdict_of(other).accepted);
  }
}

TEST(CheckTracking, RefusesACertificateOfOtherFiles) {
  const TrackingVerdict gains = verdict_of(empty_certificate(), std::string(64, 'c'));
  const TrackingVerdict model = verdict_of(empty_certificate(), kNoHash, std::string(64, 'c'));
  EXPECT_FALSE(gains.accepted || model.accepted);
  EXPECT_NE(gains.reason.find("gains_sha256"), std::string::npos) << gains.reason;
  EXPECT_NE(model.reason.find("model_sha256"), std::string::npos) << model.reason;
}

TEST(CheckTracking, RefusesAContentHashOfAnotherDocument) {
  Json certificate = empty_certificate();
  certificate["content_sha256"] = files::content_sha256(certificate);
  certificate["tool"] = "another";
  const TrackingVerdict verdict = check_tracking(certificate, kNoHash, kNoHash);
  EXPECT_FALSE(verdict.accepted);
  EXPECT_NE(verdict.reason.find("content_sha256"), std::string::npos) << verdict.reason;
}

}  // namespace
}  // namespace swarmcert::check
