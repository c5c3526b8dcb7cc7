// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <numeric>

#include "methods.hpp"
#include "pair_factors.hpp"
#include "radiosity/formfactors/assemble.hpp"

namespace radiosity {

struct RowsOnDemand::Lamps {
  std::vector<Index> patches;
  std::unique_ptr<FormFactorMethod> method;
};

RowsOnDemand::RowsOnDemand(const FormFactorMethod& method, const Visibility& visibility)
    : method_(method),
      n_(visibility.mesh().patch_count()),
      escaped_(std::make_unique<std::atomic<double>[]>(static_cast<std::size_t>(n_))) {
  if (method.reciprocal()) return;
  std::vector<Index> patches = lamps_of(visibility.mesh());
  if (patches.empty()) return;
  lamps_ = std::make_unique<Lamps>(
      Lamps{std::move(patches), make_analytic(visibility, {.samples = kLampSamples})});
}

RowsOnDemand::~RowsOnDemand() = default;

FormFactorRow RowsOnDemand::row(Index i, RowBuffer& buffer) const {
  const bool lamp = lamps_ && std::binary_search(lamps_->patches.begin(), lamps_->patches.end(), i);
  const FormFactorMethod& method = lamp ? *lamps_->method : method_;
  method.rows(i, i + 1, false,
              [&](Index, std::span<const Index> columns, std::span<const double> values, double escaped) {
                buffer.columns.assign(columns.begin(), columns.end());
                buffer.values.resize(values.size());
                std::transform(values.begin(), values.end(), buffer.values.begin(),
                               [](double f) { return static_cast<float>(f); });
                const double sum = std::accumulate(values.begin(), values.end(), 0.0);
                escaped_[static_cast<std::size_t>(i)] = escaped >= 0 ? escaped : 1 - sum;
              });
  return {buffer.columns, buffer.values, 0};
}

}  // namespace radiosity
