// SPDX-License-Identifier: Apache-2.0
#include "wire_client.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <span>

#include "protocol/reasons_json.h"
#include "protocol/stream_messages.h"

namespace blockwalk {
namespace {

constexpr int kPatience = 120;  // seconds: ends what hangs, not what is slow
constexpr std::string_view kMask("\x01\x02\x03\x04", 4);

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(tolower(c)); });
  return text;
}

}  // namespace

WireClient::WireClient(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
  const timeval patience{.tv_sec = kPatience, .tv_usec = 0};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
}

WireClient::WireClient(WireClient&& other) noexcept : socket_(other.socket_), buffer_(std::move(other.buffer_)) {
  other.socket_ = -1;
}

WireClient::~WireClient() {
  if (socket_ >= 0) close(socket_);
}

void WireClient::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

void WireClient::finishSending() { shutdown(socket_, SHUT_WR); }

bool WireClient::fill() {
  char bytes[65536];
  const ssize_t count = recv(socket_, bytes, sizeof bytes, 0);
  if (count <= 0) return false;
  buffer_.append(bytes, static_cast<std::size_t>(count));
  return true;
}

std::optional<std::string> WireClient::readBytes(std::size_t count) {
  while (buffer_.size() < count) {
    if (!fill()) return {};
  }
  std::string bytes = buffer_.substr(0, count);
  buffer_.erase(0, count);
  return bytes;
}

bool WireClient::hasBytes() {
  pollfd state{.fd = socket_, .events = POLLIN, .revents = 0};
  return !buffer_.empty() || poll(&state, 1, 0) > 0;
}

bool WireClient::atEnd() { return buffer_.empty() && !fill(); }

std::optional<std::string> WireClient::readChunk() {
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n")) == std::string::npos) {
    if (!fill()) return {};
  }
  const std::size_t size = std::stoul(*readBytes(end + 2), nullptr, 16);
  auto chunk = readBytes(size + 2);
  if (chunk) chunk->resize(size);
  return chunk;
}

std::optional<std::string> WireClient::readChunks() {
  std::string body;
  while (true) {
    const auto chunk = readChunk();
    if (!chunk || chunk->empty()) return chunk ? std::optional(body) : std::nullopt;
    body += *chunk;
  }
}

WireReply WireClient::readReply(bool has_body) {
  WireReply reply;
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
    if (!fill()) return reply;
  }
  const std::string head = *readBytes(end + 4);
  reply.status = std::stoi(head.substr(9, 3));
  for (std::size_t line = head.find("\r\n") + 2; line < end;) {
    const std::size_t stop = head.find("\r\n", line);
    const std::size_t colon = head.find(": ", line);
    reply.fields[lowerCase(head.substr(line, colon - line))] = head.substr(colon + 2, stop - colon - 2);
    line = stop + 2;
  }
  if (has_body && reply.fields["transfer-encoding"] == "chunked") {
    reply.body = readChunks().value_or("(cut short)");
  } else if (has_body && reply.fields.contains("content-length")) {
    reply.body = readBytes(std::stoul(reply.fields["content-length"])).value_or("(cut short)");
  }
  return reply;
}

WireReply request(std::uint16_t port, std::string_view bytes) {
  WireClient client(port);
  client.send(bytes);
  return client.readReply(!bytes.starts_with("HEAD"));
}

WireReply get(std::uint16_t port, std::string_view target, std::string_view more_fields) {
  return request(port, fmt::format("GET {} HTTP/1.1\r\nHost: localhost\r\n{}\r\n", target, more_fields));
}

WireReply post(std::uint16_t port, std::string_view target, std::string_view body, std::string_view type) {
  return request(port,
                 fmt::format("POST {} HTTP/1.1\r\nHost: localhost\r\nContent-Type: {}\r\nContent-Length: {}\r\n\r\n{}",
                             target, type, body.size(), body));
}

int WireMessage::closeCode() const {
  if (opcode != 8 || payload.size() < 2) return 0;
  return static_cast<unsigned char>(payload[0]) << 8 | static_cast<unsigned char>(payload[1]);
}

