// SPDX-License-Identifier: Apache-2.0
// The messages of WebSocket subprotocol blockwalk.v1, both directions. docs/protocol.md shows each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/problem.h"
#include "view/frame.h"

namespace blockwalk {

constexpr std::string_view kStreamProtocol = "blockwalk.v1";
constexpr std::uint64_t kMaxMessageId = std::uint64_t{1} << 53;   // what a JavaScript number holds exactly
constexpr std::size_t kMaxMessageBytes = std::size_t{256} << 10;  // any view fits, with all points of all channels
constexpr double kMinFps = 1;
constexpr double kMaxFps = 120;
constexpr std::uint64_t kMinBytesPerSecond = 1024;

// Client to server.
struct ViewMessage {
  std::uint64_t id = 0;
  std::vector<std::pair<std::string, std::string>> members;  // to change, in text form: for setViewFields
};
struct AckMessage {
  std::uint64_t id = 0;
};
struct LimitsMessage {
  std::optional<double> fps;
  std::optional<std::uint64_t> max_bytes_per_second;
};
struct PingMessage {
  double time = 0;
};
using ClientMessage = std::variant<ViewMessage, AckMessage, LimitsMessage, PingMessage>;

// A message that is refused; `id` is the message's own where it could be read.
struct MessageError : ProblemError {
  MessageError(Problem document, std::optional<std::uint64_t> message_id)
      : ProblemError(std::move(document)), id(message_id) {}
  std::optional<std::uint64_t> id;
};

// Throws MessageError with status 400: not JSON, an unknown type, an unknown, missing or repeated member, a value out
// of bounds. A view's members are taken over as text; setViewFields judges them.
ClientMessage parseClientMessage(std::string_view text);

// Server to client, text.
struct HelloLimits {
  int frames_in_flight = 3;
  double fps = 30;
};
// `volume`: its document, JSON.
std::string helloMessage(std::string_view volume, const HelloLimits& limits);
std::string errorMessage(const Problem& problem, std::optional<std::uint64_t> id);
std::string statsMessage(std::uint64_t id, std::uint64_t seq, const RenderStats& stats);
std::string pongMessage(double time);

// What a frame had of voxels that come and go (RenderStats).
struct FramePages {
  std::uint64_t wanted_blocks = 0;
  std::uint64_t absent_blocks = 0;
  std::uint64_t pages_read = 0;
  std::string failure = {};  // why some could not be read; empty: all could
  bool operator==(const FramePages&) const = default;
};

// Server to client, binary: u32 little endian header length | JSON header | image.
struct FrameHeader {
  std::uint64_t id = 0;   // the newest view that this frame shows
  std::uint64_t seq = 0;  // of the frame, from 1
  int width = 0;
  int height = 0;
  std::string format;
  int level = 0;
  bool final = false;                 // full resolution, will not improve
  bool complete = true;               // nothing is coarser for want of voxels (docs/large.md)
  std::optional<FramePages> pages{};  // where they come and go
  double scale = 1;                   // of the resolution asked for
  int samples = 1;                    // a pixel, that this frame shows
  double gpu_ms = 0;                  // of all samples that it shows
  double encode_ms = 0;
  std::uint64_t dropped = 0;       // views that no frame showed, so far
  std::uint64_t drawn_pixels = 0;  // that are not background alone
  std::vector<Reason> reasons{};   // why none is; empty where some are
  bool operator==(const FrameHeader&) const = default;
};
// All before the image, so that the image need not be copied.
std::vector<std::byte> frameHead(const FrameHeader& header);
std::vector<std::byte> frameMessage(const FrameHeader& header, std::span<const std::byte> image);

struct ParsedFrame {
  FrameHeader header;
  std::span<const std::byte> image;  // of the message that was parsed
};
// For clients in C++ and tests. Throws DataError.
ParsedFrame parseFrameMessage(std::span<const std::byte> message);

}  // namespace blockwalk
