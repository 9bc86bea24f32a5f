// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/http/message.hpp>

#include "server/http/message.h"

namespace blockwalk {

// A head as Beast has read it, as plain data; its fields in the order in which they came.
HttpRequest plainRequest(const boost::beast::http::request_header<>& head);

}  // namespace blockwalk
