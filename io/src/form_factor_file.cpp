// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/form_factor_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <sstream>
#include <type_traits>
#include <vector>

#include "digest.hpp"
#include "hdf5_support.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRowsFormat = "radiosity form factors 1";
constexpr const char* kRowsHold = "form factors, as radiosity factors writes them";

/// The report as numbers with names, both ways: visit(name, number).
template <class Report, class Visit>
void for_each_number(Report& report, Visit&& visit) {
  visit("closed_scene", report.closed_scene);
  visit("closed_rows", report.closed_rows);
  for (const bool after : {false, true}) {
    auto& quality = after ? report.after : report.before;
    const std::string prefix = after ? "after_" : "before_";
    visit((prefix + "closure_error_max").c_str(), quality.closure_error_max);
    visit((prefix + "closure_error_mean").c_str(), quality.closure_error_mean);
    visit((prefix + "reciprocity_error_max").c_str(), quality.reciprocity_error_max);
    visit((prefix + "reciprocity_error_mean").c_str(), quality.reciprocity_error_mean);
  }
  visit("escaped_mean", report.escaped_mean);
  visit("lamps", report.lamps);
  visit("pairwise", report.pairwise);
  visit("isolated_patches", report.isolated_patches);
  visit("rays", report.rays);
  for_each_count(report.pairs, visit);
}

template <class T>
using Stored = std::conditional_t<std::is_same_v<T, bool>, std::int32_t, T>;

FormFactorFileFacts facts_of(const Attributes& attributes) {
  return {attributes.text("method"),
          {.samples = attributes.number<std::int32_t>("samples"),
           .resolution = attributes.number<std::int32_t>("resolution"),
           .seed = attributes.number<std::uint64_t>("seed"),
           .tolerance = attributes.number<double>("factor_tolerance")},
          attributes.number<std::int32_t>("patches")};
}

// Appends values [first, first + count) of a data set as one row after the other.
template <class T>
void append(std::vector<T>& values, const H5::DataSet& data, std::size_t first, std::size_t count) {
  if (count == 0) return;
  const H5::DataSpace all = data.getSpace();
  std::vector<hsize_t> shape(static_cast<std::size_t>(all.getSimpleExtentNdims()));
  all.getSimpleExtentDims(shape.data());
  std::vector<hsize_t> from{first}, size{count};
  if (shape.size() == 2) {  // whole rows
    from = {first / shape[1], 0};
    size = {count / shape[1], shape[1]};
  }
  all.selectHyperslab(H5S_SELECT_SET, size.data(), from.data());
  const std::size_t before = values.size();
  values.resize(before + count);
  const hsize_t here = count;
  data.read(values.data() + before, type_of<T>(), H5::DataSpace(1, &here), all);
}

// Those that this rank owns of the rows of n patches, which are whole in the file.
FormFactorMatrix::Rows read_own_rows(const fs::path& file, const H5::H5File& in, Index n,
                                     const Ranks& ranks) {
  FormFactorMatrix::Rows out;
  out.n = n;
  const auto count = static_cast<std::size_t>(n);
  const H5::DataSet values = in.openDataSet("values");
  const auto stored = static_cast<std::size_t>(values.getSpace().getSimpleExtentNpoints());
  std::vector<std::size_t> start;
  std::optional<H5::DataSet> columns;
  if (in.nameExists("start")) {
    start = read_array<std::size_t>(in, "start");
    columns = in.openDataSet("columns");
    if (start.size() != count + 1 || start.front() != 0 || start.back() != stored ||
        !std::ranges::is_sorted(start) ||
        static_cast<std::size_t>(columns->getSpace().getSimpleExtentNpoints()) != stored)
      throw InputError(
          fmt::format("{}: form factor matrix: {} row starts do not divide {} values into {} rows",
                      file.string(), start.size(), stored, n));
  } else if (stored != count * count) {
    throw InputError(
        fmt::format("{}: form factor matrix: {} values do not make {} rows", file.string(), stored, n));
  }
  const auto place = [&](Index row) {
    const auto i = static_cast<std::size_t>(row);
    return columns ? start[i] : i * count;
  };
  std::size_t entries = 0;
  for (Index i = 0; i < n; ++i)
    if (ranks.owns(i)) entries += place(i + 1) - place(i);
  out.values.reserve(entries);
  if (columns) {
    out.columns.reserve(entries);
    out.start.assign(1, 0);
  }
  Index own = 0;
  for (Index first = 0; first < n; first += Ranks::kBlock) {
    const Index last = std::min(n, first + Ranks::kBlock);
    const bool mine = ranks.owns(first);
    if (mine) {
      append(out.values, values, place(first), place(last) - place(first));
      if (columns) append(out.columns, *columns, place(first), place(last) - place(first));
    }
    for (Index i = first; i < last; ++i) {
      out.place.push_back(mine ? own++ : -1);
      if (columns) out.start.push_back(out.start.back() + (mine ? place(i + 1) - place(i) : 0));
    }
  }
  return out;
}

}  // namespace

