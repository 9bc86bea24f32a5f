// SPDX-License-Identifier: Apache-2.0
// The interface's own description, walked: what it names is there, and what is there it names.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "protocol/animation_request.h"
#include "protocol/view_fields.h"
#include "server/routes.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

using nlohmann::json;

void expectReferencesResolve(const json& document, const json& value) {
  if (value.is_object() && value.contains("$ref")) {
    const auto target = value["$ref"].get<std::string>();
    ASSERT_EQ(target.substr(0, 1), "#");
    EXPECT_TRUE(document.contains(json::json_pointer(target.substr(1)))) << target;
  }
  if (!value.is_structured()) return;
  for (const json& inner : value) expectReferencesResolve(document, inner);
}

json resolved(const json& document, const json& value) {
  return value.contains("$ref") ? document.at(json::json_pointer(value["$ref"].get<std::string>().substr(1))) : value;
}

class OpenApi : public testing::Test {
 protected:
  json document() {
    const auto reply = get(server_.port(), "/api/v1/openapi.json");
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.fields.at("content-type"), "application/json");
    return reply.json();
  }
  RunningServer server_{};
};

TEST_F(OpenApi, NamesEveryPathMethodAndMember) {
  const json api = document();
  EXPECT_EQ(api["openapi"], "3.1.0");
  EXPECT_EQ(api["info"]["title"], "Blockwalk");
  EXPECT_EQ(api["paths"].size(), interfacePaths().size());
  for (const Path& path : interfacePaths()) {
    ASSERT_TRUE(api["paths"].contains(std::string(path.path))) << path.path;
    const json& operations = api["paths"][std::string(path.path)];
    for (const char* method : {"GET", "HEAD", "POST"}) {
      std::string lower(method);
      for (char& c : lower) c = static_cast<char>(c - 'A' + 'a');
      EXPECT_EQ(operations.contains(lower), path.methods.find(method) != std::string_view::npos) << path.path << method;
    }
  }
  const json& image = api["paths"]["/api/v1/volumes/{id}/image"];
  EXPECT_EQ(image["get"]["parameters"].size(), viewFields().size() + 2);
  EXPECT_EQ(image["post"]["parameters"].size(), 1u);
  const json view = resolved(api, image["post"]["requestBody"]["content"]["application/json"]["schema"]);
  EXPECT_EQ(view["properties"].size(), viewFields().size() + 1);
  for (const ViewField& field : viewFields()) EXPECT_TRUE(view["properties"].contains(std::string(field.name)));
  const json& animate = api["paths"]["/api/v1/volumes/{id}/animate"];
  const json animation = resolved(api, animate["post"]["requestBody"]["content"]["application/json"]["schema"]);
  EXPECT_EQ(animation["properties"].size(), kAnimationMembers.size());
  EXPECT_EQ(resolved(api, animation["properties"]["view"])["properties"].size(), viewFields().size() - 2);
  expectReferencesResolve(api, api);
}

// Whoever follows it is answered, with a type that it names; an unknown member is not in it.
TEST_F(OpenApi, IsWhatTheServerDoes) {
  const json api = document();
  for (const auto& [path, operations] : api["paths"].items()) {
    std::string target = path;
    if (const std::size_t id = target.find("{id}"); id != std::string::npos) target.replace(id, 4, "rock");
    if (!operations.contains("get")) {
      EXPECT_EQ(get(server_.port(), target).status, 405) << path;
      continue;
    }
    std::string query;
    bool has_query = false;
    bool has_id = false;
    for (const json& item : operations["get"].value("parameters", json::array())) {
      const json parameter = resolved(api, item);
      EXPECT_TRUE(parameter["schema"].contains("type"));
      has_id = has_id || parameter["in"] == "path";
      has_query = has_query || parameter["in"] == "query";
      if (parameter["in"] != "query") continue;
      const auto name = parameter["name"].get<std::string>();
      if (parameter["required"] == true) query += fmt::format("{}{}=0", query.empty() ? "?" : "&", name);
      // A member that is known is to blame by itself, or for its value; never for its name.
      const auto blamed = get(server_.port(), fmt::format("{}?{}=%01", target, name));
      EXPECT_EQ(blamed.status, 400) << path << ' ' << name;
      EXPECT_EQ(blamed.body.find("is no member"), std::string::npos) << blamed.body;
    }
    EXPECT_EQ(has_id, target != path);
    // An axis or a plane is required: one of two sets of members, of which none is by itself.
    if (path.ends_with("/slice")) query = "?axis=z&index=0";
    const auto reply = get(server_.port(), target + query);
    const json& responses = operations["get"]["responses"];
    if (responses.contains("101")) {
      EXPECT_EQ(reply.status, 426) << path;
      continue;
    }
    EXPECT_EQ(reply.status, 200) << path << ' ' << reply.body;
    const std::string type = reply.fields.at("content-type");
    EXPECT_TRUE(responses["200"]["content"].contains(type.substr(0, type.find(';')))) << path << ' ' << type;
    const auto unknown = get(server_.port(), target + (query.empty() ? "?" : query + "&") + "no-member=1");
    EXPECT_EQ(unknown.status, 400) << path;
    const json problem = resolved(api, responses["default"])["content"];
    EXPECT_TRUE(problem.contains(unknown.fields.at("content-type"))) << path;
    const json members = resolved(api, problem.begin().value()["schema"])["properties"];
    for (const auto& [member, schema] : members.items()) {
      EXPECT_TRUE(unknown.json().contains(member)) << member;
    }
  }
}

}  // namespace
}  // namespace blockwalk
