// SPDX-License-Identifier: Apache-2.0
// HTTPS and WSS: the same replies through TLS, and no reply without it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <boost/asio/read.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "server/http/tls.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using TlsStream = asio::ssl::stream<tcp::socket>;

struct CertificateFiles {
  std::filesystem::path certificate;
  std::filesystem::path key;
};

// A certificate for 127.0.0.1, signed by itself, good for an hour.
CertificateFiles makeCertificate(int serial = 1) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  X509_set_version(certificate.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), serial);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -60);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), 3600);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* name = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("localhost"), -1, -1, 0);
  X509_set_issuer_name(certificate.get(), name);
  X509_sign(certificate.get(), key.get(), EVP_sha256());

  CertificateFiles files{.certificate = scratchFolder() / "certificate.pem", .key = scratchFolder() / "key.pem"};
  const auto write = [](const std::filesystem::path& path, auto&& put) {
    const auto close = [](std::FILE* file) { std::fclose(file); };
    const std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "w"), close);
    ASSERT_TRUE(file);
    ASSERT_EQ(put(file.get()), 1);
  };
  write(files.certificate, [&](std::FILE* file) { return PEM_write_X509(file, certificate.get()); });
  write(files.key,
        [&](std::FILE* file) { return PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr); });
  return files;
}

std::string readAll(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Unless it is empty the key needs the passphrase.
std::filesystem::path keyFile(const std::string& name, EVP_PKEY* made, const std::string& passphrase) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(made, EVP_PKEY_free);
  auto path = scratchFolder() / name;
  const auto close = [](std::FILE* file) { std::fclose(file); };
  const std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(path.c_str(), "w"), close);
  EXPECT_EQ(PEM_write_PrivateKey(file.get(), key.get(), passphrase.empty() ? nullptr : EVP_aes_256_cbc(),
                                 reinterpret_cast<const unsigned char*>(passphrase.data()),
                                 static_cast<int>(passphrase.size()), nullptr, nullptr),
            1);
  return path;
}

ServerOptions tlsOptions() {
  const CertificateFiles files = makeCertificate();
  ServerOptions options;
  options.tls_cert = files.certificate;
  options.tls_key = files.key;
  return options;
}

tcp::socket connectTo(asio::io_context& io, std::uint16_t port) {
  tcp::socket socket(io);
  socket.connect({asio::ip::make_address("127.0.0.1"), port});
  return socket;
}

class Tls : public ::testing::Test {
 protected:
  Tls() : server_(tlsOptions(), false) {}

  TlsStream connect() {
    TlsStream stream(connectTo(io_, server_.port()), context_);
    stream.handshake(asio::ssl::stream_base::client);
    return stream;
  }

  http::response<http::string_body> get(const std::string& target) {
    TlsStream stream = connect();
    http::request<http::empty_body> request(http::verb::get, target, 11);
    request.set(http::field::host, "127.0.0.1:" + std::to_string(server_.port()));
    http::write(stream, request);
    beast::flat_buffer buffer;
    http::response<http::string_body> response;
    http::read(stream, buffer, response);
    return response;
  }

  void waitReady() {
    server_.control().hold_load = false;
    ASSERT_TRUE(eventually([&] { return get("/readyz").result_int() == 200; }));
  }

  asio::io_context io_;
  asio::ssl::context context_{asio::ssl::context::tls_client};
  RunningServer server_;
};

TEST_F(Tls, ServesImages) {
  waitReady();
  const auto response = get("/api/v1/volumes/rock/image?size=16x16");
  EXPECT_EQ(response.result_int(), 200u);
  EXPECT_EQ(response[http::field::content_type], "image/png");
  EXPECT_EQ(get("/api/v1/volumes/rock/image?size=0x16").result_int(), 400u);
}

TEST_F(Tls, StreamsFrames) {
  waitReady();
  beast::websocket::stream<TlsStream> socket(connect());
  socket.set_option(beast::websocket::stream_base::decorator(
      [](beast::websocket::request_type& request) { request.set("Sec-WebSocket-Protocol", "blockwalk.v1"); }));
  socket.handshake("127.0.0.1:" + std::to_string(server_.port()), "/api/v1/volumes/rock/stream");
  socket.write(asio::buffer(std::string(R"({"type":"view","id":1,"size":[16,16]})")));
  bool framed = false;
  for (int i = 0; i < 8 && !framed; ++i) {
    beast::flat_buffer buffer;
    socket.read(buffer);
    framed = socket.got_binary();
  }
  EXPECT_TRUE(framed);
  beast::error_code ignored;  // the server may have ended TLS first
  socket.close(beast::websocket::close_code::normal, ignored);
}

TEST_F(Tls, TakesStreamsOfItsOwnPagesOnly) {
  waitReady();
  const std::string host = "127.0.0.1:" + std::to_string(server_.port());
  const auto upgrade = [&](const std::string& origin) {
    beast::websocket::stream<TlsStream> socket(connect());
    socket.set_option(beast::websocket::stream_base::decorator([&](beast::websocket::request_type& request) {
      request.set("Sec-WebSocket-Protocol", "blockwalk.v1");
      request.set(http::field::origin, origin);
    }));
    beast::websocket::response_type response;
    beast::error_code error;  // the response says more
    socket.handshake(response, host, "/api/v1/volumes/rock/stream", error);
    return response.result_int();
  };
  EXPECT_EQ(upgrade("https://" + host), 101u);
  EXPECT_EQ(upgrade("http://" + host), 403u);
}

