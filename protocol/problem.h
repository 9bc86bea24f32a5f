// SPDX-License-Identifier: Apache-2.0
// RFC 9457 problem documents: the one form of every error on the wire.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "volume/error.h"

namespace blockwalk {

constexpr std::string_view kProblemMimeType = "application/problem+json";

struct Problem {
  int status = 500;    // as HTTP's
  std::string detail;  // a sentence for people: what is wrong, and the bound
  std::string field;   // the member, header or parameter to blame; empty: none
};

// Carries a problem out of nested code.
struct ProblemError : DataError {
  explicit ProblemError(Problem document) : DataError(document.detail), problem(std::move(document)) {}
  Problem problem;
};

// {"type":"about:blank","title","status","detail","field"?}; the title is the status's reason phrase.
nlohmann::json problemJson(const Problem& problem);

// The same as text, made without a document: also where little memory is left.
std::string problemText(const Problem& problem);

// "Not Found" for 404; "Error" for a status that this server never sends.
std::string_view reasonPhrase(int status);

}  // namespace blockwalk
