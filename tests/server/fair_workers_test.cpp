#include "server/fair_workers.h"

#include <barrier>
#include <future>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace halflight {
namespace {

using ::testing::ElementsAre;

class Worker : public ::testing::Test {
 protected:
  // Keeps the thread until `release_`.
  void Hold(const std::string& client) {
    std::promise<void> held;
    worker_->Post({.client = client, .run = [this, &held] {
                     held.set_value();
                     release_.get_future().wait();
                   }});
    held.get_future().wait();
  }
  void Post(const std::string& client, const std::string& name, int priority = 0,
            std::stop_token stop = {}) {
    worker_->Post({.client = client,
                   .priority = priority,
                   .stop = std::move(stop),
                   .run = [this, name] { run_.push_back(name); },
                   .cancelled = [this, name] { cancelled_.push_back(name); }});
  }
  // Of all that was posted.
  void Finish() {
    release_.set_value();
    worker_.reset();
  }

  std::promise<void> release_;
  std::vector<std::string> run_;
  std::vector<std::string> cancelled_;
  std::optional<FairWorkers> worker_{std::in_place, 1};
};

TEST_F(Worker, TaskOfAnotherClientIsNotLast) {
  Hold("a");
  for (const char* name : {"a1", "a2", "a3"}) {
    Post("a", name);
  }
  Post("b", "b1");
  EXPECT_EQ(worker_->waiting(), 4U);
  Finish();
  EXPECT_THAT(run_, ElementsAre("b1", "a1", "a2", "a3"));
}

TEST_F(Worker, PriorityCountsWithinAClient) {
  Hold("a");
  Post("a", "usual");
  Post("a", "high", 1);
  Post("b", "other", -1);
  Finish();
  EXPECT_THAT(run_, ElementsAre("other", "high", "usual"));
}

TEST_F(Worker, StopWhileATaskWaitsEndsItAtOnce) {
  Hold("a");
  std::stop_source stop;
  Post("a", "stopped", 0, stop.get_token());
  Post("a", "kept");
  stop.request_stop();
  EXPECT_THAT(cancelled_, ElementsAre("stopped"));
  EXPECT_EQ(worker_->waiting(), 1U);
  Finish();
  EXPECT_THAT(run_, ElementsAre("kept"));
}

TEST_F(Worker, TaskMayPostAnother) {
  Hold("a");
  // While it ends, which is when the task has its turn, the optional says that there is none.
  worker_->Post({.client = "a", .run = [this, &worker = *worker_] {
                   worker.Post({.client = "a", .run = [this] { run_.emplace_back("second"); }});
                 }});
  Finish();
  EXPECT_THAT(run_, ElementsAre("second"));
}

TEST_F(Worker, SeveralWorkAtOnce) {
  constexpr int kThreads = 3;
  worker_.emplace(kThreads);
  std::barrier all(kThreads);  // nobody goes on before as many have come
  for (int i = 0; i < kThreads; ++i) {
    worker_->Post({.client = "a", .run = [&all] { all.arrive_and_wait(); }});
  }
  worker_.reset();
}

}  // namespace
}  // namespace halflight
