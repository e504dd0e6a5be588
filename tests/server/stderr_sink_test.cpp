// A log that nobody reads, for a while or ever again.
#include "server/log/stderr_sink.h"

#include <csignal>
#include <memory>
#include <string>

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/logger.h>

#include "server/log/log_budget.h"

namespace halflight {
namespace {

class DroppingSinkTest : public ::testing::Test {
 protected:
  DroppingSinkTest() {
    EXPECT_EQ(pipe2(fds_, O_CLOEXEC), 0);
    fcntl(fds_[0], F_SETFL, O_NONBLOCK);
    logger_ = std::make_unique<spdlog::logger>(
        "test", std::make_shared<DroppingSink>(
                    fds_[1], [](uint64_t lines) { return fmt::format("dropped {}", lines); }));
    logger_->set_pattern("%v");
  }
  ~DroppingSinkTest() override {
    CloseReader();
    close(fds_[1]);
  }

  void CloseReader() {
    close(fds_[0]);
    fds_[0] = -1;
  }

  std::string Read() {
    std::string text;
    char bytes[4096];
    for (ssize_t got = 0; (got = read(fds_[0], bytes, sizeof(bytes))) > 0;) {
      text.append(bytes, static_cast<size_t>(got));
    }
    return text;
  }

  int fds_[2] = {-1, -1};
  std::unique_ptr<spdlog::logger> logger_;
};

TEST_F(DroppingSinkTest, WritesWhatIsRead) {
  logger_->info("one");
  logger_->warn("two");
  EXPECT_EQ(Read(), "one\ntwo\n");
}

TEST_F(DroppingSinkTest, DropsWhatNobodyReadsAndSaysHowMuchThatWas) {
  constexpr int kLines = 2000;  // a pipe holds 64 KiB
  for (int i = 0; i < kLines; ++i) {
    logger_->info("{:0>99}", i);  // with its end 100 bytes
  }
  const std::string before = Read();
  const size_t written = before.size() / 100;
  EXPECT_GT(written, 500U);
  EXPECT_LT(written, 700U);
  logger_->info("again");
  EXPECT_EQ(Read(), fmt::format("dropped {}\nagain\n", kLines - written));
  logger_->info("and on");
  EXPECT_EQ(Read(), "and on\n");
}

TEST_F(DroppingSinkTest, LinesAreLinesAlsoAfterOneThatWasTorn) {
  // With its end three pages; a pipe holds sixteen.
  const std::string line(3 * 4096 - 1, 'x');
  for (int i = 0; i < 6; ++i) {
    logger_->info(line);
  }
  const std::string before = Read();
  ASSERT_FALSE(before.empty());
  ASSERT_NE(before.back(), '\n') << "the last one is torn";
  logger_->info("again");
  const std::string after = Read();
  EXPECT_EQ(after.substr(0, 9), "\ndropped ");
  EXPECT_EQ(after.substr(after.size() - 7), "\nagain\n");
}

TEST_F(DroppingSinkTest, GoesOnWhereTheReaderIsGone) {
  signal(SIGPIPE, SIG_IGN);
  CloseReader();
  for (int i = 0; i < 200; ++i) {
    logger_->info("nobody");
  }
}

TEST(LogBudget, CountsWhatIsNotWritten) {
  LogBudget budget(2);
  const auto begin = LogBudget::Clock::now();
  const auto after = [&](int seconds) { return begin + std::chrono::seconds(seconds); };
  EXPECT_EQ(budget.Take(begin), 1U);
  EXPECT_EQ(budget.Take(after(1)), 1U);
  EXPECT_EQ(budget.Take(after(2)), std::nullopt);
  EXPECT_EQ(budget.Take(after(9)), std::nullopt);
  EXPECT_EQ(budget.Take(after(10)), 3U);
  EXPECT_EQ(budget.Take(after(11)), 1U);
  EXPECT_EQ(budget.Take(after(12)), std::nullopt);
}

}  // namespace
}  // namespace halflight
