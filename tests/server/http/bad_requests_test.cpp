// SPDX-License-Identifier: Apache-2.0
// Requests that must be refused: each with its status, a problem document and the field to blame, and a second client
// is served after each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

RunningServer& sharedServer() {
  static RunningServer server;
  return server;
}

void expectServing() {
  static WireClient second(sharedServer().port());
  second.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(second.readReply().status, 200);
}

void expectProblem(const WireReply& reply, int status, const std::string& field) {
  ASSERT_EQ(reply.status, status) << reply.body;
  EXPECT_EQ(reply.fields.at("content-type"), "application/problem+json");
  const nlohmann::json problem = reply.json();
  EXPECT_EQ(problem["status"], status);
  EXPECT_EQ(problem["type"], "about:blank");
  EXPECT_NE(problem["title"], "");
  EXPECT_NE(problem["detail"], "");
  EXPECT_EQ(problem.value("field", ""), field) << problem;
  EXPECT_EQ(reply.fields.contains("allow"), status == 405);
}

struct BadBytes {
  const char* name;
  std::string bytes;
  const char* field;
  int status;
  bool closes;  // the connection must end, with one reply
};

void PrintTo(const BadBytes& bad, std::ostream* out) { *out << bad.name; }

std::string head(const std::string& line, const std::string& fields = "Host: localhost\r\n") {
  return line + "\r\n" + fields + "\r\n";
}

std::string postHead(const std::string& fields) {
  return "POST /api/v1/volumes/rock/image HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" + fields +
         "\r\n";
}

const std::string kNext = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";

