// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/matrix_market.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <sstream>

#include "radiosity/io/output.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {

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

    std::size_t entries = 0;
    RowBuffer buffer;
    fmt::memory_buffer text;
    for (Index i = 0; i < n; ++i) {
      const FormFactorRow row = form_factors.row(i, buffer);
      text.clear();
      const auto put = [&](Index j, double value) {
        fmt::format_to(std::back_inserter(text), "{} {} {:.9g}\n", i + 1, j + 1, value);
        ++entries;
      };
      bool diagonal_due = row.diagonal != 0;
      for_each_entry(row, [&](Index j, float value) {
        if (diagonal_due && j >= i) {
          diagonal_due = false;
          put(i, row.diagonal + (j == i ? static_cast<double>(value) : 0.0));
          if (j == i) return;
        }
        if (value != 0) put(j, static_cast<double>(value));
      });
      if (diagonal_due) put(i, row.diagonal);
      out.write(text.data(), static_cast<std::streamsize>(text.size()));
    }
    out.seekp(header);
    write_header(entries);
    out.close();
    if (!out) throw IoError("the disk is full or the file cannot be opened");
  });
}

}  // namespace radiosity
