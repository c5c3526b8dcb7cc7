// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/formfactors/ranks.hpp"

#include <gtest/gtest.h>

#include <mutex>

#include "cases/method_setup.hpp"
#include "cases/scenes.hpp"
#include "radiosity/formfactors/assemble.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "support/parameters.hpp"
#include "support/thread_ranks.hpp"

namespace radiosity::test {
namespace {

struct RankScene {
  std::string name;
  std::function<PatchMesh()> make;
};

// Convex, closed with shadows and lamps, open, and with fewer blocks of rows than ranks.
const std::vector<RankScene>& rank_scenes() {
  static const std::vector<RankScene> scenes{
      {"cube", [] { return cube_room(4); }},
      {"cornell_box", [] { return make_patches(closed_cornell_box(), PatchSize{0.13}).mesh; }},
      {"screen", [] { return opposed_squares_with_screen(6, 0.5, 2); }},
      {"tetrahedron", [] { return tetrahedron(); }}};
  return scenes;
}

class OnRanks : public testing::TestWithParam<std::tuple<const FormFactorMethodInfo*, std::size_t>> {};

INSTANTIATE_TEST_SUITE_P(All, OnRanks,
                         testing::Combine(testing::ValuesIn(pointers(form_factor_methods())),
                                          testing::Range(std::size_t{0}, rank_scenes().size())),
                         [](const auto& tested) {
                           return std::string(std::get<0>(tested.param)->name) + "_" +
                                  rank_scenes()[std::get<1>(tested.param)].name;
                         });

TEST_P(OnRanks, FHasTheBitsThatOneProcessGivesIt) {
  const FormFactorMethodInfo& info = *std::get<0>(GetParam());
  const PatchMesh mesh = rank_scenes()[std::get<1>(GetParam())].make();
  const FormFactorOptions settings{.samples = info.name == "hemisphere" ? 64 : 1};
  const MethodSetup alone(mesh, info, settings);
  const AssembledFormFactors whole = assemble(*alone.method, alone.visibility);
  const Index n = mesh.patch_count();
  for (int count = 1; count <= 4; ++count) {
    std::mutex checking;
    Index rows = 0;
    on_ranks(count, [&](const std::shared_ptr<const Ranks>& ranks) {
      const MethodSetup setup(mesh, info, settings);
      AssemblyOptions options;
      options.ranks = ranks;
      const AssembledFormFactors part = assemble(*setup.method, setup.visibility, options);
      const DistributedFormFactors f(part.matrix, ranks);
      const std::vector<Index> component = f.component();
      BandArray x(n, 2), y, expected;
      for (Index i = 0; i < n; ++i) x.row(i) << 1.0 / (1 + i), i % 7;
      f.apply(x, y);
      whole.matrix.apply(x, expected);
      const std::lock_guard lock(checking);
      EXPECT_EQ(part.matrix.sparse(), whole.matrix.sparse());
      for (Index i = 0; i < n; ++i) {
        const FormFactorRow own = part.matrix.row(i), all = whole.matrix.row(i);
        if (!ranks->owns(i)) {
          EXPECT_TRUE(own.values.empty());
          continue;
        }
        ++rows;
        EXPECT_TRUE(std::ranges::equal(own.columns, all.columns)) << "row " << i;
        EXPECT_TRUE(std::ranges::equal(own.values, all.values)) << "row " << i;
      }
      // Dense rows of a convex room are summed in another order.
      const double rounding = alone.method->exact() ? 1e-15 : 0;
      EXPECT_LE((part.matrix.diagonal() - whole.matrix.diagonal()).abs().maxCoeff(), rounding);
      EXPECT_LE((part.matrix.escaped() - whole.matrix.escaped()).abs().maxCoeff(), rounding);
      EXPECT_LE((y - expected).abs().maxCoeff(), 10 * rounding);
      EXPECT_EQ(component, whole.matrix.component());
      const AssemblyReport &a = part.report, &b = whole.report;
      EXPECT_EQ(a.rays, b.rays);
      EXPECT_EQ(a.pairs.partial + a.pairs.free, b.pairs.partial + b.pairs.free);
      EXPECT_EQ(a.pairwise, b.pairwise);
      EXPECT_EQ(a.closed_rows, b.closed_rows);
      EXPECT_EQ(a.isolated_patches, b.isolated_patches);
      EXPECT_NEAR(a.after.reciprocity_error_mean, b.after.reciprocity_error_mean, 1e-15);
      EXPECT_NEAR(a.after.closure_error_max, b.after.closure_error_max, 1e-15);
    });
    EXPECT_EQ(rows, n);
  }
}

TEST(Ranks, RoomsThatOnlySomeRanksSeeConnectedAreOnePart) {
  // 0–20 and 40–70 by rows of two ranks of three, 5 alone.
  constexpr Index kPatches = 90;
  const std::vector<std::pair<Index, Index>> links{{0, 20}, {20, 0}, {20, 70}, {40, 70}, {70, 20}, {70, 40}};
  const auto matrix = [&](const Ranks* ranks) {
    FormFactorMatrix::Rows rows;
    rows.n = kPatches;
    rows.start = {0};
    for (Index i = 0; i < kPatches; ++i) {
      double left = 1;
      for (const auto& [from, to] : links)
        if (from == i && (ranks == nullptr || ranks->owns(i))) {
          rows.columns.push_back(to);
          rows.values.push_back(0.25F);
          left -= 0.25;
        }
      rows.start.push_back(rows.values.size());
      rows.escaped.push_back(left);
    }
    return FormFactorMatrix(std::move(rows));
  };
  const std::vector<Index> expected = matrix(nullptr).component();
  EXPECT_EQ(expected[70], 0);
  EXPECT_EQ(expected[40], 0);
  EXPECT_EQ(expected[5], 5);
  on_ranks(3, [&](const std::shared_ptr<const Ranks>& ranks) {
    const FormFactorMatrix own = matrix(ranks.get());
    EXPECT_EQ(DistributedFormFactors(own, ranks).component(), expected);
  });
}

TEST(Ranks, AMemoryLimitIsThatOfEachAndNamesHowManyWouldFit) {
  const PatchMesh mesh = cube_room(8);  // 384 patches: at most 24 · 384² = 3.54 MB
  on_ranks(2, [&](const std::shared_ptr<const Ranks>& ranks) {
    const MethodSetup setup(mesh, find_form_factor_method("analytic"));
    AssemblyOptions options;
    options.ranks = ranks;
    options.memory_limit_bytes = 1'000'000;
    try {
      assemble(*setup.method, setup.visibility, options);
      ADD_FAILURE();
    } catch (const MemoryLimitError& e) {
      EXPECT_NE(std::string(e.what()).find("4 ranks would fit"), std::string::npos) << e.what();
    }
    options.memory_limit_bytes = 1'800'000;
    EXPECT_TRUE(assemble(*setup.method, setup.visibility, options).report.completed);
  });
}

}  // namespace
}  // namespace radiosity::test
