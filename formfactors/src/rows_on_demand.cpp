// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/collaborative_call_once.h>

#include <algorithm>
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
    tbb::collaborative_call_once(made,
                                 [&] { method = make_analytic(visibility, {.samples = kPairwiseSamples}); });
    return *method;
  }
};

RowsOnDemand::RowsOnDemand(const FormFactorMethod& method, const Visibility& visibility)
    : method_(method),
      n_(visibility.mesh().patch_count()),
      escaped_(std::make_unique<std::atomic<double>[]>(static_cast<std::size_t>(n_))) {
  if (method.reciprocal()) return;
  pairwise_ = std::make_unique<Pairwise>(visibility);
}

RowsOnDemand::~RowsOnDemand() = default;

Eigen::ArrayXd RowsOnDemand::escaped() const {
  return Eigen::ArrayXd::NullaryExpr(n_, [&](Eigen::Index i) { return escaped_[i].load(); });
}

FormFactorRow RowsOnDemand::row(Index i, RowBuffer& buffer) const {
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
    if (pairwise_ && hardly_answered(method_, sum) && !pairwise_->visibility.covered(i))
      fill(pairwise_->get());
  }
  return {buffer.columns, buffer.values, 0};
}

}  // namespace radiosity
