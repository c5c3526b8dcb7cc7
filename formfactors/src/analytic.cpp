// SPDX-License-Identifier: GPL-3.0-or-later
#include "methods.hpp"
#include "pair_factors.hpp"

namespace radiosity {
namespace {

/// Pair by pair; see PairFactors. Clusters are sums over their members, and cost what all pairs of these cost.
class Analytic final : public FormFactorMethod {
 public:
  Analytic(const Visibility& visibility, const FormFactorOptions& options)
      : visibility_(visibility), pairs_(visibility, options.samples, options.seed, options.tolerance) {}

  void rows(Index first, Index last, bool upper, const Sink& sink) const override {
    const PatchMesh& mesh = visibility_.mesh();
    std::vector<double> row;
    const Index n = mesh.cluster_count();
    std::vector<Index> columns(static_cast<std::size_t>(n));
    std::vector<double> values(columns.size());
    for (Index i = first; i < last; ++i) {
      pairs_.cluster_row(i, upper, row);
      const double inverse = 1 / mesh.cluster_areas()[i];
      std::size_t count = 0;
      for (Index j = upper ? i : 0; j < n; ++j) {  // without a branch: zeros are overwritten
        columns[count] = j;
        values[count] = row[j] * inverse;
        count += row[j] != 0 ? 1 : 0;
      }
      sink(i, std::span(columns).first(count), std::span(values).first(count), std::nullopt);
    }
  }
  bool reciprocal() const override { return true; }
  bool exact() const override { return visibility_.convex(); }
  FormFactorOptions options() const override {
    return {.samples = pairs_.samples(), .seed = pairs_.seed(), .tolerance = pairs_.tolerance()};
  }
  Index max_entries_per_row() const override { return visibility_.mesh().cluster_count(); }
  std::uint64_t rays() const override { return pairs_.rays(); }
  PairCounts pairs() const override { return pairs_.counts(); }

 private:
  const Visibility& visibility_;
  PairFactors pairs_;
};

}  // namespace

std::unique_ptr<FormFactorMethod> make_analytic(const Visibility& visibility,
                                                const FormFactorOptions& options) {
  return std::make_unique<Analytic>(visibility, options);
}

}  // namespace radiosity
