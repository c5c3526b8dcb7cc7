// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/threads.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "radiosity/meshing/error.hpp"

namespace radiosity {

struct ThreadLimit::Impl {
  std::optional<tbb::global_control> control;
};

ThreadLimit::ThreadLimit(int threads) : impl_(std::make_unique<Impl>()) {
  if (threads < 0) throw InputError(fmt::format("threads: {} is negative; 0 means every core", threads));
  if (threads > 0) {
    impl_->control.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  }
}

ThreadLimit::~ThreadLimit() = default;

bool for_each_block(Index count, Index block, const std::function<void(Index, Index)>& work,
                    const std::function<bool(Index)>& watch) {
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<bool> stop = false;
  std::atomic<Index> done = 0;
  tbb::parallel_for(Index{0}, count / block + (count % block > 0 ? 1 : 0), [&](Index b) {
    if (stop) return;
    const Index first = b * block, last = std::min(count - first, block) + first;
    work(first, last);
    done += last - first;
    if (!watch || std::this_thread::get_id() != caller) return;
    // Isolated, so that a parallel loop of the watcher does not take up a block, and call the watcher from within itself.
    if (!tbb::this_task_arena::isolate([&] { return watch(done); })) stop = true;
  });
  // Who asks to stop is believed even where nothing was left to do.
  return !stop && (!watch || watch(count));
}

bool for_each_block_in_stretches(Index begin, Index end, Index stretch, Index block,
                                 const std::function<void(Index, Index)>& work,
                                 const std::function<bool(Index)>& watch,
                                 const std::function<void(Index)>& ended, const Ranks* ranks) {
  for (Index first = begin;; first = std::min(end - first, stretch) + first) {
    const Index last = std::min(end - first, stretch) + first;
    const bool completed = for_each_block(
        last - first, block, [&](Index a, Index b) { work(first + a, first + b); },
        [&](Index done) { return watch(first + done); });
    if (!on_all(ranks, completed)) return false;
    ended(last);
    if (last == end) return true;
  }
}

}  // namespace radiosity
