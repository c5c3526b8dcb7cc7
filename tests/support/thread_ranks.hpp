// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <barrier>
#include <memory>
#include <thread>
#include <vector>

#include "radiosity/formfactors/ranks.hpp"

namespace radiosity::test {

/// Ranks that are threads of this process.
class ThreadRanks final : public Ranks {
 public:
  struct Shared {
    explicit Shared(int ranks)
        : barrier(ranks),
          counted(static_cast<std::size_t>(ranks)),
          given(counted.size()),
          sent(counted.size()) {}
    std::barrier<> barrier;
    std::vector<std::span<std::uint64_t>> counted;
    std::vector<std::span<const double>> given;
    std::vector<std::span<const std::span<const std::byte>>> sent;
  };

  ThreadRanks(std::shared_ptr<Shared> shared, int rank) : shared_(std::move(shared)), rank_(rank) {}
  int count() const override { return static_cast<int>(shared_->given.size()); }
  int rank() const override { return rank_; }

  void sum(std::span<std::uint64_t> values) const override {
    own(shared_->counted) = values;
    shared_->barrier.arrive_and_wait();
    std::vector<std::uint64_t> sums(values.size(), 0);
    for (const auto& counted : shared_->counted)
      std::ranges::transform(sums, counted, sums.begin(), std::plus<>());
    shared_->barrier.arrive_and_wait();
    std::ranges::copy(sums, values.begin());
  }
  void all_gather(std::span<const double> given, std::span<const int> counts,
                  std::span<double> all) const override {
    own(shared_->given) = given;
    shared_->barrier.arrive_and_wait();
    double* to = all.data();
    for (std::size_t r = 0; r < counts.size(); ++r) to = std::copy_n(shared_->given[r].data(), counts[r], to);
    shared_->barrier.arrive_and_wait();
  }
  void exchange(std::span<const std::span<const std::byte>> to,
                std::vector<std::vector<std::byte>>& from) const override {
    own(shared_->sent) = to;
    shared_->barrier.arrive_and_wait();
    from.resize(shared_->sent.size());
    for (std::size_t r = 0; r < from.size(); ++r) {
      const auto& mine = shared_->sent[r][static_cast<std::size_t>(rank_)];
      from[r].assign(mine.begin(), mine.end());
    }
    own(from).clear();
    shared_->barrier.arrive_and_wait();
  }

 private:
  template <class T>
  T& own(std::vector<T>& of_all) const {
    return of_all[static_cast<std::size_t>(rank_)];
  }

  std::shared_ptr<Shared> shared_;
  int rank_;
};

/// Calls work(ranks) on so many ranks at once.
template <class Work>
void on_ranks(int count, const Work& work) {
  const auto shared = std::make_shared<ThreadRanks::Shared>(count);
  std::vector<std::jthread> threads;
  for (int r = 0; r < count; ++r)
    threads.emplace_back(
        [&, r] { work(std::shared_ptr<const Ranks>(std::make_shared<ThreadRanks>(shared, r))); });
}

}  // namespace radiosity::test
