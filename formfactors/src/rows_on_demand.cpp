// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <numeric>

#include "radiosity/formfactors/assemble.hpp"

namespace radiosity {

RowsOnDemand::RowsOnDemand(const FormFactorMethod& method, const Visibility& visibility)
    : method_(method),
      n_(visibility.mesh().patch_count()),
      escaped_(std::make_unique<std::atomic<double>[]>(static_cast<std::size_t>(n_))) {}

FormFactorRow RowsOnDemand::row(Index i, RowBuffer& buffer) const {
  method_.rows(i, i + 1, false,
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
