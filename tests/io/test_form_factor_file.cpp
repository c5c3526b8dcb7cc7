// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/form_factor_file.hpp"

#include <mutex>

#include "cases/scenes.hpp"
#include "files.hpp"
#include "radiosity/io/checkpoints.hpp"
#include "support/thread_ranks.hpp"

namespace radiosity::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

FormFactorMatrix sparse_matrix() {
  FormFactorMatrix::Rows rows;
  rows.n = 6;
  rows.start = {0, 2, 3, 3, 3, 3, 3};
  rows.columns = {1, 5, 0};
  rows.values = {0.1F, 0.5F, 0.75F};
  rows.diagonal = {1e-9, 0, 0, 0, 0, 0};
  rows.escaped = {1 - static_cast<double>(0.1F) - 0.5 - 1e-9, 0.25, 1, 1, 1, 1};
  return FormFactorMatrix(rows);
}

FormFactorMatrix dense_matrix() {
  FormFactorMatrix::Rows rows;
  rows.n = 6;
  rows.values.assign(36, 0.125F);
  rows.escaped.assign(6, 0.25);
  return FormFactorMatrix(rows);
}

FormFactorFacts facts() {
  FormFactorFacts facts{
      .method = "hemisphere", .why = {}, .options = {.samples = 64, .seed = 7}, .assembly = {}};
  facts.assembly.closed_scene = true;
  facts.assembly.after.closure_error_mean = 0.25;
  facts.assembly.lamps = 3;
  facts.assembly.rays = 123456789012;
  facts.assembly.pairs.partial = 5;
  facts.assembly.warnings = {"one", "two"};
  return facts;
}

TEST(FormFactorFile, ComesBackToTheBit) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = room({0, 0, 0}, {1, 1, 1}, false);
  for (const FormFactorMatrix& matrix : {sparse_matrix(), dense_matrix()}) {
    write_form_factors(directory / "F.h5", matrix, mesh, facts(), "1.2.3", "radiosity factors x");
    EXPECT_EQ(directory.entries(), 1);
    const FormFactorFileFacts found = read_form_factor_facts(directory / "F.h5");
    EXPECT_EQ(found.method, "hemisphere");
    EXPECT_EQ(found.options.samples, 64);
    EXPECT_EQ(found.options.seed, 7U);
    EXPECT_EQ(found.patches, 6);
    const auto [read, report] = read_form_factors(directory / "F.h5", mesh);
    EXPECT_EQ(read.arrays().start, matrix.arrays().start);
    EXPECT_EQ(read.arrays().columns, matrix.arrays().columns);
    EXPECT_EQ(read.arrays().values, matrix.arrays().values);
    EXPECT_EQ(read.arrays().diagonal, matrix.arrays().diagonal);
    EXPECT_EQ(read.arrays().escaped, matrix.arrays().escaped);
    EXPECT_TRUE(report.completed && report.closed_scene && !report.closed_rows);
    EXPECT_EQ(report.after.closure_error_mean, 0.25);
    EXPECT_EQ(report.lamps, 3);
    EXPECT_EQ(report.rays, 123456789012U);
    EXPECT_EQ(report.pairs.partial, 5U);
    EXPECT_THAT(report.warnings, testing::ElementsAre("one", "two"));
  }
}

TEST(FormFactorFile, GivesEachOfSeveralRanksTheRowsThatItOwns) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = cube_room(3);  // 54 patches, so that the last block is not whole
  for (const bool sparse : {true, false}) {
    FormFactorMatrix::Rows rows;
    rows.n = mesh.patch_count();
    if (sparse) rows.start = {0};
    for (Index i = 0; i < rows.n; ++i) {
      double left = 1;
      for (Index j = 0; j < rows.n; ++j) {
        const bool some = i != 7 && (i + j) % (sparse ? 7 : 1) == 0;  // row 7 is empty
        if (sparse && !some) continue;
        rows.values.push_back(some ? static_cast<float>(1 + j) / 4096 : 0);
        left -= static_cast<double>(rows.values.back());
        if (sparse) rows.columns.push_back(j);
      }
      if (sparse) rows.start.push_back(rows.values.size());
      rows.escaped.push_back(left);
    }
    const FormFactorMatrix whole(std::move(rows));
    write_form_factors(directory / "F.h5", whole, mesh, facts(), "1.2.3", "radiosity factors x");
    for (const int count : {1, 3, 5}) {  // of five, one owns no block
      std::mutex checking;
      on_ranks(count, [&](const std::shared_ptr<const Ranks>& ranks) {
        const std::lock_guard lock(checking);
        const FormFactorMatrix own = read_form_factors(directory / "F.h5", mesh, ranks.get()).matrix;
        EXPECT_EQ(own.sparse(), sparse);
        EXPECT_TRUE((own.escaped() == whole.escaped()).all());
        std::size_t entries = 0;
        for (Index i = 0; i < whole.size(); ++i) {
          const FormFactorRow row = ranks->owns(i) ? whole.row(i) : FormFactorRow{};
          EXPECT_TRUE(std::ranges::equal(own.row(i).columns, row.columns)) << "row " << i;
          EXPECT_TRUE(std::ranges::equal(own.row(i).values, row.values)) << "row " << i;
          entries += row.values.size();
        }
        EXPECT_EQ(own.arrays().values.size(), entries);
      });
    }
  }
}

