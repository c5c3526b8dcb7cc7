// SPDX-License-Identifier: GPL-3.0-or-later
#include "child_process.hpp"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <future>
#include <mutex>
#include <thread>

#include "files.hpp"

namespace radiosity::test {
namespace {

constexpr ChildLimits kAmple{1'000'000'000, 60};

TEST(ChildProcess, HandsBackWhatTheWorkReturns) {
  const std::string bytes(10'000'000, 'x');
  const ChildResult result = run_in_child([&] { return bytes + "end"; }, kAmple);
  EXPECT_EQ(result.end, ChildEnd::done);
  EXPECT_TRUE(result.bytes == bytes + "end");
}

TEST(ChildProcess, SurvivesSignalsExceptionsAndExits) {
  const auto end_of = [](const std::function<std::string()>& work) { return run_in_child(work, kAmple).end; };
  EXPECT_EQ(end_of([]() -> std::string { std::abort(); }), ChildEnd::crashed);
  EXPECT_EQ(end_of([] {
              std::raise(SIGSEGV);
              return std::string();
            }),
            ChildEnd::crashed);
  EXPECT_EQ(end_of([]() -> std::string { throw std::runtime_error("x"); }), ChildEnd::crashed);
  EXPECT_EQ(end_of([]() -> std::string { _exit(1); }), ChildEnd::crashed);
  EXPECT_EQ(end_of([]() -> std::string { throw std::bad_alloc(); }), ChildEnd::out_of_memory);
}

TEST(ChildProcess, EndsWorkThatTakesTooMuchMemory) {
  const ChildResult result = run_in_child(
      [] {
        std::vector<std::string> blocks;
        for (;;) blocks.emplace_back(1'000'000, 'x');
        return std::string();
      },
      {200'000'000, 60});
  EXPECT_EQ(result.end, ChildEnd::out_of_memory);
}

TEST(ChildProcess, EndsWorkThatTakesTooLong) {
  const ChildResult result = run_in_child(
      [] {
        for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
        return std::string();
      },
      {1'000'000'000, 0.2});
  EXPECT_EQ(result.end, ChildEnd::out_of_time);
}

TEST(ChildProcess, IsMadeAnewWhereItWaitsForALockThatAnotherThreadHeld) {
  std::mutex mutex;
  std::promise<void> held;
  std::thread holder([&] {
    const std::scoped_lock lock(mutex);
    held.set_value();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  });
  held.get_future().wait();
  const ChildResult result = run_in_child(
      [&] {
        const std::scoped_lock lock(mutex);
        return std::string("done");
      },
      kAmple);
  holder.join();
  EXPECT_EQ(result.end, ChildEnd::done);
  EXPECT_EQ(result.bytes, "done");
}

TEST(ChildProcess, PrintsNothing) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  run_in_child(
      [] {
        std::fputs("out", stdout);
        std::fputs("err", stderr);
        std::fflush(nullptr);
        return std::string();
      },
      kAmple);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ChildProcess, PackedValuesThatEndTooEarlyAreNotComplete) {
  Packer packer;
  packer.put(7);
  const std::vector<double> numbers{1, 2, 3};
  packer.put_all(numbers.data(), numbers.size());
  const std::string whole = packer.bytes();
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const std::string bytes = whole.substr(0, size);
    Unpacker unpacker(bytes);
    const int first = unpacker.take<int>();
    const auto rest = unpacker.take_all<double>();
    EXPECT_EQ(unpacker.complete(), size == whole.size()) << size;
    if (unpacker.complete()) {
      EXPECT_EQ(first, 7);
      EXPECT_EQ(rest, numbers);
    }
  }
}

}  // namespace
}  // namespace radiosity::test
