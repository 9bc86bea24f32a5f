// SPDX-License-Identifier: Apache-2.0
#include "protocol/stream_messages.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "protocol/json_text.h"
#include "protocol/reasons_json.h"
#include "protocol/render_json.h"
#include "protocol/view_json.h"

namespace blockwalk {
namespace {

using nlohmann::json;

// One message while it is read: every failure names the field and carries the id once that is known.
class MessageReader {
 public:
  explicit MessageReader(const json& object) : object_(object) {}

  [[noreturn]] void fail(const std::string& field, const std::string& detail) const {
    throw MessageError({.status = 400, .detail = field + ": " + detail, .field = field}, id_);
  }

  std::uint64_t readId() {
    const json& value = member("id");
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMaxMessageId) {
      fail("id", "must be a whole number from 0 to 2^53");
    }
    id_ = value.get<std::uint64_t>();
    return *id_;
  }

  const json& member(const char* name) const {
    const auto found = object_.find(name);
    if (found == object_.end()) fail(name, "is missing");
    return *found;
  }

  bool has(const char* name) const { return object_.contains(name); }

  void allowOnly(std::initializer_list<std::string_view> names) const {
    for (const auto& [name, value] : object_.items()) {
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        fail(name.substr(0, 40), "is no member of this message");
      }
    }
  }

  std::optional<std::uint64_t> id() const { return id_; }

 private:
  const json& object_;
  std::optional<std::uint64_t> id_;
};

ViewMessage readView(MessageReader& reader, const json& object) {
  static constexpr std::string_view kOwn[] = {"type", "id"};
  ViewMessage message{.id = reader.readId(), .members = {}};
  try {
    message.members = viewFieldTexts(object, kOwn);
  } catch (const ViewError& error) {
    throw MessageError({.status = 400, .detail = error.what(), .field = error.field}, reader.id());
  }
  return message;
}

LimitsMessage readLimits(const MessageReader& reader) {
  reader.allowOnly({"type", "fps", "max_bytes_per_second"});
  LimitsMessage message;
  if (reader.has("fps")) {
    const json& fps = reader.member("fps");
    if (!fps.is_number() || fps.get<double>() < kMinFps || fps.get<double>() > kMaxFps) {
      reader.fail("fps", "must be a number from 1 to 120");
    }
    message.fps = fps.get<double>();
  }
  if (reader.has("max_bytes_per_second")) {
    const json& bytes = reader.member("max_bytes_per_second");
    if (!bytes.is_number_unsigned() || bytes.get<std::uint64_t>() < kMinBytesPerSecond ||
        bytes.get<std::uint64_t>() > kMaxMessageId) {
      reader.fail("max_bytes_per_second", "must be a whole number from 1024 to 2^53");
    }
    message.max_bytes_per_second = bytes.get<std::uint64_t>();
  }
  return message;
}

json parseMessageText(std::string_view text) {
  try {
    return parseJson(text, {.text_bytes = kMaxMessageBytes});
  } catch (const JsonError& error) {
    throw MessageError({.status = 400, .detail = error.what(), .field = error.field}, std::nullopt);
  }
}

}  // namespace

ClientMessage parseClientMessage(std::string_view text) {
  json object = parseMessageText(text);
  const JsonEnd end(object);
  if (!object.is_object()) {
    throw MessageError({.status = 400, .detail = "a message must be a JSON object", .field = {}}, std::nullopt);
  }
  MessageReader reader(object);
  const json& type = reader.member("type");
  if (type == "view") return readView(reader, object);
  if (type == "ack") {
    const AckMessage message{reader.readId()};
    reader.allowOnly({"type", "id"});
    return message;
  }
  if (type == "limits") return readLimits(reader);
  if (type == "ping") {
    reader.allowOnly({"type", "t"});
    const json& time = reader.member("t");
    if (!time.is_number()) reader.fail("t", "must be a number");
    return PingMessage{time.get<double>()};
  }
  reader.fail("type", "must be view, ack, limits or ping");
}

std::string helloMessage(std::string_view volume, const HelloLimits& limits) {
  const json rest = {{"frames_in_flight", limits.frames_in_flight},
                     {"fps", limits.fps},
                     {"max_fps", kMaxFps},
                     {"max_message_bytes", kMaxMessageBytes},
                     {"max_size", {kMaxImageSide, kMaxImageSide}}};
  return fmt::format(R"({{"limits":{},"type":"hello","version":"{}","volume":{}}})", writeJson(rest), kStreamProtocol,
                     volume);
}

