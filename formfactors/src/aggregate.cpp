// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/aggregate.hpp"

#include <fmt/format.h>

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <utility>

#include "assembly_steps.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

// Per thread: sums over unions, all 0 in between, and those that are not.
struct Sums {
  explicit Sums(std::size_t count) : of(count, 0.0) {}
  void add(Index column, double value) {
    if (value == 0) return;
    if (of[column] == 0) met.push_back(column);
    of[column] += value;
  }
  // use(J, sum), ascending where that is asked for.
  template <class Use>
  void empty(bool sorted, const Use& use) {
    if (sorted) std::ranges::sort(met);
    for (const Index j : met) use(j, std::exchange(of[j], 0));
    met.clear();
  }
  std::vector<double> of;
  std::vector<Index> met;
};

}  // namespace

FormFactorMatrix aggregate(const FormFactorMatrix& f, const Eigen::ArrayXd& areas,
                           const Coarsening& coarsening, const Ranks* ranks) {
  const auto n = static_cast<std::size_t>(f.size());
  const auto count = static_cast<std::size_t>(coarsening.count);
  if (areas.size() != f.size() || coarsening.parent.size() != n)
    throw InputError(
        fmt::format("form factors of larger patches: F has {} rows, there are {} areas and {} parents", n,
                    areas.size(), coarsening.parent.size()));
  std::vector<std::vector<Index>> members(count);
  for (std::size_t i = 0; i < n; ++i) members[coarsening.parent[i]].push_back(static_cast<Index>(i));

  // Σ_j∈J F_ij of each J that row i has factors to.
  const auto condense = [&](Index i, Sums& sums, const auto& use) {
    for_each_entry(f.row(i),
                   [&](Index j, float f_ij) { sums.add(coarsening.parent[j], static_cast<double>(f_ij)); });
    sums.empty(false, use);
  };
  // Of several ranks, whoever owns a union gets these of its members.
  std::vector<std::vector<std::pair<Index, double>>> received(ranks != nullptr ? n : 0);
  if (ranks != nullptr) {
    Sums sums(count);
    exchange_entries<double>(
        *ranks, f.size(), [&](Index i) { return f.row(i).values.size(); },
        [&](Index i, const auto& send) {
          condense(i, sums, [&, owner = ranks->owner(coarsening.parent[i])](Index j, double sum) {
            send(owner, j, sum);
          });
        },
        [&](Index i, Index j, double sum) { received[i].emplace_back(j, sum); });
  }

  const Eigen::ArrayXd escaped_of = f.escaped(), diagonal_of = f.diagonal();
  RowList rows(count);
  Eigen::ArrayXd diagonals(coarsening.count), escapes(coarsening.count);
  tbb::enumerable_thread_specific<std::pair<Sums, Sums>> all_sums(Sums{count}, Sums{count});
  for_each_block(coarsening.count, Ranks::kBlock, [&](Index first, Index last) {
    auto& [of_row, sums] = all_sums.local();
    for (Index g = first; g < last; ++g) {
      double area = 0, diagonal = 0, escaped = 0;
      for (const Index i : members[g]) {
        area += areas[i];
        diagonal += areas[i] * diagonal_of[i];
        escaped += areas[i] * escaped_of[i];
        const auto add = [&, &sums = sums](Index j, double sum) { sums.add(j, areas[i] * sum); };
        if (ranks == nullptr)
          condense(i, of_row, add);
        else
          for (const auto& [j, sum] : received[i]) add(j, sum);
      }
      diagonals[g] = diagonal / area;
      rows[g].reserve(sums.met.size());
      sums.empty(true, [&](Index j, double sum) {
        const double exact = sum / area;
        rows[g].push_back({j, rounded_down(exact)});
        diagonals[g] += exact - static_cast<double>(rows[g].back().value);
      });
      escapes[g] = escaped / area;
    }
  });
  gather(ranks, diagonals);

  FormFactorMatrix::Rows out = store(rows, ranks);
  out.diagonal.assign(diagonals.begin(), diagonals.end());
  out.escaped.assign(escapes.begin(), escapes.end());
  return FormFactorMatrix(std::move(out));
}

}  // namespace radiosity
