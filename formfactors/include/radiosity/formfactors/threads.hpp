// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/meshing/types.hpp"

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

/// Calls work(first, last) for every block of `block` of the indices below count, on all threads. Whenever the calling
/// thread is done with one, and on that thread alone, watch(done) is told how many indices are done: it may use the
/// toolkit, and false from it ends the work early. It is told the end, too. Returns whether all was done and watch never asked to end it.
bool for_each_block(Index count, Index block, const std::function<void(Index first, Index last)>& work,
                    const std::function<bool(Index done)>& watch = {});

/// The same for the indices of [begin, end), so many at a stretch; watch is told how many of those from 0 on are done. At the end of each
/// stretch, if only of an empty one, ended(last) is called on the calling thread while all others rest. Of several ranks, all go on with the
/// next stretch or none does.
bool for_each_block_in_stretches(Index begin, Index end, Index stretch, Index block,
                                 const std::function<void(Index first, Index last)>& work,
                                 const std::function<bool(Index done)>& watch,
                                 const std::function<void(Index last)>& ended, const Ranks* ranks = nullptr);

}  // namespace radiosity
