// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include <limits>
#include <sstream>

#include "files.hpp"
#include "radiosity/io/matrix_market.hpp"
#include "radiosity/io/output.hpp"
#include "radiosity/io/report.hpp"

namespace radiosity::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using Json = nlohmann::ordered_json;

TEST(WriteAtomically, WritesBesideTheFileAndRenames) {
  const TemporaryDirectory directory;
  const fs::path file = directory / "a.txt";
  write_atomically(file, [&](const fs::path& temporary) {
    EXPECT_EQ(temporary.parent_path(), file.parent_path());
    EXPECT_EQ(temporary.extension(), ".txt");
    EXPECT_NE(temporary, file);
    std::ofstream(temporary) << "new";
    EXPECT_FALSE(fs::exists(file));
  });
  EXPECT_EQ(read_text(file), "new");
  EXPECT_EQ(directory.entries(), 1);
}

TEST(WriteAtomically, AFailingWriterLeavesTheOldFileAndNothingElse) {
  const TemporaryDirectory directory;
  const fs::path file = directory.write("a.txt", "old");
  const auto fail = [](const fs::path& temporary) {
    std::ofstream(temporary) << "half";
    throw IoError("the disk is full");
  };
  EXPECT_EQ(message_of<IoError>([&] { write_atomically(file, fail); }),
            file.string() + ": cannot be written: the disk is full");
  EXPECT_EQ(read_text(file), "old");
  EXPECT_THROW(write_atomically(directory / "b.txt", fail), IoError);
  EXPECT_THROW(write_atomically(directory / "b.txt", [](const fs::path&) { throw std::bad_alloc(); }),
               std::bad_alloc);
  EXPECT_EQ(directory.entries(), 1);
}

TEST(WriteAtomically, AWriterThatWritesNothingIsAnError) {
  const TemporaryDirectory directory;
  EXPECT_THAT(message_of<IoError>([&] { write_atomically(directory / "a.txt", [](const fs::path&) {}); }),
              StartsWith((directory / "a.txt").string()));
}

TEST(WriteAtomically, FollowsALinkAndSparesWhatIsNoRegularFile) {
  const TemporaryDirectory directory;
  const fs::path file = directory.write("real.txt", "old"), link = directory / "link.txt";
  fs::create_symlink(file, link);
  write_atomically(link, [](const fs::path& temporary) { std::ofstream(temporary) << "new"; });
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(read_text(file), "new");
  EXPECT_THAT(message_of<IoError>([&] { write_atomically("/dev/null", [](const fs::path&) { FAIL(); }); }),
              HasSubstr("not a regular file"));
}

TEST(RequireWritable, AcceptsWhatCanBeWrittenAndLeavesNothing) {
  const TemporaryDirectory directory;
  EXPECT_NO_THROW(require_writable(directory / "a.vtp", ".vtp"));
  EXPECT_NO_THROW(require_writable(directory / "a.VTP", ".vtp"));
  EXPECT_NO_THROW(require_writable(directory / "a.anything", ""));
  EXPECT_EQ(directory.entries(), 0);
  directory.write("old.vtp", "old");
  EXPECT_NO_THROW(require_writable(directory / "old.vtp", ".vtp"));
  EXPECT_EQ(read_text(directory / "old.vtp"), "old");
}

TEST(RequireWritable, NamesWhatIsWrong) {
  const TemporaryDirectory directory;
  const auto error = [](const fs::path& file) {
    return message_of<IoError>([&] { require_writable(file, ".vtp"); });
  };
  EXPECT_THAT(error(directory / "a.vtk"), AllOf(HasSubstr("a.vtk"), HasSubstr(".vtp")));
  EXPECT_THAT(error(directory / "none/a.vtp"), AllOf(HasSubstr("a.vtp"), HasSubstr("does not exist")));
  fs::create_directory(directory / "d.vtp");
  EXPECT_THAT(error(directory / "d.vtp"), HasSubstr("is a directory"));
  EXPECT_THAT(error(directory.path() / ""), HasSubstr("not the name of a file"));
}

struct Entry {
  Index row, column;
  double value;
  bool operator==(const Entry&) const = default;
};

struct ParsedMatrix {
  std::vector<std::string> comments;
  Index rows = 0, columns = 0;
  std::size_t declared = 0;
  std::vector<Entry> entries;
};

ParsedMatrix parse(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "%%MatrixMarket matrix coordinate real general");
  ParsedMatrix matrix;
  while (std::getline(in, line) && line.starts_with('%')) matrix.comments.push_back(line);
  std::istringstream(line) >> matrix.rows >> matrix.columns >> matrix.declared;
  for (Entry e{}; in >> e.row >> e.column >> e.value;) matrix.entries.push_back(e);
  return matrix;
}