TEST(FormFactorFile, IsRefusedForOtherPatchesAndWhereItIsNoSuchFile) {
  const TemporaryDirectory directory;
  const PatchMesh mesh = room({0, 0, 0}, {1, 1, 1}, false);
  const fs::path file = directory / "F.h5";
  write_form_factors(file, dense_matrix(), mesh, facts(), "1.2.3", "radiosity factors x");
  EXPECT_THAT(message_of<InputError>([&] {
                read_form_factors(file, room({0, 0, 0}, {1, 1, 1.5}, false));
              }),
              HasSubstr("F.h5: its form factors are of other patches (6) than these (6)"));
  const fs::path text = directory.write("text.h5", "not HDF5");
  EXPECT_THAT(message_of<IoError>([&] { read_form_factors(text, mesh); }),
              HasSubstr("text.h5: does not hold form factors, as radiosity factors writes them"));
  std::string cut = read_text(file);
  cut.resize(cut.size() / 2);
  const fs::path half = directory.write("half.h5", cut);
  EXPECT_THAT(message_of<IoError>([&] { read_form_factors(half, mesh); }),
              HasSubstr("half.h5: does not hold"));
  EXPECT_THROW(read_form_factor_facts(directory / "none.h5"), IoError);
}

TEST(FormFactorFile, DigestsTellPatchesApart) {
  const PatchMesh mesh = room({0, 0, 0}, {1, 1, 1}, false);
  EXPECT_EQ(digest(mesh), digest(room({0, 0, 0}, {1, 1, 1}, false)));
  EXPECT_NE(digest(mesh), digest(room({0, 0, 0}, {1, 1, 1 + 1e-15}, false)));
}

TEST(Checkpoints, ComeBackToTheBitAndGoWhenThereIsAResult) {
  const TemporaryDirectory directory;
  const fs::path result = directory / "out.vtp";
  const PartialRows rows{
      2, {}, {0, 1, 3}, {1, 0, 2}, {0.1F, 0.25F, 0.5F}, {0.125, 0.25}, 77, {1, 2, 3, 4, 5}};
  const PartialProbe elements{BandArray::Constant(4, 2, 1.0 / 3), BandArray::Constant(4, 2, 0.1)};
  const ShootingState shots{BandArray::Constant(3, 2, 1.0 / 3),
                            BandArray::Constant(3, 2, 1.0 / 7),
                            0.1,
                            0.2,
                            0.5,
                            0.3,
                            {1, 0.7, 0.4}};
  {
    Checkpoints saving(result, 42, "1.2.3", 0);
    EXPECT_FALSE(saving.found());
    SolveOptions options;
    saving.connect(options);
    EXPECT_EQ(options.partial_rows, nullptr);
    options.save_rows(2, [&] { return rows; });
    options.save_shots(2, [&] { return shots; });
    options.save_elements(4, [&] { return elements; });
    EXPECT_EQ(directory.entries(), 3);
  }
  Checkpoints other(result, 43, "1.2.3", 0);
  EXPECT_TRUE(other.found());
  EXPECT_THAT(message_of<InputError>([&] { other.resume(); }),
              HasSubstr("out.checkpoint.h5: is of other work than this"));
  Checkpoints resuming(result, 42, "1.2.3", 1e9);
  resuming.resume();
  EXPECT_EQ(resuming.resumed_rows(), 2);
  EXPECT_EQ(resuming.resumed_shots(), 2);
  EXPECT_EQ(resuming.resumed_elements(), 4);
  SolveOptions options;
  resuming.connect(options);
  EXPECT_EQ(options.partial_rows->start, rows.start);
  EXPECT_EQ(options.partial_rows->columns, rows.columns);
  EXPECT_EQ(options.partial_rows->values, rows.values);
  EXPECT_EQ(options.partial_rows->escaped, rows.escaped);
  EXPECT_EQ(options.partial_rows->rays, 77U);
  EXPECT_EQ(options.partial_rows->pairs.by_rays, 5U);
  EXPECT_TRUE((options.partial_shots->received == shots.received).all());
  EXPECT_TRUE((options.partial_shots->unshot == shots.unshot).all());
  EXPECT_EQ(options.partial_shots->shot, 0.1);
  EXPECT_EQ(options.partial_shots->arrived, 0.2);
  EXPECT_EQ(options.partial_shots->trust, 0.5);
  EXPECT_EQ(options.partial_shots->before, 0.3);
  EXPECT_EQ(options.partial_shots->history, shots.history);
  EXPECT_TRUE((options.partial_elements->irradiance == elements.irradiance).all());
  EXPECT_TRUE((options.partial_elements->standard_error == elements.standard_error).all());
  options.save_rows(2, [&]() -> PartialRows { throw std::logic_error("it is not due"); });
  resuming.remove();
  EXPECT_EQ(directory.entries(), 0);
}

}  // namespace
}  // namespace radiosity::test
