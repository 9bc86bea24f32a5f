// SPDX-License-Identifier: Apache-2.0
#include "protocol/problem.h"

#include <nlohmann/json.hpp>

#include "protocol/json_text.h"

namespace blockwalk {

nlohmann::json problemJson(const Problem& problem) {
  nlohmann::json document = {{"type", "about:blank"},
                             {"title", reasonPhrase(problem.status)},
                             {"status", problem.status},
                             {"detail", problem.detail}};
  if (!problem.field.empty()) document["field"] = problem.field;
  return document;
}

std::string problemText(const Problem& problem) {
  std::string text = "{\"detail\":" + writeJson(problem.detail);
  if (!problem.field.empty()) text += ",\"field\":" + writeJson(problem.field);
  return text + fmt::format(",\"status\":{},\"title\":\"{}\",\"type\":\"about:blank\"}}", problem.status,
                            reasonPhrase(problem.status));
}

std::string_view reasonPhrase(int status) {
  switch (status) {
    case 100:
      return "Continue";
    case 101:
      return "Switching Protocols";
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 303:
      return "See Other";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 406:
      return "Not Acceptable";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 417:
      return "Expectation Failed";
    case 426:
      return "Upgrade Required";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Error";
  }
}

}  // namespace blockwalk