TEST(MatrixMarket, WritesADenseMatrixWithItsDiagonalRemainder) {
  FormFactorMatrix::Rows rows;
  rows.n = 2;
  rows.values = {0, 0.1F, 1.0F / 3, 0.25F};
  rows.diagonal = {0.5, 0.125};
  rows.escaped = {0.5 - static_cast<double>(0.1F), 0.625 - static_cast<double>(1.0F / 3)};
  const TemporaryDirectory directory;
  write_matrix_market(directory / "F.mtx", FormFactorMatrix(rows), "two\nlines");
  const ParsedMatrix matrix = parse(directory / "F.mtx");
  EXPECT_THAT(matrix.comments, ElementsAre("% two", "% lines"));
  EXPECT_EQ(matrix.rows, 2);
  EXPECT_EQ(matrix.columns, 2);
  EXPECT_EQ(matrix.declared, 4U);
  ASSERT_EQ(matrix.entries.size(), 4U);
  EXPECT_EQ(matrix.entries[0], (Entry{1, 1, 0.5}));
  EXPECT_EQ(matrix.entries[3], (Entry{2, 2, 0.375}));
  EXPECT_EQ(static_cast<float>(matrix.entries[1].value), 0.1F);
  EXPECT_EQ(static_cast<float>(matrix.entries[2].value), 1.0F / 3);
}

TEST(MatrixMarket, WritesOnlyWhatASparseMatrixHolds) {
  FormFactorMatrix::Rows rows;
  rows.n = 3;
  rows.start = {0, 2, 3, 3};
  rows.columns = {0, 2, 1};
  rows.values = {0.25F, 0.5F, 0.75F};
  rows.diagonal = {0, 0, 0.125};
  rows.escaped = {0.25, 0.25, 0.875};
  const TemporaryDirectory directory;
  write_matrix_market(directory / "F.mtx", FormFactorMatrix(rows), "");
  const ParsedMatrix matrix = parse(directory / "F.mtx");
  EXPECT_EQ(matrix.declared, 4U);
  EXPECT_THAT(matrix.entries,
              ElementsAre(Entry{1, 1, 0.25}, Entry{1, 3, 0.5}, Entry{2, 2, 0.75}, Entry{3, 3, 0.125}));
}

TEST(MatrixMarket, NamesAFileThatCannotBeWritten) {
  FormFactorMatrix::Rows rows;
  rows.n = 1;
  rows.values = {0};
  rows.escaped = {1};
  const FormFactorMatrix matrix(rows);
  const TemporaryDirectory directory;
  const fs::path file = directory / "none/F.mtx";
  EXPECT_THAT(message_of<IoError>([&] { write_matrix_market(file, matrix, ""); }), StartsWith(file.string()));
}

std::vector<std::string> names(const Json& object) {
  std::vector<std::string> result;
  for (const auto& [name, value] : object.items()) result.push_back(name);
  return result;
}

Report full_report() {
  Report report;
  report.version = "1.2";
  report.command = "radiosity solve a.obj";
  report.converged = true;
  report.scene.emplace();
  report.scene->file = "a.obj";
  report.scene->surfaces = 2;
  report.scene->patches = 3;
  report.scene->bands = 1;
  report.scene->area_m2 = 4.5;
  report.scene->lower = {0, 1, 2};
  report.scene->upper = {3, 4, 5};
  report.scene->repairs.flipped_faces = 7;
  report.scene->warnings = {"odd"};
  report.modelled.emplace();
  report.modelled->bands = 1;
  report.modelled->left_out = {"grey"};
  report.modelled->saved.visibility_tests = 3;
  report.form_factors.emplace();
  report.form_factors->method = "hemisphere";
  report.form_factors->storage = FormFactorStorage::dense;
  report.form_factors->options = {.samples = 1024};
  report.form_factors->nonzeros = 6;
  report.form_factors->assembly.rays = 99;
  report.form_factors->assembly.before.closure_error_max = 0.25;
  report.form_factors->assembly.after.closure_error_max = 0.125;
  report.solver.emplace();
  report.solver->name = "jacobi";
  report.solver->tolerance = 1e-6;
  report.solver->report.status = SolveStatus::iteration_limit;
  report.solver->report.history = {1, 0.5};
  report.energy =
      EnergyBalance{BandValues::Constant(1, 2), BandValues::Constant(1, 1), BandValues::Constant(1, 1),
                    BandValues::Constant(1, std::numeric_limits<double>::quiet_NaN())};
  report.seconds.solve = 0.5;
  report.peak_memory_bytes = 12345;
  return report;
}

