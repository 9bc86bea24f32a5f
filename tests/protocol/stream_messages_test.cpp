// SPDX-License-Identifier: Apache-2.0
#include "protocol/stream_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "protocol/json_text.h"
#include "protocol/view_fields.h"
#include "protocol/view_values.h"

namespace blockwalk {
namespace {

using nlohmann::json;

TEST(ClientMessages, ReadEachType) {
  const auto view = std::get<ViewMessage>(parseClientMessage(R"({"type":"view","id":7,"fov":30,"range":[1,2]})"));
  EXPECT_EQ(view.id, 7u);
  EXPECT_THAT(view.members, testing::UnorderedElementsAre(testing::Pair("fov", "30"), testing::Pair("range", "1:2")));
  EXPECT_EQ(std::get<AckMessage>(parseClientMessage(R"({"type":"ack","id":9007199254740992})")).id, kMaxMessageId);
  const auto limits = std::get<LimitsMessage>(parseClientMessage(R"({"type":"limits","fps":15})"));
  EXPECT_EQ(limits.fps, 15);
  EXPECT_FALSE(limits.max_bytes_per_second.has_value());
  EXPECT_EQ(std::get<PingMessage>(parseClientMessage(R"({"type":"ping","t":1.5})")).time, 1.5);
}

struct BadMessage {
  const char* text;
  const char* field;
  int id;  // -1: none
};

class BadMessages : public testing::TestWithParam<BadMessage> {};

TEST_P(BadMessages, NameTheFieldAndTheId) {
  try {
    parseClientMessage(GetParam().text);
    FAIL() << GetParam().text << " was accepted";
  } catch (const MessageError& error) {
    EXPECT_EQ(error.problem.status, 400);
    EXPECT_EQ(error.problem.field, GetParam().field);
    EXPECT_EQ(error.id ? static_cast<int>(*error.id) : -1, GetParam().id);
  }
}

const BadMessage kBadMessages[] = {
    {"", "", -1},
    {"[]", "", -1},
    {"5", "", -1},
    {"{", "", -1},
    {R"({"type":"view","type":"view","id":1})", "type", -1},
    {R"({})", "type", -1},
    {R"({"type":5})", "type", -1},
    {R"({"type":"wiev","id":1})", "type", -1},
    {R"({"type":"view"})", "id", -1},
    {R"({"type":"view","id":-1})", "id", -1},
    {R"({"type":"view","id":1.5})", "id", -1},
    {R"({"type":"view","id":"1"})", "id", -1},
    {R"({"type":"view","id":9007199254740993})", "id", -1},
    {R"({"type":"view","id":1e3})", "id", -1},
    {R"({"type":"view","id":4,"eye":null})", "eye", 4},
    {R"({"type":"view","id":4,"eye":{}})", "eye", 4},
    {R"({"type":"ack"})", "id", -1},
    {R"({"type":"ack","id":3,"seq":1})", "seq", 3},
    {R"({"type":"limits","fps":0})", "fps", -1},
    {R"({"type":"limits","fps":121})", "fps", -1},
    {R"({"type":"limits","fps":"30"})", "fps", -1},
    {R"({"type":"limits","max_bytes_per_second":1023})", "max_bytes_per_second", -1},
    {R"({"type":"limits","max_bytes_per_second":-5})", "max_bytes_per_second", -1},
    {R"({"type":"limits","max_bytes_per_second":1e9})", "max_bytes_per_second", -1},
    {R"({"type":"limits","frames":3})", "frames", -1},
    {R"({"type":"ping"})", "t", -1},
    {R"({"type":"ping","t":"now"})", "t", -1},
    {R"({"type":"ping","t":1,"u":2})", "u", -1},
};
INSTANTIATE_TEST_SUITE_P(Table, BadMessages, testing::ValuesIn(kBadMessages));

// All points of all channels, with as many digits as a number has; what is more is told by its name.
TEST(ClientMessages, HoldTheLongestFunctions) {
  const auto message = [](int count) {
    json functions = json::array();
    for (int channel = 0; channel < kMaxChannels; ++channel) {
      std::vector<TransferPoint> points;
      for (int i = 0; i < count; ++i) {
        points.push_back({.value = -1.2345678901234567e308 + i * 1.0000000000000002e304,
                          .color = glm::dvec3(1),
                          .opacity = 1.2345678901234567e-101 * (i + 1)});
      }
      functions.push_back(transferText(points));
    }
    return json{{"type", "view"}, {"id", 1}, {"tf", functions}}.dump();
  };
  ImageRequest request;
  setViewFields(request, std::get<ViewMessage>(parseClientMessage(message(kMaxTransferPoints))).members);
  EXPECT_EQ(request.view.channels[3].transfer.size(), kMaxTransferPoints);
  try {
    setViewFields(request, std::get<ViewMessage>(parseClientMessage(message(kMaxTransferPoints + 1))).members);
    ADD_FAILURE() << "too many points are taken";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "tf");
    EXPECT_THAT(error.what(), testing::HasSubstr("1 to 1024 points"));
  }
}

TEST(ServerMessages, HaveTheirMembers) {
  const json hello = parseJson(helloMessage(R"({"id":"rock"})", {.frames_in_flight = 3, .fps = 30}));
  EXPECT_EQ(hello["type"], "hello");
  EXPECT_EQ(hello["version"], "blockwalk.v1");
  EXPECT_EQ(hello["volume"]["id"], "rock");
  EXPECT_EQ(hello["limits"]["frames_in_flight"], 3);
  const json error = parseJson(errorMessage({.status = 400, .detail = "d", .field = "eye"}, 5));
  EXPECT_EQ(error, parseJson(R"({"type":"error","id":5,"problem":{"type":"about:blank","title":"Bad Request",
                                 "status":400,"detail":"d","field":"eye"}})"));
  EXPECT_FALSE(parseJson(errorMessage({.status = 400, .detail = "d", .field = ""}, {})).contains("id"));
  EXPECT_EQ(parseJson(pongMessage(2.5)), parseJson(R"({"type":"pong","t":2.5})"));
  const json stats = parseJson(statsMessage(3, 4, {.gpu_ms = 2, .finder = "grid", .kernel = "k", .drawn_pixels = 5}));
  EXPECT_EQ(stats["stats"]["finder"], "grid");
  EXPECT_EQ(stats["stats"]["drawn_pixels"], 5);
  EXPECT_EQ(stats["stats"].size(), 15u);  // the interface's list
  RenderStats built;
  built.finder_build.rebuilt = true;
  built.finder_build.macrocell_voxels = 16;
  built.finder_build.macrocells = 100;
  built.finder_build.active_macrocells = 7;
  const json region = parseJson(statsMessage(3, 4, built))["stats"]["finder_build"];
  EXPECT_EQ(region["macrocell"], 16);
  EXPECT_EQ(region["active_macrocells"], 7);
  EXPECT_EQ(region["rebuilt"], true);
}

