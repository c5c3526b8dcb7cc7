// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

namespace radiosity {

/// Limits all parallel work of the toolkit to `threads` threads for as long as it lives; 0 leaves every core
/// in use. The number of threads never changes a result, to the last bit.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace radiosity
