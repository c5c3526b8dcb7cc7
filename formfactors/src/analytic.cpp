// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "methods.hpp"
#include "pair_factors.hpp"

namespace radiosity {
namespace {

/// Pair by pair; see PairFactors.
class Analytic final : public FormFactorMethod {
 public:
  Analytic(const Visibility& visibility, const FormFactorOptions& options)
      : visibility_(visibility), pairs_(visibility, options.samples, options.seed) {}

  void rows(Index first, Index last, bool upper, const Sink& sink) const override {
    const PatchMesh& mesh = visibility_.mesh();
    std::vector<std::pair<Index, double>> row;
    std::vector<Index> columns;
    std::vector<double> values;
    for (Index i = first; i < last; ++i) {
      row.clear();
      pairs_.for_each_in_row(i, upper,
                             [&](Index j, double mutual) { row.emplace_back(j, mutual / mesh.area(i)); });
      std::sort(row.begin(), row.end());
      columns.clear();
      values.clear();
      for (const auto& [j, f] : row) {
        columns.push_back(j);
        values.push_back(f);
      }
      sink(i, columns, values, std::nullopt);
    }
  }
  bool reciprocal() const override { return true; }
  bool exact() const override { return visibility_.convex(); }
  FormFactorOptions options() const override { return {.samples = pairs_.samples(), .seed = pairs_.seed()}; }
  Index max_entries_per_row() const override { return visibility_.mesh().patch_count(); }
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
