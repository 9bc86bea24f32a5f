// SPDX-License-Identifier: Apache-2.0
// Reads JSON text from its beginning to its end, value by value, and keeps nothing of it: however large, it takes no
// memory. Lets a comma pass behind the last member or element, as people write them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace blockwalk {

// Throws DataError that names the file, the field and the byte. `text` must outlive it.
class JsonCursor {
 public:
  JsonCursor(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  // Calls member(key) for each member: it takes the value. The key is the text between the quotes, as it stands.
  template <typename Member>
  void object(std::string_view field, Member member) {
    expect('{', field);
    while (!closes('}')) {
      const std::string_view key = quoted(field);
      expect(':', key);
      member(key);
      separate('}', field);
    }
  }
  // Calls element() for each element: it takes the value.
  template <typename Element>
  void array(std::string_view field, Element element) {
    expect('[', field);
    while (!closes(']')) {
      element();
      separate(']', field);
    }
  }
  std::string text(std::string_view field);  // without escapes but \" \\ and \/
  double number(std::string_view field);     // finite
  std::int64_t integer(std::string_view field);
  void skip(std::string_view field);  // any value, nested kMaxDepth times at most
  void end();                         // nothing may follow

  [[noreturn]] void fail(std::string_view field, std::string_view detail) const;

 private:
  char peek();  // the next that is no space; 0 at the end
  bool closes(char bracket);
  void expect(char letter, std::string_view field);
  void separate(char bracket, std::string_view field);
  std::string_view quoted(std::string_view field);
  std::string_view word();
  void skipNested(std::string_view field, int depth);

  std::string_view text_;
  std::string name_;
  std::size_t position_ = 0;
};

}  // namespace blockwalk
