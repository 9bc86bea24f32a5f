// SPDX-License-Identifier: Apache-2.0
#include "tests/cli/fixed_server.h"

#include <arpa/inet.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

namespace blockwalk {
namespace {

// What cannot be set up ends the program: no client is to blame.
void require(bool holds) {
  if (!holds) std::abort();
}

// The bytes of one connection, plain or through TLS.
class Peer {
 public:
  Peer(int socket, SSL_CTX* tls) : socket_(socket), tls_(tls == nullptr ? nullptr : SSL_new(tls), SSL_free) {
    if (!tls_) return;
    SSL_set_fd(tls_.get(), socket);
    greeted_ = SSL_accept(tls_.get()) == 1;
  }
  bool isGreeted() const { return greeted_; }
  long receive(char* buffer, int size) const {
    return tls_ ? SSL_read(tls_.get(), buffer, size) : recv(socket_, buffer, static_cast<std::size_t>(size), 0);
  }
  void send(const std::string& bytes) const {
    if (tls_) {
      if (!bytes.empty()) SSL_write(tls_.get(), bytes.data(), static_cast<int>(bytes.size()));
      SSL_shutdown(tls_.get());
    } else {
      ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    }
  }

 private:
  int socket_;
  std::unique_ptr<SSL, decltype(&SSL_free)> tls_;
  bool greeted_ = true;
};

}  // namespace

FixedServer::FixedServer(std::string answer, const FixedServerOptions& options)
    : answer_(std::move(answer)), options_(options) {
  if (!options_.certificate.empty()) {
    std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
    tls_.reset(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
    require(SSL_CTX_use_certificate_file(tls_.get(), options_.certificate.c_str(), SSL_FILETYPE_PEM) == 1);
    require(SSL_CTX_use_PrivateKey_file(tls_.get(), options_.certificate.c_str(), SSL_FILETYPE_PEM) == 1);
  }
  sockaddr_in6 six{};
  six.sin6_family = AF_INET6;
  six.sin6_addr = in6addr_loopback;
  sockaddr_in four{};
  four.sin_family = AF_INET;
  four.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* address = options_.ipv6 ? reinterpret_cast<sockaddr*>(&six) : reinterpret_cast<sockaddr*>(&four);
  socklen_t size = options_.ipv6 ? sizeof six : sizeof four;
  listener_ = socket(address->sa_family, SOCK_STREAM, 0);
  if (listener_ < 0 || bind(listener_, address, size) != 0 || listen(listener_, 4) != 0 ||
      getsockname(listener_, address, &size) != 0) {
    return;
  }
  port_ = ntohs(options_.ipv6 ? six.sin6_port : four.sin_port);
  thread_ = std::thread([this] { serve(); });
}

FixedServer::~FixedServer() {
  if (listener_ < 0) return;
  shutdown(listener_, SHUT_RDWR);
  if (thread_.joinable()) thread_.join();
  close(listener_);
}

std::string FixedServer::url(const std::string& path) const {
  return std::string(tls_ ? "https://" : "http://") + (options_.ipv6 ? "[::1]:" : "127.0.0.1:") +
         std::to_string(port_) + path;
}

std::string FixedServer::request() const {
  const std::lock_guard lock(mutex_);
  return request_;
}

void FixedServer::serve() {
  for (;;) {
    const int peer = accept(listener_, nullptr, nullptr);
    if (peer < 0) return;
    answerPeer(peer);
    close(peer);
  }
}

void FixedServer::answerPeer(int socket) {
  const Peer peer(socket, tls_.get());
  if (!peer.isGreeted()) return;
  std::string request;
  char buffer[4096];
  const auto isWhole = [&request] {
    const std::size_t end = request.find("\r\n\r\n");
    const std::size_t length = request.find("Content-Length: ");
    if (end == std::string::npos || length > end) return end != std::string::npos;
    return request.size() >= end + 4 + std::stoul(request.substr(length + 16));
  };
  while (!isWhole()) {
    const long got = peer.receive(buffer, sizeof buffer);
    if (got <= 0) break;
    request.append(buffer, static_cast<std::size_t>(got));
  }
  {
    const std::lock_guard lock(mutex_);
    request_ = request;
  }
  peer.send(answer_);
  shutdown(socket, SHUT_WR);
  while (recv(socket, buffer, sizeof buffer, 0) > 0) {
  }
}

std::string answerOf(const std::string& status, const std::string& headers, const std::string& body) {
  return "HTTP/1.1 " + status + "\r\n" + headers + "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

void writeCertificate(const std::filesystem::path& file, const std::string& address) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  X509_set_version(certificate.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), 1);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -60);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), 3600);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* name = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("test"), -1, -1, 0);
  X509_set_issuer_name(certificate.get(), name);
  const std::string names = "IP:" + address;
  const std::unique_ptr<X509_EXTENSION, decltype(&X509_EXTENSION_free)> extension(
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, names.c_str()), X509_EXTENSION_free);
  require(extension && X509_add_ext(certificate.get(), extension.get(), -1) == 1);
  require(X509_sign(certificate.get(), key.get(), EVP_sha256()) != 0);
  const auto close_file = [](std::FILE* open) { std::fclose(open); };
  const std::unique_ptr<std::FILE, decltype(close_file)> out(std::fopen(file.c_str(), "w"), close_file);
  require(out && PEM_write_X509(out.get(), certificate.get()) == 1);
  require(PEM_write_PrivateKey(out.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1);
}

}  // namespace blockwalk