TEST(Report, HasTheStableNamesInOrder) {
  const TemporaryDirectory directory;
  write_report(directory / "r.json", full_report());
  const Json json = Json::parse(read_text(directory / "r.json"));
  EXPECT_THAT(names(json), ElementsAre("version", "command", "converged", "scene", "modelled", "form_factors",
                                       "solver", "energy", "seconds", "peak_memory_bytes"));
  EXPECT_THAT(names(json["scene"]), ElementsAre("file", "surfaces", "patches", "pieces", "bands", "area_m2",
                                                "bounds_m", "repairs", "warnings"));
  EXPECT_THAT(
      names(json["scene"]["repairs"]),
      ElementsAre("merged_vertices", "degenerate_faces", "duplicate_faces", "unwound_faces", "flipped_faces",
                  "triangulated_faces", "non_planar_faces", "split_edges", "cut_faces"));
  EXPECT_THAT(names(json["modelled"]), ElementsAre("bands", "occlusion", "left_out", "saved"));
  EXPECT_THAT(names(json["modelled"]["saved"]), ElementsAre("visibility_tests"));  // what is known
  EXPECT_THAT(names(json["form_factors"]),
              ElementsAre("method", "parameters", "storage", "nonzeros", "bytes", "rays", "closure_error_max",
                          "closure_error_mean", "reciprocity_error_max", "reciprocity_error_mean",
                          "escaped_mean", "before", "closed_scene", "closed_rows", "blind_patches", "pairs"));
  EXPECT_THAT(names(json["form_factors"]["pairs"]),
              ElementsAre("behind", "hidden", "free", "partial", "by_rays"));
  EXPECT_THAT(names(json["form_factors"]["before"]),
              ElementsAre("closure_error_max", "closure_error_mean", "reciprocity_error_max",
                          "reciprocity_error_mean"));
  EXPECT_THAT(names(json["solver"]),
              ElementsAre("name", "iterations", "residual", "tolerance", "status", "message", "history",
                          "error_bound", "condition", "warning"));
  EXPECT_THAT(names(json["energy"]), ElementsAre("emitted_w", "absorbed_w", "escaped_w", "imbalance"));
  EXPECT_THAT(names(json["seconds"]),
              ElementsAre("read", "mesh", "form_factors", "solve", "error", "elements", "write", "total"));
}

TEST(Report, HoldsTheValues) {
  const TemporaryDirectory directory;
  write_report(directory / "r.json", full_report());
  const Json json = Json::parse(read_text(directory / "r.json"));
  EXPECT_EQ(json["version"], "1.2");
  EXPECT_EQ(json["converged"], true);
  EXPECT_EQ(json["scene"]["bounds_m"], Json::parse("[[0.0,1.0,2.0],[3.0,4.0,5.0]]"));
  EXPECT_EQ(json["scene"]["repairs"]["flipped_faces"], 7);
  EXPECT_EQ(json["scene"]["warnings"][0], "odd");
  EXPECT_EQ(json["form_factors"]["parameters"]["samples"], 1024);
  EXPECT_EQ(json["form_factors"]["rays"], 99);
  EXPECT_EQ(json["form_factors"]["closure_error_max"], 0.125);
  EXPECT_EQ(json["form_factors"]["before"]["closure_error_max"], 0.25);
  EXPECT_EQ(json["solver"]["status"], "iteration_limit");
  EXPECT_EQ(json["solver"]["history"], Json::parse("[1.0,0.5]"));
  EXPECT_EQ(json["energy"]["emitted_w"], Json::parse("[2.0]"));
  EXPECT_TRUE(json["energy"]["imbalance"][0].is_null());  // not a number has no JSON
  EXPECT_EQ(json["seconds"]["solve"], 0.5);
  EXPECT_EQ(json["peak_memory_bytes"], 12345);
}

TEST(Report, LeavesOutPartsThatWereNotReached) {
  const TemporaryDirectory directory;
  Report report;
  report.command = "name that is not UTF-8: \xff";
  write_report(directory / "r.json", report);
  EXPECT_THAT(names(Json::parse(read_text(directory / "r.json"))),
              ElementsAre("version", "command", "converged", "seconds", "peak_memory_bytes"));
}

TEST(Report, PeakMemoryCoversWhatIsInUse) {
  const std::size_t bytes = 64U << 20U;
  std::vector<char> block(bytes, 1);
  EXPECT_GE(peak_memory_bytes(), bytes);
  EXPECT_EQ(block.back(), 1);
}

}  // namespace
}  // namespace radiosity::test