TEST_F(Tls, AnswersNothingInTheClear) {
  waitReady();
  tcp::socket socket = connectTo(io_, server_.port());
  asio::write(socket, asio::buffer(std::string("GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")));
  std::string answer(256, '\0');
  beast::error_code error;
  const std::size_t count = asio::read(socket, asio::buffer(answer), error);
  EXPECT_TRUE(error);
  EXPECT_THAT(answer.substr(0, count), ::testing::Not(::testing::HasSubstr("HTTP/1.1")));
  EXPECT_EQ(get("/healthz").result_int(), 200u);  // and goes on serving
}

TEST_F(Tls, HasForwardSecrecyAndNoOldCiphers) {
  const auto connects = [&](const char* ciphers, int version) {
    asio::ssl::context context(asio::ssl::context::tls_client);
    SSL_CTX_set_min_proto_version(context.native_handle(), version);
    SSL_CTX_set_max_proto_version(context.native_handle(), version);
    SSL_CTX_set_security_level(context.native_handle(), 0);
    if (version != TLS1_3_VERSION) {
      EXPECT_EQ(SSL_CTX_set_cipher_list(context.native_handle(), ciphers), 1) << ciphers;
    }
    TlsStream stream(connectTo(io_, server_.port()), context);
    beast::error_code error;
    stream.handshake(asio::ssl::stream_base::client, error);
    return !error;
  };
  EXPECT_TRUE(connects("", TLS1_3_VERSION));
  EXPECT_TRUE(connects("ECDHE-ECDSA-AES128-GCM-SHA256", TLS1_2_VERSION));
  EXPECT_TRUE(connects("ECDHE-ECDSA-CHACHA20-POLY1305", TLS1_2_VERSION));
  EXPECT_FALSE(connects("ECDHE-ECDSA-AES128-SHA256", TLS1_2_VERSION)) << "CBC";
  EXPECT_FALSE(connects("ECDHE-ECDSA-AES128-SHA", TLS1_2_VERSION)) << "CBC";
  EXPECT_FALSE(connects("ALL:@SECLEVEL=0", TLS1_1_VERSION));
}

TEST(TlsReload, TakesTheNewCertificateAndABrokenOneLeavesTheOld) {
  const ServerOptions options = tlsOptions();
  RunningServer server(options, false);
  asio::io_context io;
  asio::ssl::context context(asio::ssl::context::tls_client);
  const auto serial = [&] {
    TlsStream stream(connectTo(io, server.port()), context);
    stream.handshake(asio::ssl::stream_base::client);
    const std::unique_ptr<X509, decltype(&X509_free)> certificate(SSL_get1_peer_certificate(stream.native_handle()),
                                                                  X509_free);
    return ASN1_INTEGER_get(X509_get0_serialNumber(certificate.get()));
  };
  EXPECT_EQ(serial(), 1);
  TlsStream open(connectTo(io, server.port()), context);
  open.handshake(asio::ssl::stream_base::client);
  makeCertificate(2);
  server.reload();
  EXPECT_TRUE(eventually([&] { return serial() == 2; }));
  std::ofstream(options.tls_key) << "no key";
  server.reload();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(serial(), 2);
  http::request<http::empty_body> request(http::verb::get, "/healthz", 11);
  request.set(http::field::host, "localhost");
  http::write(open, request);
  beast::flat_buffer buffer;
  http::response<http::string_body> response;
  http::read(open, buffer, response);
  EXPECT_EQ(response.result_int(), 200u) << "what is open stays open";
}

TEST(TlsOptions, WhatIsNoneIsRefusedByNameAndInWords) {
  const ServerOptions good = tlsOptions();
  const auto write = [](const char* name, const std::string& text) {
    auto path = scratchFolder() / name;
    std::ofstream(path) << text;
    return path;
  };
  const std::string key = readAll(good.tls_key);
  makeCertificate(2);  // another key under the same name
  const std::string other_key = readAll(good.tls_key);
  const auto kept_key = write("kept-key.pem", other_key);
  struct Case {
    std::filesystem::path certificate;
    std::filesystem::path key;
    const char* flag;
    const char* says;
  };
  const Case cases[] = {
      {write("text.pem", "no certificate"), kept_key, "--tls-cert", "no certificate in PEM"},
      {write("empty.pem", ""), kept_key, "--tls-cert", "no certificate in PEM"},
      {kept_key, kept_key, "--tls-cert", "no certificate in PEM"},
      {good.tls_cert, write("text-key.pem", "no key"), "--tls-key", "no private key in PEM"},
      {good.tls_cert, good.tls_cert, "--tls-key", "no private key in PEM"},
      {good.tls_cert, write("old-key.pem", key), "--tls-key", "not the key of the certificate"},
      {good.tls_cert, keyFile("rsa.pem", EVP_RSA_gen(2048), ""), "--tls-key", "not the key of the certificate"},
      {good.tls_cert, keyFile("encrypted.pem", EVP_EC_gen("P-256"), "passphrase"), "--tls-key", "passphrase"},
  };
  for (const Case& wrong : cases) {
    const bool is_key = std::string_view(wrong.flag) == "--tls-key";
    try {
      loadTls({.tls_cert = wrong.certificate, .tls_key = wrong.key});
      ADD_FAILURE() << wrong.says;
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(),
                  ::testing::AllOf(::testing::StartsWith(wrong.flag), ::testing::HasSubstr(wrong.says),
                                   ::testing::HasSubstr((is_key ? wrong.key : wrong.certificate).string()),
                                   ::testing::Not(::testing::HasSubstr(" lib"))));
    }
  }
}

}  // namespace
}  // namespace blockwalk
