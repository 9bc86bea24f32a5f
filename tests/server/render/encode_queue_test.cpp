// SPDX-License-Identifier: Apache-2.0
#include "server/render/encode_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

namespace blockwalk {
namespace {

constexpr std::int64_t kLarge = std::int64_t{4096} * 4096;
constexpr std::int64_t kSmall = std::int64_t{256} * 256;

// Encodes nothing; a job that is begun goes on until it is let end.
class EncodeQueueTest : public testing::Test {
 protected:
  ~EncodeQueueTest() override {
    {
      const std::lock_guard lock(mutex_);
      held_ = false;
    }
    changed_.notify_all();
    threads_.join();
    queue_.end();
  }

  EncodeQueue::Place& add(const std::string& name, std::uint64_t peer, std::int64_t pixels) {
    return queue_.add({.peer = peer, .group = 1, .client = ++client_}, EncodeQueue::takesLong(ImageFormat::png, pixels),
                      [this, name](const std::exception_ptr&) {
                        std::unique_lock lock(mutex_);
                        begun_.push_back(name);
                        changed_.notify_all();
                        changed_.wait(lock, [this] { return !held_; });
                      });
  }

  // What was begun, once it is so many; or after a while.
  std::vector<std::string> begun(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(5), [&] { return begun_.size() >= count; });
    return begun_;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = true;
  std::vector<std::string> begun_;
  std::uint64_t client_ = 0;
  boost::asio::thread_pool threads_{8};  // more than the queue may use
  EncodeQueue queue_{threads_, 2};
};

TEST_F(EncodeQueueTest, LargePicturesLeaveAThreadToTheOthers) {
  add("large 1", 1, kLarge);
  add("large 2", 1, kLarge);
  add("large 3", 2, kLarge);
  EXPECT_THAT(begun(1), testing::ElementsAre("large 1"));
  add("small", 1, kSmall);
  EXPECT_THAT(begun(2), testing::ElementsAre("large 1", "small"));
}

TEST_F(EncodeQueueTest, NoMoreThanThereAreThreads) {
  EncodeQueue::Place& first = add("1", 1, kSmall);
  add("2", 1, kSmall);
  add("3", 1, kSmall);
  EXPECT_EQ(begun(2).size(), 2u);
  queue_.finish(first, 1);
  EXPECT_THAT(begun(3), testing::UnorderedElementsAre("1", "2", "3"));
}

TEST_F(EncodeQueueTest, WhoUsedLessIsNext) {
  EncodeQueue::Place& first = add("hog 1", 1, kLarge);
  add("hog 2", 1, kLarge);
  add("hog 3", 1, kLarge);
  begun(1);
  add("other", 2, kLarge);
  queue_.finish(first, 3000);
  EXPECT_THAT(begun(2), testing::ElementsAre("hog 1", "other"));
}

TEST(EncodeQueue, TellsWhatTakesLong) {
  EXPECT_FALSE(EncodeQueue::takesLong(ImageFormat::raw, kLarge));
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp}) {
    EXPECT_TRUE(EncodeQueue::takesLong(format, kLarge));
    EXPECT_FALSE(EncodeQueue::takesLong(format, kSmall));
  }
}

}  // namespace
}  // namespace blockwalk
