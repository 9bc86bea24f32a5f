// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace blockwalk {

// The flag is true as long as this lives: in a coroutine, however that ends, even by being destroyed unfinished.
class TrueWhile {
 public:
  explicit TrueWhile(bool& flag) : flag_(flag) { flag_ = true; }
  ~TrueWhile() { flag_ = false; }
  TrueWhile(const TrueWhile&) = delete;
  TrueWhile& operator=(const TrueWhile&) = delete;

 private:
  bool& flag_;
};

}  // namespace blockwalk
