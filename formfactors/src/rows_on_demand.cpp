// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/collaborative_call_once.h>

#include <algorithm>
#include <list>
#include <mutex>
#include <numeric>

#include "methods.hpp"
#include "pairwise.hpp"
#include "radiosity/formfactors/assemble.hpp"

namespace radiosity {

struct RowsOnDemand::Pairwise {
  explicit Pairwise(const Visibility& v) : visibility(v), patches(pairwise_in_advance(v)) {}

  const Visibility& visibility;
  std::vector<Index> patches;
  tbb::collaborative_once_flag made;
  std::unique_ptr<FormFactorMethod> method;

  const FormFactorMethod& get() {
    tbb::collaborative_call_once(made, [&] {
      method =
          make_analytic(visibility, {.samples = pairwise_samples(visibility), .tolerance = kFactorTolerance});
    });
    return *method;
  }
};

/// Rows by number, those asked for last in front. Copies go in and out: a row may be given up while another thread reads it.
class RowsOnDemand::Kept {
 public:
  Kept(Index n, std::size_t bytes) : entries_(bytes / (sizeof(Index) + sizeof(float))), place_(n) {
    std::fill(place_.begin(), place_.end(), rows_.end());
  }

  bool find(Index i, RowBuffer& buffer) {
    const std::lock_guard lock(mutex_);
    const auto at = place_[i];
    if (at == rows_.end()) return false;
    rows_.splice(rows_.begin(), rows_, at);
    buffer = at->row;
    return true;
  }

  void keep(Index i, const RowBuffer& row) {
    const std::size_t size = row.columns.size();
    const std::lock_guard lock(mutex_);
    if (size > entries_ || place_[i] != rows_.end()) return;
    while (used_ + size > entries_) {
      used_ -= rows_.back().row.columns.size();
      place_[rows_.back().number] = rows_.end();
      rows_.pop_back();
    }
    used_ += size;
    rows_.push_front({i, row});
    place_[i] = rows_.begin();
  }

 private:
  struct Row {
    Index number;
    RowBuffer row;
  };
  std::size_t entries_, used_ = 0;
  std::list<Row> rows_;
  std::vector<std::list<Row>::iterator> place_;  // the end: not kept
  std::mutex mutex_;
};

RowsOnDemand::RowsOnDemand(const FormFactorMethod& method, const Visibility& visibility,
                           std::size_t memory_bytes)
    : method_(method),
      n_(visibility.mesh().cluster_count()),
      escaped_(std::make_unique<std::atomic<double>[]>(static_cast<std::size_t>(n_))),
      kept_(std::make_unique<Kept>(n_, memory_bytes)) {
  if (method.reciprocal()) return;
  pairwise_ = std::make_unique<Pairwise>(visibility);
}

RowsOnDemand::~RowsOnDemand() = default;

Eigen::ArrayXd RowsOnDemand::escaped() const {
  return Eigen::ArrayXd::NullaryExpr(n_, [&](Eigen::Index i) { return escaped_[i].load(); });
}

FormFactorRow RowsOnDemand::row(Index i, RowBuffer& buffer) const {
  if (!kept_->find(i, buffer)) {
    compute(i, buffer);
    kept_->keep(i, buffer);
  }
  return {buffer.columns, buffer.values, 0};
}

void RowsOnDemand::compute(Index i, RowBuffer& buffer) const {
  computed_.fetch_add(1, std::memory_order_relaxed);
  double sum = 0;
  const auto fill = [&](const FormFactorMethod& method) {
    method.rows(i, i + 1, false,
                [&](Index, std::span<const Index> columns, std::span<const double> values,
                    std::optional<double> escaped) {
                  buffer.columns.assign(columns.begin(), columns.end());
                  buffer.values.resize(values.size());
                  std::transform(values.begin(), values.end(), buffer.values.begin(),
                                 [](double f) { return static_cast<float>(f); });
                  sum = std::accumulate(values.begin(), values.end(), 0.0);
                  escaped_[i] = escaped.value_or(1 - sum);
                });
  };
  if (pairwise_ && std::binary_search(pairwise_->patches.begin(), pairwise_->patches.end(), i)) {
    fill(pairwise_->get());
  } else {
    fill(method_);
    if (pairwise_ && hardly_answered(method_, sum) && !all_covered(pairwise_->visibility, i))
      fill(pairwise_->get());
  }
}

}  // namespace radiosity