const BadBytes kBadBytes[] = {
    {"no_host", "GET / HTTP/1.1\r\n\r\n", "Host", 400, true},
    {"two_hosts", head("GET / HTTP/1.1", "Host: localhost\r\nHost: localhost\r\n"), "Host", 400, true},
    {"empty_host", head("GET / HTTP/1.1", "Host:\r\n"), "Host", 400, true},
    {"host_with_user", head("GET / HTTP/1.1", "Host: a@localhost\r\n"), "Host", 400, true},
    {"host_list", head("GET / HTTP/1.1", "Host: localhost,localhost\r\n"), "Host", 400, true},
    {"host_with_path", head("GET / HTTP/1.1", "Host: localhost/x\r\n"), "Host", 400, true},
    {"host_port_text", head("GET / HTTP/1.1", "Host: localhost:http\r\n"), "Host", 400, true},
    {"host_open_bracket", head("GET / HTTP/1.1", "Host: [::1\r\n"), "Host", 400, true},
    {"foreign_host", head("GET / HTTP/1.1", "Host: evil.example\r\n"), "Host", 403, true},
    {"host_suffix", head("GET / HTTP/1.1", "Host: localhost.evil.example\r\n"), "Host", 403, true},
    {"version_9", head("GET / HTTP/9.9"), "version", 505, true},
    {"version_2_preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "version", 505, true},
    {"no_version", "GET /\r\n\r\n", "", 400, true},
    {"random_bytes", std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", 15), "", 400, true},
    {"absolute_form", head("GET http://localhost/ HTTP/1.1"), "target", 400, true},
    {"connect", head("CONNECT localhost:80 HTTP/1.1"), "target", 400, true},
    {"star_get", head("GET * HTTP/1.1"), "target", 400, true},
    {"fragment", head("GET /#x HTTP/1.1"), "target", 400, true},
    {"unknown_method", head("BREW / HTTP/1.1"), "method", 501, true},
    {"lower_method", head("get / HTTP/1.1"), "method", 501, true},
    {"length_negative", postHead("Content-Length: -1\r\n") + kNext, "Content-Length", 400, true},
    {"length_plus", postHead("Content-Length: +5\r\n") + kNext, "Content-Length", 400, true},
    {"length_hex", postHead("Content-Length: 0x10\r\n") + kNext, "Content-Length", 400, true},
    {"length_list", postHead("Content-Length: 5,5\r\n") + kNext, "Content-Length", 400, true},
    {"length_twice", postHead("Content-Length: 2\r\nContent-Length: 2\r\n") + "{}" + kNext, "Content-Length", 400,
     true},
    {"length_10_30", postHead("Content-Length: 1000000000000000000000000000000\r\n"), "Content-Length", 400, true},
    {"length_large", postHead("Content-Length: 10000000000\r\n"), "body", 413, true},
    {"length_expected", postHead("Content-Length: 10000000000\r\nExpect: 100-continue\r\n"), "body", 413, true},
    {"expect_other", postHead("Content-Length: 2\r\nExpect: tea\r\n") + "{}", "Expect", 417, true},
    {"coding_and_length", postHead("Transfer-Encoding: chunked\r\nContent-Length: 3\r\n") + "0\r\n\r\n" + kNext,
     "Content-Length", 400, true},
    {"coding_last_other", postHead("Transfer-Encoding: chunked, gzip\r\n") + kNext, "Transfer-Encoding", 501, true},
    {"coding_unknown", postHead("Transfer-Encoding: xchunked\r\n") + kNext, "Transfer-Encoding", 501, true},
    {"coding_identity", postHead("Transfer-Encoding: identity\r\n") + kNext, "Transfer-Encoding", 501, true},
    {"coding_empty", postHead("Transfer-Encoding:\r\n") + kNext, "Transfer-Encoding", 501, true},
    {"coding_twice", postHead("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n") + "0\r\n\r\n" + kNext,
     "Transfer-Encoding", 400, true},
    {"coding_old",
     head("POST /api/v1/volumes/rock/image HTTP/1.0", "Host: localhost\r\nTransfer-Encoding: chunked\r\n"),
     "Transfer-Encoding", 400, true},
    {"chunk_negative", postHead("Transfer-Encoding: chunked\r\n") + "-1\r\n{}\r\n0\r\n\r\n", "body", 400, true},
    {"chunk_17_hex", postHead("Transfer-Encoding: chunked\r\n") + "00000000000000002\r\n{}\r\n0\r\n\r\n", "body", 400,
     true},
    {"chunk_32_hex", postHead("Transfer-Encoding: chunked\r\n") + "00000000000000010000000000000000\r\n{", "body", 400,
     true},
    {"chunk_bare_lf", postHead("Transfer-Encoding: chunked\r\n") + "2\n", "body", 400, true},
    {"chunk_data_bare_lf", postHead("Transfer-Encoding: chunked\r\n") + "2\r\n{}\n", "body", 400, true},
    {"chunk_trailer_bare_lf", postHead("Transfer-Encoding: chunked\r\n") + "2\r\n{}\r\n0\r\nA: b\n", "body", 400, true},
    {"chunk_end_bare_lf", postHead("Transfer-Encoding: chunked\r\n") + "2\r\n{}\r\n0\r\n\n", "body", 400, true},
    {"chunk_huge", postHead("Transfer-Encoding: chunked\r\n") + "7fffffff\r\n{", "body", 413, true},
    {"long_line", "GET /" + std::string(200000, 'a') + " HTTP/1.1\r\n", "target", 414, true},
    {"long_field", "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(100000, 'a') + "\r\n\r\n", "header", 431,
     true},
    {"field_no_colon", head("GET / HTTP/1.1", "Host: localhost\r\nnonsense\r\n"), "", 400, true},
    {"field_space", head("GET / HTTP/1.1", "Host : localhost\r\n"), "", 400, true},
    {"put", head("PUT /api/v1/volumes HTTP/1.1"), "method", 405, false},
    {"delete_volume", head("DELETE /api/v1/volumes/rock HTTP/1.1"), "method", 405, false},
    {"put_image", head("PUT /api/v1/volumes/rock/image HTTP/1.1"), "method", 405, false},
    {"post_stream", head("POST /api/v1/volumes/rock/stream HTTP/1.1", "Host: localhost\r\nContent-Length: 0\r\n"),
     "method", 405, false},
    {"post_no_length", postHead(""), "Content-Length", 411, false},
    {"post_text",
     "POST /api/v1/volumes/rock/image HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\n"
     "Content-Length: 2\r\n\r\n{}",
     "Content-Type", 415, false},
    {"post_no_type", "POST /api/v1/volumes/rock/image HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n{}",
     "Content-Type", 415, false},
    {"accept_json_html", head("GET /api/v1/volumes HTTP/1.1", "Host: localhost\r\nAccept: text/html\r\n"), "Accept",
     406, false},
    {"accept_image", head("GET /api/v1/volumes/rock/image HTTP/1.1", "Host: localhost\r\nAccept: image/webp\r\n"),
     "Accept", 406, false},
    {"up_path", head("GET /api/v1/volumes/../../etc/passwd HTTP/1.1"), "id", 404, false},
    {"up_path_encoded", head("GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1"), "", 404, false},
    {"nul_path", head("GET /%00 HTTP/1.1"), "", 404, false},
    {"page_none", head("GET / HTTP/1.1"), "", 404, false},
    {"api_none", head("GET /api/v1/nothing HTTP/1.1"), "", 404, false},
    {"volume_none", head("GET /api/v1/volumes/none HTTP/1.1"), "id", 404, false},
    {"volume_part_none", head("GET /api/v1/volumes/rock/none HTTP/1.1"), "", 404, false},
    {"list_query", head("GET /api/v1/volumes?x=1 HTTP/1.1"), "query", 400, false},
    {"stream_plain", head("GET /api/v1/volumes/rock/stream HTTP/1.1"), "Upgrade", 426, false},
};

class BadRequests : public testing::TestWithParam<BadBytes> {};

TEST_P(BadRequests, AreRefusedOnce) {
  const BadBytes& bad = GetParam();
  WireClient client(sharedServer().port());
  client.send(bad.bytes);
  const WireReply reply = client.readReply();
  expectProblem(reply, bad.status, bad.field);
  if (bad.closes) {
    client.finishSending();
    EXPECT_EQ(client.readReply().status, 0) << "answered twice";
  } else {
    client.send(kNext);
    EXPECT_EQ(client.readReply().status, 200) << "the connection is out of step";
  }
  expectServing();
}

TEST(BadRequests, ALongTargetIsToldItsBoundAndAWayOut) {
  WireClient client(sharedServer().port());
  client.send("GET /api/v1/volumes/rock/image?tf=" + std::string(100000, '1') + " HTTP/1.1\r\n");
  const std::string detail = client.readReply().json()["detail"];
  EXPECT_THAT(detail, testing::HasSubstr("at most 32768 bytes"));
  EXPECT_THAT(detail, testing::HasSubstr("POST .../image"));
}

INSTANTIATE_TEST_SUITE_P(Table, BadRequests, testing::ValuesIn(kBadBytes),
                         [](const auto& test) { return std::string(test.param.name); });

struct BadView {
  const char* query;
  const char* field;
};

const BadView kBadViews[] = {
    {"size=0x1", "size"},
    {"size=8193x1", "size"},
    {"size=5", "size"},
    {"sise=5x5", "sise"},
    {"fov=0", "fov"},
    {"fov=180", "fov"},
    {"fov=1e-300", "fov"},
    {"fov=40&fov=40", "fov"},
    {"fov=30&ortho=2", "ortho"},
    {"ortho=-1", "ortho"},
    {"eye=1,2", "eye"},
    {"eye=nan,0,0", "eye"},
    {"eye=1e400,0,0", "eye"},
    {"eye=1,2,3&target=1,2,3", "target"},
    {"up=0,0,0", "up"},
    {"eye=0,9,0&target=0,0,0&up=0,1,0", "up"},
    {"range=10:5", "range"},
    {"range=nan:nan", "range"},
    {"mode=max", "mode"},
    {"mode=Iso", "mode"},
    {"filter=cubic", "filter"},
    {"step=0", "step"},
    {"extinction=-1", "extinction"},
    {"tf=0:000000:0,1:ffffff:1", "tf"},
    {"tf=0:000000:2", "tf"},
    {"lit=yes", "lit"},
    {"iso=high", "iso"},
    {"clip=1,1,1,0,0,0", "clip"},
    {"level=17", "level"},
    {"level=-1", "level"},
    {"background=red", "background"},
    {"finder=tree", "finder"},
    {"macrocell=12", "macrocell"},
    {"walk=maybe", "walk"},
    {"planes=0,0,0,1", "planes"},
    {"output=normal", "output"},
    {"output=depth&mode=mean", "output"},
    {"format=avif", "format"},
    {"quality=0", "quality"},
    {"%zz=1", "query"},
    {"fov", "query"},
    {"fov=%4", "query"},
};

class BadViews : public testing::TestWithParam<BadView> {};

TEST_P(BadViews, NameTheField) {
  const auto reply = get(sharedServer().port(), std::string("/api/v1/volumes/rock/image?") + GetParam().query);
  expectProblem(reply, 400, GetParam().field);
  expectServing();
}

INSTANTIATE_TEST_SUITE_P(Table, BadViews, testing::ValuesIn(kBadViews));

struct BadBody {
  const char* body;
  const char* field;
};

const BadBody kBadBodies[] = {
    {"", "body"},
    {"{", "body"},
    {"[]", "view"},
    {"5", "view"},
    {"\xef\xbb\xbf{}", "body"},
    {R"({"fov":30,"fov":30})", "fov"},
    {R"({"fov":1e400})", "fov"},
    {R"({"fov":1e-400})", "fov"},
    {R"({"walk":true,"eye":[1,2,1e400]})", "eye"},
    {R"({"tf":[{"value":1,"value":2}]})", "tf"},
    {R"({"fov":1e-300})", "fov"},
    {R"({"eye":["\ud800"]})", "body"},
    {R"({"eye":null})", "eye"},
    {R"({"eye":[1,2]})", "eye"},
    {R"({"eye":{"x":1}})", "eye"},
    {R"({"walk":1})", "walk"},
    {R"({"range":[10,5]})", "range"},
    {R"({"nonsense":1})", "nonsense"},
    {R"({"type":"view"})", "type"},
};

class BadBodies : public testing::TestWithParam<BadBody> {};

TEST_P(BadBodies, NameTheField) {
  const auto reply = post(sharedServer().port(), "/api/v1/volumes/rock/image", GetParam().body);
  expectProblem(reply, 400, GetParam().field);
  expectServing();
}

INSTANTIATE_TEST_SUITE_P(Table, BadBodies, testing::ValuesIn(kBadBodies));

TEST(BadBodies, WhatIsNoJsonIsRefusedWithItsByte) {
  const auto reply = post(sharedServer().port(), "/api/v1/volumes/rock/image", R"({"fov":30,})");
  expectProblem(reply, 400, "body");
  EXPECT_EQ(reply.json()["detail"], "JSON, byte 11: not valid JSON");
}

TEST(BadBodies, DeepNestingIsRefusedByItsDepth) {
  const auto reply = post(sharedServer().port(), "/api/v1/volumes/rock/image", std::string(500000, '['));
  expectProblem(reply, 400, "body");
  EXPECT_THAT(reply.body, testing::HasSubstr("deeper than 32"));
}

struct BadUpgrade {
  const char* name;
  const char* remove;   // a line of the upgrade that is left out
  const char* replace;  // and what stands instead
  int status;
  const char* field;
};

void PrintTo(const BadUpgrade& bad, std::ostream* out) { *out << bad.name; }

const BadUpgrade kBadUpgrades[] = {
    {"no_key", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n", "", 400, "Sec-WebSocket-Key"},
    {"short_key", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n", "Sec-WebSocket-Key: dGhl\r\n", 400,
     "Sec-WebSocket-Key"},
    {"version_12", "Sec-WebSocket-Version: 13\r\n", "Sec-WebSocket-Version: 12\r\n", 426, "Sec-WebSocket-Version"},
    {"no_version", "Sec-WebSocket-Version: 13\r\n", "", 426, "Sec-WebSocket-Version"},
    {"other_protocol", "Sec-WebSocket-Protocol: blockwalk.v1\r\n", "Sec-WebSocket-Protocol: chat\r\n", 400,
     "Sec-WebSocket-Protocol"},
    {"no_protocol", "Sec-WebSocket-Protocol: blockwalk.v1\r\n", "", 400, "Sec-WebSocket-Protocol"},
    {"no_connection", "Connection: Upgrade\r\n", "", 426, "Upgrade"},
    {"foreign_origin", "Host: localhost\r\n", "Host: localhost\r\nOrigin: http://evil.example\r\n", 403, "Origin"},
    {"https_origin", "Host: localhost\r\n", "Host: localhost\r\nOrigin: https://localhost\r\n", 403, "Origin"},
    {"null_origin", "Host: localhost\r\n", "Host: localhost\r\nOrigin: null\r\n", 403, "Origin"},
    {"other_port_origin", "Host: localhost\r\n", "Host: localhost\r\nOrigin: http://localhost:99\r\n", 403, "Origin"},
    {"no_volume", "/rock/", "/none/", 404, "id"},
};

class BadUpgrades : public testing::TestWithParam<BadUpgrade> {};

TEST_P(BadUpgrades, GetNo101) {
  std::string bytes = upgradeHead("rock");
  const std::size_t at = bytes.find(GetParam().remove);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, std::string_view(GetParam().remove).size(), GetParam().replace);
  expectProblem(request(sharedServer().port(), bytes + "\r\n"), GetParam().status, GetParam().field);
  expectServing();
}

INSTANTIATE_TEST_SUITE_P(Table, BadUpgrades, testing::ValuesIn(kBadUpgrades),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace blockwalk