std::string errorMessage(const Problem& problem, std::optional<std::uint64_t> id) {
  json message = {{"type", "error"}, {"problem", problemJson(problem)}};
  if (id) message["id"] = *id;
  return writeJson(message);
}

std::string statsMessage(std::uint64_t id, std::uint64_t seq, const RenderStats& stats) {
  return writeJson({{"type", "stats"}, {"id", id}, {"seq", seq}, {"stats", statsJson(stats)}});
}

std::string pongMessage(double time) { return writeJson({{"type", "pong"}, {"t", time}}); }

std::vector<std::byte> frameHead(const FrameHeader& header) {
  json members = {{"id", header.id},           {"seq", header.seq},
                  {"width", header.width},     {"height", header.height},
                  {"format", header.format},   {"level", header.level},
                  {"final", header.final},     {"complete", header.complete},
                  {"scale", header.scale},     {"samples", header.samples},
                  {"gpu_ms", header.gpu_ms},   {"encode_ms", header.encode_ms},
                  {"dropped", header.dropped}, {"drawn_pixels", header.drawn_pixels}};
  if (header.drawn_pixels == 0) members["reasons"] = reasonsJson(header.reasons);
  if (header.pages) {
    members["wanted_blocks"] = header.pages->wanted_blocks;
    members["absent_blocks"] = header.pages->absent_blocks;
    members["pages_read"] = header.pages->pages_read;
    if (!header.pages->failure.empty()) members["page_failure"] = header.pages->failure;
  }
  const std::string text = writeJson(members);
  std::vector<std::byte> head(4 + text.size());
  for (std::size_t i = 0; i < 4; ++i) head[i] = static_cast<std::byte>(text.size() >> (8 * i) & 0xff);
  std::memcpy(head.data() + 4, text.data(), text.size());
  return head;
}

std::vector<std::byte> frameMessage(const FrameHeader& header, std::span<const std::byte> image) {
  std::vector<std::byte> message = frameHead(header);
  message.insert(message.end(), image.begin(), image.end());
  return message;
}

namespace {

std::optional<FramePages> readPages(const json& header) {
  if (!header.contains("pages_read")) return std::nullopt;
  return FramePages{.wanted_blocks = header.at("wanted_blocks").get<std::uint64_t>(),
                    .absent_blocks = header.at("absent_blocks").get<std::uint64_t>(),
                    .pages_read = header.at("pages_read").get<std::uint64_t>(),
                    .failure = header.value("page_failure", std::string())};
}

}  // namespace

ParsedFrame parseFrameMessage(std::span<const std::byte> message) {
  if (message.size() < 4) failData("frame: {} bytes, at least 4 are needed", message.size());
  std::size_t length = 0;
  for (std::size_t i = 0; i < 4; ++i) length |= std::to_integer<std::size_t>(message[i]) << (8 * i);
  if (length > message.size() - 4) {
    failData("frame: header of {} bytes in a message of {}", length, message.size());
  }
  const auto* text = reinterpret_cast<const char*>(message.data() + 4);
  json object = parseJson({text, length});
  const JsonEnd end(object);
  try {
    return {
        .header = {.id = object.at("id").get<std::uint64_t>(),
                   .seq = object.at("seq").get<std::uint64_t>(),
                   .width = object.at("width").get<int>(),
                   .height = object.at("height").get<int>(),
                   .format = object.at("format").get<std::string>(),
                   .level = object.at("level").get<int>(),
                   .final = object.at("final").get<bool>(),
                   .complete = object.at("complete").get<bool>(),
                   .pages = readPages(object),
                   .scale = object.at("scale").get<double>(),
                   .samples = object.at("samples").get<int>(),
                   .gpu_ms = object.at("gpu_ms").get<double>(),
                   .encode_ms = object.at("encode_ms").get<double>(),
                   .dropped = object.at("dropped").get<std::uint64_t>(),
                   .drawn_pixels = object.at("drawn_pixels").get<std::uint64_t>(),
                   .reasons = object.contains("reasons") ? readReasons(object.at("reasons")) : std::vector<Reason>()},
        .image = message.subspan(4 + length)};
  } catch (const json::exception&) {
    failData("frame: a member of the header is missing or has another type");
  }
}

}  // namespace blockwalk
