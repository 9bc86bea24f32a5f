// SPDX-License-Identifier: Apache-2.0
// A client of bare sockets, so that tests can send what no library would, and read exactly what comes back.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace blockwalk {

struct WireReply {
  int status = 0;                             // 0: the connection closed without a reply
  std::map<std::string, std::string> fields;  // names in lower case
  std::string body;
  nlohmann::json json() const { return nlohmann::json::parse(body); }
};

class WireClient {
 public:
  explicit WireClient(std::uint16_t port);
  ~WireClient();
  WireClient(WireClient&& other) noexcept;
  WireClient(const WireClient&) = delete;
  WireClient& operator=(const WireClient&) = delete;

  void send(std::string_view bytes);  // gives up silently when the peer closes
  void finishSending();
  // The next reply; `has_body` false for HEAD. Waits up to two minutes.
  WireReply readReply(bool has_body = true);
  WireReply readHead() { return readReply(false); }
  std::optional<std::string> readChunk();  // empty: the last; none: the connection ended
  bool hasBytes();                         // something can be read at once, the end also
  bool atEnd();                            // nothing more comes, and the peer has closed
  std::optional<std::string> readBytes(std::size_t count);

 private:
  bool fill();
  std::optional<std::string> readChunks();
  int socket_ = -1;
  std::string buffer_;
};

// One request on a connection of its own.
WireReply request(std::uint16_t port, std::string_view bytes);
WireReply get(std::uint16_t port, std::string_view target, std::string_view more_fields = {});
WireReply post(std::uint16_t port, std::string_view target, std::string_view body,
               std::string_view type = "application/json");

struct WireMessage {
  int opcode = 0;  // 1 text, 2 binary, 8 close, 9 ping, 10 pong
  std::string payload;
  int closeCode() const;
};

class StreamClient {
 public:
  // Opens the stream of a volume; `reply().status` is 101 when that worked.
  StreamClient(std::uint16_t port, std::string_view volume, std::string_view more_fields = {});

  const WireReply& reply() const { return reply_; }
  void sendText(std::string_view text) { sendFrame(0x81, text); }
  void sendFrame(int first_byte, std::string_view payload, bool masked = true);
  void sendBytes(std::string_view bytes) { wire_.send(bytes); }
  // A whole message, of one frame or several. Empty: the connection ended.
  std::optional<WireMessage> read();
  // The next text message of this type, passing over others. Fails the test when the connection ends first.
  nlohmann::json readText(std::string_view type);
  // The next frame's header, passing over texts; acknowledged when asked.
  nlohmann::json readFrame(bool acknowledge = true);
  std::size_t lastImageBytes() const { return image_.size(); }
  const std::string& lastImage() const { return image_; }

 private:
  std::optional<WireMessage> readFrameBytes(bool& is_last);

  WireClient wire_;
  WireReply reply_;
  std::string image_;
};

// The upgrade request that StreamClient sends, without its last empty line.
std::string upgradeHead(std::string_view volume);

}  // namespace blockwalk
