// SPDX-License-Identifier: Apache-2.0
#include "server/render/mailbox.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <cstdint>
#include <system_error>

namespace blockwalk {

namespace asio = boost::asio;

namespace {

int openEvent() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  return descriptor;
}

}  // namespace

struct Mailbox::Event {
  explicit Event(asio::io_context& io) : descriptor(io, openEvent()) {}
  asio::posix::stream_descriptor descriptor;
};

Mailbox::Mailbox(asio::io_context& io) : event_(std::make_unique<Event>(io)) { listen(); }

// One by one: destroyed in a chain they would recurse.
Mailbox::~Mailbox() {
  while (takeFirst()) {
  }
}

void Mailbox::put(std::shared_ptr<Letter> letter) noexcept {
  {
    const std::lock_guard lock(mutex_);
    Letter* added = letter.get();
    (first_ == nullptr ? first_ : last_->next_) = std::move(letter);
    last_ = added;
  }
  wake();
}

void Mailbox::nudge() noexcept {
  nudged_ = true;
  wake();
}

// Cannot fail but for a count that is full, which wakes just as well.
void Mailbox::wake() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t count = ::write(event_->descriptor.native_handle(), &one, sizeof one);
}

void Mailbox::listen() {
  if (listening_) return;
  listening_ = true;
  try {
    event_->descriptor.async_wait(asio::posix::stream_descriptor::wait_read, [this](boost::system::error_code error) {
      listening_ = false;
      if (error) return;  // the end
      std::uint64_t count = 0;
      [[maybe_unused]] const ssize_t bytes = ::read(event_->descriptor.native_handle(), &count, sizeof count);
      listen();
      openAll();
    });
  } catch (...) {
    listening_ = false;
    wake();
    throw;
  }
}

void Mailbox::openAll() {
  try {
    while (const std::shared_ptr<Letter> letter = takeFirst()) letter->open();
    if (nudged_.exchange(false) && on_nudge) on_nudge();  // after, as it may end the server
  } catch (...) {
    wake();  // for the others
    throw;
  }
}

std::shared_ptr<Letter> Mailbox::takeFirst() noexcept {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Letter> letter = std::move(first_);
  if (letter != nullptr) first_ = std::move(letter->next_);
  return letter;
}

}  // namespace blockwalk
