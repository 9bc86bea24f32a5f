// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <memory>

#include "server/base/options.h"

namespace blockwalk {

// TLS 1.3, and 1.2 with forward secrecy and authenticated encryption only. Null when the options name no certificate.
// Throws UsageError where one of certificate and key is missing or cannot be read, and where a file is none or the key
// is not the certificate's: it names the file and what is expected of it.
std::shared_ptr<boost::asio::ssl::context> loadTls(const ServerOptions& options);

}  // namespace blockwalk
