// SPDX-License-Identifier: GPL-3.0-or-later
#include "row_memory.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <thread>
#include <vector>

namespace radiosity::test {
namespace {

using Numbers = std::vector<int, RowMemory<int>>;

TEST(RowMemory, RowsOfManyThreadsKeepWhatTheyHoldWhoeverFreesTheOthers) {
  constexpr std::size_t kRows =
      500;  // of up to 200 kB, some larger than what chunks are cut into: several chunks
  std::vector<Numbers> rows(4 * kRows);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (std::size_t k = t; k < rows.size(); k += 4) {
          rows[k].resize(k % 50 * 1000 + 1);
          std::iota(rows[k].begin(), rows[k].end(), static_cast<int>(k));
          if (k >= 40) rows[k - 40] = Numbers();  // of the same thread
        }
      });
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(rows[k].data()) % alignof(int), 0u);
    for (std::size_t i = 0; i < rows[k].size(); ++i) ASSERT_EQ(rows[k][i], static_cast<int>(k + i));
    EXPECT_EQ(rows[k].empty(), k + 40 < rows.size());
  }
  rows.clear();  // by a thread that made none of them, after those that did have ended
}

}  // namespace
}  // namespace radiosity::test
