// SPDX-License-Identifier: Apache-2.0
#include "server/http/tls.h"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <string>
#include <string_view>

#include "server/base/small_file.h"

namespace blockwalk {

namespace ssl = boost::asio::ssl;
using boost::system::error_code;

namespace {

// OpenSSL's own words say which of its rooms refused, "PEM lib", and not what it was given.
std::string certificateFault(const error_code& error) {
  const auto code = static_cast<unsigned long>(error.value());
  if (ERR_GET_LIB(code) == ERR_LIB_SSL) return fmt::format("cannot be used: {}", error.message());
  return "holds no certificate in PEM (-----BEGIN CERTIFICATE-----), or a broken one";
}

std::string keyFault(const error_code& error, std::string_view key) {
  const auto code = static_cast<unsigned long>(error.value());
  if (ERR_GET_LIB(code) == ERR_LIB_X509) return "is not the key of the certificate in --tls-cert";
  if (key.find("ENCRYPTED") != std::string_view::npos) return "needs a passphrase; give the key without one";
  if (ERR_GET_LIB(code) == ERR_LIB_SSL) return fmt::format("cannot be used: {}", error.message());
  return "holds no private key in PEM (-----BEGIN PRIVATE KEY-----), or a broken one";
}

}  // namespace

std::shared_ptr<ssl::context> loadTls(const ServerOptions& options) {
  if (options.tls_cert.empty() && options.tls_key.empty()) return nullptr;
  if (options.tls_cert.empty() || options.tls_key.empty()) {
    throw UsageError("--tls-cert and --tls-key come together: one of them is missing");
  }
  auto tls = std::make_shared<ssl::context>(ssl::context::tls_server);
  tls->set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
  // Of 1.2; those of 1.3 all have both.
  if (SSL_CTX_set_cipher_list(tls->native_handle(), "ECDHE+AESGCM:ECDHE+CHACHA20") != 1) {
    failData("TLS: this OpenSSL has no cipher with forward secrecy");
  }
  const auto refuse = [](const char* flag, const std::filesystem::path& file, std::string_view why) {
    throw UsageError(fmt::format("{}: '{}' {}", flag, file.string(), why));
  };
  error_code error;
  const std::string chain = readSmallFile("tls-cert", options.tls_cert);
  tls->use_certificate_chain(boost::asio::buffer(chain), error);
  if (error) refuse("--tls-cert", options.tls_cert, certificateFault(error));
  // Nobody is there to be asked for a passphrase.
  tls->set_password_callback([](std::size_t, ssl::context::password_purpose) { return std::string(); }, error);
  const std::string key = readSmallFile("tls-key", options.tls_key);
  tls->use_private_key(boost::asio::buffer(key), ssl::context::pem, error);
  if (error) refuse("--tls-key", options.tls_key, keyFault(error, key));
  // Of another type than the certificate's it was taken.
  if (SSL_CTX_check_private_key(tls->native_handle()) != 1) {
    refuse("--tls-key", options.tls_key, "is not the key of the certificate in --tls-cert");
  }
  return tls;
}

}  // namespace blockwalk
