// SPDX-License-Identifier: Apache-2.0
#include "protocol/problem.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "protocol/json_text.h"

namespace blockwalk {
namespace {

TEST(Problem, ItsTextIsThatOfItsDocument) {
  const Problem problems[] = {
      {.status = 400, .detail = "size: must be WxH", .field = "size"},
      {.status = 503, .detail = "the server is out of memory", .field = {}},
      {.status = 404, .detail = "quotes \" and \\ and \n and \x01 and \xc3\xa9 and no UTF-8: \xff", .field = "a\"b"},
      {.status = 599, .detail = "", .field = {}},
  };
  for (const Problem& problem : problems) EXPECT_EQ(problemText(problem), writeJson(problemJson(problem)));
}

}  // namespace
}  // namespace blockwalk
