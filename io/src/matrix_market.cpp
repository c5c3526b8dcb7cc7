// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/matrix_market.hpp"

#include <fmt/format.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>
#include <string>

#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

struct Lines {
  std::string text;
  std::size_t entries = 0;
};

template <class Number>
void append(std::string& text, Number value) {
  constexpr std::size_t kLongest = 32;
  const std::size_t size = text.size();
  text.resize(size + kLongest);
  const auto [end, error] = std::to_chars(text.data() + size, text.data() + text.size(), value);
  text.resize(static_cast<std::size_t>(end - text.data()));
}

/// Rows [first, last).
Lines lines_of(const FormFactorRows& form_factors, Index first, Index last) {
  Lines lines;
  RowBuffer buffer;
  std::string before;
  for (Index i = first; i < last; ++i) {
    const FormFactorRow row = form_factors.row(i, buffer);
    before.clear();
    append(before, i + 1);
    before += ' ';
    const auto put = [&](Index j, auto value) {
      lines.text += before;
      append(lines.text, j + 1);
      lines.text += ' ';
      append(lines.text, value);
      lines.text += '\n';
      ++lines.entries;
    };
    bool diagonal_due = row.diagonal != 0;
    for_each_entry(row, [&](Index j, float value) {
      if (diagonal_due && j >= i) {
        diagonal_due = false;
        put(i, row.diagonal + (j == i ? static_cast<double>(value) : 0.0));
        if (j == i) return;
      }
      if (value != 0) put(j, value);
    });
    if (diagonal_due) put(i, row.diagonal);
  }
  return lines;
}

}  // namespace

void write_matrix_market(const std::filesystem::path& file, const FormFactorRows& form_factors,
                         const std::string& comment) {
  write_atomically(file, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << "%%MatrixMarket matrix coordinate real general\n";
    std::istringstream lines(comment);
    for (std::string line; std::getline(lines, line);) out << "% " << line << '\n';
    // The number of entries is known only at the end: rows may be computed on demand, and once is expensive enough.
    const Index n = form_factors.size();
    const auto header = out.tellp();
    const auto write_header = [&](std::size_t entries) {
      out << fmt::format("{} {} {:>20}\n", n, n, entries);
    };
    write_header(0);

    // Numbers become text on all threads, and are written in their order by one at a time.
    constexpr Index kRows = 16;
    constexpr std::size_t kInFlight = 64;
    Index next = 0;
    std::size_t entries = 0;
    tbb::parallel_pipeline(
        kInFlight,
        tbb::make_filter<void, Index>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& control) {
          const Index first = next;
          if (first >= n) control.stop();
          next = std::min(n - first, kRows) + first;
          return first;
        }) & tbb::make_filter<Index, Lines>(tbb::filter_mode::parallel, [&](Index first) {
          return lines_of(form_factors, first, std::min(n - first, kRows) + first);
        }) & tbb::make_filter<Lines, void>(tbb::filter_mode::serial_in_order, [&](const Lines& part) {
          out.write(part.text.data(), static_cast<std::streamsize>(part.text.size()));
          entries += part.entries;
        }));
    out.seekp(header);
    write_header(entries);
    out.close();
    if (!out) throw IoError("the disk is full or the file cannot be opened");
  });
}

}  // namespace radiosity
