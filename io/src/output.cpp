// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <system_error>

#include "mesh_file.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

/// A name beside `file` that nobody else uses, hidden, with the same extension.
fs::path temporary_beside(const fs::path& file) {
  static std::atomic<unsigned> count{0};
  return file.parent_path() /
         fmt::format(".{}.{}-{}{}", file.stem().string(), ::getpid(), count++, file.extension().string());
}

/// What writing `file` would replace: a link's target, not the link.
fs::path destination(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return file;
  if (fs::is_directory(file, error)) throw IoError(fmt::format("{}: is a directory", file.string()));
  if (!fs::is_regular_file(file, error))
    throw IoError(fmt::format("{}: is not a regular file", file.string()));
  return fs::is_symlink(file, error) ? fs::canonical(file) : file;
}

}  // namespace

void require_writable(const fs::path& file, const std::string& extension) {
  if (file.filename().empty()) throw IoError(fmt::format("'{}': is not the name of a file", file.string()));
  if (!extension.empty() && lower_case_extension(file) != extension)
    throw IoError(fmt::format("{}: the extension must be {}", file.string(), extension));
  const fs::path target = destination(file);
  const fs::path directory = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::error_code error;
  if (!fs::is_directory(directory, error))
    throw IoError(fmt::format("{}: the directory {} does not exist", file.string(), directory.string()));
  const fs::path probe = temporary_beside(target);
  errno = 0;
  if (!std::ofstream(probe))
    throw IoError(
        fmt::format("{}: cannot be written: {}", file.string(), std::generic_category().message(errno)));
  fs::remove(probe, error);
}

void write_atomically(const fs::path& file, const std::function<void(const fs::path& temporary)>& write) {
  const fs::path target = destination(file);
  const fs::path temporary = temporary_beside(target);
  std::error_code ignored;
  try {
    write(temporary);
    fs::rename(temporary, target);
  } catch (const fs::filesystem_error& error) {
    fs::remove(temporary, ignored);
    throw IoError(fmt::format("{}: cannot be written: {}", file.string(), error.code().message()));
  } catch (const IoError& error) {
    fs::remove(temporary, ignored);
    throw IoError(fmt::format("{}: cannot be written: {}", file.string(), error.what()));
  } catch (...) {
    fs::remove(temporary, ignored);
    throw;
  }
}

void write_file(const fs::path& file, std::string_view content) {
  write_atomically(file, [&](const fs::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(content.data(), static_cast<std::streamsize>(content.size()));
    stream.close();
    if (!stream) throw IoError("the disk is full or the file cannot be opened");
  });
}

}  // namespace radiosity