FrameHeader sampleHeader() {
  return {.id = 7,
          .seq = 9,
          .width = 4,
          .height = 2,
          .format = "jpeg",
          .level = 1,
          .final = true,
          .complete = true,
          .scale = 0.5,
          .samples = 16,
          .gpu_ms = 1.25,
          .encode_ms = 0.5,
          .dropped = 3,
          .drawn_pixels = 8};
}

TEST(Frames, AreReadBack) {
  const std::vector<std::byte> image{std::byte{1}, std::byte{2}, std::byte{3}};
  const auto message = frameMessage(sampleHeader(), image);
  const ParsedFrame parsed = parseFrameMessage(message);
  EXPECT_EQ(parsed.header, sampleHeader());
  EXPECT_TRUE(std::equal(parsed.image.begin(), parsed.image.end(), image.begin(), image.end()));
}

TEST(Frames, SayWhatCameAndWent) {
  FrameHeader header = sampleHeader();
  header.complete = false;
  header.pages = FramePages{.wanted_blocks = 70, .absent_blocks = 3, .pages_read = 12, .failure = "a.bwv: is cut"};
  EXPECT_EQ(parseFrameMessage(frameMessage(header, {})).header, header);
}

TEST(Frames, SayWhyTheyAreEmpty) {
  FrameHeader header = sampleHeader();
  header.drawn_pixels = 0;
  header.reasons = {{.name = "range", .detail = "none", .change = {{.member = "range", .value = "auto"}}},
                    {.name = "extinction", .detail = "0", .change = {{.member = "extinction", .value = 0.2}}}};
  const auto message = frameMessage(header, {});
  EXPECT_EQ(parseFrameMessage(message).header, header);
  const std::string text(reinterpret_cast<const char*>(message.data()) + 4, message.size() - 4);
  EXPECT_EQ(json::parse(text).at("reasons"), json::parse(R"([
    {"reason": "range", "detail": "none", "change": {"range": "auto"}},
    {"reason": "extinction", "detail": "0", "change": {"extinction": 0.2}}])"));
  header.reasons.clear();
  EXPECT_EQ(parseFrameMessage(frameMessage(header, {})).header, header);
}

TEST(Frames, HaveGoldenBytes) {
  const std::vector<std::byte> image{std::byte{0xff}};
  const auto message = frameMessage(sampleHeader(), image);
  const std::string expected =
      std::string("\xb0\0\0\0", 4) +
      R"({"complete":true,"drawn_pixels":8,"dropped":3,"encode_ms":0.5,"final":true,"format":"jpeg","gpu_ms":1.25,"height":2,)"
      R"("id":7,"level":1,"samples":16,"scale":0.5,"seq":9,"width":4})" +
      "\xff";
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(message.data()), message.size()), expected);
}

TEST(Frames, EveryTruncatedHeaderIsRefused) {
  const auto message = frameMessage(sampleHeader(), {});
  for (std::size_t length = 0; length < message.size(); ++length) {
    EXPECT_THROW(parseFrameMessage(std::span(message).first(length)), DataError) << length;
  }
}

}  // namespace
}  // namespace blockwalk