std::uint64_t digest(const PatchMesh& mesh) {
  Digest all;
  all.add(mesh.symmetry());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    all.add(static_cast<std::uint64_t>(mesh.corners(i).size()));
    for (const Index v : mesh.corners(i))
      for (const double x : mesh.vertex(v)) all.add(x);
    if (mesh.clustered()) all.add(static_cast<std::uint64_t>(mesh.cluster(i)) + 1);
  }
  return all.value();
}

void write_form_factors(const fs::path& file, const FormFactorMatrix& form_factors, const PatchMesh& mesh,
                        const FormFactorFacts& facts, const std::string& version,
                        const std::string& command) {
  const FormFactorMatrix::Rows& rows = form_factors.arrays();
  write_hdf5(file, kRowsFormat, [&](H5::H5File& out, Attributes& attributes) {
    attributes.write("version", version);
    attributes.write("command", command);
    attributes.write("method", facts.method);
    attributes.write_number("samples", facts.options.samples);
    attributes.write_number("resolution", facts.options.resolution);
    attributes.write_number("seed", facts.options.seed);
    attributes.write_number("factor_tolerance", facts.options.tolerance);
    attributes.write_number("patches", rows.n);
    attributes.write_number("mesh_digest", digest(mesh));
    for_each_number(facts.assembly, [&](const char* name, const auto& value) {
      attributes.write_number(name, static_cast<Stored<std::decay_t<decltype(value)>>>(value));
    });
    attributes.write("warnings", fmt::format("{}", fmt::join(facts.assembly.warnings, "\n")));
    if (form_factors.sparse()) {
      write_array(out, "start", rows.start);
      write_array(out, "columns", rows.columns);
      write_array(out, "values", rows.values);
    } else {
      const auto n = static_cast<hsize_t>(rows.n);
      write_array(out, "values", rows.values, {n, n});
    }
    if (!rows.diagonal.empty()) write_array(out, "diagonal", rows.diagonal);
    write_array(out, "escaped", rows.escaped);
    const Eigen::ArrayXd& areas = mesh.cluster_areas();
    write_array(out, "area", std::vector<double>(areas.begin(), areas.end()));
    if (facts.assembly.unreliable.empty()) return;
    std::vector<Index> unreliable;
    std::vector<double> shares;
    for (const auto& [cluster, share] : facts.assembly.unreliable) {
      unreliable.push_back(cluster);
      shares.push_back(share);
    }
    write_array(out, "unreliable", unreliable);
    write_array(out, "unreliable_share", shares);
  });
}

FormFactorFileFacts read_form_factor_facts(const fs::path& file) {
  return read_hdf5(file, kRowsFormat, kRowsHold,
                   [](H5::H5File&, const Attributes& attributes) { return facts_of(attributes); });
}

AssembledFormFactors read_form_factors(const fs::path& file, const PatchMesh& mesh, const Ranks* ranks) {
  AssemblyReport report;
  FormFactorMatrix::Rows rows =
      read_hdf5(file, kRowsFormat, kRowsHold, [&](H5::H5File& in, const Attributes& attributes) {
        const Index patches = facts_of(attributes).patches;
        if (patches != mesh.cluster_count() ||
            attributes.number<std::uint64_t>("mesh_digest") != digest(mesh))
          throw InputError(fmt::format(
              "{}: its form factors are of other patches ({}) than these ({}): it takes the same mesh and "
              "--patch-size; it was made by '{}'",
              file.string(), patches, mesh.cluster_count(), attributes.text("command")));
        for_each_number(report, [&](const char* name, auto& value) {
          using T = std::decay_t<decltype(value)>;
          value = static_cast<T>(attributes.number<Stored<T>>(name));
        });
        if (const std::string warnings = attributes.text("warnings"); !warnings.empty()) {
          std::istringstream lines(warnings);
          for (std::string line; std::getline(lines, line);) report.warnings.push_back(line);
        }
        if (in.nameExists("unreliable")) {
          const auto clusters = read_array<Index>(in, "unreliable");
          const auto shares = read_array<double>(in, "unreliable_share");
          for (std::size_t k = 0; k < std::min(clusters.size(), shares.size()); ++k)
            if (clusters[k] >= 0 && clusters[k] < patches)
              report.unreliable.emplace_back(clusters[k], shares[k]);
        }
        FormFactorMatrix::Rows out;
        if (ranks != nullptr) {
          out = read_own_rows(file, in, patches, *ranks);
        } else {
          out.n = patches;
          if (in.nameExists("start")) {
            out.start = read_array<std::size_t>(in, "start");
            out.columns = read_array<Index>(in, "columns");
          }
          out.values = read_array<float>(in, "values");
        }
        if (in.nameExists("diagonal")) out.diagonal = read_array<double>(in, "diagonal");
        out.escaped = read_array<double>(in, "escaped");
        return out;
      });
  try {
    return {FormFactorMatrix(std::move(rows)), std::move(report)};
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file.string(), error.what()));
  }
}

}  // namespace radiosity
