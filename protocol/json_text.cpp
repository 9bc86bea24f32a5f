// SPDX-License-Identifier: Apache-2.0
#include "protocol/json_text.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <vector>

namespace blockwalk {
namespace {

using nlohmann::json;

// Tells the receiver below how far the parser has read, which nlohmann's SAX calls do not say.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, std::size_t* read) : at_(at), read_(read) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    ++at_;
    ++*read_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  std::size_t* read_;
};

bool isZeroText(std::string_view number) {
  for (char c : number) {
    if (c == 'e' || c == 'E') return true;
    if (c >= '1' && c <= '9') return false;
  }
  return true;
}

// Recursion is as deep as the document.
void empty(json& value) noexcept {
  if (value.is_array()) {
    auto& elements = value.get_ref<json::array_t&>();
    for (json& element : elements) empty(element);
    elements.clear();
  } else if (value.is_object()) {
    auto& members = value.get_ref<json::object_t&>();
    for (auto& [name, member] : members) empty(member);
    members.clear();
  }
}

// Receives the parser's events and builds the value, with a stack of the containers that are open.
class BoundedBuilder : public json::json_sax_t {
 public:
  BoundedBuilder(const JsonLimits& limits, const std::size_t* read) : limits_(limits), read_(read) {}

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(number_integer_t value) override { return put(value); }
  bool number_unsigned(number_unsigned_t value) override { return put(value); }
  bool number_float(number_float_t value, const string_t& text) override {
    if (value == 0 && !isZeroText(text)) fail("number too small for a double");
    return put(value);
  }
  bool string(string_t& value) override {
    checkLength(value);
    return put(std::move(value));
  }
  bool binary(binary_t&) override { fail("binary values are not JSON"); }
  bool start_object(std::size_t) override { return open(json::object()); }
  bool start_array(std::size_t) override { return open(json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (stack_.size() == 1) member_ = fmt::format("{:.40}", name);
    checkLength(name);
    if (stack_.back()->contains(name)) fail(fmt::format("member '{:.60}' is repeated", name));
    key_ = std::move(name);
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& error) override {
    // Ids 401.. are numbers out of range; the rest are faults of syntax.
    const bool range = error.id >= 401;
    throw JsonError(
        position,
        fmt::format("JSON, byte {}: {}", position, range ? "number too large for a double" : "not valid JSON"),
        range ? member_ : std::string());
  }

  json take() { return std::move(root_); }

 private:
  [[noreturn]] void fail(std::string_view detail) const {
    throw JsonError(*read_, fmt::format("JSON, byte {}: {}", *read_, detail), member_);
  }
  void checkLength(const std::string& text) const {
    if (text.size() > limits_.string_bytes) fail(fmt::format("string longer than {} bytes", limits_.string_bytes));
  }
  json* place(json value) {
    if (++values_ > limits_.values) fail(fmt::format("more than {} values", limits_.values));
    if (stack_.empty()) {
      root_ = std::move(value);
      return &root_;
    }
    json& parent = *stack_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }
  bool put(json value) {
    place(std::move(value));
    return true;
  }
  bool open(json container) {
    if (stack_.size() >= limits_.depth) fail(fmt::format("nested deeper than {}", limits_.depth));
    stack_.push_back(place(std::move(container)));
    return true;
  }
  bool close() {
    stack_.pop_back();
    return true;
  }

  const JsonLimits& limits_;
  const std::size_t* read_;
  json root_;
  const JsonEnd end_{root_};  // where parsing fails half way
  std::size_t values_ = 0;
  std::vector<json*> stack_;  // an element's address is stable while its container is the innermost open one
  std::string key_;
  std::string member_;  // the outermost object's newest
};

}  // namespace

json parseJson(std::string_view text, const JsonLimits& limits) {
  if (text.size() > limits.text_bytes) {
    throw JsonError(limits.text_bytes, fmt::format("JSON: longer than {} bytes", limits.text_bytes));
  }
  // nlohmann-json skips a byte order mark and takes NUL for the end of the text.
  if (text.starts_with("\xef\xbb\xbf")) throw JsonError(0, "JSON, byte 0: byte order mark");
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    throw JsonError(nul, fmt::format("JSON, byte {}: NUL", nul));
  }
  std::size_t read = 0;
  BoundedBuilder builder(limits, &read);
  json::sax_parse(CountingIterator(text.data(), &read), CountingIterator(text.data() + text.size(), &read), &builder);
  return builder.take();
}

JsonEnd::~JsonEnd() { empty(document_); }

std::string writeJson(const json& value) { return value.dump(-1, ' ', true, json::error_handler_t::replace); }

}  // namespace blockwalk
