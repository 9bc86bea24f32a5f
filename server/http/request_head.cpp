// SPDX-License-Identifier: Apache-2.0
#include "server/http/request_head.h"

namespace blockwalk {

HttpRequest plainRequest(const boost::beast::http::request_header<>& head) {
  HttpRequest request{.method = std::string(head.method_string()),
                      .target = std::string(head.target()),
                      .version = static_cast<int>(head.version()),
                      .fields = {},
                      .body = {}};
  for (const auto& field : head) {
    request.fields.emplace_back(std::string(field.name_string()), std::string(field.value()));
  }
  return request;
}

}  // namespace blockwalk
