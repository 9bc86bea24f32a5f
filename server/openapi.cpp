// SPDX-License-Identifier: Apache-2.0
#include "server/openapi.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string>

#include "protocol/animation_request.h"
#include "protocol/image_members.h"
#include "protocol/pick_request.h"
#include "protocol/problem.h"
#include "protocol/region_request.h"
#include "protocol/slice_request.h"
#include "protocol/view_fields.h"

namespace blockwalk {
namespace {

using nlohmann::json;

json reference(std::string_view kind, std::string_view name) {
  return {{"$ref", fmt::format("#/components/{}/{}", kind, name)}};
}

// Members are read from their text, of which `value` says the form.
json parameterOf(const QueryMember& member) {
  return {{"name", member.name},
          {"in", "query"},
          {"required", member.required},
          {"description", fmt::format("{}: {}", member.value, member.help)},
          {"schema", {{"type", "string"}}}};
}

json parametersOf(const Path& path) {
  json parameters = json::array();
  if (path.path.find("{id}") != std::string_view::npos) parameters.push_back(reference("parameters", "id"));
  const auto addMembers = [&](std::span<const QueryMember> members) {
    for (const QueryMember& member : members) parameters.push_back(parameterOf(member));
  };
  if (path.query == Query::image) addMembers(kImageMembers);
  if (path.query == Query::region) addMembers(kRegionMembers);
  if (path.query == Query::slice) addMembers(kSliceMembers);
  if (path.query == Query::pick) addMembers(kPickMembers);
  return parameters;
}

json viewParameters() {
  json list = json::array();
  for (const ViewField& field : viewFields()) list.push_back(reference("parameters", field.name));
  return list;
}

json responsesOf(const Path& path) {
  json content = json::object();
  for (std::string_view rest = path.replies; !rest.empty();) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    content[std::string(rest.substr(0, end))] = json::object();
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return {{path.query == Query::upgrade ? "101" : "200", {{"description", path.summary}, {"content", content}}},
          {"default", reference("responses", "problem")}};
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

json operationOf(const Path& path, std::string_view method) {
  json parameters = parametersOf(path);
  if (method == "POST") parameters.erase(parameters.begin() + 1, parameters.end());  // its body has the members
  json operation = {{"summary", path.summary}, {"responses", responsesOf(path)}};
  if (method == "POST") {
    const json schema = reference("schemas", path.query == Query::animation ? "Animation" : "Image");
    operation["requestBody"] = {{"required", true}, {"content", {{"application/json", {{"schema", schema}}}}}};
  } else if (path.query == Query::image || path.query == Query::view || path.query == Query::pick) {
    for (json& parameter : viewParameters()) parameters.push_back(std::move(parameter));
  }
  if (!parameters.empty()) operation["parameters"] = std::move(parameters);
  return operation;
}

json operationsOf(const Path& path) {
  json operations = json::object();
  for (std::string_view rest = path.methods; !rest.empty();) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    const std::string_view method = rest.substr(0, end);
    if (method != "OPTIONS") operations[lower(method)] = operationOf(path, method);
    rest.remove_prefix(std::min(end + 2, rest.size()));
  }
  return operations;
}

// A member of an object, whatever it may be written as.
json memberSchema(const QueryMember& member, json types) {
  return {{"description", parameterOf(member)["description"]}, {"type", std::move(types)}};
}

json animationSchema() {
  json members = json::object();
  for (const QueryMember& member : kAnimationMembers) {
    members[std::string(member.name)] = memberSchema(member, {"string", "number", "array", "object"});
  }
  members["view"] = {{"description", members["view"]["description"]}, {"$ref", "#/components/schemas/View"}};
  members["keys"]["items"] = {
      {"type", "object"},
      {"required", {"seconds"}},
      {"properties", {{"seconds", {{"type", "number"}}}, {"view", reference("schemas", "View")}}},
      {"additionalProperties", false}};
  return {{"type", "object"}, {"properties", std::move(members)}, {"additionalProperties", false}};
}

json componentsJson() {
  json parameters = {{"id",
                      {{"name", "id"},
                       {"in", "path"},
                       {"required", true},
                       {"description", "of a volume, as /api/v1/volumes lists it"},
                       {"schema", {{"type", "string"}}}}}};
  json members = json::object();
  for (const ViewField& field : viewFields()) {
    const std::string name(field.name);
    const QueryMember member{field.name, field.value, field.help};
    parameters[name] = parameterOf(member);
    members[name] = memberSchema(member, {"string", "number", "boolean", "array"});
  }
  json of_view = members;
  of_view.erase("format");
  of_view.erase("quality");
  for (const QueryMember& member : kImageMembers) {
    members[std::string(member.name)] = memberSchema(member, "number");
  }
  const json problem = {{"type", "object"},
                        {"required", {"type", "title", "status", "detail"}},
                        {"properties",
                         {{"type", {{"type", "string"}}},
                          {"title", {{"type", "string"}}},
                          {"status", {{"type", "integer"}}},
                          {"detail", {{"type", "string"}}},
                          {"field", {{"type", "string"}}}}}};
  return {{"parameters", std::move(parameters)},
          {"schemas",
           {{"Image", {{"type", "object"}, {"properties", std::move(members)}, {"additionalProperties", false}}},
            {"View", {{"type", "object"}, {"properties", std::move(of_view)}, {"additionalProperties", false}}},
            {"Animation", animationSchema()},
            {"Problem", problem}}},
          {"responses",
           {{"problem",
             {{"description", "what is wrong, and with which member (RFC 9457)"},
              {"content", {{std::string(kProblemMimeType), {{"schema", reference("schemas", "Problem")}}}}}}}}},
          {"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}};
}

}  // namespace

json openApiJson(std::span<const Path> paths) {
  json operations = json::object();
  for (const Path& path : paths) operations[std::string(path.path)] = operationsOf(path);
  return {{"openapi", "3.1.0"},
          {"info",
           {{"title", "Blockwalk"},
            {"version", BLOCKWALK_VERSION},
            {"license", {{"name", "Apache-2.0"}, {"identifier", "Apache-2.0"}}}}},
          {"paths", std::move(operations)},
          {"components", componentsJson()},
          {"security", {{{"token", json::array()}}, json::object()}}};
}

}  // namespace blockwalk