std::string upgradeHead(std::string_view volume) {
  return fmt::format(
      "GET /api/v1/volumes/{}/stream HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
      "Sec-WebSocket-Protocol: blockwalk.v1\r\n",
      volume);
}

StreamClient::StreamClient(std::uint16_t port, std::string_view volume, std::string_view more_fields) : wire_(port) {
  wire_.send(upgradeHead(volume) + std::string(more_fields) + "\r\n");
  reply_ = wire_.readReply();
}

void StreamClient::sendFrame(int first_byte, std::string_view payload, bool masked) {
  std::string frame(1, static_cast<char>(first_byte));
  const int mask_bit = masked ? 0x80 : 0;
  if (payload.size() < 126) {
    frame += static_cast<char>(mask_bit | static_cast<int>(payload.size()));
  } else {
    const bool is_short = payload.size() < 65536;
    frame += static_cast<char>(mask_bit | (is_short ? 126 : 127));
    for (int shift = is_short ? 8 : 56; shift >= 0; shift -= 8)
      frame += static_cast<char>(payload.size() >> shift & 0xff);
  }
  if (masked) frame += kMask;
  for (std::size_t i = 0; i < payload.size(); ++i) {
    frame += masked ? static_cast<char>(payload[i] ^ kMask[i % 4]) : payload[i];
  }
  wire_.send(frame);
}

std::optional<WireMessage> StreamClient::read() {
  bool is_last = false;
  auto message = readFrameBytes(is_last);
  while (message && !is_last) {
    const auto more = readFrameBytes(is_last);
    if (!more) return {};
    message->payload += more->payload;
  }
  return message;
}

std::optional<WireMessage> StreamClient::readFrameBytes(bool& is_last) {
  const auto head = wire_.readBytes(2);
  if (!head) return {};
  WireMessage message{.opcode = (*head)[0] & 0x0f, .payload = {}};
  is_last = ((*head)[0] & 0x80) != 0;
  std::size_t length = static_cast<std::size_t>((*head)[1] & 0x7f);
  if (length >= 126) {
    const auto bytes = wire_.readBytes(length == 126 ? 2 : 8);
    if (!bytes) return {};
    length = 0;
    for (char byte : *bytes) length = length << 8 | static_cast<unsigned char>(byte);
  }
  const auto payload = wire_.readBytes(length);
  if (!payload) return {};
  message.payload = *payload;
  return message;
}

nlohmann::json StreamClient::readText(std::string_view type) {
  while (const auto message = read()) {
    if (message->opcode == 8) break;
    if (message->opcode != 1) continue;
    nlohmann::json text = nlohmann::json::parse(message->payload);
    if (text["type"] == type) return text;
  }
  ADD_FAILURE() << "the stream ended before a message of type " << type;
  return nlohmann::json::object();
}

nlohmann::json StreamClient::readFrame(bool acknowledge) {
  while (const auto message = read()) {
    if (message->opcode == 8) break;
    if (message->opcode != 2) continue;
    const auto parsed = parseFrameMessage(std::as_bytes(std::span(message->payload)));
    image_.assign(reinterpret_cast<const char*>(parsed.image.data()), parsed.image.size());
    const auto& header = parsed.header;
    if (acknowledge) sendText(fmt::format(R"({{"type":"ack","id":{}}})", header.id));
    nlohmann::json members = {{"id", header.id},           {"seq", header.seq},
                              {"width", header.width},     {"height", header.height},
                              {"format", header.format},   {"final", header.final},
                              {"scale", header.scale},     {"dropped", header.dropped},
                              {"samples", header.samples}, {"drawn_pixels", header.drawn_pixels}};
    if (!header.reasons.empty()) members["reasons"] = reasonsJson(header.reasons);
    return members;
  }
  ADD_FAILURE() << "the stream ended before a frame";
  return nlohmann::json::object();
}

}  // namespace blockwalk
