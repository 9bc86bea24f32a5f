// SPDX-License-Identifier: Apache-2.0
// What other threads have for the socket thread. Whoever waits makes the letter beforehand, so that handing it over
// takes no memory and cannot fail: nothing may leave a thread as an exception.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace boost::asio {
class io_context;
}

namespace blockwalk {

class Letter {
 public:
  virtual ~Letter() = default;
  virtual void open() = 0;  // on the socket thread

 private:
  friend class Mailbox;
  std::shared_ptr<Letter> next_;
};

class Mailbox {
 public:
  // Throws std::system_error. `on_nudge` is called on the socket thread after nudge(), once for several.
  explicit Mailbox(boost::asio::io_context& io);
  ~Mailbox();
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  // Any thread.
  void put(std::shared_ptr<Letter> letter) noexcept;
  void nudge() noexcept;

  // The socket thread: wait for letters, unless it does already. It goes on by itself, but must be told again after
  // something was thrown out of the io_context, which may have been the waiting.
  void listen();

  std::function<void()> on_nudge = {};

 private:
  void wake() noexcept;
  void openAll();
  std::shared_ptr<Letter> takeFirst() noexcept;

  struct Event;  // Asio's: kept out of here, as every user would compile it
  std::unique_ptr<Event> event_;
  bool listening_ = false;
  std::atomic<bool> nudged_ = false;
  std::mutex mutex_;  // guards the letters
  std::shared_ptr<Letter> first_;
  Letter* last_ = nullptr;
};

// Moving a Result must not throw, whether its type says so (glm's do not) or not.
template <typename Result>
class ResultLetter : public Letter {
 public:
  explicit ResultLetter(Mailbox& mailbox) : mailbox_(mailbox) {}
  std::optional<Result> result;
  Mailbox& mailbox() { return mailbox_; }

 private:
  Mailbox& mailbox_;
};

// Answers whoever waits, once, from any thread. If it never does, whoever waits is destroyed with it.
template <typename Result>
class Answer {
 public:
  explicit Answer(std::shared_ptr<ResultLetter<Result>> letter) : letter_(std::move(letter)) {}
  void operator()(Result result) const noexcept {
    letter_->result.emplace(std::move(result));
    Mailbox& mailbox = letter_->mailbox();
    mailbox.put(std::move(letter_));
  }

 private:
  mutable std::shared_ptr<ResultLetter<Result>> letter_;
};

}  // namespace blockwalk
