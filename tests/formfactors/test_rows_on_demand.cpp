// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/formfactors/threads.hpp"

namespace radiosity::test {
namespace {

/// The first row that it is asked for is empty, so that the pairs must tell it; all others are full.
class FirstRowUnanswered final : public FormFactorMethod {
 public:
  void rows(Index first, Index last, bool, const Sink& sink) const override {
    EXPECT_EQ(last, first + 1);
    std::thread::id nobody;
    const std::thread::id me = std::this_thread::get_id();
    if (first_asker_.compare_exchange_strong(nobody, me)) return sink(first, {}, {}, 0);
    if (!first_row_done && first_asker_.load() == me)
      throw std::logic_error("a row within the making of what another one needs, which waits for itself");
    // Long enough that rows remain to be asked for.
    if (!first_row_done) std::this_thread::sleep_for(std::chrono::microseconds(100));
    sink(first, column_, full_, 0);
  }
  bool reciprocal() const override { return false; }
  bool exact() const override { return false; }
  FormFactorOptions options() const override { return {}; }
  Index max_entries_per_row() const override { return 1; }
  std::optional<double> direction_share() const override { return 1.0 / 64; }

  std::thread::id first_asker() const { return first_asker_; }
  std::atomic<bool> first_row_done = false;

 private:
  const std::vector<Index> column_{0};
  const std::vector<double> full_{1.0};
  mutable std::atomic<std::thread::id> first_asker_;
};

TEST(RowsOnDemand, MakeThePairwisePartWithoutTakingUpAnotherRowMeanwhile) {
  // It is made by a parallel loop of its own. Whoever waits for the end of that must not take up another row of the loop around
  // it: with a once_flag of the standard library, which TBB knows nothing of, that row would wait for its own thread. Of 32 times
  // that happened in about ten.
  const PatchMesh mesh = MeshBuilder()
                             .use_material(grey("wall", 0.5, 0))
                             .box({-1, -1, -1}, {1, 1, 1}, 1, Facing::inward)
                             .sphere({0, 0, 0}, 0.5, 2, Facing::outward)
                             .build();
  const Visibility visibility(mesh);
  constexpr int kThreads = 16;
  const ThreadLimit limit(kThreads);
  tbb::task_arena arena(kThreads);  // the limit alone gives no more threads than there are cores
  for (int run = 0; run < 32; ++run) {
    FirstRowUnanswered method;
    const RowsOnDemand rows(method, visibility, 0);
    std::atomic<Index> told = 0;
    const auto ask = [&](const tbb::blocked_range<Index>& one) {
      RowBuffer buffer;
      told += rows.row(one.begin(), buffer).columns.empty() ? 0 : 1;
      if (method.first_asker() == std::this_thread::get_id()) method.first_row_done = true;
    };
    arena.execute([&] {
      tbb::parallel_for(tbb::blocked_range<Index>(0, mesh.patch_count(), 1), ask, tbb::simple_partitioner());
    });
    EXPECT_EQ(told, mesh.patch_count());
  }
}

TEST(RowsOnDemand, KeepsThoseAskedForLastWhileThereIsRoom) {
  const PatchMesh mesh =
      MeshBuilder().use_material(grey("wall", 0.5, 0)).box({0, 0, 0}, {1, 1, 1}, 2, Facing::inward).build();
  const Index n = mesh.patch_count();
  ASSERT_EQ(n, 24);
  const Visibility visibility(mesh);
  const auto method = find_form_factor_method("analytic").make(visibility);
  constexpr std::size_t kRow = 20 * 8;  // all but the four of the same wall
  RowBuffer buffer;
  const auto ask = [&](const RowsOnDemand& rows, Index i) {
    const FormFactorRow row = rows.row(i, buffer);
    return std::vector<float>(row.values.begin(), row.values.end());
  };
  const RowsOnDemand never(*method, visibility, kRow - 1), always(*method, visibility, 24 * kRow),
      three(*method, visibility, 3 * kRow);
  for (int round = 0; round < 2; ++round)
    for (Index i = 0; i < n; ++i) {
      const std::vector<float> row = ask(never, i);
      EXPECT_EQ(row.size(), 20U);
      EXPECT_EQ(ask(always, i), row) << i;
      EXPECT_EQ(ask(three, i), row) << i;
      EXPECT_EQ(always.escaped()[i], never.escaped()[i]);
    }
  EXPECT_EQ(never.computed(), 48U);
  EXPECT_EQ(always.computed(), 24U);
  EXPECT_EQ(three.computed(), 48U);
  for (const Index i : {22, 23, 21}) ask(three, i);  // still there
  EXPECT_EQ(three.computed(), 48U);
  ask(three, 0);  // in the place of 22
  for (const Index i : {23, 21, 0}) ask(three, i);
  EXPECT_EQ(three.computed(), 49U);
  ask(three, 22);
  EXPECT_EQ(three.computed(), 50U);
}

}  // namespace
}  // namespace radiosity::test
